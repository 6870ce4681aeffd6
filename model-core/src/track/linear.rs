//! Small dense matrices.

pub(crate) use crate::reading_model::sqrt;

/// Rows of numbers.
pub type Square<const N: usize> = [[f32; N]; N];

/// Least square of a pivot: a covariance that is not positive is one of rounding.
const LEAST_PIVOT: f32 = 1e-12;

/// Sum of products.
#[inline]
pub fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Makes of a positive `matrix`, of which the lower half is looked at, its lower triangular root. Returns one over each number
/// of the diagonal.
pub fn cholesky<const N: usize>(matrix: &mut Square<N>) -> [f32; N] {
    let mut inverses = [0.0; N];
    for row in 0..N {
        for column in 0..=row {
            let known = matrix[row].iter().zip(&matrix[column]).take(column);
            let rest = known.fold(matrix[row][column], |rest, (a, b)| rest - a * b);
            matrix[row][column] = if column == row {
                let root = sqrt(if rest > LEAST_PIVOT { rest } else { LEAST_PIVOT });
                inverses[row] = 1.0 / root;
                root
            } else {
                rest * inverses[column]
            };
        }
        matrix[row].iter_mut().skip(row + 1).for_each(|number| *number = 0.0);
    }
    inverses
}

/// Solves `root`·x = `right` for a lower triangular root, and one over each number of its diagonal.
pub fn solve_lower<const N: usize>(
    root: &Square<N>,
    inverses: &[f32; N],
    right: &[f32; N],
) -> [f32; N] {
    let mut x = [0.0; N];
    for row in 0..N {
        // The others of `x` are still 0.
        x[row] = (right[row] - dot(&root[row], &x)) * inverses[row];
    }
    x
}

/// Solves `root`ᵀ·x = `x` as [`solve_lower`] does.
pub fn solve_upper<const N: usize>(root: &Square<N>, inverses: &[f32; N], x: &mut [f32; N]) {
    for row in (0..N).rev() {
        x[row] *= inverses[row];
        let solved = x[row];
        x.iter_mut().zip(&root[row]).take(row).for_each(|(x, number)| *x -= number * solved);
    }
}

/// Writes the lower half of a symmetric `matrix` to its upper half.
pub fn mirror<const N: usize>(matrix: &mut Square<N>) {
    for column in 1..N {
        let (above, below) = matrix.split_at_mut(column);
        let Some(row) = below.first() else { return };
        above.iter_mut().zip(row).for_each(|(above, number)| above[column] = *number);
    }
}
