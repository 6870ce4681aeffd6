//! Budgets: the most cycles that decoding may take, with any compiler.

use super::figures::{Figure, Scope};
use super::regions::Count;

/// Budgets: kernel, K, scope, and cycles of a model without an affine tail.
const BUDGETS: [(&str, u64, Scope, u64); 7] = [
    // Loops that fit 1 KiB hand exponents over in memory, which takes 30 cycles for sixteen centres.
    ("fixed16", 16, Scope::Inference, 1250),
    ("fixed16", 64, Scope::Inference, 4000),
    ("fixed16", 256, Scope::Inference, 15_000),
    ("f32", 16, Scope::Inference, 2600),
    ("f32", 64, Scope::Inference, 9300),
    ("f32", 256, Scope::Inference, 36_500),
    // This is 0.2 ms at 168 MHz.
    ("fixed16", 64, Scope::Frame, 33_600),
];

/// Budget in cycles of one power of two, in the number format that has a loop for them.
const EXPONENTIAL: u64 = 32;

/// Budget in cycles of a frame whose rows are all at rest, in any number format: a tenth of that of a frame.
const RESTING_FRAME: u64 = 3360;

/// Budgets of an inference with K = 64 from flash, with weights in RAM: kernel, and per cent of its cycles at zero
/// wait. The loops of `fixed16` fit the flash's instruction cache. In `f32`, most of the allowance is for the reading
/// of the manual by which prefetched lines are not kept: instructions are long, and prefetching cannot keep up.
const FROM_FLASH: [(&str, u64); 2] = [("fixed16", 115), ("f32", 145)];
const FROM_FLASH_CENTRES: u64 = 64;

/// Budget of a figure in cycles; `None` if it has none.
fn budget(figure: &Figure) -> Option<u64> {
    if figure.affine {
        return None;
    }
    match figure.scope {
        Scope::Exponential => return Some(EXPONENTIAL * figure.centres),
        Scope::RestingFrame | Scope::ArrayRestingFrame => return Some(RESTING_FRAME),
        _ => (),
    }
    let of = |(kernel, centres, scope, _): &&(&str, u64, Scope, u64)| {
        (*kernel, *centres, *scope) == (&figure.kernel, figure.centres, figure.scope)
    };
    BUDGETS.iter().find(of).map(|(.., cycles)| *cycles)
}

/// Descriptions of all figures that exceed their budgets.
pub fn exceeded(figures: &[Figure]) -> Vec<String> {
    let over = |figure: &Figure| {
        let allowed = budget(figure).filter(|allowed| figure.count.cycles > *allowed)?;
        let Figure { kernel, centres, scope, count, .. } = figure;
        Some(format!(
            "{kernel}, K = {centres}, {}: {} cycles, {allowed} allowed",
            scope.name(),
            count.cycles
        ))
    };
    figures.iter().filter_map(over).chain(figures.iter().filter_map(over_from_flash)).collect()
}

/// Description of a figure that exceeds its budget from flash.
fn over_from_flash(figure: &Figure) -> Option<String> {
    let Figure { kernel, centres, affine, scope, count } = figure;
    if (*centres, *affine, *scope) != (FROM_FLASH_CENTRES, false, Scope::Inference) {
        return None;
    }
    let (_, percent) = FROM_FLASH.iter().find(|(name, _)| name == kernel)?;
    let Count { cycles, flash_cycles, .. } = count;
    (100 * flash_cycles > percent * cycles).then(|| {
        format!(
            "{kernel}, K = {centres}, {}: {flash_cycles} cycles from flash, {percent} % of {cycles} allowed",
            scope.name()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(kernel: &str, scope: Scope, affine: bool, cycles: u64) -> Figure {
        let count = Count { instructions: 1, cycles, flash_cycles: 2 * cycles };
        Figure { kernel: kernel.into(), centres: 16, affine, scope, count }
    }

    #[test]
    fn a_budget_may_be_used_up_but_not_exceeded() {
        let within = [
            figure("fixed16", Scope::Inference, false, 1250),
            figure("fixed16", Scope::Inference, true, 1271),
            figure("fixed16", Scope::Row, false, 5000),
            figure("f32", Scope::Exponential, false, 16 * 32),
            figure("f32-direct", Scope::Inference, false, 5000),
            figure("f32", Scope::RestingFrame, false, 3360),
        ];
        assert!(exceeded(&within).is_empty());
        let beyond = [
            figure("fixed16", Scope::Inference, false, 1251),
            figure("f32", Scope::Exponential, false, 16 * 32 + 1),
            figure("f32", Scope::RestingFrame, false, 3361),
        ];
        assert_eq!(
            exceeded(&beyond),
            [
                "fixed16, K = 16, inference: 1251 cycles, 1250 allowed",
                "f32, K = 16, exponential: 513 cycles, 512 allowed",
                "f32, K = 16, resting-frame: 3361 cycles, 3360 allowed"
            ]
        );
    }

    #[test]
    fn waiting_for_flash_has_a_budget_at_64_centres() {
        let figure = |kernel: &str, centres, flash_cycles| {
            let count = Count { instructions: 1, cycles: 1000, flash_cycles };
            let (kernel, scope) = (kernel.into(), Scope::Inference);
            Figure { kernel, centres, affine: false, scope, count }
        };
        let within = [
            figure("fixed16", 64, 1150),
            figure("f32", 64, 1450),
            figure("f32", 256, 3000),
            figure("f32-direct", 64, 3000),
            Figure { affine: true, ..figure("f32", 64, 3000) },
        ];
        assert!(exceeded(&within).is_empty());
        assert_eq!(
            exceeded(&[figure("fixed16", 64, 1151), figure("f32", 64, 1451)]),
            [
                "fixed16, K = 64, inference: 1151 cycles from flash, 115 % of 1000 allowed",
                "f32, K = 64, inference: 1451 cycles from flash, 145 % of 1000 allowed"
            ]
        );
    }
}
