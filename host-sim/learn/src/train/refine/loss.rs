//! The loss that refinement lowers, and its gradient.
//!
//! Output weights are not moved: they are those of least squares for the centres at hand (variable projection;
//! Golub & Pereyra, SIAM J. Numer. Anal. 10, 1973). Descending on the weights as well diverges, since they are
//! large and cancel.

use nalgebra::{Cholesky, DMatrix, Dyn};

use super::movable::{Activated, Movable, Piece};
use super::products::{
    Line, SIDE, add_combinations, add_normal_equations, add_products, transposed,
};
use crate::error::{Result, no_regression};
use crate::parallel;

/// Mean squared error of one set of samples, and its gradient by what moves.
#[derive(Debug, Clone)]
pub(super) struct Loss {
    pub(super) value: f64,
    pub(super) gradient: Vec<f64>,
}

impl Loss {
    /// Sum of the losses of two tasks.
    pub(super) fn plus(mut self, other: &Self) -> Self {
        self.value += other.value;
        add(&mut self.gradient, &other.gradient);
        self
    }
}

/// Output weights solved on a set of samples, and what a gradient through them needs.
struct Solved {
    activated: Vec<Activated>,
    /// Decomposition of the normal equations.
    normal: Cholesky<f64, Dyn>,
    /// Weights, `regressors × outputs`, row-major.
    weights: Vec<f64>,
}

impl Solved {
    /// Solves for the weights of `movable` on `pieces`, with the penalty `ridge` times the number of samples on
    /// squared weights.
    fn new(movable: &Movable, pieces: &[&Piece], ridge: f64) -> Result<Self> {
        let (n, outputs) = (movable.sizes.regressors(), pieces[0].targets.len());
        let parts = parallel::map(pieces.len(), &|index| {
            let activated = movable.activate(pieces[index]);
            let (mut squares, mut products) = (vec![0.0; n * n], vec![0.0; n * outputs]);
            let (a, b) = (&activated.regressors, &pieces[index].targets);
            add_normal_equations(a, b, &mut squares, &mut products);
            (activated, squares, products)
        });
        let (mut squares, mut products) = (vec![0.0; n * n], vec![0.0; n * outputs]);
        let mut activated = Vec::with_capacity(parts.len());
        for (of_piece, s, p) in parts {
            add(&mut squares, &s);
            add(&mut products, &p);
            activated.push(of_piece);
        }
        let penalty = ridge * samples(pieces) as f64;
        // Columns of a symmetric matrix are its rows: the upper triangle stands where nalgebra reads the lower.
        let mut normal = DMatrix::from_column_slice(n, n, &squares);
        (0..n).for_each(|i| normal[(i, i)] += penalty);
        let normal = Cholesky::new(normal).ok_or_else(no_regression)?;
        let weights = solve(&normal, &products, outputs);
        Ok(Self { activated, normal, weights })
    }
}

/// Mean squared error on `pieces` with the weights solved on the same samples.
///
/// By the weights the derivative is 0, but for the penalty's small part, so they count as constants.
pub(super) fn on_same(movable: &Movable, pieces: &[&Piece], ridge: f64) -> Result<Loss> {
    let solved = Solved::new(movable, pieces, ridge)?;
    let back = transposed(&solved.weights, pieces[0].targets.len());
    let parts = parallel::map(pieces.len(), &|index| {
        let (piece, activated) = (pieces[index], &solved.activated[index]);
        let (errors, square) = errors(&solved.weights, activated, piece);
        (square, through(movable, piece, activated, &back, &errors))
    });
    let squares = parts.iter().map(|(square, _)| *square);
    Ok(mean(movable, pieces, squares, parts.iter().map(|(_, gradient)| gradient)))
}

