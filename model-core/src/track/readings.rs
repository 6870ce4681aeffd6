//! What a contact does to readings, and what a frame of readings says of a contact.
//!
//! The conductance of a cell is a sum over the electrodes of its row. Its change by an electrode's deformation Δ, over the
//! cell's conductance at rest, is a quadratic form of Δ, whose coefficients are the *shares*: those of x, y, z, x², xy, xz,
//! y², yz and z².
//!
//! A reading R of a cell with R₀ at rest says c = R₀/R, which is h = 1 + Σ shares of Δ where there is no noise. Columns that lie
//! close, beside their distance from the electrodes, say nearly the same: the mean c of a *group* of them counts as one, for a
//! third of the work.

use core::ops::Range;

use super::Tracker;
use super::dent::{Form, OF_DEPTH};
use super::linear::{Square, mirror, sqrt};
use super::walk::{LATENTS, Latents, RATES, Settings, Vector, latents};

/// Number of shares of an electrode and a column.
pub const TERMS: usize = 9;

/// Depth in mm below which an electrode counts as at rest.
const AT_REST_MM: f32 = 1e-4;

/// Readings whose products are added at once.
const BATCH: usize = 12;

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
    /// Number of columns of a group; the last one may have fewer.
    pub span: usize,
}

impl Sizes {
    /// Whether a row's outputs are deformations of its electrodes: along z, or along x, y and z.
    pub const fn has_outputs(self, outputs: usize) -> bool {
        let fits = self.electrodes > 0 && self.electrodes <= MOST_ELECTRODES && self.span > 0;
        fits && (outputs == self.electrodes || outputs == 3 * self.electrodes)
    }

    /// Number of readings in a frame.
    pub const fn cells(self) -> usize {
        self.rows.saturating_mul(self.columns)
    }

    /// Number of groups of columns.
    pub const fn groups(self) -> usize {
        self.columns.div_ceil(if self.span > 0 { self.span } else { 1 })
    }

    /// Number of electrodes of all rows.
    pub const fn all_electrodes(self) -> usize {
        self.rows.saturating_mul(self.electrodes)
    }

    /// Number of floats in the block.
    pub const fn block_floats(self) -> usize {
        let shares = self.all_electrodes().saturating_mul(self.groups()).saturating_mul(TERMS);
        let places = self.all_electrodes().saturating_mul(2);
        shares.saturating_add(places).saturating_add(self.cells()).saturating_add(Settings::FLOATS)
    }
}

/// A frame of readings, and when its rows were read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<'f> {
    /// All cells in Ω, row after row; one that is NaN does not count.
    pub readings_ohm: &'f [f32],
    /// One over each reading of the baseline, in place of the resistances at rest that the blob has: then gains that differ
    /// from those of training do not matter.
    pub reciprocals: Option<&'f [f32]>,
    /// Start of the frame in µs, by a clock of any start.
    pub start_us: u64,
    /// Time in µs from there to the middle of each row's readings.
    pub row_us: &'f [f32],
}

impl Frame<'_> {
    /// Middle of the times of rows, in µs from the start and by the clock: the time that a state is of.
    pub fn middle(&self) -> (f32, u64) {
        let middle_us = self.row_us.iter().sum::<f32>() / self.row_us.len().max(1) as f32;
        (middle_us, self.start_us.saturating_add(middle_us as u64))
    }
}

/// An electrode under a contact.
#[derive(Clone, Copy)]
struct Pressed<'a> {
    depth_mm: f32,
    slopes: [f32; 7],
    /// Shares of the groups, one after the other.
    shares: &'a [[f32; TERMS]],
}

impl<'a> Tracker<'a> {
    /// What `frame` says of latents, with readings of this noise. Writes JᵀJ, adds Jᵀr, with the derivatives J and the residuals
    /// r of all readings over their noise. Rows are expected at their own times by the rates, which learn from frame to
    /// frame alone; returns the mean of r², NaN without a reading.
    pub(super) fn inform(
        &self,
        noise: f32,
        mean: &Vector,
        frame: &Frame<'_>,
        information: &mut Square<LATENTS>,
        gradient: &mut Latents,
    ) -> f32 {
        *information = [[0.0; LATENTS]; LATENTS];
        let Sizes { rows, columns, span, .. } = self.sizes;
        let (middle_us, form) = (frame.middle().0, Form::new(*latents(mean)));
        let (mut squares, mut readings, mut batch) = (0.0, 0.0, Batch::EMPTY);
        let mut all = [Pressed { depth_mm: 0.0, slopes: [0.0; 7], shares: &[] }; MOST_ELECTRODES];
        for (row, row_us) in frame.row_us.iter().enumerate().take(rows) {
            let since_s = (row_us - middle_us) * 1e-6;
            let mut latents = *latents(mean);
            for axis in 0..RATES {
                latents[axis] += since_s * mean[LATENTS + axis];
            }
            let pressed = self.pressed(row, &form, &latents, &mut all);
            let cells = row.saturating_mul(columns)..row.saturating_add(1).saturating_mul(columns);
            for (group, first) in cells.clone().step_by(span.max(1)).enumerate() {
                let of_group = first..first.saturating_add(span).min(cells.end);
                let count = of_group.len() as f32;
                let ratio = self.ratio(of_group, frame) / count;
                if ratio.is_finite() {
                    let (expected, slopes) = expect(pressed, group, [latents[4], latents[5]]);
                    // The noise of a mean is less by the root of the count.
                    let scale = sqrt(count) / (expected * noise);
                    let residual = (ratio - expected) * scale;
                    squares += residual * residual;
                    readings += 1.0;
                    if batch.push(slopes, scale, residual) {
                        batch.add_to(information, gradient);
                    }
                }
            }
        }
        batch.add_rest_to(information, gradient);
        mirror(information);
        squares / readings
    }

