//! Small dense matrices.

use super::NUMBERS;

/// A number for each of the state's.
pub type Vector = [f32; NUMBERS];
/// Rows of numbers.
pub type Matrix = [Vector; NUMBERS];

/// Least square of a pivot: a covariance that is not positive is one of rounding.
const LEAST_PIVOT: f32 = 1e-12;

pub const ZERO: Matrix = [[0.0; NUMBERS]; NUMBERS];

/// Sum of products.
#[inline]
pub fn dot(a: &Vector, b: &Vector) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Makes of a positive `matrix`, of which the lower half is looked at, its lower triangular root.
pub fn cholesky(matrix: &mut Matrix) {
    for row in 0..NUMBERS {
        for column in 0..=row {
            let known = matrix[row].iter().zip(&matrix[column]).take(column);
            let rest = known.fold(matrix[row][column], |rest, (a, b)| rest - a * b);
            matrix[row][column] = if column == row {
                libm::sqrtf(rest.max(LEAST_PIVOT))
            } else {
                rest / matrix[column][column]
            };
        }
        matrix[row].iter_mut().skip(row + 1).for_each(|number| *number = 0.0);
    }
}

/// Solves `root`·x = `right` for a lower triangular root.
pub fn solve_lower(root: &Matrix, right: &Vector) -> Vector {
    let mut x = [0.0; NUMBERS];
    for row in 0..NUMBERS {
        let known = root[row].iter().zip(&x).take(row);
        let rest = known.fold(right[row], |rest, (a, b)| rest - a * b);
        x[row] = rest / root[row][row];
    }
    x
}

/// Writes the transposed `matrix`.
pub fn transpose(matrix: &Matrix, to: &mut Matrix) {
    for (row, numbers) in to.iter_mut().enumerate() {
        *numbers = core::array::from_fn(|column| matrix[column][row]);
    }
}

/// Writes the lower half of a symmetric `matrix` to its upper half.
pub fn mirror(matrix: &mut Matrix) {
    for column in 1..NUMBERS {
        let (above, below) = matrix.split_at_mut(column);
        let Some(row) = below.first() else { return };
        above.iter_mut().zip(row).for_each(|(above, number)| above[column] = *number);
    }
}
