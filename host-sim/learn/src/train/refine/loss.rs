//! The loss that refinement lowers, and its gradient.
//!
//! Output weights are not moved: they are those of least squares for the centres at hand (variable projection;
//! Golub & Pereyra, SIAM J. Numer. Anal. 10, 1973). Descending on the weights as well diverges, since they are
//! large and cancel.

use nalgebra::{Cholesky, DMatrix, Dyn};

use super::movable::{Activated, Movable, Piece};
use super::products::{Line, SIDE, add_combinations, add_products, normal_equations, transposed};
use crate::error::{Result, no_regression};
use crate::parallel;

/// Mean squared error of each task's samples, summed over tasks, and its gradient by what moves.
#[derive(Debug, Clone)]
pub struct Loss {
    /// Sum over tasks of the mean squared error.
    pub value: f64,
    /// Derivative of the value by each of [`Movable::values`].
    pub gradient: Vec<f64>,
}

/// Output weights solved on a set of samples, and what a gradient through them needs.
struct Solved<'t> {
    activated: Vec<Activated>,
    /// Outputs of each task that has samples, and the decomposition of its normal equations.
    tasks: Vec<(&'t [usize], Cholesky<f64, Dyn>)>,
    /// Weights, `regressors × outputs`, row-major; 0 for outputs without samples.
    weights: Vec<f64>,
}

impl<'t> Solved<'t> {
    /// Solves for the weights of `movable` on `pieces`, with the penalty `ridge` times the number of a task's samples on
    /// squared weights.
    fn new(
        movable: &Movable,
        tasks: &'t [Vec<usize>],
        pieces: &[&Piece],
        ridge: f64,
    ) -> Result<Self> {
        let (n, outputs) = (movable.sizes.regressors(), pieces[0].targets.len());
        let parts = parallel::map(pieces.len(), &|index| {
            let piece = pieces[index];
            let activated = movable.activate(piece);
            let (masks, groups): (Vec<_>, Vec<_>) = piece.together(tasks).into_iter().unzip();
            let targets = piece.known(piece.targets.clone());
            let (squares, products) = normal_equations(&activated.regressors, &targets, &masks);
            (activated, groups, squares, products)
        });
        let mut squares = vec![vec![0.0; n * n]; tasks.len()];
        let mut products = vec![0.0; n * outputs];
        let mut activated = Vec::with_capacity(parts.len());
        for (of_piece, groups, s, p) in parts {
            for (group, s) in groups.iter().zip(&s) {
                group.iter().for_each(|task| add(&mut squares[*task], s));
            }
            add(&mut products, &p);
            activated.push(of_piece);
        }
        let mut solved = Self { activated, tasks: vec![], weights: vec![] };
        for (columns, squares) in tasks.iter().zip(squares) {
            let samples = samples(columns, pieces);
            if samples > 0 {
                // Columns of a symmetric matrix are its rows: the upper triangle stands where nalgebra reads the lower.
                let mut normal = DMatrix::from_vec(n, n, squares);
                (0..n).for_each(|i| normal[(i, i)] += ridge * samples as f64);
                let normal = Cholesky::new(normal).ok_or_else(no_regression)?;
                solved.tasks.push((columns, normal));
            }
        }
        solved.weights = solved.solve(&products, outputs);
        Ok(solved)
    }

    /// Solves the normal equations of all tasks for right sides (`regressors × outputs`, row-major), in that layout.
    fn solve(&self, right: &[f64], outputs: usize) -> Vec<f64> {
        let n = right.len() / outputs;
        let mut solved = vec![0.0; right.len()];
        for (columns, normal) in &self.tasks {
            let of_task =
                DMatrix::from_fn(n, columns.len(), |i, o| right[i * outputs + columns[o]]);
            for (column, solution) in columns.iter().zip(normal.solve(&of_task).column_iter()) {
                let places = solved.iter_mut().skip(*column).step_by(outputs);
                places.zip(&solution).for_each(|(place, weight)| *place = *weight);
            }
        }
        solved
    }
}

/// What the errors of each output are multiplied by, so that one mean serves the samples of all tasks.
struct Weighing {
    factors: Vec<f64>,
    mean: f64,
}

