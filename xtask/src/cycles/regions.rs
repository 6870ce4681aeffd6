//! Counting instructions and cycles in regions of a program, from the addresses of its instructions.
//!
//! A region starts where a call of one function returns, and ends where another is called. The count of every
//! region includes the call at its end, which the caller must subtract.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::ops::{Range, Sub};

use super::code::Code;
use super::cost::cycles;
use super::flash::{Flash, Keeps};
use super::loops::Loop;
use super::thumb::Instruction;
use super::untraced::Untraced;
use crate::process::Outcome;

/// Number of instructions executed, and their cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    pub instructions: u64,
    /// Cycles by the cost model, with memory that never waits.
    pub cycles: u64,
    /// Cycles with code in flash ([`Flash`]) and all data but literals in RAM.
    pub flash_cycles: u64,
}

impl Count {
    fn add(&mut self, cycles: u64, flash_cycles: u64) {
        self.instructions += 1;
        self.cycles += cycles;
        self.flash_cycles += flash_cycles;
    }
}

impl Sub for Count {
    type Output = Self;

    fn sub(self, less: Self) -> Self {
        Self {
            instructions: self.instructions.saturating_sub(less.instructions),
            cycles: self.cycles.saturating_sub(less.cycles),
            flash_cycles: self.flash_cycles.saturating_sub(less.flash_cycles),
        }
    }
}

/// Counts of one region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Region {
    pub whole: Count,
    /// Count of the loop of exponentials, as [`Watched::exponential`] has it.
    pub exponential: Count,
    pub assembly: Count,
}

/// Addresses of code that is counted separately besides.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Watched {
    pub exponential: Range<u32>,
    pub assembly: Vec<Range<u32>>,
}

/// Place of the program, relative to regions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Outside,
    /// In the function that starts a region.
    Starting,
    Inside,
}

/// Counter of one region after the other.
pub struct Regions<'c> {
    code: &'c Code,
    /// Instructions that have been decoded already, by address.
    decoded: HashMap<u32, Instruction>,
    begin: u32,
    end: u32,
    watched: Watched,
    untraced: Untraced,
    place: Place,
    /// Last address executed; its cost depends on the next one.
    pending: Option<u32>,
    previous: Option<Instruction>,
    /// The region so far, with each way to read the flash's manual.
    counts: [(Flash, Region); 2],
    counted: Vec<Region>,
    /// Last branch back in this region.
    last_back: Option<Loop>,
    loops: HashSet<Loop>,
}

impl<'c> Regions<'c> {
    /// Makes a counter of regions from the return of the function at `begin` to the call of the one at `end`.
    pub fn new(code: &'c Code, begin: u32, end: u32) -> Self {
        Self {
            code,
            decoded: HashMap::new(),
            begin,
            end,
            watched: Watched::default(),
            untraced: Untraced::default(),
            place: Place::Outside,
            pending: None,
            previous: None,
            counts: nothing(),
            counted: Vec::new(),
            last_back: None,
            loops: HashSet::new(),
        }
    }

    /// Also counts the code that is `watched` separately.
    pub fn watching(self, watched: Watched) -> Self {
        Self { watched, ..self }
    }

    /// Expects a trace without the functions `untraced`, which no region may call.
    pub fn without(self, untraced: Untraced) -> Self {
        Self { untraced, ..self }
    }

    /// Counts a block of code that was executed, given by its instructions' addresses. All of them were executed,
    /// and only the last one may branch.
    pub fn execute(&mut self, block: &[u32]) -> Outcome {
        let Some((last, before)) = block.split_last() else { return Ok(()) };
        for address in before {
            self.step(*address)?;
            if self.place == Place::Inside && self.instruction(*address)?.may_branch {
                return Err(format!(
                    "{address:#010x} may branch, and is not the last of its block"
                ));
            }
        }
        self.step(*last)
    }

    fn step(&mut self, address: u32) -> Outcome {
        if let Some(last) = self.pending.replace(address) {
            self.settle(last, address)?;
        }
        if self.place == Place::Outside && address == self.begin {
            self.place = Place::Starting;
        }
        Ok(())
    }

    /// Innermost loops of all regions so far: what was repeated by a branch that is neither a call nor a return.
    pub fn loops(&self) -> Vec<Loop> {
        self.loops.iter().copied().collect()
    }

    /// Ends counting, and returns the regions' counts in their order.
    pub fn finish(self) -> Outcome<Vec<Region>> {
        if self.place == Place::Outside {
            Ok(self.counted)
        } else {
            Err(format!("the program ended in its region {}", self.counted.len() + 1))
        }
    }

    fn instruction(&mut self, address: u32) -> Outcome<Instruction> {
        match self.decoded.entry(address) {
            Entry::Occupied(entry) => Ok(*entry.get()),
            Entry::Vacant(entry) => Ok(*entry.insert(self.code.instruction(address)?)),
        }
    }

    fn settle(&mut self, address: u32, next: u32) -> Outcome {
        if self.place == Place::Outside {
            return Ok(());
        }
        let instruction = self.instruction(address)?;
        let branched = next != address.wrapping_add(instruction.bytes);
        if branched && !instruction.may_branch {
            return Err(format!(
                "{next:#010x} was executed after {address:#010x}, which is no branch: an exception?"
            ));
        }
        if self.place == Place::Starting {
            if branched {
                self.place = Place::Inside;
                self.counts = nothing();
                self.previous = None;
            }
            return Ok(());
        }
        if next == self.begin {
            return Err(format!("region {} starts another", self.counted.len() + 1));
        }
        // The first instruction of such a function is traced, to be seen here.
        if let Some(name) = self.untraced.function_at(next) {
            return Err(format!(
                "region {} calls {name}, which is not traced: take it out of xtask/src/cycles/untraced.rs",
                self.counted.len() + 1
            ));
        }
        if instruction.calls && !branched {
            return Err(format!("the call at {address:#010x} leads to code that is not traced"));
        }
        let cost = cycles(&instruction, self.previous.as_ref(), branched);
        let cost = cost.ok_or_else(|| {
            format!(
                "the instruction at {address:#010x} has no place in a region: it stops the core"
            )
        })?;
        let code = address..address.wrapping_add(instruction.bytes);
        let literal = instruction.literal(address);
        let in_assembly = self.watched.assembly.iter().any(|range| range.contains(&address));
        for (flash, count) in &mut self.counts {
            // The call at the end never waits, so that it costs the same in every region.
            let is_end = next == self.end;
            let flash_cost = if is_end { cost } else { flash.execute(&code, &literal, cost) };
            count.whole.add(cost, flash_cost);
            if self.watched.exponential.contains(&address) {
                count.exponential.add(cost, flash_cost);
            }
            if in_assembly {
                count.assembly.add(cost, flash_cost);
            }
        }
        self.previous = Some(instruction);
        if branched && next <= address && !instruction.calls && !self.code.returns(address) {
            let back = Loop { start: next, end: address.wrapping_add(instruction.bytes) };
            if self.last_back.replace(back) == Some(back) {
                self.loops.insert(back);
            }
        }
        if next == self.end {
            self.last_back = None;
            let [some, others] = self.counts.each_ref().map(|(_, count)| *count);
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
mod tests;
