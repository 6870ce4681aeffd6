//! Tracking of a contact: an extended Kalman filter on what a contact is, not on what each electrode does.
//!
//! A contact has a place (x, y), a depth, a radius, a shear, and a form. They move smoothly
//! ([`Settings`]), and fix the deformation of every electrode, and with it every reading. A frame corrects
//! the state by its innovation, each row at the time at which it was read (Bar-Shalom, Li and Kirubarajan, *Estimation
//! with Applications to Tracking and Navigation*, 2001, §10.3; iterated as in Bell and Cathey, "The iterated Kalman filter
//! update as a Gauss–Newton method", IEEE Transactions on Automatic Control 38, 1993). Errors are kept as a root L of the
//! covariance P = LLᵀ, so that f32 is enough.
//!
//! A network starts the tracker, and again wherever readings are not explained: of both states, the one stays that explains
//! the frame better. It also gives the estimate where neither does.
//!
//! The blob tells a noise to begin with. How far readings scatter, less where samples are averaged and more by gains that are a
//! little off or a contact of another form, the tracker learns as a level, and trusts each reading accordingly.

mod linear;
mod dent;
mod walk;
mod readings;
#[cfg(test)]
mod tests;

use core::mem;

use crate::estimate::{Estimate, RowStatus};
use crate::rbf::NetworkError;
use dent::Form;
use linear::{Square, cholesky, dot, solve_lower, solve_upper};
use walk::Vector;

pub use readings::{Frame, MOST_ELECTRODES, Sizes, TERMS};
pub use walk::{LATENTS, Latents, NUMBERS, RATES, Settings};

/// Most corrections by a frame that follows another, and by the first one.
const ITERATIONS: usize = 2;
const FIRST_ITERATIONS: usize = 4;

/// Mean square of residuals, over its level, below which one correction will do: the contact was where it was expected.
const AS_EXPECTED: f32 = 1.2;

/// Standard deviations of the mean square of residuals above its level from which a frame is not explained.
const NOT_EXPLAINED: f32 = 6.0;

/// Time in s over which the level of residuals is learnt, and its bounds.
const LEVEL_S: f32 = 0.5;
const LEVELS: [f32; 2] = [1e-3, 1e3];

/// Frames at a start in which the level is learnt by such a share of each: until the state has settled.
const YOUNG: u32 = 16;
const YOUNG_SHARE: f32 = 0.3;

/// Most that residuals count over their level, so that frames that no contact explains do not teach that readings scatter.
const MOST_OVER: f32 = 3.0;

/// Time in µs for which frames are left to the network behind one that no contact explains: a search takes several frames'
/// time at 1 kHz.
const PAUSE_US: u64 = 5000;

/// Longest time in s between two frames of one trajectory.
const LONGEST_GAP_S: f32 = 0.5;

/// How contacts move and what they do to readings, borrowed from a blob.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tracker<'a> {
    sizes: Sizes,
    /// All floats of the blob, and those of the [`Settings`].
    block: &'a [f32],
    settings: &'a [f32; Settings::FLOATS],
    /// Resistance of each cell at rest.
    rest_ohm: &'a [f32],
    /// Place of each electrode, row after row.
    places_mm: &'a [[f32; 2]],
    /// Shares of each electrode and column.
    shares: &'a [[f32; readings::TERMS]],
}

/// What a tracker remembers between the frames of a trajectory, and its working memory: some 2 kB.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    now: Contact,
    /// Room for a contact that the network starts.
    other: Contact,
    /// Whether there is a contact now.
    is_known: bool,
    /// Until when frames are left to the network.
    paused_until_us: u64,
    /// How far a frame is explained that is not finished.
    followed: Option<Followed>,
    work: Work,
}

/// Room for a correction: the information of a frame, the first columns of a root, and the product of both.
#[derive(Debug, Clone, PartialEq)]
struct Work {
    information: Square<LATENTS>,
    columns: Square<LATENTS>,
    product: Square<LATENTS>,
}

/// What a frame has shown of the contact before it: the time since, and the mean square of residuals over that of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Followed {
    gap_s: f32,
    residual: f32,
}

