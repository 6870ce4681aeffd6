//! Filling of missing readings from the others of their frame.
//!
//! Readings move together: a press changes many at once. Training describes that by a few common factors (factor
//! analysis): r = m + L·f + noise of each reading's own, with standard normal factors f. The expected value of missing
//! readings, given those that are there, then takes the solution of a small system of equations.
//!
//! With s one over each reading's own noise, z = (r − m)·s are standardised readings, and V their parts in the
//! factors, turned so that (I − VVᵀ) is the inverse of the covariance of z. For readings M that are missing and O that
//! are there,
//!
//! > E\[z_M | z_O\] = V_M·(I − V_Mᵀ·V_M)⁻¹·V_Oᵀ·z_O.
//!
//! So a missing reading costs a sum over the factors squared, and readings that are there cost what a projection does.
//! `docs/reliability.md` tells how large the errors are.

use crate::rbf::NetworkError;

/// Share of a frame's readings that may be missing: one in so many. If more are, they are not filled.
pub const MOST_MISSING: usize = 4;

/// What fills missing readings, borrowed from a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fill<'a> {
    readings: usize,
    factors: usize,
    block: &'a [f32],
}

/// Number of floats in the block of a [`Fill`].
pub(crate) const fn block_floats(readings: usize, factors: usize) -> usize {
    factors.saturating_add(2).saturating_mul(readings)
}

impl<'a> Fill<'a> {
    /// Makes a fill of a block, whose arrays are in this order: m of every reading, in its unit; s of every reading,
    /// one over its unit, and 0 for a reading that never changed; V, the parts of one reading in all factors after the
    /// other.
    ///
    /// # Errors
    /// [`NetworkError::Empty`] without readings or factors, [`NetworkError::Length`] for a block of another length,
    /// [`NetworkError::NotFinite`] for a number that is NaN or infinite, [`NetworkError::NotPositive`] for a negative s,
    /// or parts of a reading whose squares sum up to 1 or more.
    pub fn new(readings: usize, factors: usize, block: &'a [f32]) -> Result<Self, NetworkError> {
        const WHAT: &str = "fill";
        if readings == 0 || factors == 0 {
            return Err(NetworkError::Empty);
        }
        let (expected, found) = (block_floats(readings, factors), block.len());
        if expected != found {
            return Err(NetworkError::Length { what: WHAT, expected, found });
        }
        if !block.iter().all(|value| value.is_finite()) {
            return Err(NetworkError::NotFinite { what: WHAT });
        }
        let fill = Self { readings, factors, block };
        let sound = |(_, s, parts): (f32, f32, &[f32])| {
            s >= 0.0 && parts.iter().map(|part| part * part).sum::<f32>() < 1.0
        };
        if fill.channels().all(sound) {
            Ok(fill)
        } else {
            Err(NetworkError::NotPositive { what: WHAT })
        }
    }

    /// Makes a fill of an array in a program, as [`new`](Self::new) takes it. Numbers are not looked at.
    ///
    /// # Panics
    /// If the array has another length.
    pub const fn of_array(readings: usize, factors: usize, array: &'a [f32]) -> Self {
        assert!(array.len() == block_floats(readings, factors), "a fill of another length");
        Self::of_checked(readings, factors, array)
    }

    /// Makes a fill of a block that [`new`](Self::new) has checked before, or will.
    pub(crate) const fn of_checked(readings: usize, factors: usize, block: &'a [f32]) -> Self {
        Self { readings, factors, block }
    }

    /// Number of readings in a frame.
    pub const fn readings(&self) -> usize {
        self.readings
    }

    /// Number of factors.
    pub fn factors(&self) -> usize {
        self.factors
    }

