//! Nonlinear equations, solved by Gauss–Newton steps whose damping is taken away by degrees.
//!
//! Every step minimises ‖F + J·d‖² + λ·‖(x + d − start)/deviation‖². The damping λ falls from a value at which the start
//! is kept to the least one, so the place follows a path on which ever finer residuals count. A sensor's equations need
//! that: their Jacobian has a condition of 1e7, and a line search on ‖F‖ from rest, as Levenberg and Marquardt's, stalls
//! far from any solution. With a least damping of 0 the path ends in Newton's method, at an exact solution.

use nalgebra::{DMatrix, DVector};

/// First damping λ, and how far it falls from one step to the next.
const FIRST_DAMPING: f64 = 0.1;
const FALL: f64 = 0.316_227_766_016_837_94;
/// Damping below which what is left of it is left out.
const LAST_DAMPING: f64 = 1e-24;
/// Largest change of an unknown in one step, in its deviations.
const LARGEST_STEP: f64 = 1.0;
/// Most steps without damping, and the largest last one in deviations: rounding may move the place further.
const EXACT_END: (usize, f64) = (20, 1e-9);
/// Most steps at a least damping that stays, and the largest last one: these steps converge slowly.
const DAMPED_END: (usize, f64) = (100, 1e-6);
/// Rise of a damped sum, relative to it, that rounding explains.
const SMALLEST_RISE: f64 = 1e-13;

/// Unknowns: where the search starts, and where it may go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknowns<'u> {
    /// Place at which the search starts, and towards which damping pulls.
    pub start: &'u [f64],
    /// Deviation by which all unknowns are scaled.
    pub deviation: f64,
    /// Largest magnitude of every unknown. The search may leave this box by half of it; a solution may not.
    pub largest: f64,
}

impl Unknowns<'_> {
    /// Sum of squares that a step at this damping makes smaller.
    fn damped_sum(&self, place: &[f64], residuals: &[f64], damping: f64) -> f64 {
        let off = place.iter().zip(self.start).map(|(x, start)| (x - start) / self.deviation);
        residuals.iter().map(|residual| residual * residual).sum::<f64>()
            + damping * off.map(|off| off * off).sum::<f64>()
    }
}

/// End of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Place of the end, in the box.
    pub place: Vec<f64>,
    /// Whether it is a solution: its residuals are below [`exact`](solve), and it lies in the box. With damping, whether
    /// the last step was negligible.
    pub converged: bool,
    /// Number of steps, each with one evaluation and one decomposition.
    pub steps: usize,
}

/// Solves `equations` F(x) = 0, which write the residuals at a place and their derivatives (one line an equation).
///
/// `least_damping` is λ at the end. With 0 the equations are solved exactly: the end is a solution if no residual
/// exceeds `exact` and it lies in the box. Otherwise the sum of squares that is stated above is minimised, which is the
/// most probable place for normal noise of variance λ in F and a normal prior about the start.
///
/// # Panics
/// If `equations` writes other numbers of residuals and derivatives than `count` and `count × unknowns`.
pub fn solve(
    unknowns: &Unknowns<'_>,
    count: usize,
    (least_damping, exact): (f64, f64),
    mut equations: impl FnMut(&[f64], &mut [f64], &mut DMatrix<f64>),
) -> Solution {
    let n = unknowns.start.len();
    let mut place = unknowns.start.to_vec();
    let mut residuals = vec![0.0; count];
    let mut derivatives = DMatrix::zeros(count, n);
    let (mut damping, mut last_steps) = (FIRST_DAMPING.max(least_damping), 0);
    let (mut steps, mut settled) = (0, false);
    // Last place from which the damped sum fell at the least damping, with that sum.
    let mut lowest: Option<(f64, Vec<f64>)> = None;
    let (most, smallest) = if least_damping > 0.0 { DAMPED_END } else { EXACT_END };
    while last_steps < most && !settled {
        equations(&place, &mut residuals, &mut derivatives);
        steps += 1;
        let is_last = damping <= least_damping;
        if is_last && damping > 0.0 {
            last_steps += 1;
            let sum = unknowns.damped_sum(&place, &residuals, damping);
            match &lowest {
                // Beyond the minimum along the step: half of it.
                Some((least, from)) if sum > *least => {
                    settled = sum - least <= SMALLEST_RISE * least;
                    place.iter_mut().zip(from).for_each(|(x, from)| *x = f64::midpoint(*x, *from));
                    continue;
                }
                _ => lowest = Some((sum, place.clone())),
            }
        }
        let Some(step) = step(unknowns, &place, &residuals, &derivatives, damping) else { break };
        let largest = step.amax();
        let share = (LARGEST_STEP / largest).min(1.0) * unknowns.deviation;
        let bound = 1.5 * unknowns.largest;
        place.iter_mut().zip(&step).for_each(|(x, d)| *x = (*x + share * d).clamp(-bound, bound));
        if is_last {
            last_steps += usize::from(damping == 0.0);
            settled = largest < smallest;
        } else {
            damping = (damping * FALL).max(least_damping);
            damping = if damping < LAST_DAMPING { 0.0 } else { damping };
        }
    }
    // Out of steps: the place has not been evaluated since.
    if let (false, Some((_, from))) = (settled, lowest) {
        place = from;
    }
    let in_box = place.iter().all(|x| x.abs() <= unknowns.largest * (1.0 + 1e-9));
    if least_damping == 0.0 {
        equations(&place, &mut residuals, &mut derivatives);
        settled = in_box && residuals.iter().all(|residual| residual.abs() <= exact);
    }
    place.iter_mut().for_each(|x| *x = x.clamp(-unknowns.largest, unknowns.largest));
    Solution { place, converged: settled, steps }
}

