//! Code of the image that is not traced, because it is in no region. QEMU writes a line for every block that it
//! starts, and most blocks of a run only check the model and print.

use std::ops::Range;

use super::code::Code;

/// Parts of the symbols of these functions, which both ways to mangle names contain. If a region calls one of them
/// after all, the measurement fails and names it.
pub const FUNCTIONS: [&[&str]; 12] = [
    // Checking the blob, once: everything except the search for a row's network.
    &["10model_core8checksum"],
    &["10model_core4blob6decode", "5Model6decode"],
    &["10model_core4blob6decode4take"],
    &["10model_core4blob6decode15take_projection"],
    &["10model_core4blob6decode14take_expansion"],
    &["10model_core4blob6decode16checked_metadata"],
    &["10model_core3rbf", "7Network12check_values"],
    &["4core3str8converts9from_utf8"],
    // Making the readings, once.
    &["10qemu_bench6inputs"],
    // Logging.
    &["defmt"],
    &["semihosting"],
    &["4core3fmt"],
];

/// Bytes of the shortest instruction that a function can start with.
const FIRST_INSTRUCTION: u32 = 2;

/// Functions whose blocks are not traced, except the first instruction of each, so that a call is noticed.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Untraced {
    /// Names and addresses, in the order of the addresses.
    functions: Vec<(String, Range<u32>)>,
}

impl Untraced {
    /// The functions of `code` whose symbols contain all parts of one of `names`.
    pub fn of(code: &Code, names: &[&[&str]]) -> Self {
        let is_meant =
            |name: &str| names.iter().any(|parts| parts.iter().all(|part| name.contains(part)));
        let mut functions: Vec<_> = code
            .functions()
            .filter(|(name, range)| is_meant(name) && range.len() > FIRST_INSTRUCTION as usize)
            .map(|(name, range)| (name.to_owned(), range))
            .collect();
        functions.sort_by_key(|(name, range)| (range.start, range.end, name.clone()));
        functions.dedup_by_key(|(_, range)| range.start);
        Self { functions }
    }

    /// Name of the function that contains `address`.
    pub fn function_at(&self, address: u32) -> Option<&str> {
        let after = self.functions.partition_point(|(_, range)| range.start <= address);
        let (name, range) = self.functions.get(after.checked_sub(1)?)?;
        range.contains(&address).then_some(name)
    }

    /// Ranges of all addresses to be traced, for QEMU's `-dfilter`: the first and last address of each range. They
    /// include the first instruction of each untraced function.
    pub fn ranges_of_others(&self) -> String {
        let mut ranges = Vec::new();
        let mut start = 0;
        for (_, range) in &self.functions {
            let last = range.start + FIRST_INSTRUCTION - 1;
            if start <= last {
                ranges.push(format!("{start:#x}..{last:#x}"));
            }
            start = start.max(range.end);
        }
        ranges.push(format!("{start:#x}..{:#x}", u32::MAX));
        ranges.join(",")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn untraced() -> Untraced {
        let code = Code::of(0, &[])
            .with_symbol("_ZN5print4lineE", 0x40, 0x10)
            .with_symbol("_ZN5print4wordE", 0x20, 0x8)
            .with_symbol("its_alias_in_print", 0x40, 0x10)
            .with_symbol("_ZN5print5emptyE", 0x60, 0)
            .with_symbol("_ZN6decode3rowE", 0x28, 0x18);
        Untraced::of(&code, &[&["print"], &["decode", "3row", "E2"]])
    }

    #[test]
    fn everything_else_is_traced_and_the_first_instruction_of_what_is_not() {
        assert_eq!(untraced().ranges_of_others(), "0x0..0x21,0x28..0x41,0x50..0xffffffff");
        assert_eq!(Untraced::default().ranges_of_others(), "0x0..0xffffffff");
    }

    #[test]
    fn an_address_belongs_to_the_function_around_it() {
        let untraced = untraced();
        for (address, name) in [
            (0x1F, None),
            (0x20, Some("_ZN5print4wordE")),
            (0x27, Some("_ZN5print4wordE")),
            (0x28, None),
            (0x40, Some("_ZN5print4lineE")),
            (0x50, None),
        ] {
            assert_eq!(untraced.function_at(address), name, "{address:#x}");
        }
    }
}