    /// The electrodes of a row that a contact presses, at the front of `all`.
    fn pressed<'p>(
        &self,
        row: usize,
        form: &Form,
        latents: &Latents,
        all: &'p mut [Pressed<'a>; MOST_ELECTRODES],
    ) -> &'p [Pressed<'a>] {
        let (electrodes, groups) = (self.sizes.electrodes, self.sizes.groups());
        let first = row.saturating_mul(electrodes);
        let mut count = 0;
        for electrode in first..first.saturating_add(electrodes) {
            let Some(place) = self.places_mm.get(electrode) else { break };
            let depth = form.at(latents, *place);
            let from = electrode.saturating_mul(groups);
            let shares = self.shares.get(from..from.saturating_add(groups));
            let (Some(slot), Some(shares)) = (all.get_mut(count), shares) else { break };
            if depth.mm.abs() > AT_REST_MM {
                *slot = Pressed { depth_mm: depth.mm, slopes: depth.slopes, shares };
                count += 1;
            }
        }
        all.get(..count).unwrap_or_default()
    }

    /// Sum over `cells` of the resistance at rest over that of the cell; NaN if a reading is missing, shorted or open.
    fn ratio(&self, cells: Range<usize>, frame: &Frame<'_>) -> f32 {
        let known = frame.reciprocals.unwrap_or(self.rest_ohm);
        let known = known.get(cells.clone()).unwrap_or_default();
        let readings = frame.readings_ohm.get(cells).unwrap_or_default().iter();
        let usable = |ohm: f32| if ohm > 0.0 && ohm < f32::INFINITY { ohm } else { f32::NAN };
        let pairs = readings.map(|ohm| usable(*ohm)).zip(known);
        if frame.reciprocals.is_some() {
            pairs.fold(0.0, |sum, (ohm, reciprocal)| sum + 1.0 / (ohm * reciprocal))
        } else {
            pairs.fold(0.0, |sum, (ohm, rest)| sum + rest / ohm)
        }
    }
}

/// The ratio that is expected of a group, and its derivatives by the latents.
#[inline(always)]
fn expect(pressed: &[Pressed<'_>], group: usize, [along_x, along_y]: [f32; 2]) -> (f32, Latents) {
    let (mut twice, mut of_depths, mut of_shear) = (2.0, [0.0; OF_DEPTH.len()], [0.0; 2]);
    for Pressed { depth_mm: dz, slopes, shares } in pressed {
        let Some([x, y, z, xx, xy, xz, yy, yz, zz]) = shares.get(group) else { continue };
        let by_x = x + dz * (2.0 * along_x * xx + along_y * xy + xz);
        let by_y = y + dz * (along_x * xy + 2.0 * along_y * yy + yz);
        let by_z = z + dz * (along_x * xz + along_y * yz + 2.0 * zz);
        let by_depth = along_x * by_x + along_y * by_y + by_z;
        // A quadratic form is half its slope, and half that at 0.
        twice += dz * (along_x * x + along_y * y + z + by_depth);
        of_depths = core::array::from_fn(|at| of_depths[at] + by_depth * slopes[at]);
        of_shear = [of_shear[0] + by_x * dz, of_shear[1] + by_y * dz];
    }
    let [x, y, depth, radius, stretch, turn, form] = of_depths;
    (0.5 * twice, [x, y, depth, radius, of_shear[0], of_shear[1], stretch, turn, form])
}

/// So many readings' derivatives by the latents, and residuals, all over noise: their products are added at once.
struct Batch {
    derivatives: [[f32; BATCH]; LATENTS],
    residuals: [f32; BATCH],
    count: usize,
}

impl Batch {
    const EMPTY: Self =
        Self { derivatives: [[0.0; BATCH]; LATENTS], residuals: [0.0; BATCH], count: 0 };

    /// Adds a reading. Returns whether there is no room for another.
    #[inline(always)]
    fn push(&mut self, slopes: Latents, scale: f32, residual: f32) -> bool {
        let at = self.count.min(BATCH - 1);
        for (derivatives, slope) in self.derivatives.iter_mut().zip(slopes) {
            derivatives[at] = slope * scale;
        }
        self.residuals[at] = residual;
        self.count = at + 1;
        self.count == BATCH
    }

    /// Adds what readings say that do not fill the batch.
    fn add_rest_to(&mut self, information: &mut Square<LATENTS>, gradient: &mut Latents) {
        if self.count > 0 {
            for numbers in self.derivatives.iter_mut().chain([&mut self.residuals]) {
                numbers.iter_mut().skip(self.count).for_each(|number| *number = 0.0);
            }
            self.add_to(information, gradient);
        }
    }

    /// Adds what the readings say to the lower half of `information` and to the `gradient`, and forgets them.
    fn add_to(&mut self, information: &mut Square<LATENTS>, gradient: &mut Latents) {
        let add = |sum: &mut f32, a: &[f32; BATCH], b: &[f32; BATCH]| {
            *sum = a.iter().zip(b).fold(*sum, |sum, (a, b)| sum + a * b);
        };
        let rows = information.iter_mut().zip(gradient).zip(&self.derivatives);
        for (row, ((sums, gradient), of_row)) in rows.enumerate() {
            let of_row = *of_row;
            add(gradient, &of_row, &self.residuals);
            for (sum, of_column) in sums.iter_mut().zip(&self.derivatives).take(row + 1) {
                add(sum, &of_row, of_column);
            }
        }
        self.count = 0;
    }
}
