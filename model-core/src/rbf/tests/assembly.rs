//! Constants and sizes that the assembly assumes, compared with those of its compiled twins.

use super::super::fixed16::CUBIC;
use super::super::{Shape, expanded, fixed16};
use crate::cortex_m4;
use crate::exp::{EXP2_COEFFICIENTS, ROUND};

/// Every constant of the assembly, in the order of its text.
fn words(assembly: &str) -> Vec<u32> {
    let lines = assembly.lines().filter_map(|line| line.trim().strip_prefix(".word "));
    let words = lines.flat_map(|line| line.split('@').next().unwrap().split(','));
    let parse = |word: &str| match word.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).unwrap(),
        None => word.parse::<i32>().unwrap().cast_unsigned(),
    };
    words.map(|word| parse(word.trim())).collect()
}

#[test]
fn the_assembly_has_the_coefficients_of_its_twins_and_no_other_constants() {
    let exp2 = EXP2_COEFFICIENTS.into_iter().chain([ROUND]).map(f32::to_bits);
    // The routines for rows and for arrays each have the cubic once.
    let cubics = [CUBIC, CUBIC].into_iter().flatten().map(i32::cast_unsigned);
    let expected: Vec<u32> = exp2.chain(cubics).collect();
    assert_eq!(words(include_str!("../../cortex_m4.s")), expected);
}

#[test]
fn a_block_has_the_words_that_the_assembly_reads() {
    for centres in 1..=70 {
        for (groups, affine) in (1..=8).flat_map(|groups| [(groups, false), (groups, true)]) {
            let shape =
                Shape { inputs: cortex_m4::INPUTS, centres, outputs: cortex_m4::OUTPUTS * groups };
            let expanded = expanded::Network::block_words(shape, affine);
            assert_eq!(expanded, cortex_m4::expanded_words(centres, affine, groups), "{shape:?}");
            let fixed16 = fixed16::Network::block_words(shape, affine);
            assert_eq!(fixed16, cortex_m4::fixed16_words(centres, affine, groups), "{shape:?}");
        }
    }
}
