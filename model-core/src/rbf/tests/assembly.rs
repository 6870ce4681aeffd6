//! Constants that the assembly assumes, compared with those of its compiled twins.

use super::super::fixed16::CUBIC;

/// Every constant of the assembly, in the order of its text, without addresses and strides.
fn words(assembly: &str) -> Vec<u32> {
    let lines = assembly.lines().filter_map(|line| line.trim().strip_prefix(".word "));
    let words = lines.flat_map(|line| line.split('@').next().unwrap().split(','));
    let parse = |word: &str| match word.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => word.parse::<i32>().ok().map(i32::cast_unsigned),
    };
    words.filter_map(|word| parse(word.trim())).collect()
}

#[test]
fn the_assembly_has_the_same_coefficients_as_the_rust_code() {
    let cubic = CUBIC.map(i32::cast_unsigned);
    assert_eq!(words(include_str!("../../cortex_m4/fixed16.s")), cubic);
}
