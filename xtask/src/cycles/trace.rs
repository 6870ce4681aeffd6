//! Counting instructions and cycles in regions of a program, from the trace that QEMU writes with
//! `-d exec,nochain,in_asm`.
//!
//! QEMU lists a block of code when it translates it, and prints its address whenever the block starts. A block is
//! executed from its first instruction to its last, and only the last one may branch. A region starts where a call of
//! one function returns, and ends where another is called: every count includes that call.

use std::collections::HashMap;
use std::io::BufRead;
use std::ops::Range;

use super::flash::{Flash, Keeps};
use super::instruction::Instruction;
use crate::process::Outcome;

/// Number of instructions executed, and their cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    pub instructions: u64,
    /// Cycles with memory that never waits.
    pub cycles: u64,
    /// Cycles with code in flash ([`Flash`]) and all data but literals in RAM.
    pub flash_cycles: u64,
}

impl Count {
    /// As instructions, cycles, and cycles from flash.
    pub fn all(self) -> [u64; 3] {
        [self.instructions, self.cycles, self.flash_cycles]
    }

    fn add(&mut self, cycles: u64, flash_cycles: u64) {
        self.instructions += 1;
        self.cycles += cycles;
        self.flash_cycles += flash_cycles;
    }
}

/// Counts of one region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Region {
    pub whole: Count,
    /// Count of the loop of exponentials.
    pub exponential: Count,
}

/// Addresses of the functions that start and end a region, and of code that is counted separately besides.
#[derive(Debug, Clone)]
pub struct Marks {
    pub begin: u32,
    pub end: u32,
    pub exponential: Range<u32>,
}

/// An instruction's address, and what it is; `None` if that is unknown.
type Step = (u32, Option<Instruction>);

/// Place of the program, relative to regions.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Outside,
    /// In the function that starts a region.
    Starting,
    Inside,
}

/// Counts the regions in `trace`; also returns the lines that belong to no trace.
///
/// # Errors
/// An instruction inside a region has no known cost, was not followed by the next one, or calls code that is not traced;
/// or the program ended in a region.
pub fn count(mut trace: impl BufRead, marks: Marks) -> Outcome<(Vec<Region>, String)> {
    let mut counter = Counter::new(marks);
    let mut blocks: HashMap<u32, Vec<Step>> = HashMap::new();
    // The block that is listed, and the one that was announced last: the next line says whether it started.
    let (mut listed, mut announced) = (Vec::new(), None);
    let (mut line, mut others) = (Vec::new(), String::new());
    loop {
        line.clear();
        let length = trace.read_until(b'\n', &mut line);
        if length.map_err(|cause| format!("the trace cannot be read: {cause}"))? == 0 {
            break;
        }
        if let Some(step) = line.strip_prefix(b"0x").and_then(instruction) {
            listed.push(step);
            continue;
        }
        // `Trace 0: 0x7f… [00800408/00000400/00000110/ff000201] main`: the second number is the block's address.
        let starts = line.starts_with(b"Trace ").then(|| line.split(|byte| *byte == b'/').nth(1));
        let starts = starts.flatten().and_then(hexadecimal);
        if starts.is_some() || line.starts_with(b"IN:") {
            let block = std::mem::take(&mut listed);
            if let Some((first, _)) = block.first() {
                let before = blocks.entry(*first).or_insert_with(|| block.clone());
                if *before != block {
                    return Err(format!("the block at {first:#010x} was listed in two ways"));
                }
            }
        }
        if starts.is_some() {
            if let Some(address) = std::mem::replace(&mut announced, starts) {
                let block = blocks.get(&address);
                counter.execute(block.ok_or_else(|| {
                    format!("QEMU did not list its block at {address:#010x}; was it built with a disassembler?")
                })?)?;
            }
        } else if line.starts_with(b"Stopped execution of TB chain before") {
            // It will be announced again.
            announced = None;
        } else if !line.starts_with(b"IN:") && !line.trim_ascii().iter().all(|byte| *byte == b'-') {
            others.push_str(&String::from_utf8_lossy(&line));
        }
    }
    if counter.place == Place::Outside {
        Ok((counter.counted, others))
    } else {
        Err(format!("the program ended in its region {}", counter.counted.len() + 1))
    }
}