/// Step from `place` in deviations, by an orthogonal decomposition of derivatives and damping together: their normal
/// equations would square the condition. `None` for derivatives that are singular or not finite.
fn step(
    unknowns: &Unknowns<'_>,
    place: &[f64],
    residuals: &[f64],
    derivatives: &DMatrix<f64>,
    damping: f64,
) -> Option<DVector<f64>> {
    let (count, n, root) = (residuals.len(), place.len(), damping.sqrt());
    let mut system = DMatrix::zeros(count + n, n);
    let mut right = DVector::zeros(count + n);
    system.rows_mut(0, count).copy_from(derivatives);
    system *= unknowns.deviation;
    for (i, (x, start)) in place.iter().zip(unknowns.start).enumerate() {
        system[(count + i, i)] = root;
        right[count + i] = -root * (x - start) / unknowns.deviation;
    }
    residuals.iter().enumerate().for_each(|(k, residual)| right[k] = -residual);
    let decomposed = system.qr();
    decomposed.q_tr_mul(&mut right);
    let step = decomposed.unpack_r().solve_upper_triangular(&right.rows(0, n))?;
    step.iter().all(|d| d.is_finite()).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x² = 2 and x·y = 1, on the unknowns (x, y).
    fn curves(at: &[f64], residuals: &mut [f64], derivatives: &mut DMatrix<f64>) {
        let (x, y) = (at[0], at[1]);
        residuals.copy_from_slice(&[x * x - 2.0, x * y - 1.0]);
        derivatives.copy_from(&DMatrix::from_row_slice(2, 2, &[2.0 * x, 0.0, y, x]));
    }

    #[test]
    fn the_solution_on_the_starts_side_is_found() {
        for side in [1.0, -1.0] {
            let start = [side, side];
            let unknowns = Unknowns { start: &start, deviation: 1.0, largest: 3.0 };
            let found = solve(&unknowns, 2, (0.0, 1e-12), curves);
            let root = side * 2.0_f64.sqrt();
            assert!(found.converged && found.steps < 80, "{found:?}");
            assert!((found.place[0] - root).abs() < 1e-14, "{found:?}");
            assert!((found.place[1] - 1.0 / root).abs() < 1e-14, "{found:?}");
        }
    }

    #[test]
    fn a_solution_outside_the_box_does_not_count() {
        let unknowns = Unknowns { start: &[1.0, 1.0], deviation: 1.0, largest: 1.2 };
        let found = solve(&unknowns, 2, (0.0, 1e-12), curves);
        assert!(!found.converged, "{found:?}");
        assert!(found.place.iter().all(|x| x.abs() <= 1.2), "{found:?}");
    }

    #[test]
    fn damping_that_stays_gives_ridge_regression() {
        // x = 3 and x = 5, damped by 0.5 towards 1: (3 + 5 + 0.5)/(2 + 0.5).
        let unknowns = Unknowns { start: &[1.0], deviation: 1.0, largest: 9.0 };
        let found = solve(&unknowns, 2, (0.5, 0.0), |at, residuals, derivatives| {
            residuals.copy_from_slice(&[at[0] - 3.0, at[0] - 5.0]);
            derivatives.fill(1.0);
        });
        assert!(found.converged && (found.place[0] - 3.4).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_search_that_runs_out_of_steps_ends_at_the_lowest_place_it_saw() {
        // A slope of a seventh of the true one: each step from x leads to −6x, and half of half of it to −0.75x.
        let unknowns = Unknowns { start: &[1e3], deviation: 1e4, largest: 1e6 };
        let mut seen: Vec<f64> = Vec::new();
        let found = solve(&unknowns, 1, (FIRST_DAMPING, 0.0), |at, residuals, derivatives| {
            seen.push(at[0]);
            residuals[0] = at[0];
            derivatives.fill(1.0 / 7.0);
        });
        let lowest = seen.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs()));
        assert!(!found.converged && found.steps == DAMPED_END.0, "{found:?}");
        assert_eq!(Some(found.place[0]), lowest);
    }
}
