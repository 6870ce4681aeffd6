//! Time of code that runs from an STM32F446's flash at 180 MHz, behind ST's accelerator (RM0390, section 3.4.2).
//!
//! Instructions and data share one port, which reads a line of 16 bytes at a time. The processor waits for a line
//! unless it is the current one, was prefetched, or is in a cache. `docs/cycles.md` says what is modelled and what is
//! left out.

use std::ops::Range;

/// Wait states of the flash above 150 MHz, from 2.7 V on (section 3.4.1): cycles that a read takes longer than from
/// memory that never waits.
pub const WAIT_STATES: u64 = 5;

/// Bytes that the port reads at once.
const LINE_BYTES: u32 = 16;

/// Numbers of lines in the caches for instructions and for data.
const INSTRUCTION_LINES: usize = 64;
const DATA_LINES: usize = 8;

/// Which lines of instructions the cache keeps. The manual names only lines that were missed; it does not say what
/// becomes of prefetched lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keeps {
    /// Every line from which instructions were executed.
    Executed,
    /// Only lines that were neither prefetched nor in the cache.
    Missed,
}

impl Keeps {
    pub const ALL: [Self; 2] = [Self::Executed, Self::Missed];
}

/// Number of a line: its address divided by its length.
type Line = u32;

/// The line behind the current one, read before it is wanted.
#[derive(Debug, Clone, Copy)]
struct Prefetch {
    line: Line,
    /// Cycle in which the port begins to read it.
    begins: u64,
}

/// Flash and its accelerator, with a clock that counts the cycles of what was executed.
#[derive(Debug, Clone)]
pub struct Flash {
    keeps: Keeps,
    /// The current cycle.
    now: u64,
    /// First cycle in which the port can begin another read.
    free: u64,
    /// Line from which the last instruction came.
    current: Option<Line>,
    prefetch: Option<Prefetch>,
    instructions: Cache<INSTRUCTION_LINES>,
    data: Cache<DATA_LINES>,
}

impl Flash {
    /// The state with empty caches and an idle port.
    pub fn cold(keeps: Keeps) -> Self {
        Self {
            keeps,
            now: 0,
            free: 0,
            current: None,
            prefetch: None,
            instructions: Cache::default(),
            data: Cache::default(),
        }
    }

    /// Executes an instruction that takes `cycles` without waiting, and returns its cycles with all waiting. It stands
    /// at the addresses `code`, and loads what stands at `literal` if that is not empty.
    pub fn execute(&mut self, code: &Range<u32>, literal: &Range<u32>, cycles: u64) -> u64 {
        let start = self.now;
        lines(code).for_each(|line| self.fetch(line));
        lines(literal).for_each(|line| self.load(line));
        self.now += cycles;
        self.now - start
    }

    /// Waits for a line of instructions, and prefetches the next one unless the cache has it.
    fn fetch(&mut self, line: Line) {
        if self.current.replace(line) == Some(line) {
            return;
        }
        let prefetched = self.prefetch.take_if(|prefetch| prefetch.line == line);
        if !self.instructions.touch(line) {
            if prefetched.is_none() || self.keeps == Keeps::Executed {
                self.instructions.keep(line);
            }
            let begins = prefetched.map_or_else(|| self.read(), |prefetch| prefetch.begins);
            self.now = self.now.max(begins + WAIT_STATES);
        }
        let next = line + 1;
        let is_coming = self.prefetch.is_some_and(|prefetch| prefetch.line == next);
        if !is_coming && !self.instructions.has(next) {
            self.prefetch = Some(Prefetch { line: next, begins: self.read() });
        }
    }

    /// Waits for a line of data.
    fn load(&mut self, line: Line) {
        if self.data.touch(line) {
            return;
        }
        self.data.keep(line);
        let read = self.read();
        // Data go before a prefetch that has not begun.
        let begins = match &mut self.prefetch {
            Some(prefetch) if prefetch.begins > self.now => {
                let begins = prefetch.begins;
                prefetch.begins = read;
                begins
            }
            _ => read,
        };
        self.now = begins + WAIT_STATES;
    }

    /// Reserves the port for one more read, and returns the cycle in which that begins.
    fn read(&mut self) -> u64 {
        let begins = self.free.max(self.now);
        self.free = begins + 1 + WAIT_STATES;
        begins
    }
}

/// Lines that hold the bytes at `addresses`.
fn lines(addresses: &Range<u32>) -> Range<Line> {
    addresses.start / LINE_BYTES..addresses.end.div_ceil(LINE_BYTES)
}

/// Up to `LINES` lines; the one that was used least recently makes room.
#[derive(Debug, Clone, Default)]
struct Cache<const LINES: usize> {
    /// The most recently used line is the last.
    lines: Vec<Line>,
}

impl<const LINES: usize> Cache<LINES> {
    fn has(&self, line: Line) -> bool {
        self.lines.contains(&line)
    }

    /// Uses `line`; whether it is here.
    fn touch(&mut self, line: Line) -> bool {
        let at = self.lines.iter().rposition(|other| *other == line);
        if let Some(at) = at {
            self.lines[at..].rotate_left(1);
        }
        at.is_some()
    }

    /// Keeps `line`, which is not here yet.
    fn keep(&mut self, line: Line) {
        if self.lines.len() == LINES {
            self.lines.remove(0);
        }
        self.lines.push(line);
    }
}

#[cfg(test)]
mod tests;
