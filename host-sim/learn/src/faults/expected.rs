//! What a frame's other readings tell of each, by a reading model, whatever the noise.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use taxel_core::reading_model::{ReadingModel, Sizes};

use super::FEWEST_FOR_NOISE;

/// Median of the square of a standard normal number.
const MEDIAN_SQUARE: f64 = 0.4549;
/// Squares of errors, in those of noise, from which on a reading is far off the others. A touch that the model does not know
/// has up to 11 while it lasts.
const FAR_OFF: f64 = 25.0;
/// Rounds in which the present noise is found.
const ROUNDS: usize = 6;
/// Largest variance along a factor, in that of noise.
const MOST_VARIANCE: f64 = 1e7;

/// Factors of a reading model, in f64, and their parts.
#[derive(Debug)]
pub struct Expected {
    mean: Vec<f64>,
    scale: Vec<f64>,
    /// Parts of the readings in the factors, in units of the noise in training; `readings × factors`.
    parts: DMatrix<f64>,
}

/// What solves for a frame's factors, given the readings that are there, at some noise.
pub struct Solver {
    there: Vec<bool>,
    variance: f64,
    decomposition: Cholesky<f64, Dyn>,
    /// Shares of the readings' noise that is left in their differences from what is expected.
    pub left: Vec<f64>,
}

impl Solver {
    /// Standard error of what is expected of a sum of readings that has these `parts` in the factors.
    pub fn standard_error(&self, parts: &DVector<f64>) -> f64 {
        (self.variance * parts.dot(&self.decomposition.solve(parts))).sqrt()
    }
}

impl Expected {
    pub fn new(model: ReadingModel<'_>) -> Self {
        let channels: Vec<_> = model.channels().collect();
        let Sizes { readings, factors, .. } = model.sizes();
        let mut parts = DMatrix::from_fn(readings, factors, |i, f| f64::from(channels[i].2[f]));
        // The block has parts of the inverse covariance. Their squares sum up to 1 − 1/λ, with λ the variance.
        for mut column in parts.column_iter_mut() {
            let variance = (1.0 / (1.0 - column.norm_squared()).max(1.0 / MOST_VARIANCE)).max(1.0);
            column.scale_mut(variance.sqrt());
        }
        let of = |value: fn(&(f32, f32, &[f32])) -> f32| {
            channels.iter().map(|channel| f64::from(value(channel))).collect()
        };
        Self { mean: of(|channel| channel.0), scale: of(|channel| channel.1), parts }
    }

    pub fn readings(&self) -> usize {
        self.mean.len()
    }

    /// Readings about their means, in units of their noise in training; NaN stays.
    pub fn standardised(&self, readings: &[f64]) -> Vec<f64> {
        let place = |(at, reading): (usize, &f64)| {
            let channel = at % self.readings();
            (reading - self.mean[channel]) * self.scale[channel]
        };
        readings.iter().enumerate().map(place).collect()
    }

    /// Difference of the means of two readings, and of standardised ones, in units of the noise of a difference.
    pub fn difference(&self, [a, b]: [usize; 2], [of_a, of_b]: [f64; 2]) -> f64 {
        let ohm = |at: usize, z: f64| self.mean[at] + z / self.scale[at];
        let noise = (1.0 / self.scale[a]).hypot(1.0 / self.scale[b]);
        (ohm(a, of_a) - ohm(b, of_b)) / noise
    }

    /// Parts of the [`difference`](Self::difference) of two readings in the factors.
    pub fn parts_of_difference(&self, [a, b]: [usize; 2]) -> DVector<f64> {
        let part = |at: usize| self.parts.row(at).transpose() / self.scale[at];
        (part(a) - part(b)) / (1.0 / self.scale[a]).hypot(1.0 / self.scale[b])
    }