/// A contact as it is known, and when.
#[derive(Debug, Clone, PartialEq)]
struct Contact {
    mean: Vector,
    /// L of the covariance LLᵀ.
    root: Square<NUMBERS>,
    at_us: u64,
    /// Mean square of residuals over that of the noise that the blob tells, slowly averaged over so many frames.
    level: f32,
    frames: u32,
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    /// Before the first frame.
    pub const fn new() -> Self {
        // All zero, so that a static of it costs no flash.
        const NOTHING: Contact = Contact {
            mean: [0.0; NUMBERS],
            root: [[0.0; NUMBERS]; NUMBERS],
            at_us: 0,
            level: 0.0,
            frames: 0,
        };
        const ZERO: Square<LATENTS> = [[0.0; LATENTS]; LATENTS];
        const NO_WORK: Work = Work { information: ZERO, columns: ZERO, product: ZERO };
        Self {
            now: NOTHING,
            other: NOTHING,
            is_known: false,
            paused_until_us: 0,
            followed: None,
            work: NO_WORK,
        }
    }

    /// Lets the next frame be the first one.
    pub fn restart(&mut self) {
        (self.is_known, self.paused_until_us) = (false, 0);
    }

    /// Whether a frame of this time is left to the network. A clock that goes back ends a pause.
    fn is_paused(&self, at_us: u64) -> bool {
        self.paused_until_us
            .checked_sub(at_us)
            .is_some_and(|left_us| (1..=PAUSE_US).contains(&left_us))
    }

    /// Depth of the contact in mm at its deepest, 0 without one.
    pub fn depth_mm(&self) -> f32 {
        if self.is_known { self.now.mean[2].max(0.0) } else { 0.0 }
    }

    /// Place of the contact along x and y in mm, and the standard deviation of it; `None` while there is no contact.
    pub fn place_mm(&self) -> Option<([f32; 2], f32)> {
        let Contact { mean: [x, y, ..], root: [of_x, of_y, ..], .. } = &self.now;
        let variance = dot(of_x, of_x) + dot(of_y, of_y);
        self.is_known.then(|| ([*x, *y], linear::sqrt(variance)))
    }
}

impl<'a> Tracker<'a> {
    /// Makes one of the floats in `block`: [`Settings`], and then rest, places and shares.
    ///
    /// # Errors
    /// [`NetworkError::Length`] for another number of floats than `sizes` tell, [`NetworkError::NotFinite`] for one that is
    /// NaN or infinite.
    pub fn new(sizes: Sizes, block: &'a [f32]) -> Result<Self, NetworkError> {
        const WHAT: &str = "tracker";
        let (expected, found) = (sizes.block_floats(), block.len());
        let wrong = NetworkError::Length { what: WHAT, expected, found };
        if found != expected {
            return Err(wrong);
        }
        if !block.iter().all(|number| number.is_finite()) {
            return Err(NetworkError::NotFinite { what: WHAT });
        }
        let (settings, rest) = block.split_first_chunk().ok_or(wrong)?;
        let (rest_ohm, rest) = rest.split_at_checked(sizes.cells()).ok_or(wrong)?;
        let (places, shares) = rest.split_at_checked(2 * sizes.all_electrodes()).ok_or(wrong)?;
        Ok(Self {
            sizes,
            block,
            settings,
            rest_ohm,
            places_mm: places.as_chunks().0,
            shares: shares.as_chunks().0,
        })
    }

    /// How contacts move.
    pub fn settings(&self) -> Settings {
        Settings::of_floats(self.settings)
    }

