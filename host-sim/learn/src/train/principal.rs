//! Principal directions of a covariance.

use nalgebra::{DMatrix, SymmetricEigen};

/// First `count` eigenvectors of the symmetric matrix `covariance`, one a column, by falling eigenvalues. There are
/// fewer columns if the matrix has fewer.
pub fn directions(covariance: DMatrix<f64>, count: usize) -> DMatrix<f64> {
    let size = covariance.nrows();
    let eigen = SymmetricEigen::new(covariance);
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let mut directions = DMatrix::zeros(size, count.min(size));
    for (mut column, place) in directions.column_iter_mut().zip(order) {
        let direction = eigen.eigenvectors.column(place);
        // Either sign would serve; the largest component is made positive.
        let sign = if direction[direction.iamax()] < 0.0 { -1.0 } else { 1.0 };
        column.copy_from(&(direction * sign));
    }
    directions
}