/// Mean squared error on the pieces `held_out`, with the weights solved on the `rest`.
///
/// With A and Y the regressors and targets of the rest, W = G⁻¹AᵀY with G = AᵀA + penalty, V the derivative of
/// the loss by W, and Z = G⁻¹V, the derivative by A is (Y − AW)·Zᵀ − A·Z·Wᵀ.
pub(super) fn on_held_out(
    movable: &Movable,
    rest: &[&Piece],
    held_out: &[&Piece],
    ridge: f64,
) -> Result<Loss> {
    let solved = Solved::new(movable, rest, ridge)?;
    let (n, outputs) = (movable.sizes.regressors(), held_out[0].targets.len());
    let back = transposed(&solved.weights, outputs);
    let parts = parallel::map(held_out.len(), &|index| {
        let piece = held_out[index];
        let activated = movable.activate(piece);
        let (errors, square) = errors(&solved.weights, &activated, piece);
        let mut by_weights = vec![0.0; n * outputs];
        add_products(&activated.regressors, &errors, &mut by_weights);
        let gradient = through(movable, piece, &activated, &back, &errors);
        (square, gradient, by_weights)
    });
    let mut by_weights = vec![0.0; n * outputs];
    parts.iter().for_each(|(_, _, part)| add(&mut by_weights, part));
    let adjoint = solve(&solved.normal, &by_weights, outputs);
    let adjoint_back = transposed(&adjoint, outputs);
    let minus_back: Vec<f64> = back.iter().map(|w| -w).collect();
    let through_rest = parallel::map(rest.len(), &|index| {
        let (piece, activated) = (rest[index], &solved.activated[index]);
        let (errors, _) = errors(&solved.weights, activated, piece);
        let left: Vec<Line> = errors.into_iter().map(|line| line.map(|e| -e)).collect();
        let mut of_adjoint = vec![[0.0; SIDE]; outputs];
        add_combinations(&adjoint, &activated.regressors, &mut of_adjoint);
        let mut gradient = through(movable, piece, activated, &adjoint_back, &left);
        add(&mut gradient, &through(movable, piece, activated, &minus_back, &of_adjoint));
        gradient
    });
    let squares = parts.iter().map(|(square, ..)| *square);
    let gradients = parts.iter().map(|(_, gradient, _)| gradient).chain(&through_rest);
    Ok(mean(movable, held_out, squares, gradients))
}

/// Squared error of every sample in the pieces `held_out`, with the weights solved on the `rest`.
pub(super) fn held_out_errors(
    movable: &Movable,
    rest: &[&Piece],
    held_out: &[&Piece],
    ridge: f64,
) -> Result<Vec<f64>> {
    let solved = Solved::new(movable, rest, ridge)?;
    let of_piece = |index: usize| -> Vec<f64> {
        let piece = held_out[index];
        let (errors, _) = errors(&solved.weights, &movable.activate(piece), piece);
        let of_sample = |s: usize| errors.iter().map(|line| line[s] * line[s]).sum();
        (0..piece.samples).map(of_sample).collect()
    };
    Ok(parallel::map(held_out.len(), &of_piece).concat())
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

/// Mean over the samples of `pieces`, of squared errors and of halves of their gradients, which are summed in order.
fn mean<'g>(
    movable: &Movable,
    pieces: &[&Piece],
    squares: impl Iterator<Item = f64>,
    gradients: impl Iterator<Item = &'g Vec<f64>>,
) -> Loss {
    let mean = 1.0 / samples(pieces) as f64;
    let mut loss = Loss { value: 0.0, gradient: vec![0.0; movable.values.len()] };
    squares.for_each(|square| loss.value += square * mean);
    gradients.for_each(|gradient| add(&mut loss.gradient, gradient));
    loss.gradient.iter_mut().for_each(|slope| *slope *= 2.0 * mean);
    loss
}

/// Errors of a piece's outputs, a line each, and the sum of their squares.
fn errors(weights: &[f64], activated: &Activated, piece: &Piece) -> (Vec<Line>, f64) {
    let mut errors: Vec<Line> = piece.targets.iter().map(|line| line.map(|y| -y)).collect();
    add_combinations(weights, &activated.regressors, &mut errors);
    let square = errors.iter().flatten().map(|e| e * e).sum();
    (errors, square)
}

fn samples(pieces: &[&Piece]) -> usize {
    pieces.iter().map(|piece| piece.samples).sum()
}

fn add(sums: &mut [f64], values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
}

/// Solves the normal equations for right sides (`n × columns`, row-major), in that layout.
fn solve(normal: &Cholesky<f64, Dyn>, right: &[f64], columns: usize) -> Vec<f64> {
    let n = right.len() / columns;
    let solution = normal.solve(&DMatrix::from_row_slice(n, columns, right));
    transposed(solution.as_slice(), n)
}
