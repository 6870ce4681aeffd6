//! Counting instructions in regions of a program, from the trace that QEMU writes with `-d exec,nochain,in_asm`.
//!
//! QEMU lists a block of code when it translates it, and prints its address whenever the block starts. A block is
//! executed from its first instruction to its last. A region starts where a call of one function returns, and ends
//! where another is called: every count includes that call.

use std::collections::HashMap;
use std::io::BufRead;

use crate::process::Outcome;

/// Addresses of the functions that start and end a region.
#[derive(Debug, Clone, Copy)]
pub struct Marks {
    pub begin: u32,
    pub end: u32,
}

/// Counts the instructions of each region in `trace`; also returns the lines that belong to no trace.
///
/// # Errors
/// A block was listed in two ways or not at all, a region starts in another, or the program ended in one.
pub fn count(mut trace: impl BufRead, marks: Marks) -> Outcome<(Vec<u64>, String)> {
    let mut blocks: HashMap<u32, u64> = HashMap::new();
    // The block that is listed, and the one that was announced last: the next line says whether it started.
    let (mut listed, mut announced): (Option<(u32, u64)>, Option<u32>) = (None, None);
    let (mut counted, mut region) = (Vec::new(), None);
    let (mut line, mut others) = (Vec::new(), String::new());
    loop {
        line.clear();
        let length = trace.read_until(b'\n', &mut line);
        if length.map_err(|cause| format!("the trace cannot be read: {cause}"))? == 0 {
            break;
        }
        // `0x00000400:  b5f0       push     {r4, r5, r6, r7, lr}`
        if let Some(rest) = line.strip_prefix(b"0x") {
            let address = rest.split(|byte| *byte == b':').next().and_then(hexadecimal);
            let address = address.ok_or("a listed instruction has no address")?;
            listed.get_or_insert((address, 0)).1 += 1;
            continue;
        }
        // `Trace 0: 0x7f… [00800408/00000400/00000110/ff000201] main`: the second number is the block's address.
        let starts = line.starts_with(b"Trace ").then(|| line.split(|byte| *byte == b'/').nth(1));
        let starts = starts.flatten().and_then(hexadecimal);
        if (starts.is_some() || line.starts_with(b"IN:"))
            && let Some((address, instructions)) = listed.take()
            && blocks.insert(address, instructions).is_some_and(|it| it != instructions)
        {
            return Err(format!("the block at {address:#010x} was listed in two ways"));
        }
        if starts.is_some() {
            let Some(address) = std::mem::replace(&mut announced, starts) else { continue };
            if address == marks.begin {
                if region.replace(0).is_some() {
                    return Err(format!("region {} starts another", counted.len() + 1));
                }
            } else if address == marks.end {
                counted.extend(region.take());
            } else if let Some(region) = &mut region {
                *region += blocks.get(&address).ok_or_else(|| {
                    format!("QEMU did not list its block at {address:#010x}; was it built with a disassembler?")
                })?;
            }
        } else if line.starts_with(b"Stopped execution of TB chain before") {
            // It will be announced again.
            announced = None;
        } else if !line.starts_with(b"IN:") && !line.trim_ascii().iter().all(|byte| *byte == b'-') {
            others.push_str(&String::from_utf8_lossy(&line));
        }
    }
    match region {
        None => Ok((counted, others)),
        Some(_) => Err(format!("the program ended in its region {}", counted.len() + 1)),
    }
}

/// A hexadecimal number that fits an address.
fn hexadecimal(digits: &[u8]) -> Option<u32> {
    u64::from_str_radix(str::from_utf8(digits).ok()?, 16).ok()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LISTED: &str = "IN: begin\n0x00000010:  bf00  nop\n0x00000012:  4770  bx lr\n\n\
        ----------------\nIN: main\n0x00000020:  3001  adds r0, #1\n0x00000022:  3001  adds r0, #1\n\
        0x00000024:  f000 f804  bl #0x30\n\nIN: end\n0x00000030:  4770  bx lr\n\n";

    /// Counts of a trace with these blocks, one after the other.
    fn counted(listed: &str, blocks: &[u32]) -> Outcome<(Vec<u64>, String)> {
        let starts = |address: &u32| format!("Trace 0: 0x1 [0/{address:016x}/0/0] name\n");
        let trace = listed.to_owned() + &blocks.iter().map(starts).collect::<String>();
        count(trace.as_bytes(), Marks { begin: 0x10, end: 0x30 })
    }

    #[test]
    fn blocks_of_a_region_count_whole_as_often_as_they_start() {
        let twice = [0x20, 0x10, 0x20, 0x20, 0x30, 0x10, 0x20, 0x30, 0x30];
        assert_eq!(counted(LISTED, &twice), Ok((vec![6, 3], String::new())));
        let stopped = "Trace 0: 0x1 [0/10/0/0] begin\nTrace 0: 0x1 [0/20/0/0] main\n\
            Stopped execution of TB chain before 0x1 [00000020] name\na complaint\n";
        let found = counted(&[LISTED, stopped].concat(), &[0x20, 0x30, 0x30]);
        assert_eq!(found, Ok((vec![3], "a complaint\n".to_owned())));
    }

    #[test]
    fn what_cannot_be_counted_is_refused() {
        let other = format!("{LISTED}IN: b\n0x00000020:  bf00  nop\n\n");
        for (listed, blocks, named) in [
            (&other[..], &[0x20][..], "the block at 0x00000020 was listed in two ways"),
            (LISTED, &[0x10, 0x40, 0x30], "QEMU did not list its block at 0x00000040"),
            (LISTED, &[0x10, 0x10, 0x30], "region 1 starts another"),
            (LISTED, &[0x10, 0x20, 0x20], "the program ended in its region 1"),
        ] {
            let error = counted(listed, blocks).unwrap_err();
            assert!(error.contains(named), "{named}: {error}");
        }
    }
}
