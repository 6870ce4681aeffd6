//! What one inference may cost at most, whatever the compiler.

use super::figures::Figures;

/// Kernel, K, model cycles of one inference.
const BUDGETS: [(&str, u64, u64); 6] = [
    ("fixed16", 16, 1220),
    ("fixed16", 64, 4120),
    ("fixed16", 256, 15_700),
    ("f32", 16, 2600),
    ("f32", 64, 9300),
    ("f32", 256, 36_500),
];

/// What exceeds its budget, in words.
pub fn exceeded(figures: &[Figures]) -> Vec<String> {
    let over = |figures: &Figures| {
        let budget = BUDGETS
            .iter()
            .find(|(kernel, centres, _)| *kernel == figures.kernel && *centres == figures.centres);
        let budget = budget.filter(|(_, _, cycles)| figures.inference.cycles > *cycles);
        budget.map(|(kernel, centres, cycles)| {
            let taken = figures.inference.cycles;
            format!("{kernel}, K = {centres}: one inference takes {taken} cycles, {cycles} allowed")
        })
    };
    figures.iter().filter_map(over).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycles::regions::Count;

    #[test]
    fn a_budget_may_be_used_up_but_not_exceeded() {
        let figures = |kernel: &str, cycles| Figures {
            kernel: kernel.into(),
            centres: 16,
            inference: Count { instructions: 1, cycles },
            row: Count::default(),
            frame: Count::default(),
        };
        assert!(exceeded(&[figures("fixed16", 1220), figures("f32-direct", 5000)]).is_empty());
        assert_eq!(
            exceeded(&[figures("fixed16", 1221)]),
            ["fixed16, K = 16: one inference takes 1221 cycles, 1220 allowed"]
        );
    }
}
