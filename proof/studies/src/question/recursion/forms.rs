//! The forms of the recursion, and the batch solution of what each of them solves.

use std::ops::Range;

use nalgebra::DMatrix;
use taxel_core::rls::{Real, Rls};
use taxel_learn::train::least_squares::{Design, Factor, predict};

use super::{DIVERGED, Form, KINDS, LOOK_EVERY, MOST_COMPARED, Outcome, SETTLED};

/// Regressors and targets of all samples, in the order in which they come.
pub(super) struct Regressed<'t> {
    regressors: usize,
    /// Regressors, `samples × regressors`.
    rows: Vec<f64>,
    targets: &'t [f64],
}

/// Matrix whose rows are regressors.
struct Rows<'r> {
    regressors: usize,
    rows: &'r [f64],
}

impl Design for Rows<'_> {
    fn regressors(&self) -> usize {
        self.regressors
    }

    fn fill(&self, samples: Range<usize>, values: &mut [f64]) {
        let n = self.regressors;
        values.copy_from_slice(&self.rows[samples.start * n..samples.end * n]);
    }
}

impl<'t> Regressed<'t> {
    pub(super) fn new(design: &impl Design, targets: &'t [f64]) -> Self {
        let regressors = design.regressors();
        let mut rows = vec![0.0; targets.len() * regressors];
        design.fill(0..targets.len(), &mut rows);
        Self { regressors, rows, targets }
    }

    /// Largest over smallest singular value: those of R.
    pub(super) fn condition(&self) -> f64 {
        let n = self.regressors;
        let design = Rows { regressors: n, rows: &self.rows };
        let root = Factor::new(&design, self.targets, 1, 1e200).root;
        let values = DMatrix::from_row_slice(n, n, &root).singular_values();
        values.max() / values.min()
    }

    /// Outcomes of all forms and precisions.
    pub(super) fn outcomes(
        &self,
        width: f64,
        forgetting_factor: f64,
        initial_covariance: f64,
    ) -> Vec<Outcome> {
        let setting = (initial_covariance, forgetting_factor);
        let samples = self.targets.len();
        let batch =
            [Form::Covariance, Form::SquareRoot].map(|form| self.batch(form, setting, samples));
        let outcome = |(form, precision): (Form, &'static str)| {
            let found = match (form, precision) {
                (Form::Covariance, "f32") => self.by_covariance::<f32>(setting),
                (Form::Covariance, _) => self.by_covariance::<f64>(setting),
                (Form::SquareRoot, "f32") => self.by_square_root::<f32>(setting),
                (Form::SquareRoot, _) => self.by_square_root::<f64>(setting),
            };
            let batch = &batch[usize::from(form == Form::SquareRoot)];
            let difference =
                found.as_ref().ok().map(|w| self.difference(w, batch, forgetting_factor));
            let late = difference.is_some_and(|it| !it.is_finite() || it > DIVERGED);
            Outcome {
                form,
                precision,
                width,
                forgetting_factor,
                initial_covariance,
                diverged_after: found.as_ref().err().copied().or(late.then_some(samples)),
                wound_up: found.is_err_and(|after| self.is_exactly_wild(form, setting, after)),
                difference: difference.filter(|_| !late),
            }
        };
        KINDS.map(outcome).to_vec()
    }

    /// Whether the exact solution of all samples before number `after` (from 1) is as far off at that one as a recursion
    /// that has diverged.
    fn is_exactly_wild(&self, form: Form, setting: (f64, f64), after: usize) -> bool {
        let (n, last) = (self.regressors, after - 1);
        let weights = self.batch(form, setting, last);
        let design = Rows { regressors: n, rows: &self.rows };
        let predicted = predict(&design, last..after, &weights, 1)[0];
        last >= SETTLED * n && (predicted - self.targets[last]).abs() > DIVERGED
    }

    /// Weights in f64 by QR decomposition of so many weighted samples, for the problem that a form solves exactly.
    ///
    /// The covariance form forgets its start, 1/δ. The square-root form gives back what it forgets of it, one direction
    /// at a time.
    fn batch(&self, form: Form, (covariance, forgetting): (f64, f64), samples: usize) -> Vec<f64> {
        let n = self.regressors;
        let weight = |t: usize| forgetting.powf((samples - 1 - t) as f64 / 2.0);
        let (mut rows, mut targets) = (Vec::new(), Vec::new());
        let left = (0..n).fold(1.0, |left, _| left * forgetting);
        let share = ((1.0 - left) / covariance).sqrt();
        for (t, (h, y)) in self.rows.chunks_exact(n).zip(self.targets).enumerate().take(samples) {
            rows.extend(h.iter().map(|h| h * weight(t)));
            targets.push(y * weight(t));
            if form == Form::SquareRoot && forgetting < 1.0 {
                rows.extend((0..n).map(|i| if i == t % n { share * weight(t) } else { 0.0 }));
                targets.push(0.0);
            }
        }
        // A start that is forgotten is as good as none, but R must stay regular.
        let start = (covariance / forgetting.powf(samples as f64)).min(1e30);
        Factor::new(&Rows { regressors: n, rows: &rows }, &targets, 1, start).weights()
    }

