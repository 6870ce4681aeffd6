//! Reads the trace that QEMU writes with `-d exec,nochain`, as it comes.

use std::io::BufRead;

use super::regions::Regions;
use crate::process::Outcome;

/// A line of the trace.
#[derive(Debug, PartialEq, Eq)]
enum Line {
    /// `Trace 0: 0x7f… [00800408/00000400/00000110/ff000201] Reset`: a block of code starts, of one
    /// instruction. The second number is its address, in guests of either width.
    Starts(u32),
    /// `Stopped execution of TB chain before …`: the block that was announced last did not start;
    /// it will be announced again.
    DidNotStart,
    /// Something else.
    Other,
}

/// Hands what `trace` tells to `regions`, and gives back the lines that are no trace.
///
/// # Errors
/// Whatever [`Regions::execute`] says, or the trace cannot be read.
pub fn follow(mut trace: impl BufRead, regions: &mut Regions<'_>) -> Outcome<String> {
    let mut others = String::new();
    let mut line = Vec::new();
    loop {
        line.clear();
        let length = trace.read_until(b'\n', &mut line);
        if length.map_err(|cause| format!("the trace cannot be read: {cause}"))? == 0 {
            return Ok(others);
        }
        match parse(&line) {
            Line::Starts(address) => regions.execute(address)?,
            Line::DidNotStart => regions.undo(),
            Line::Other => others.push_str(&String::from_utf8_lossy(&line)),
        }
    }
}

fn parse(line: &[u8]) -> Line {
    if line.starts_with(b"Trace ") {
        let address = line.split(|byte| *byte == b'/').nth(1);
        let address = address.and_then(|digits| std::str::from_utf8(digits).ok());
        let address = address.and_then(|digits| u64::from_str_radix(digits, 16).ok());
        address.and_then(|address| u32::try_from(address).ok()).map_or(Line::Other, Line::Starts)
    } else if line.starts_with(b"Stopped execution of TB chain before") {
        Line::DidNotStart
    } else {
        Line::Other
    }
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
        assert_eq!(parse(b"Trace 0: something\n"), Line::Other);
        assert_eq!(parse(b"qemu-system-arm: a warning\n"), Line::Other);
    }

    #[test]
    fn a_block_that_did_not_start_is_not_counted() {
        // 0x10 begin: bx lr; 0x20: adds r0, #1; bl 0x30.
        let mut halfwords = vec![0x4770; 16];
        halfwords[8..11].copy_from_slice(&[0x3001, 0xF000, 0xF805]);
        let code = Code::of(0x10, &halfwords);
        let trace = b"Trace 0: 0x1 [0/00000010/0/0] begin\n\
            Trace 0: 0x1 [0/00000020/0/0] main\n\
            Stopped execution of TB chain before 0x1 [00000020] main\n\
            Trace 0: 0x1 [0/00000020/0/0] main\n\
            a complaint\n\
            Trace 0: 0x1 [0/00000022/0/0] main\n\
            Stopped execution of TB chain before 0x1 [00000022] main\n\
            Trace 0: 0x1 [0/00000022/0/0] main\n\
            Trace 0: 0x1 [0/00000030/0/0] end\n";
        let mut regions = Regions::new(&code, 0x10, 0x30);
        assert_eq!(follow(&trace[..], &mut regions).unwrap(), "a complaint\n");
        // adds: 1; bl: 1 + 2.
        let whole = Count { instructions: 2, cycles: 4 };
        assert_eq!(regions.finish().unwrap(), [Region { whole, ..Region::default() }]);
    }
}