impl Weighing {
    /// Weighing of the samples of `tasks` that are `held_out`; none of a task without any on either side, for an output
    /// may be missing in a whole fold. Nothing if there is no other task.
    fn new(tasks: &[Vec<usize>], rest: &[&Piece], held_out: &[&Piece]) -> Option<Self> {
        let count = |columns: &Vec<usize>| match samples(columns, rest) {
            0 => 0,
            _ => samples(columns, held_out),
        };
        let counts: Vec<usize> = tasks.iter().map(count).collect();
        let first = *counts.iter().find(|count| **count > 0)? as f64;
        let mut factors = vec![0.0; held_out[0].targets.len()];
        for (columns, count) in tasks.iter().zip(counts).filter(|(_, count)| *count > 0) {
            columns.iter().for_each(|column| factors[*column] = first / count as f64);
        }
        Some(Self { factors, mean: 1.0 / first })
    }

    /// Weighed `errors`, and the weighed sum of their squares.
    fn weighed(&self, mut errors: Vec<Line>) -> (Vec<Line>, f64) {
        let mut square = 0.0;
        for (line, factor) in errors.iter_mut().zip(&self.factors) {
            for error in line {
                square += factor * *error * *error;
                *error *= factor;
            }
        }
        (errors, square)
    }

    /// Mean of squared errors and of halves of their gradients, which are summed in order.
    fn mean<'g>(
        &self,
        movable: &Movable,
        squares: impl Iterator<Item = f64>,
        gradients: impl Iterator<Item = &'g Vec<f64>>,
    ) -> Loss {
        let mut loss = Loss { value: 0.0, gradient: vec![0.0; movable.values.len()] };
        squares.for_each(|square| loss.value += square * self.mean);
        gradients.for_each(|gradient| add(&mut loss.gradient, gradient));
        loss.gradient.iter_mut().for_each(|slope| *slope *= 2.0 * self.mean);
        loss
    }
}

/// Mean squared error of `tasks` on `pieces` with the weights solved on the same samples; none without samples.
///
/// By the weights the derivative is 0, but for the penalty's small part, so they count as constants.
///
/// # Errors
/// [`Error`](crate::Error) for samples without a regression.
pub fn on_same(
    movable: &Movable,
    tasks: &[Vec<usize>],
    pieces: &[&Piece],
    ridge: f64,
) -> Result<Option<Loss>> {
    let Some(weighing) = Weighing::new(tasks, pieces, pieces) else { return Ok(None) };
    let solved = Solved::new(movable, tasks, pieces, ridge)?;
    let back = transposed(&solved.weights, pieces[0].targets.len());
    let parts = parallel::map(pieces.len(), &|index| {
        let (piece, activated) = (pieces[index], &solved.activated[index]);
        let (errors, square) = weighing.weighed(errors(&solved.weights, activated, piece));
        (square, through(movable, piece, activated, &back, &errors))
    });
    let squares = parts.iter().map(|(square, _)| *square);
    Ok(Some(weighing.mean(movable, squares, parts.iter().map(|(_, gradient)| gradient))))
}

