//! Sizes of the assembly's innermost loops, as they were executed: each must fit an instruction cache.

use super::code::Code;
use crate::process::Outcome;

/// Bytes of the instruction cache of an STM32F4's flash interface.
const CACHE_BYTES: u32 = 1024;

/// Functions in assembly that loop, which the images' symbols name.
const FUNCTIONS: [&str; 3] = ["taxel_f32", "f32_sums", "taxel_fixed16"];

/// An innermost loop: a branch back to an address at or before it, taken twice without another one between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Loop {
    /// Address of its first instruction.
    pub start: u32,
    /// Address behind its last one, the branch.
    pub end: u32,
}

impl Loop {
    fn bytes(self) -> u32 {
        self.end - self.start
    }
}

/// The largest of `loops` in every function in assembly, as lines: name and bytes.
pub fn largest(code: &Code, loops: &[Loop]) -> Outcome<String> {
    let mut lines = Vec::new();
    let mut wrong = Vec::new();
    for function in FUNCTIONS {
        let range = code.functions().find(|(name, _)| *name == function).map(|(_, range)| range);
        let range = range.ok_or_else(|| format!("the image has no function {function}"))?;
        let within = loops.iter().filter(|it| range.contains(&it.start));
        match within.map(|it| it.bytes()).max() {
            Some(bytes) if bytes <= CACHE_BYTES => {
                lines.push(format!("largest loop of {function:16} {bytes:5} bytes\n"));
            }
            Some(bytes) => wrong.push(format!(
                "a loop of {function} has {bytes} bytes; {CACHE_BYTES} fit the instruction cache"
            )),
            None => wrong.push(format!("no loop of {function} was executed")),
        }
    }
    if wrong.is_empty() { Ok(lines.concat()) } else { Err(wrong.join("; ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> Code {
        let places = FUNCTIONS.iter().zip(1..);
        places.fold(Code::of(0, &[]), |code, (name, place)| {
            code.with_symbol(name, place * 0x1000, 0x1000)
        })
    }

    #[test]
    fn a_loop_may_fill_the_cache_but_not_exceed_it() {
        let mut loops: Vec<Loop> = (1..4)
            .map(|place| Loop { start: place * 0x1000, end: place * 0x1000 + 1024 })
            .collect();
        let lines = largest(&image(), &loops).unwrap();
        assert!(lines.contains("largest loop of taxel_fixed16     1024 bytes\n"), "{lines}");
        loops[2].end += 2;
        let error = largest(&image(), &loops).unwrap_err();
        assert_eq!(error, "a loop of taxel_fixed16 has 1026 bytes; 1024 fit the instruction cache");
        loops.remove(2);
        assert_eq!(largest(&image(), &loops).unwrap_err(), "no loop of taxel_fixed16 was executed");
    }
}