    /// Root mean square difference of the predictions on the last samples that are not forgotten.
    fn difference(&self, weights: &[f64], batch: &[f64], forgetting: f64) -> f64 {
        let (n, samples) = (self.regressors, self.targets.len());
        let remembered = (1.0 / (1.0 - forgetting)).min(MOST_COMPARED as f64) as usize;
        let last = samples - remembered.min(samples)..samples;
        let design = Rows { regressors: n, rows: &self.rows };
        let predictions =
            [weights, batch].map(|weights| predict(&design, last.clone(), weights, 1));
        let squares = predictions[0].iter().zip(&predictions[1]).map(|(a, b)| (a - b) * (a - b));
        (squares.sum::<f64>() / last.len() as f64).sqrt()
    }

    /// Weights by the covariance form, or the number of updates after which it had diverged.
    fn by_covariance<T: Number>(
        &self,
        (covariance, forgetting): (f64, f64),
    ) -> std::result::Result<Vec<f64>, usize> {
        let n = self.regressors;
        let forgetting = T::of(forgetting);
        let (mut p, mut w) = (vec![T::ZERO; n * n], vec![T::ZERO; n]);
        p.iter_mut().step_by(n + 1).for_each(|place| *place = T::of(covariance));
        let (mut column, mut row) = (vec![T::ZERO; n], vec![T::ZERO; n]);
        let product = |a: &[T], b: &[T]| a.iter().zip(b).fold(T::ZERO, |sum, (a, b)| sum + *a * *b);
        for (t, (h, y)) in self.rows.chunks_exact(n).zip(self.targets).enumerate() {
            let h: Vec<T> = h.iter().map(|h| T::of(*h)).collect();
            row.fill(T::ZERO);
            for ((p, column), h_i) in p.chunks_exact(n).zip(&mut column).zip(&h) {
                *column = product(p, &h);
                row.iter_mut().zip(p).for_each(|(row, p)| *row = *row + *h_i * *p);
            }
            let innovation = T::of(*y) - product(&w, &h);
            let denominator = forgetting + product(&h, &column);
            for (i, (w, column)) in w.iter_mut().zip(&column).enumerate() {
                let gain = *column / denominator;
                *w = *w + gain * innovation;
                let p = &mut p[i * n..(i + 1) * n];
                p.iter_mut().zip(&row).for_each(|(p, r)| *p = (*p - gain * *r) / forgetting);
            }
            let is_wild = t >= SETTLED * n && innovation.f64().abs() > DIVERGED;
            if is_wild || !w.iter().all(|w| w.is_finite()) {
                return Err(t + 1);
            }
        }
        Ok(w.into_iter().map(T::f64).collect())
    }

    /// Weights by the square-root form, or the number of updates after which it had diverged.
    fn by_square_root<T: Number>(
        &self,
        (covariance, forgetting): (f64, f64),
    ) -> std::result::Result<Vec<f64>, usize> {
        let n = self.regressors;
        let mut memory = vec![T::ZERO; Rls::<T>::values(n, 1)];
        let started = Rls::try_new(&mut memory, [n, 1], T::of(covariance), T::of(forgetting));
        let mut rls = started.expect("covariances and forgetting factors of this study");
        let mut weights = vec![T::ZERO; n];
        for (t, (h, y)) in self.rows.chunks_exact(n).zip(self.targets).enumerate() {
            let mut regressor: Vec<T> = h.iter().map(|h| T::of(*h)).collect();
            let updated = rls.update(&mut regressor, &mut [T::of(*y)]);
            if updated.is_err() {
                return Err(t + 1);
            }
            if t % LOOK_EVERY == 0 || t + 1 == self.targets.len() {
                rls.weights(&mut weights);
                let predicted: f64 = h.iter().zip(&weights).map(|(h, w)| h * w.f64()).sum();
                let is_wild = t >= SETTLED * n && (predicted - y).abs() > DIVERGED;
                if is_wild || !weights.iter().all(|w| w.is_finite()) {
                    return Err(t + 1);
                }
            }
        }
        Ok(weights.into_iter().map(T::f64).collect())
    }
}

/// Precision that a recursion works in.
trait Number: Real {
    fn of(value: f64) -> Self;
    fn f64(self) -> f64;
}

impl Number for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
    fn f64(self) -> f64 {
        self.into()
    }
}

impl Number for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn f64(self) -> f64 {
        self
    }
}

#[cfg(test)]
mod tests;
