//! Parsing the trace that QEMU writes with `-d exec,nochain,in_asm`, while it is written.
//!
//! QEMU lists a block of code when it translates it, and prints its address whenever the block starts. A block is
//! executed from its first instruction to its last, and only the last one may branch.

use std::collections::HashMap;
use std::io::BufRead;

use super::regions::Regions;
use crate::process::Outcome;

/// A line of the trace.
#[derive(Debug, PartialEq, Eq)]
enum Line {
    /// `IN: main`: a block is listed in the lines that follow.
    Lists,
    /// `0x00000400:  b5f0       push     {r4, r5, r6, r7, lr}`: an instruction of that block, by its address.
    Instruction(u32),
    /// `Trace 0: 0x7f… [00800408/00000400/00000110/ff000201] main`: a block starts. The second number is its
    /// address, in guests of either width.
    Starts(u32),
    /// `Stopped execution of TB chain before …`: the block that was announced last did not start;
    /// it will be announced again.
    DidNotStart,
    /// Dashes and empty lines around what is listed.
    Nothing,
    /// Something else.
    Other,
}

/// The blocks that were listed, by the address of their first instruction.
#[derive(Default)]
struct Blocks {
    instructions: HashMap<u32, Vec<u32>>,
    /// Addresses of the block that is being listed.
    listed: Vec<u32>,
}

impl Blocks {
    /// Completes the block that was listed.
    fn close(&mut self) -> Outcome {
        let listed = std::mem::take(&mut self.listed);
        let Some(first) = listed.first().copied() else { return Ok(()) };
        let before = self.instructions.entry(first).or_insert_with(|| listed.clone());
        if *before == listed {
            Ok(())
        } else {
            let lengths = [before.len(), listed.len()];
            Err(format!("the block at {first:#010x} was listed with {lengths:?} instructions"))
        }
    }

    fn at(&self, address: u32) -> Outcome<&[u32]> {
        let block = self.instructions.get(&address);
        block.map(Vec::as_slice).ok_or_else(|| {
            format!(
                "QEMU did not list its block at {address:#010x}; was it built with a disassembler?"
            )
        })
    }
}

/// Passes the blocks in `trace` to `regions`, and returns the lines that belong to no trace.
pub fn follow(mut trace: impl BufRead, regions: &mut Regions<'_>) -> Outcome<String> {
    let mut others = String::new();
    let mut blocks = Blocks::default();
    // The block that was announced last; the next line says whether it started.
    let mut pending = None;
    let mut line = Vec::new();
    loop {
        line.clear();
        let length = trace.read_until(b'\n', &mut line);
        if length.map_err(|cause| format!("the trace cannot be read: {cause}"))? == 0 {
            return Ok(others);
        }
        match parse(&line) {
            Line::Starts(address) => {
                blocks.close()?;
                if let Some(last) = pending.replace(address) {
                    regions.execute(blocks.at(last)?)?;
                }
            }
            Line::DidNotStart => pending = None,
            Line::Lists => blocks.close()?,
            Line::Instruction(address) => blocks.listed.push(address),
            Line::Nothing => (),
            Line::Other => others.push_str(&String::from_utf8_lossy(&line)),
        }
    }
}

fn parse(line: &[u8]) -> Line {
    if line.starts_with(b"Trace ") {
        let address = line.split(|byte| *byte == b'/').nth(1);
        address.and_then(hexadecimal).map_or(Line::Other, Line::Starts)
    } else if let Some(rest) = line.strip_prefix(b"0x") {
        let address = rest.split(|byte| *byte == b':').next();
        address.and_then(hexadecimal).map_or(Line::Other, Line::Instruction)
    } else if line.starts_with(b"Stopped execution of TB chain before") {
        Line::DidNotStart
    } else if line.starts_with(b"IN:") {
        Line::Lists
    } else if line.trim_ascii().iter().all(|byte| *byte == b'-') {
        Line::Nothing
    } else {
        Line::Other
    }
}