    fn solver(&self, there: Vec<bool>, variance: f64) -> Option<Solver> {
        let factors = self.parts.ncols();
        let mut matrix = DMatrix::identity(factors, factors) * variance;
        for (row, _) in self.parts.row_iter().zip(&there).filter(|(_, there)| **there) {
            matrix.ger(1.0, &row.transpose(), &row.transpose(), 1.0);
        }
        let decomposition = matrix.cholesky()?;
        let solved = decomposition.solve(&self.parts.transpose());
        let of = |at: usize| {
            let along = self.parts.row(at).transpose().dot(&solved.column(at));
            if there[at] { (1.0 - along).max(1e-6) } else { 1.0 + along }
        };
        let left = (0..self.readings()).map(of).collect();
        Some(Solver { there, variance, decomposition, left })
    }

    /// Calls `take` with each frame of `scaled` readings, what is expected of all its readings given those that are neither
    /// missing nor `left_out`, and what solved for that.
    pub fn each(
        &self,
        scaled: &[f64],
        left_out: &dyn Fn(usize) -> bool,
        variance: f64,
        mut take: impl FnMut(&[f64], &DVector<f64>, &Solver),
    ) {
        let mut known: Option<Solver> = None;
        for frame in scaled.chunks_exact(self.readings()) {
            let there: Vec<bool> =
                (0..frame.len()).map(|at| !frame[at].is_nan() && !left_out(at)).collect();
            if known.as_ref().is_none_or(|solver| solver.there != there) {
                known = self.solver(there, variance);
            }
            let Some(solver) = &known else { continue };
            let z = DVector::from_fn(
                frame.len(),
                |at, _| if solver.there[at] { frame[at] } else { 0.0 },
            );
            let factors = solver.decomposition.solve(&self.parts.tr_mul(&z));
            take(frame, &(&self.parts * factors), solver);
        }
    }

    /// Median squares of what each reading differs from what is expected, in units of the noise in training. 0 for a
    /// reading that is there in too few frames to tell.
    fn squares(&self, scaled: &[f64], struck: &[bool], variance: f64) -> Vec<f64> {
        let mut squares = vec![Vec::new(); self.readings()];
        self.each(scaled, &|at| struck[at], variance, |frame, expected, solver| {
            for (at, squares) in squares.iter_mut().enumerate() {
                let square = (frame[at] - expected[at]).powi(2) / solver.left[at];
                if !square.is_nan() && self.scale[at] > 0.0 {
                    squares.push(square);
                }
            }
        });
        squares.iter_mut().filter(|it| it.len() < FEWEST_FOR_NOISE).for_each(Vec::clear);
        squares.into_iter().map(|mut squares| median(&mut squares) / MEDIAN_SQUARE).collect()
    }

    /// Variance of the present noise, in that of training, and the median squares at it.
    pub fn present_noise(&self, scaled: &[f64], struck: &[bool]) -> (f64, Vec<f64>) {
        let mut variance = 1.0;
        let mut squares = Vec::new();
        for _ in 0..ROUNDS {
            squares = self.squares(scaled, struck, variance);
            let mut sound: Vec<f64> = (0..squares.len())
                .filter(|at| !struck[*at] && squares[*at] > 0.0)
                .map(|at| squares[at])
                .collect();
            let next = median(&mut sound).max(0.01);
            let settled = (next / variance - 1.0).abs() < 0.02;
            variance = next;
            if settled {
                break;
            }
        }
        (variance, squares)
    }

    /// Readings besides the `struck` ones that are far off the others, the farthest first.
    pub fn far_off(&self, scaled: &[f64], struck: &[bool]) -> Vec<usize> {
        let mut struck = struck.to_vec();
        let mut found = Vec::new();
        while found.len() < self.readings() / 3 {
            let (variance, squares) = self.present_noise(scaled, &struck);
            let sound = (0..squares.len()).filter(|at| !struck[*at]);
            let Some(worst) = sound.max_by(|a, b| squares[*a].total_cmp(&squares[*b])) else {
                break;
            };
            if squares[worst] < FAR_OFF * variance {
                break;
            }
            struck[worst] = true;
            found.push(worst);
        }
        found
    }
}

/// Median of `values`, which are reordered; 0 of none.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