    /// Its floats.
    pub fn block(&self) -> &'a [f32] {
        self.block
    }

    /// Sizes of the sensor.
    pub fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// Corrects the `state` by the next frame. Returns whether it explains the frame, so that [`write`](Self::write) has its
    /// estimate: else a network must decode the frame, for [`start`](Self::start).
    #[inline(never)] // so that others' work finds the stack free
    pub fn follow(&self, state: &mut State, frame: &Frame<'_>) -> bool {
        let settings = &self.settings();
        let at_us = frame.middle().1;
        state.followed = None;
        if state.is_paused(at_us) {
            return false;
        }
        let State { now, other, is_known, followed, work, .. } = state;
        let Some(gap_s) = now.gap_s(at_us).filter(|_| *is_known) else { return false };
        settings.predict(now, gap_s, &mut other.root);
        now.at_us = at_us;
        let (before, was_light) = (now.mean, settings.is_light(&now.mean));
        if was_light {
            settings.widen_form(&mut now.root);
        }
        let residual = self.correct(settings, now, frame, ITERATIONS, work);
        if was_light && settings.is_light(&now.mean) {
            // Else noise at rest would move the form.
            let form = now.mean.iter_mut().zip(before).take(LATENTS).skip(RATES);
            form.for_each(|(latent, before)| *latent = before);
        }
        *followed = Some(Followed { gap_s, residual });
        self.is_explained(residual, now.level) && self.finish(state)
    }

    /// Starts a contact from a network's `estimate` of a frame that [`follow`](Self::follow) did not explain, unless the contact
    /// before explains it better. Returns whether one of them does, so that [`write`](Self::write) has a better estimate.
    #[inline(never)]
    pub fn start(&self, state: &mut State, frame: &Frame<'_>, estimate: &Estimate<'_>) -> bool {
        if state.is_paused(frame.middle().1) {
            return false;
        }
        let settings = &self.settings();
        let State { now, other, followed, work, .. } = state;
        let (level, frames) = followed.map_or((1.0, 0), |_| (now.level, now.frames));
        self.begin(settings, estimate, other);
        (other.at_us, other.level, other.frames) = (frame.middle().1, level, frames);
        let residual = self.correct(settings, other, frame, FIRST_ITERATIONS, work);
        let before = followed.get_or_insert(Followed { gap_s: 0.0, residual: f32::NAN });
        if residual < before.residual || before.residual.is_nan() {
            mem::swap(now, other);
            before.residual = residual;
        }
        self.finish(state)
    }

    /// Follows a frame of which the `estimate` is a network's already, or else starts from it; [writes](Self::write) over the
    /// estimate if it is explained. Returns whether it is.
    pub fn track(
        &self,
        state: &mut State,
        frame: &Frame<'_>,
        ahead_us: f32,
        estimate: &mut Estimate<'_>,
    ) -> bool {
        let is_explained = self.follow(state, frame) || self.start(state, frame, estimate);
        if is_explained {
            self.write(state, ahead_us, estimate);
        }
        is_explained
    }

    /// Learns the level of residuals from a frame. Returns whether it is explained.
    fn finish(&self, state: &mut State) -> bool {
        let State { now, is_known, followed, .. } = state;
        let Some(Followed { gap_s, residual }) = followed.take() else { return false };
        *is_known = residual.is_finite() && now.mean.iter().all(|number| number.is_finite());
        if !*is_known {
            return false;
        }
        let is_explained = self.is_explained(residual, now.level);
        let learnt = learnt_level(now.level, residual, gap_s, now.frames);
        (now.level, now.frames) =
            (learnt.clamp(LEVELS[0], LEVELS[1]), now.frames.saturating_add(1));
        if !is_explained {
            state.paused_until_us = now.at_us.saturating_add(PAUSE_US);
        }
        is_explained
    }

    /// Whether a mean square of `residual`s is one of this level: squares of normal numbers, each of variance 2.
    fn is_explained(&self, residual: f32, level: f32) -> bool {
        let readings = self.sizes.rows.saturating_mul(self.sizes.groups());
        let deviation = linear::sqrt(2.0 / readings as f32);
        residual < (1.0 + NOT_EXPLAINED * deviation) * level
    }

    /// Corrects a state by a frame of its time, of whose root L only the lower triangle is not 0. Returns the mean square of
    /// residuals before the last correction, over that of the noise.
    fn correct(
        &self,
        settings: &Settings,
        contact: &mut Contact,
        frame: &Frame<'_>,
        iterations: usize,
        work: &mut Work,
    ) -> f32 {
        let Work { information, columns, product } = work;
        let Contact { mean, root, level, .. } = contact;
        settings.keep_in_range(mean);
        let (prior, weight) = (*mean, 1.0 / *level);
        // Readings depend on latents alone, and these on the first columns of L.
        for (at, column) in columns.iter_mut().enumerate() {
            *column = core::array::from_fn(|latent| root[latent][at]);
        }
        let (mut last, mut inverses) = (f32::NAN, [1.0; LATENTS]);
        for iteration in 0..iterations {
            if iteration == 1 && last < AS_EXPECTED * *level {
                break;
            }
            let mut gradient = [0.0; LATENTS];
            last = self.inform(settings.noise, mean, frame, information, &mut gradient);
            let moved: Latents = core::array::from_fn(|at| mean[at] - prior[at]);
            for (row, gradient) in information.iter_mut().zip(&mut gradient) {
                *gradient = weight * (*gradient + dot(row, &moved));
                row.iter_mut().for_each(|number| *number *= weight);
            }
            // I + Lᵀ·M·L and its root C: the covariance becomes L·(C·Cᵀ)⁻¹·Lᵀ.
            for (of_product, column) in product.iter_mut().zip(&*columns) {
                *of_product = core::array::from_fn(|at| dot(&information[at], column));
            }
            let inner = &mut *information;
            for row in 0..LATENTS {
                for column in 0..=row {
                    inner[row][column] = dot(&product[row], &columns[column]);
                }
                inner[row][row] += 1.0;
            }
            inverses = cholesky(inner);
            let right = core::array::from_fn(|at| dot(&columns[at], &gradient));
            let mut step = solve_lower(inner, &inverses, &right);
            solve_upper(inner, &inverses, &mut step);
            for ((number, prior), row) in mean.iter_mut().zip(prior).zip(&*root) {
                *number = prior + dot(walk::latents(row), &step);
            }
            settings.keep_in_range(mean);
        }
        for row in root {
            let solved = solve_lower(information, &inverses, walk::latents(row));
            row.iter_mut().zip(solved).for_each(|(number, solved)| *number = solved);
        }
        last
    }

    /// Makes the `contact` one as the network sees it.
    fn begin(&self, settings: &Settings, estimate: &Estimate<'_>, contact: &mut Contact) {
        let Contact { mean, root, .. } = contact;
        (*mean, *root) = ([0.0; NUMBERS], [[0.0; NUMBERS]; NUMBERS]);
        for (place, [deviation, usual]) in settings.start.into_iter().enumerate() {
            (mean[place], root[place][place]) = (usual, deviation);
        }
        for (axis, [rate, deviation, _]) in settings.smooth.into_iter().enumerate() {
            root[LATENTS + axis][LATENTS + axis] = rate * deviation;
        }
        let (mut sum, mut deepest, mut moment) = (0.0, 0.0_f32, [0.0; 2]);
        for (place_mm, mm) in self.places_mm.iter().zip(self.depths(estimate)) {
            let mm = if *mm > 0.0 { *mm } else { 0.0 }; // NaN as well
            sum += mm;
            deepest = deepest.max(mm);
            moment = [moment[0] + mm * place_mm[0], moment[1] + mm * place_mm[1]];
        }
        if sum > 0.0 {
            (mean[0], mean[1], mean[2]) = (moment[0] / sum, moment[1] / sum, deepest);
        }
    }

    /// Depth of each electrode in an estimate: the last output of each.
    fn depths<'e>(&self, estimate: &'e Estimate<'_>) -> impl Iterator<Item = &'e f32> {
        let axes = self.axes(estimate);
        estimate.outputs.iter().skip(axes - 1).step_by(axes)
    }

    /// Number of outputs of an electrode: z alone, or x, y and z.
    fn axes(&self, estimate: &Estimate<'_>) -> usize {
        let axes = estimate.outputs.len().checked_div(self.sizes.all_electrodes());
        axes.unwrap_or(0).max(1)
    }

    /// Writes the deformation of every electrode that is expected `ahead_us` after the [middle](Frame::middle) of the frame
    /// that was explained last.
    #[inline(never)]
    pub fn write(&self, state: &State, ahead_us: f32, estimate: &mut Estimate<'_>) {
        let mean = self.settings().mean_after(&state.now.mean, ahead_us * 1e-6);
        let mut latents = *walk::latents(&mean);
        latents[2] = latents[2].max(0.0);
        let (form, axes) = (Form::new(latents), self.axes(estimate));
        for (outputs, place) in estimate.outputs.chunks_exact_mut(axes).zip(self.places_mm) {
            let mm = form.mm(&latents, *place);
            let of_axes = [latents[4] * mm, latents[5] * mm, mm];
            let from = of_axes.len().saturating_sub(axes);
            outputs.iter_mut().zip(of_axes.iter().skip(from)).for_each(|(to, mm)| *to = *mm);
        }
        estimate.status.fill(RowStatus::Decoded);
    }
}

/// Level of residuals after a frame, `gap_s` behind the one before, of so many `frames` so far.
fn learnt_level(level: f32, residual: f32, gap_s: f32, frames: u32) -> f32 {
    let share = match frames {
        0 => return residual,
        1..YOUNG => YOUNG_SHARE,
        _ => (gap_s / LEVEL_S).min(1.0),
    };
    level + share * (residual.min(MOST_OVER * level) - level)
}

impl Contact {
    /// Time in s from this state to `at_us`; `None` if it is none, or too long.
    fn gap_s(&self, at_us: u64) -> Option<f32> {
        let gap_s = at_us.checked_sub(self.at_us)? as f32 * 1e-6;
        (gap_s <= LONGEST_GAP_S).then_some(gap_s)
    }
}
