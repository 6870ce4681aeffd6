//! Table 1 as the paper prints it, and how near other tables come to it.

/// Spreads of the lines of the paper's Table 1.
pub const SPREADS: [f64; 10] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
/// Noise levels of its columns, as fractions.
pub const NOISE_LEVELS: [f64; 4] = [0.005, 0.01, 0.05, 0.1];

/// Cells of a table laid out as the paper's Table 1: relative decoupling error along z in per cent, by spread and
/// noise level.
pub type Cells = [[f64; 4]; 10];

/// Whether a table with these spreads and noise levels is laid out as the printed one.
pub fn is_layout(spreads: &[f64], noise_levels: &[f64]) -> bool {
    spreads == SPREADS && noise_levels == NOISE_LEVELS
}

/// Cells of Table 1 in Wang et al., Sensors & Transducers 2014. The paper does not state the formula of the error.
pub const CELLS: Cells = [
    [6.47, 7.89, 9.12, 9.55],
    [7.23, 9.20, 9.52, 9.78],
    [7.77, 10.23, 9.78, 9.81],
    [8.21, 9.50, 9.77, 9.75],
    [8.37, 9.27, 9.98, 9.84],
    [8.80, 9.70, 9.98, 10.56],
    [8.82, 9.23, 10.33, 10.64],
    [8.36, 9.29, 10.18, 10.86],
    [8.89, 9.42, 10.06, 11.23],
    [9.31, 11.11, 10.67, 11.39],
];

/// Printed cell of a spread and a noise level, in per cent.
pub fn cell(spread: f64, noise_level: f64) -> Option<f64> {
    let line = SPREADS.iter().position(|it| *it == spread)?;
    let column = NOISE_LEVELS.iter().position(|it| *it == noise_level)?;
    Some(CELLS[line][column])
}

/// How near a table comes to the printed one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearness {
    /// Root mean square of the gaps, in points (per cent of error).
    pub gap: f64,
    /// Pearson correlation with the printed cells; none for a table of equal cells.
    pub correlation: Option<f64>,
}

impl Nearness {
    /// Nearness of `cells` to the printed ones.
    pub fn new(cells: &Cells) -> Self {
        let pairs = cells.as_flattened().iter().zip(CELLS.as_flattened());
        let gap = f64::sqrt(pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / 40.0);
        Self { gap, correlation: correlation(cells) }
    }

    /// Nearness of a table whose cells are all the mean of the printed ones.
    pub fn of_a_constant() -> Self {
        Self::new(&[[mean(&CELLS); 4]; 10])
    }
}

/// Mean of all cells, in per cent.
fn mean(cells: &Cells) -> f64 {
    cells.as_flattened().iter().sum::<f64>() / 40.0
}

fn correlation(cells: &Cells) -> Option<f64> {
    let [own, printed] = [mean(cells), mean(&CELLS)];
    let sum = |of: fn(f64, f64) -> f64| -> f64 {
        let pairs = cells.as_flattened().iter().zip(CELLS.as_flattened());
        pairs.map(|(a, b)| of(a - own, b - printed)).sum()
    };
    let (common, square) = (sum(|a, b| a * b), sum(|a, _| a * a));
    (square > 1e-12).then(|| common / (square * sum(|_, b| b * b)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gap_to_the_paper_is_0_for_itself_and_1_05_for_a_constant() {
        let constant = Nearness::of_a_constant();
        assert!((constant.gap - 1.05).abs() < 0.005, "{constant:?}");
        assert_eq!(constant.correlation, None);
        let own = Nearness::new(&CELLS);
        assert_eq!(own.gap, 0.0);
        assert!((own.correlation.unwrap() - 1.0).abs() < 1e-12);
    }
}
