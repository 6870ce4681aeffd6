//! White noise, a correlated part and a drift, fitted to half the mean squared differences of frames by lag.

use crate::elementary::exp;

/// Shortest time constant that is tried, in frames: neighbours then have the correlation 0.14.
const SHORTEST: f64 = 0.5;
/// Ratio of a time constant that is tried to the one before it.
const STEP: f64 = 1.3;
/// Rounds in which the best time constant is narrowed down, each to two thirds.
const ROUNDS: usize = 20;

/// Parts of the variance. A part that would be negative is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    pub white: f64,
    pub correlated: f64,
    /// Time constant of the correlated part, in frames.
    pub time_constant: f64,
    /// Factor on the squared lag.
    pub drift: f64,
    /// Sum of squared deviations, each over its own variance for white noise.
    pub squares: f64,
}

impl Fit {
    /// Variance of half a squared difference at a `lag`.
    pub fn at(&self, lag: f64) -> f64 {
        self.white
            + self.correlated * (1.0 - exp(-lag / self.time_constant))
            + self.drift * lag * lag
    }

    /// Best fit without a correlated part to `curve`, of which each value is told by so many independent `pairs`.
    pub fn white(lags: &[usize], curve: &[f64], pairs: &[f64]) -> Option<Self> {
        Self::best(lags, curve, pairs, 1.0, &[&[true, false, true], &[true, false, false]])
    }

    /// Best fit with a correlated part, whose time constant is at most the `longest` lag.
    pub fn correlated(lags: &[usize], curve: &[f64], pairs: &[f64], longest: f64) -> Option<Self> {
        let of = |time_constant: f64| {
            let parts: [&[bool; 3]; 4] = [
                &[true, true, true],
                &[true, true, false],
                &[false, true, true],
                &[false, true, false],
            ];
            Self::best(lags, curve, pairs, time_constant, &parts)
        };
        let tried = std::iter::successors(Some(SHORTEST), |tau| Some(tau * STEP));
        let tried = tried.take_while(|tau| *tau <= longest).filter_map(of);
        let mut best = tried.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
        let mut reach = STEP;
        for _ in 0..ROUNDS {
            let nearby = [best.time_constant / reach, best.time_constant * reach];
            let nearby = nearby.into_iter().filter(|tau| (SHORTEST..=longest).contains(tau));
            for other in nearby.filter_map(of) {
                if other.squares < best.squares {
                    best = other;
                }
            }
            reach = 1.0 + (reach - 1.0) / 1.5;
        }
        Some(best)
    }

    /// Best of the fits with these parts (white, correlated, drift), of which none is negative.
    fn best(
        lags: &[usize],
        curve: &[f64],
        pairs: &[f64],
        time_constant: f64,
        choices: &[&[bool; 3]],
    ) -> Option<Self> {
        let longest = *lags.last()? as f64;
        let row = |lag: usize| {
            let lag = lag as f64;
            [1.0, 1.0 - exp(-lag / time_constant), (lag / longest).powi(2)]
        };
        let fit = |parts: &&[bool; 3]| {
            // Normal equations with a row of 1·x = 0 for each part that is left out.
            let mut matrix = [[0.0; 4]; 3];
            for ((lag, value), pairs) in lags.iter().zip(curve).zip(pairs) {
                let row = row(*lag);
                // Deviations are relative: the scatter of a difference grows with its variance.
                let weight = pairs / (value * value);
                for i in 0..3 {
                    for j in 0..3 {
                        matrix[i][j] += weight * row[i] * row[j];
                    }
                    matrix[i][3] += weight * row[i] * value;
                }
            }
            for part in (0..3).filter(|part| !parts[*part]) {
                matrix.iter_mut().for_each(|row| row[part] = 0.0);
                matrix[part] = [0.0; 4];
                matrix[part][part] = 1.0;
            }
            let [white, correlated, drift] = solve(matrix)?;
            if white < 0.0 || correlated < 0.0 || drift < 0.0 {
                return None;
            }
            let drift = drift / (longest * longest);
            let mut fit = Self { white, correlated, time_constant, drift, squares: 0.0 };
            let square = |((lag, value), pairs): ((&usize, &f64), &f64)| {
                pairs * (fit.at(*lag as f64) / value - 1.0).powi(2)
            };
            fit.squares = lags.iter().zip(curve).zip(pairs).map(square).sum();
            fit.squares.is_finite().then_some(fit)
        };
        choices.iter().filter_map(fit).min_by(|a, b| a.squares.total_cmp(&b.squares))
    }
}

/// Solution of three equations, by elimination in the order of a positive definite matrix.
fn solve(mut matrix: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    for pivot in 0..3 {
        if matrix[pivot][pivot] <= 0.0 {
            return None;
        }
        let row = matrix[pivot];
        for other in (0..3).filter(|other| *other != pivot) {
            let factor = matrix[other][pivot] / row[pivot];
            for (value, of_row) in matrix[other].iter_mut().zip(row) {
                *value -= factor * of_row;
            }
        }
    }
    Some([0, 1, 2].map(|place| matrix[place][3] / matrix[place][place]))
}