/// Parses a hexadecimal number of up to 16 digits that fits an address.
fn hexadecimal(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() || digits.len() > 16 {
        return None;
    }
    let mut number = 0_u64;
    for digit in digits {
        number = number << 4 | u64::from(char::from(*digit).to_digit(16)?);
    }
    u32::try_from(number).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycles::code::Code;
    use crate::cycles::regions::{Count, Region};

    #[test]
    fn the_address_is_found_in_what_old_and_new_versions_write() {
        let old = b"Trace 0: 0x7f8d50000240 [00800408/0000048c/00000110/ff000201] __pre_init\n";
        let new = b"Trace 0: 0x7f8d50000240 [00800408/000000000000048c/00000110/ff000201] \n";
        assert_eq!([parse(old), parse(new)], [Line::Starts(0x48C), Line::Starts(0x48C)]);
        assert_eq!(parse(b"0x0000048c:  4770  bx lr\n"), Line::Instruction(0x48C));
        assert_eq!(parse(b"IN: __pre_init\n"), Line::Lists);
        assert_eq!([parse(b"----------------\n"), parse(b"\n")], [Line::Nothing, Line::Nothing]);
        assert_eq!(parse(b"Trace 0: something\n"), Line::Other);
        assert_eq!(parse(b"0x1 is odd\n"), Line::Other);
        assert_eq!(parse(b"qemu-system-arm: a warning\n"), Line::Other);
    }

    /// Code with `begin` at 0x10 (bx lr), and adds r0, #1; adds r0, #1; bl 0x30 at 0x20.
    fn code() -> Code {
        let mut halfwords = vec![0x4770; 17];
        halfwords[8..12].copy_from_slice(&[0x3001, 0x3001, 0xF000, 0xF804]);
        Code::of(0x10, &halfwords)
    }

    /// The blocks of [`code`], as listed and as started.
    const BEGIN: &str = "IN: begin\n0x00000010:  4770  bx lr\n\n";
    const MAIN: &str = "----------------\nIN: main\n0x00000020:  3001  adds r0, #1\n\
        0x00000022:  3001  adds r0, #1\n0x00000024:  f000 f804  bl #0x30\n\n";
    const END: &str = "IN: end\n0x00000030:  4770  bx lr\n\n";

    fn starts(address: u32) -> String {
        format!("Trace 0: 0x1 [0/{address:08x}/0/0] name\n")
    }

    fn stopped(address: u32) -> String {
        format!("Stopped execution of TB chain before 0x1 [{address:08x}] name\n")
    }

    fn counted(trace: &str) -> Outcome<(String, Vec<Region>)> {
        let code = code();
        let mut regions = Regions::new(&code, 0x10, 0x30);
        let others = follow(trace.as_bytes(), &mut regions)?;
        Ok((others, regions.finish()?))
    }

    #[test]
    fn a_block_counts_from_its_first_instruction_to_its_last() {
        let trace = [BEGIN, &starts(0x10), MAIN, &starts(0x20), END, &starts(0x30), &starts(0x30)];
        // adds: 1 each; bl: 1 + 2. From flash, the first waits for its line.
        let whole = Count { instructions: 3, cycles: 5, flash_cycles: 10 };
        let expected = (String::new(), vec![Region { whole, ..Region::default() }]);
        assert_eq!(counted(&trace.concat()), Ok(expected));
    }

    #[test]
    fn a_block_that_did_not_start_is_not_counted() {
        let trace = [
            BEGIN,
            &starts(0x10),
            &stopped(0x10),
            &starts(0x10),
            MAIN,
            &starts(0x20),
            &stopped(0x20),
            "a complaint\n",
            &starts(0x20),
            END,
            &starts(0x30),
            &starts(0x30),
        ];
        let whole = Count { instructions: 3, cycles: 5, flash_cycles: 10 };
        let expected = ("a complaint\n".to_owned(), vec![Region { whole, ..Region::default() }]);
        assert_eq!(counted(&trace.concat()), Ok(expected));
    }

    #[test]
    fn a_block_that_was_not_listed_or_twice_with_other_lengths_is_refused() {
        let error = counted(&[starts(0x10), starts(0x20)].concat()).unwrap_err();
        assert!(error.starts_with("QEMU did not list its block at 0x00000010"), "{error}");
        let again = "IN: main\n0x00000020:  3001  adds r0, #1\n\n";
        assert!(counted(&[MAIN, MAIN, &starts(0x10)].concat()).is_ok());
        let error = counted(&[MAIN, again, &starts(0x10)].concat()).unwrap_err();
        assert_eq!(error, "the block at 0x00000020 was listed with [3, 1] instructions");
    }

    #[test]
    fn a_block_with_a_gap_is_refused() {
        // The adds at 0x20 does not lead to the bl.
        let gap = "IN: main\n0x00000020:  3001  adds r0, #1\n0x00000024:  f000 f804  bl #0x30\n\n";
        let trace = [BEGIN, &starts(0x10), gap, &starts(0x20), END, &starts(0x30), &starts(0x30)];
        let error = counted(&trace.concat()).unwrap_err();
        assert!(error.contains("0x00000024 was executed after 0x00000020"), "{error}");
    }
}