/// The instruction in `00000400:  b5f0       push     {r4, r5, r6, r7, lr}`.
fn instruction(line: &[u8]) -> Option<Step> {
    let (address, listed) = str::from_utf8(line).ok()?.split_once(':')?;
    Some((hexadecimal(address.as_bytes())?, Instruction::read(listed.trim())))
}

/// A hexadecimal number that fits an address.
fn hexadecimal(digits: &[u8]) -> Option<u32> {
    u64::from_str_radix(str::from_utf8(digits).ok()?, 16).ok()?.try_into().ok()
}

/// Counter of one region after the other.
struct Counter {
    marks: Marks,
    place: Place,
    /// Last instruction executed; its cost depends on the next one.
    pending: Option<Step>,
    previous: Option<Instruction>,
    /// The region so far, with each way to read the flash's manual.
    counts: [(Flash, Region); 2],
    counted: Vec<Region>,
}

impl Counter {
    fn new(marks: Marks) -> Self {
        let place = Place::Outside;
        Self { marks, place, pending: None, previous: None, counts: nothing(), counted: Vec::new() }
    }

    /// Counts a block that was executed.
    fn execute(&mut self, block: &[Step]) -> Outcome {
        let last = block.len().saturating_sub(1);
        for (index, &(address, instruction)) in block.iter().enumerate() {
            if let Some((before, it)) = self.pending.replace((address, instruction)) {
                self.settle(before, it, address)?;
            }
            if self.place == Place::Outside && address == self.marks.begin {
                self.place = Place::Starting;
            }
            let branches = instruction.is_some_and(|it| it.may_branch);
            if self.place == Place::Inside && index < last && branches {
                return Err(format!(
                    "{address:#010x} may branch, and is not the last of its block"
                ));
            }
        }
        Ok(())
    }

    /// Counts the instruction at `address`, now that `next` is executed.
    fn settle(&mut self, address: u32, instruction: Option<Instruction>, next: u32) -> Outcome {
        if self.place == Place::Outside {
            return Ok(());
        }
        let it = instruction.ok_or_else(|| {
            format!(
                "the instruction at {address:#010x} is not known, or stops the core; teach \
                 xtask/src/cycles/instruction.rs what it costs"
            )
        })?;
        let branched = next != address.wrapping_add(it.bytes);
        if branched && !it.may_branch {
            return Err(format!(
                "{next:#010x} was executed after {address:#010x}, which is no branch: an exception?"
            ));
        }
        if self.place == Place::Starting {
            if branched {
                (self.place, self.counts, self.previous) = (Place::Inside, nothing(), None);
            }
            return Ok(());
        }
        if next == self.marks.begin {
            return Err(format!("region {} starts another", self.counted.len() + 1));
        }
        if it.calls && !branched {
            return Err(format!("the call at {address:#010x} leads to code that is not traced"));
        }
        let cycles = it.cycles(self.previous.as_ref(), branched);
        let (code, literal) = (address..address + it.bytes, it.literal(address));
        let is_end = next == self.marks.end;
        for (flash, region) in &mut self.counts {
            // The call at the end never waits, so that it costs the same in every region.
            let waited = if is_end { cycles } else { flash.execute(&code, &literal, cycles) };
            region.whole.add(cycles, waited);
            if self.marks.exponential.contains(&address) {
                region.exponential.add(cycles, waited);
            }
        }
        self.previous = Some(it);
        if is_end {
            let [some, others] = self.counts.each_ref().map(|(_, region)| *region);
            let more = some.whole.flash_cycles > others.whole.flash_cycles;
            self.counted.push(if more { some } else { others });
            self.place = Place::Outside;
        }
        Ok(())
    }
}

