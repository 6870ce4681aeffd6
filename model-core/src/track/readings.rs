//! What a contact does to readings, and what a frame of readings says of a contact.
//!
//! The conductance of a cell is a sum over the electrodes of its row. Its change by an electrode's deformation Δ, over the
//! cell's conductance at rest, is a quadratic form of Δ, whose coefficients are the *shares*: those of x, y, z, x², xy, xz,
//! y², yz and z².
//!
//! A reading R of a cell with R₀ at rest says c = R₀/R, which is h = 1 + Σ shares of Δ where there is no noise.

use super::Tracker;
use super::dent::{Dent, OF_DEPTH};
use super::linear::{Matrix, Vector, ZERO, mirror};
use super::walk::{LATENTS, Latents, PLACES, RATES, Settings, place_of};

/// Number of shares of an electrode and a column.
pub const TERMS: usize = 9;

/// Depth in mm below which an electrode counts as at rest.
const AT_REST_MM: f32 = 1e-4;

/// Most electrodes of a row.
pub const MOST_ELECTRODES: usize = 16;

/// Sizes of a tracker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Number of rows.
    pub rows: usize,
    /// Number of electrodes of a row.
    pub electrodes: usize,
    /// Number of columns.
    pub columns: usize,
}

impl Sizes {
    /// Whether a row's outputs are deformations of its electrodes: along z, or along x, y and z.
    pub const fn has_outputs(self, outputs: usize) -> bool {
        let fits = self.electrodes > 0 && self.electrodes <= MOST_ELECTRODES;
        fits && (outputs == self.electrodes || outputs == 3 * self.electrodes)
    }

    /// Number of readings in a frame.
    pub const fn cells(self) -> usize {
        self.rows.saturating_mul(self.columns)
    }

    /// Number of electrodes of all rows.
    pub const fn all_electrodes(self) -> usize {
        self.rows.saturating_mul(self.electrodes)
    }

    /// Number of floats in the block.
    pub const fn block_floats(self) -> usize {
        let shares = self.all_electrodes().saturating_mul(self.columns).saturating_mul(TERMS);
        let places = self.all_electrodes().saturating_mul(2);
        shares.saturating_add(places).saturating_add(self.cells()).saturating_add(Settings::FLOATS)
    }
}

/// A frame of readings, when rows were read, and how far ahead its estimate is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<'f> {
    /// All cells in Ω, row after row; one that is NaN does not count.
    pub readings_ohm: &'f [f32],
    /// One over each reading of the baseline, in place of the resistances at rest that the blob has.
    pub reciprocals: Option<&'f [f32]>,
    /// Start of the frame in µs, by a clock of any start.
    pub start_us: u64,
    /// Time in µs from there to the middle of each row's readings.
    pub row_us: &'f [f32],
    /// Time in µs from the start for which outputs are expected.
    pub ahead_us: f32,
}

impl Frame<'_> {
    /// Middle of the times of rows, in µs from the start and by the clock: the time that a state is of.
    pub(super) fn middle(&self) -> (f32, u64) {
        let middle_us = self.row_us.iter().sum::<f32>() / self.row_us.len().max(1) as f32;
        (middle_us, self.start_us.saturating_add(middle_us as u64))
    }
}

/// What a row says of latents: the lower half of JᵀJ, Jᵀr, the sum of r² and the number of readings.
struct OfRow {
    information: [Latents; LATENTS],
    gradient: Latents,
    squares: f32,
    readings: usize,
}

/// An electrode under a contact.
#[derive(Clone, Copy)]
struct Pressed<'a> {
    depth_mm: f32,
    slopes: [f32; 7],
    /// Shares of the columns, one after the other.
    shares: &'a [[f32; TERMS]],
}

