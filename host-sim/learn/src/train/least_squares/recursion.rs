//! Recursive least squares: one sample after another, in memory that does not grow with their number.
//!
//! The recursion is that of [`taxel_core::rls`], to the bit: R and z are rotated with each sample, forgotten by λ, and
//! given back what is forgotten of 1/δ. What differs is the order in which independent rotations are computed. A
//! rotation of row i with sample t needs row i after sample t − 1, and sample t after row i − 1, and nothing else. So a
//! few samples pass through a few rows at a time, in vector lanes: the divisions and roots of one row hide behind those
//! of the next.

use std::ops::Range;

use taxel_data::widest;

use super::super::Recursive;
use super::{Design, FILLED, Factor};

/// Numbers that are rotated together: rows are of whole such groups, and rotated from one on.
const LANES: usize = 8;
/// Rows that are rotated by turns, each with a sample of its own.
const ROWS_BY_TURNS: usize = 4;
/// Samples that pass through the rows together: they stay in the first cache.
const SAMPLES_AT_ONCE: usize = 16;

/// Recursion over samples of so many regressors and outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Recursion {
    regressors: usize,
    outputs: usize,
    /// Numbers in a row: its regressors, its outputs, and zeros up to whole groups.
    width: usize,
    /// Rows of [R | z].
    rows: Vec<f64>,
    /// Samples [h | y] that are being rotated; with forgetting, each followed by what it gives back.
    samples: Vec<f64>,
    root_forgetting: f64,
    /// What a direction gets back at its turn, once in as many samples as there are regressors.
    share: f64,
    turn: usize,
}

impl Recursion {
    /// Starts with weights 0, covariance δ·I, and the forgetting factor of `settings`.
    ///
    /// # Panics
    /// If a setting or δ is beyond what [`Recursive::check`] allows.
    pub fn new(
        regressors: usize,
        outputs: usize,
        initial_covariance: f64,
        settings: &Recursive,
    ) -> Self {
        let forgetting_factor = settings.forgetting_factor;
        let diagonal = 1.0 / initial_covariance.sqrt();
        assert!(diagonal.is_normal(), "the initial covariance must be positive and finite");
        settings.check().expect("a checked forgetting factor");
        let width = (regressors + outputs).next_multiple_of(LANES);
        let mut rows = vec![0.0; regressors * width];
        rows.iter_mut().step_by(width + 1).for_each(|place| *place = diagonal);
        let left = (0..regressors).fold(1.0, |left, _| left * forgetting_factor);
        let share = diagonal * (1.0 - left).sqrt();
        let root_forgetting = forgetting_factor.sqrt();
        let samples = Vec::new();
        Self { regressors, outputs, width, rows, samples, root_forgetting, share, turn: 0 }
    }

    /// Takes in the samples of `design` in `range`, with `targets` of all its samples (`samples × outputs`).
    ///
    /// Work: 3n² + 6n·outputs operations a sample, and about as many again with forgetting.
    pub fn absorb(
        &mut self,
        design: &(impl Design + ?Sized),
        targets: &[f64],
        range: Range<usize>,
    ) {
        let (n, outputs) = (self.regressors, self.outputs);
        let mut values = vec![0.0; FILLED * n];
        for first in range.clone().step_by(SAMPLES_AT_ONCE) {
            let last = range.end.min(first + SAMPLES_AT_ONCE);
            self.samples.clear();
            for start in (first..last).step_by(FILLED) {
                let run = start..last.min(start + FILLED);
                let values = &mut values[..run.len() * n];
                design.fill(run.clone(), values);
                for (sample, h) in run.zip(values.chunks_exact(n)) {
                    self.push(h, &targets[sample * outputs..][..outputs]);
                }
            }
            self.rotate();
        }
    }

    /// Appends a sample to those that are rotated next, and with forgetting what it gives back.
    fn push(&mut self, regressor: &[f64], target: &[f64]) {
        self.samples.extend(regressor.iter().chain(target));
        self.samples.resize(self.samples.len().next_multiple_of(self.width), 0.0);
        if self.share > 0.0 {
            let start = self.samples.len();
            self.samples.resize(start + self.width, 0.0);
            self.samples[start + self.turn] = self.share;
            self.turn = (self.turn + 1) % self.regressors;
        }
    }

    /// Rotates all samples into R and z.
    fn rotate(&mut self) {
        let (width, forgets) = (self.width, self.share > 0.0);
        let forgotten = forgets.then_some(self.root_forgetting);
        let (rows, samples) = (self.rows.as_mut_slice(), self.samples.as_mut_slice());
        widest!(pass(width, rows, samples, forgotten));
    }

    /// Factor of all samples so far.
    pub fn factor(&self) -> Factor {
        let (n, outputs) = (self.regressors, self.outputs);
        let cut = |from: usize, to: usize| {
            self.rows
                .chunks_exact(self.width)
                .flat_map(|row| row[from..to].iter().copied())
                .collect()
        };
        Factor { root: cut(0, n), projection: cut(n, n + outputs), regressors: n, outputs }
    }
}

/// Passes all samples through all rows.
#[inline(always)]
fn pass(width: usize, rows: &mut [f64], samples: &mut [f64], forgotten: Option<f64>) {
    let count = samples.len() / width;
    for (group, rows) in rows.chunks_mut(ROWS_BY_TURNS * width).enumerate() {
        for step in 0..count + ROWS_BY_TURNS - 1 {
            for (turn, row) in rows.chunks_exact_mut(width).enumerate() {
                // Row i is as many samples behind the first as rows lie between.
                let sample = step.wrapping_sub(turn);
                if sample < count {
                    // With forgetting, every other sample gives back what is forgotten.
                    let forgotten = forgotten.filter(|_| sample % 2 == 0);
                    let sample = &mut samples[sample * width..][..width];
                    rotate_row(row, sample, group * ROWS_BY_TURNS + turn, forgotten);
                }
            }
        }
    }
}

/// Rotates row number `i` of [R | z] with a sample, so that the sample's entry `i` becomes 0. Before that, the row is
/// multiplied by what is left of it, if something is `forgotten`.
#[inline(always)]
fn rotate_row(row: &mut [f64], sample: &mut [f64], i: usize, forgotten: Option<f64>) {
    let start = i / LANES * LANES;
    let (row, sample) = (&mut row[start..], &mut sample[start..]);
    if let Some(root) = forgotten {
        row.iter_mut().for_each(|r| *r *= root);
    }
    let (pivot, entry) = (row[i - start], sample[i - start]);
    let length = (pivot * pivot + entry * entry).sqrt();
    if entry == 0.0 || length <= 0.0 {
        return;
    }
    let (cosine, sine) = (pivot / length, entry / length);
    let (groups, _) = row.as_chunks_mut::<LANES>();
    let (samples, _) = sample.as_chunks_mut::<LANES>();
    for (row, sample) in groups.iter_mut().zip(samples) {
        let (r, h) = (*row, *sample);
        *row = std::array::from_fn(|l| cosine * r[l] + sine * h[l]);
        *sample = std::array::from_fn(|l| cosine * h[l] - sine * r[l]);
    }
    sample[i - start] = 0.0;
}