/// The start of a region: no counts, and flash with empty caches, because what a device does between two frames
/// replaces their lines.
fn nothing() -> [(Flash, Region); 2] {
    Keeps::ALL.map(|keeps| (Flash::cold(keeps), Region::default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: &str = "IN: begin\n0x00000010:  bf00  nop\n0x00000012:  4770  bx lr\n\n";
    const MAIN: &str = "----------------\nIN: main\n0x00000020:  3001  adds r0, #1\n\
        0x00000022:  3001  adds r0, #1\n0x00000024:  f000 f804  bl #0x30\n\n";
    const END: &str = "IN: end\n0x00000030:  4770  bx lr\n\n";

    fn starts(address: u32) -> String {
        format!("Trace 0: 0x1 [0/{address:016x}/0/0] name\n")
    }

    /// Counts of a trace that starts a region, and has these listings and blocks in it.
    fn counted(listed: &str, blocks: &[u32]) -> Outcome<(Vec<Region>, String)> {
        let blocks = blocks.iter().map(|address| starts(*address));
        let trace = [BEGIN, listed, END, &starts(0x10)].concat() + &blocks.collect::<String>();
        count(trace.as_bytes(), Marks { begin: 0x10, end: 0x30, exponential: 0x22..0x24 })
    }

    #[test]
    fn blocks_count_from_their_first_instruction_to_their_last() {
        // adds: 1 each; bl: 1 + 2. From flash, the first waits for its line.
        let whole = Count { instructions: 3, cycles: 5, flash_cycles: 10 };
        let exponential = Count { instructions: 1, cycles: 1, flash_cycles: 1 };
        let region = Region { whole, exponential };
        let twice = [0x20, 0x30, 0x10, 0x20, 0x30, 0x30];
        assert_eq!(counted(MAIN, &twice), Ok((vec![region; 2], String::new())));

        let stopped = "Stopped execution of TB chain before 0x1 [00000020] name\na complaint\n";
        let stopped = [MAIN, &starts(0x20), stopped].concat();
        assert_eq!(counted(&stopped, &[0x20, 0x30, 0x30]).unwrap().1, "a complaint\n");
    }

    #[test]
    fn a_loop_is_counted_as_by_hand_and_waits_as_the_manual_allows_at_most() {
        // Four nops in line 1 of flash, then a loop across lines 1 and 2.
        let listed = "IN: a\n0x00000046:  bf00  nop\n0x00000048:  bf00  nop\n0x0000004a:  bf00  nop\n\
            0x0000004c:  bf00  nop\n0x0000004e:  3801  subs r0, #1\n0x00000050:  d1fd  bne #0x4e\n\
            IN: b\n0x0000004e:  3801  subs r0, #1\n0x00000050:  d1fd  bne #0x4e\n\
            IN: c\n0x00000052:  f7ff fff7  bl #0x30\n";
        // Line 1 comes after 5 cycles, line 2 after 11. The first round ends in cycle 14, when line 3 is read until 17.
        // If line 2 is not kept, it is read from cycle 18 and, the next round, from 30 on. It comes after 23 and 35.
        let (cycles, flash_cycles) = (4 + 2 * 4 + 2 + 3, 35 + 1 + 3);
        let whole = Count { instructions: 11, cycles, flash_cycles };
        let found = counted(listed, &[0x46, 0x4E, 0x4E, 0x52, 0x30, 0x30]).unwrap();
        assert_eq!(found.0, [Region { whole, ..Region::default() }]);
    }

    #[test]
    fn what_cannot_be_counted_is_refused() {
        let gap = MAIN.replace("0x00000022:  3001  adds r0, #1\n", "");
        let unknown = MAIN.replace("adds r0, #1", "setend le");
        let within = MAIN.replace("3001  adds r0, #1", "d100  bne #0x24");
        let call = format!("{MAIN}IN: b\n0x00000028:  bf00  nop\n\n");
        let other = format!("{MAIN}IN: b\n0x00000020:  3001  adds r0, #1\n\n");
        for (listed, blocks, named) in [
            (&gap[..], &[0x20, 0x30, 0x30][..], "0x00000024 was executed after 0x00000020"),
            (&unknown, &[0x20, 0x30, 0x30], "at 0x00000020 is not known"),
            (&within, &[0x20, 0x30, 0x30], "0x00000020 may branch"),
            (&call, &[0x20, 0x28, 0x30], "the call at 0x00000024 leads to code that is not traced"),
            (&other, &[0x20], "the block at 0x00000020 was listed in two ways"),
            (MAIN, &[0x20, 0x40, 0x30], "QEMU did not list its block at 0x00000040"),
            (MAIN, &[0x20, 0x10, 0x30], "region 1 starts another"),
            (MAIN, &[0x20, 0x20], "the program ended in its region 1"),
        ] {
            let error = counted(listed, blocks).unwrap_err();
            assert!(error.contains(named), "{named}: {error}");
        }
    }
}