impl Tracker<'_> {
    /// What `frame` says of a state, with readings of this noise. Writes JᵀJ, adds Jᵀr, with the derivatives J and the residuals
    /// r of all readings over their noise; returns the mean of r², NaN without a reading.
    pub(super) fn inform(
        &self,
        noise: f32,
        mean: &Vector,
        frame: &Frame<'_>,
        information: &mut Matrix,
        gradient: &mut Vector,
    ) -> f32 {
        *information = ZERO;
        let middle_us = frame.middle().0;
        let (mut squares, mut readings) = (0.0, 0);
        for (row, row_us) in frame.row_us.iter().enumerate().take(self.sizes.rows) {
            let since_s = (row_us - middle_us) * 1e-6;
            let mut latents = PLACES.map(|place| mean[place]);
            for (axis, latent) in latents.iter_mut().take(RATES).enumerate() {
                *latent += since_s * mean[2 * axis + 1];
            }
            let of_row = self.inform_of_row(row, noise, latents, frame);
            of_row.add_to(information, gradient, since_s);
            squares += of_row.squares;
            readings += of_row.readings;
        }
        mirror(information);
        squares / readings as f32
    }

    fn inform_of_row(&self, row: usize, noise: f32, latents: Latents, frame: &Frame<'_>) -> OfRow {
        let Sizes { electrodes, columns, .. } = self.sizes;
        let dent = Dent::new(latents);
        let first = row.saturating_mul(electrodes);
        let mut pressed =
            [Pressed { depth_mm: 0.0, slopes: [0.0; 7], shares: &[] }; MOST_ELECTRODES];
        let mut count = 0;
        for electrode in first..first.saturating_add(electrodes) {
            let Some(place) = self.places_mm.get(electrode) else { break };
            let depth = dent.at(*place);
            let shares = self.shares.chunks_exact(columns.max(1)).nth(electrode);
            let (Some(slot), Some(shares)) = (pressed.get_mut(count), shares) else { break };
            if depth.mm.abs() > AT_REST_MM {
                *slot = Pressed { depth_mm: depth.mm, slopes: depth.slopes, shares };
                count += 1;
            }
        }
        let pressed = pressed.get(..count).unwrap_or_default();
        let mut of_row = OfRow {
            information: [[0.0; LATENTS]; LATENTS],
            gradient: [0.0; LATENTS],
            squares: 0.0,
            readings: 0,
        };
        let cells = (row.saturating_mul(columns)..).take(columns);
        for (column, cell) in cells.enumerate() {
            let Some(ratio) = self.ratio(cell, frame).filter(|ratio| ratio.is_finite()) else {
                continue;
            };
            let (expected, slopes) = expect(pressed, column, [latents[4], latents[5]]);
            of_row.add(ratio, expected, slopes, noise);
        }
        of_row
    }

    /// Resistance at rest over that of a cell; `None` of a reading that is missing, shorted or open.
    fn ratio(&self, cell: usize, frame: &Frame<'_>) -> Option<f32> {
        let ohm = frame.readings_ohm.get(cell).filter(|ohm| ohm.is_finite() && **ohm > 0.0)?;
        match frame.reciprocals {
            Some(reciprocals) => Some(1.0 / (ohm * reciprocals.get(cell)?)),
            None => Some(self.rest_ohm.get(cell)? / ohm),
        }
    }
}

/// The ratio that is expected of a column, and its derivatives by the latents.
fn expect(pressed: &[Pressed<'_>], column: usize, [along_x, along_y]: [f32; 2]) -> (f32, Latents) {
    let (mut ratio, mut slopes) = (1.0, [0.0; LATENTS]);
    for Pressed { depth_mm: dz, slopes: of_depth, shares } in pressed {
        let Some([x, y, z, xx, xy, xz, yy, yz, zz]) = shares.get(column) else { continue };
        let (dx, dy) = (along_x * dz, along_y * dz);
        let by_x = x + 2.0 * xx * dx + xy * dy + xz * dz;
        let by_y = y + xy * dx + 2.0 * yy * dy + yz * dz;
        let by_z = z + xz * dx + yz * dy + 2.0 * zz * dz;
        ratio += 0.5 * ((x + by_x) * dx + (y + by_y) * dy + (z + by_z) * dz);
        let by_depth = along_x * by_x + along_y * by_y + by_z;
        for (latent, slope) in OF_DEPTH.into_iter().zip(of_depth) {
            slopes[latent] += by_depth * slope;
        }
        slopes[4] += by_x * dz;
        slopes[5] += by_y * dz;
    }
    (ratio, slopes)
}

impl OfRow {
    fn add(&mut self, ratio: f32, expected: f32, mut slopes: Latents, noise: f32) {
        let scale = 1.0 / (expected * noise);
        let residual = (ratio - expected) * scale;
        slopes.iter_mut().for_each(|slope| *slope *= scale);
        for row in 0..LATENTS {
            self.gradient[row] += slopes[row] * residual;
            for column in 0..=row {
                self.information[row][column] += slopes[row] * slopes[column];
            }
        }
        self.squares += residual * residual;
        self.readings += 1;
    }

    /// Adds what the row says, which was read `since_s` after the time of the state, to the lower half of `information`. A
    /// latent with a rate counts for both.
    fn add_to(&self, information: &mut Matrix, gradient: &mut Vector, since_s: f32) {
        for row in 0..LATENTS {
            let (place, of_row) = (place_of(row), self.gradient[row]);
            gradient[place] += of_row;
            if row < RATES {
                gradient[2 * row + 1] += since_s * of_row;
            }
            for (column, value) in self.information[row].iter().enumerate().take(row + 1) {
                let other = place_of(column);
                information[place][other] += value;
                if row < RATES {
                    information[2 * row + 1][other] += since_s * value;
                    information[2 * row + 1][2 * column + 1] += since_s * since_s * value;
                }
                if column < RATES && column < row {
                    information[place][2 * column + 1] += since_s * value;
                }
            }
        }
    }
}