/// Mean squared error of `tasks` on the pieces `held_out`, with the weights solved on the `rest`; none where no task has
/// samples in both.
///
/// With A and Y the regressors and targets of the rest, W = G⁻¹AᵀY with G = AᵀA + penalty, V the derivative of
/// the loss by W, and Z = G⁻¹V, the derivative by A is (Y − AW)·Zᵀ − A·Z·Wᵀ.
///
/// # Errors
/// [`Error`](crate::Error) for samples without a regression.
pub fn on_held_out(
    movable: &Movable,
    tasks: &[Vec<usize>],
    rest: &[&Piece],
    held_out: &[&Piece],
    ridge: f64,
) -> Result<Option<Loss>> {
    let Some(weighing) = Weighing::new(tasks, rest, held_out) else { return Ok(None) };
    let solved = Solved::new(movable, tasks, rest, ridge)?;
    let (n, outputs) = (movable.sizes.regressors(), held_out[0].targets.len());
    let back = transposed(&solved.weights, outputs);
    let parts = parallel::map(held_out.len(), &|index| {
        let piece = held_out[index];
        let activated = movable.activate(piece);
        let (errors, square) = weighing.weighed(errors(&solved.weights, &activated, piece));
        let mut by_weights = vec![0.0; n * outputs];
        add_products(&activated.regressors, &errors, &mut by_weights);
        let gradient = through(movable, piece, &activated, &back, &errors);
        (square, gradient, by_weights)
    });
    let mut by_weights = vec![0.0; n * outputs];
    parts.iter().for_each(|(_, _, part)| add(&mut by_weights, part));
    let adjoint = solved.solve(&by_weights, outputs);
    let adjoint_back = transposed(&adjoint, outputs);
    let minus_back: Vec<f64> = back.iter().map(|w| -w).collect();
    let through_rest = parallel::map(rest.len(), &|index| {
        let (piece, activated) = (rest[index], &solved.activated[index]);
        let errors = errors(&solved.weights, activated, piece);
        let left: Vec<Line> = errors.into_iter().map(|line| line.map(|e| -e)).collect();
        let mut of_adjoint = vec![[0.0; SIDE]; outputs];
        add_combinations(&adjoint, &activated.regressors, &mut of_adjoint);
        let of_adjoint = piece.known(of_adjoint);
        let mut gradient = through(movable, piece, activated, &adjoint_back, &left);
        add(&mut gradient, &through(movable, piece, activated, &minus_back, &of_adjoint));
        gradient
    });
    let squares = parts.iter().map(|(square, ..)| *square);
    let gradients = parts.iter().map(|(_, gradient, _)| gradient).chain(&through_rest);
    Ok(Some(weighing.mean(movable, squares, gradients)))
}

/// Squared errors of the samples of each task in the pieces `held_out`, with the weights solved on the `rest`: none of a
/// task without samples there.
///
/// # Errors
/// [`Error`](crate::Error) for samples without a regression.
pub fn held_out_errors(
    movable: &Movable,
    tasks: &[Vec<usize>],
    rest: &[&Piece],
    held_out: &[&Piece],
    ridge: f64,
) -> Result<Vec<Vec<f64>>> {
    if rest.is_empty() {
        return Ok(vec![]);
    }
    let solved = Solved::new(movable, tasks, rest, ridge)?;
    let of_piece = |index: usize| {
        let piece = held_out[index];
        errors(&solved.weights, &movable.activate(piece), piece)
    };
    let errors = parallel::map(held_out.len(), &of_piece);
    let of_task = |(columns, _): &(&[usize], _)| -> Vec<f64> {
        let pieces = held_out.iter().zip(&errors);
        let of_piece = |(piece, errors): (&&'_ Piece, &Vec<Line>)| -> Vec<f64> {
            let samples = (0..piece.samples).filter(|s| !piece.targets[columns[0]][*s].is_nan());
            let square = |s: usize| columns.iter().map(|column| errors[*column][s].powi(2)).sum();
            samples.map(square).collect()
        };
        pieces.flat_map(of_piece).collect()
    };
    Ok(solved.tasks.iter().map(of_task).collect())
}

/// Gradient by what moves, where the derivative by the regressors is Σ_outputs factor·line.
///
/// `factors` are `outputs × regressors`.
fn through(
    movable: &Movable,
    piece: &Piece,
    activated: &Activated,
    factors: &[f64],
    lines: &[Line],
) -> Vec<f64> {
    let mut by_regressors = vec![[0.0; SIDE]; movable.sizes.regressors()];
    add_combinations(factors, lines, &mut by_regressors);
    let mut gradient = vec![0.0; movable.values.len()];
    movable.add_gradient(piece, activated, by_regressors, &mut gradient);
    gradient
}

/// Errors of a piece's outputs, a line each; 0 where one is missing.
fn errors(weights: &[f64], activated: &Activated, piece: &Piece) -> Vec<Line> {
    let mut errors: Vec<Line> = piece.targets.iter().map(|line| line.map(|y| -y)).collect();
    add_combinations(weights, &activated.regressors, &mut errors);
    piece.known(errors)
}

/// Number of samples of the task with these outputs.
fn samples(columns: &[usize], pieces: &[&Piece]) -> usize {
    pieces.iter().map(|piece| piece.samples_with(columns[0])).sum()
}

fn add(sums: &mut [f64], values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
}