    /// The fill's numbers, as [`new`](Self::new) takes them.
    pub fn block(&self) -> &'a [f32] {
        self.block
    }

    /// Number of floats of working space that [`fill`](Self::fill) needs.
    pub const fn scratch_floats(&self) -> usize {
        triangle(self.factors).saturating_add(self.factors)
    }

    /// m, s and the parts of every reading.
    pub fn channels(&self) -> impl Iterator<Item = (f32, f32, &'a [f32])> {
        let (mean, rest) = self.block.split_at_checked(self.readings).unwrap_or_default();
        let (scale, parts) = rest.split_at_checked(self.readings).unwrap_or_default();
        let parts = parts.chunks_exact(self.factors.max(1));
        mean.iter().zip(scale).zip(parts).map(|((mean, scale), parts)| (*mean, *scale, parts))
    }

    /// Replaces missing readings (not finite) of a frame by those expected of the others, in their unit. Returns the number
    /// of readings that were filled.
    ///
    /// `scratch` is working space of [`scratch_floats`](Self::scratch_floats). Nothing is filled if none is missing, if
    /// more than one in [`MOST_MISSING`] is, or if a slice is too short.
    ///
    /// ```
    /// use taxel_core::fill::Fill;
    /// // Two readings near 60 Ω, with noise of 0.1 Ω, that move together by 3 Ω; and two more alike.
    /// let part = 3.0 / f32::sqrt(4.0 * 9.0 + 0.01);
    /// let block = [[60.0; 4], [10.0; 4], [part; 4]];
    /// let fill = Fill::new(4, 1, block.as_flattened())?;
    /// let mut frame = [63.0, f32::NAN, 63.0, 63.0];
    /// assert_eq!(fill.fill(&mut frame, &mut [0.0; 2]), 1);
    /// assert!((frame[1] - 63.0).abs() < 0.01);
    /// # Ok::<(), taxel_core::rbf::NetworkError>(())
    /// ```
    pub fn fill(&self, readings: &mut [f32], scratch: &mut [f32]) -> usize {
        let missing = readings.iter().filter(|reading| !reading.is_finite()).count();
        let few = missing.saturating_mul(MOST_MISSING) <= self.readings;
        let room = scratch.split_at_mut_checked(triangle(self.factors));
        let Some((matrix, rest)) = room.filter(|_| missing > 0 && few) else { return 0 };
        let Some(factors) = rest.get_mut(..self.factors) else { return 0 };
        self.equations(readings, matrix, factors);
        if readings.len() != self.readings || !solve(matrix, factors) {
            return 0;
        }
        for (reading, (mean, scale, parts)) in readings.iter_mut().zip(self.channels()) {
            if !reading.is_finite() {
                let moved = if scale > 0.0 { product(parts, factors) / scale } else { 0.0 };
                *reading = mean + moved;
            }
        }
        missing
    }

    /// Writes the lower triangle of I − V_Mᵀ·V_M, row after row, and V_Oᵀ·z_O.
    fn equations(&self, readings: &[f32], matrix: &mut [f32], sums: &mut [f32]) {
        matrix.fill(0.0);
        sums.fill(0.0);
        let mut rest = &mut *matrix;
        for row in 0..self.factors {
            let Some((head, after)) = rest.split_at_mut_checked(row.saturating_add(1)) else {
                return;
            };
            if let Some(diagonal) = head.last_mut() {
                *diagonal = 1.0;
            }
            rest = after;
        }
        for (reading, (mean, scale, parts)) in readings.iter().zip(self.channels()) {
            if reading.is_finite() {
                let z = (reading - mean) * scale;
                sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += z * part);
                continue;
            }
            let mut places = matrix.iter_mut();
            for (row, part) in parts.iter().enumerate() {
                let places = places.by_ref().zip(parts).take(row.saturating_add(1));
                places.for_each(|(place, other)| *place -= part * other);
            }
        }
    }
}

/// Number of floats in the lower triangle of a matrix of so many rows.
const fn triangle(rows: usize) -> usize {
    rows.saturating_mul(rows.saturating_add(1)) / 2
}

/// Row of a lower triangle, which has one number more than its index.
fn row_of(triangle_rows: &[f32], row: usize) -> &[f32] {
    let start = triangle(row);
    triangle_rows.get(start..start.saturating_add(row).saturating_add(1)).unwrap_or_default()
}

fn product(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Solves the equations of a positive definite `matrix`, given by its lower triangle, for the right-hand side in `x`, by
/// Cholesky's decomposition. Returns whether the matrix is positive definite in f32.
fn solve(matrix: &mut [f32], x: &mut [f32]) -> bool {
    let size = x.len();
    for row in 0..size {
        let (before, this) = matrix.split_at_mut_checked(triangle(row)).unwrap_or_default();
        let Some(this) = this.get_mut(..=row) else { return false };
        for column in 0..row {
            let other = row_of(before, column);
            let (known, rest) = this.split_at_mut_checked(column).unwrap_or_default();
            let (Some(place), Some(diagonal)) = (rest.first_mut(), other.last()) else {
                return false;
            };
            *place = (*place - product(known, other)) / diagonal;
        }
        let Some((diagonal, known)) = this.split_last_mut() else { return false };
        let left = *diagonal - product(known, known);
        if left.is_nan() || left <= 0.0 {
            return false;
        }
        *diagonal = sqrt(left);
        let (solved, rest) = x.split_at_mut_checked(row).unwrap_or_default();
        let Some(place) = rest.first_mut() else { return false };
        *place = (*place - product(known, solved)) / *diagonal;
    }
    for row in (0..size).rev() {
        let this = row_of(matrix, row);
        let (earlier, rest) = x.split_at_mut_checked(row).unwrap_or_default();
        let (Some(place), Some((diagonal, parts))) = (rest.first_mut(), this.split_last()) else {
            return false;
        };
        *place /= *diagonal;
        earlier.iter_mut().zip(parts).for_each(|(x, part)| *x -= part * *place);
    }
    true
}

/// Square root, rounded correctly.
fn sqrt(value: f32) -> f32 {
    #[cfg(cortex_m4f)]
    return crate::cortex_m4::sqrt(value);
    #[cfg(not(cortex_m4f))]
    return libm::sqrtf(value);
}

#[cfg(test)]
mod tests;
