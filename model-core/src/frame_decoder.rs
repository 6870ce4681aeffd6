//! Decoding the readings of a frame with networks, wherever these lie: row by row, or whole frames.

use crate::blob::{Front, ModelShape};
#[cfg(cortex_m4f)]
use crate::cortex_m4;
use crate::estimate::{Estimate, RowStatus};
use crate::infer::{Infer, Row, all_finite};
use crate::rbf::NetworkError;
use crate::relative::relative;
use crate::touch::{Kind, Touch};

/// A frame to be decoded, with the baseline of the sensor at rest.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'f> {
    /// `rows × inputs` readings in Ω, row after row; NaN is missing.
    pub readings_ohm: &'f [f32],
    /// [Reciprocals](crate::relative::reciprocal) of the baseline, one a reading, for a model with relative inputs.
    /// A reading without one is missing. Other models ignore them.
    pub reciprocals: &'f [f32],
}

impl<'f> From<&'f [f32]> for Frame<'f> {
    /// Readings in Ω, without a baseline.
    fn from(readings_ohm: &'f [f32]) -> Self {
        Self { readings_ohm, reciprocals: &[] }
    }
}

/// Networks of a model, with what each is given.
#[derive(Debug, Clone, Copy)]
pub enum Networks<'n, 'a, N> {
    /// A network for each row.
    OfRows(&'n [N]),
    /// Networks that see whole frames, each with its front. Each gives the outputs that follow those of the previous
    /// network.
    OfFrames(&'n [(Front<'a>, N)]),
}

/// Decoder of frames, wherever its networks lie.
#[derive(Debug, Clone, Copy)]
pub struct FrameDecoder<'n, 'a, N> {
    pub shape: ModelShape,
    /// Whether inputs are relative to the baseline.
    pub relative: bool,
    pub networks: Networks<'n, 'a, N>,
}

impl<N: Infer> FrameDecoder<'_, '_, N> {
    /// Decodes one frame as [`Decoder::decode_into`](crate::Decoder::decode_into) does.
    ///
    /// # Errors
    /// [`NetworkError::Length`] if a slice does not have the model's length, or `scratch` is too short.
    #[inline(always)]
    pub fn decode(
        &self,
        frame: Frame<'_>,
        scratch: &mut [f32],
        estimate: &mut Estimate<'_>,
    ) -> Result<bool, NetworkError> {
        let ModelShape { rows, inputs, outputs } = self.shape;
        // A model has a name for each, so that no product overflows.
        check_length("frame", frame.readings_ohm, rows.wrapping_mul(inputs))?;
        check_length("outputs of the estimate", estimate.outputs, rows.wrapping_mul(outputs))?;
        check_length("status of the estimate", estimate.status, rows)?;
        let too_short = |expected, found| NetworkError::Length { what: "scratch", expected, found };
        match self.networks {
            Networks::OfFrames(networks) => {
                let readings = frame.readings_ohm.len();
                let floats =
                    |(front, _): &(Front<'_>, N)| floats_of_front(front, readings, self.relative);
                let expected = networks.iter().map(floats).max().unwrap_or(0);
                let found = scratch.len();
                // No more than that: what is left behind the parts below is readings relative to the baseline, to the last.
                let scratch =
                    scratch.get_mut(..expected).ok_or_else(|| too_short(expected, found))?;
                let frames = WholeFrames { networks, relative: self.relative, rows };
                Ok(frames.decode(frame, scratch, estimate))
            }
            Networks::OfRows(networks) => {
                let expected = floats_of_rows(inputs, self.relative);
                let found = scratch.len();
                let scratch =
                    scratch.get_mut(..expected).ok_or_else(|| too_short(expected, found))?;
                let (scaled, more) = scratch
                    .split_at_mut_checked(inputs)
                    .ok_or_else(|| too_short(expected, found))?;
                let rows = Rows { networks, inputs, outputs };
                Ok(if self.relative {
                    rows.decode::<true>(frame, [scaled, more], estimate)
                } else {
                    rows.decode::<false>(frame, [scaled, more], estimate)
                })
            }
        }
    }
}

impl<N> FrameDecoder<'_, '_, N> {
    /// Number of floats of working space that decoding needs.
    #[inline(always)]
    pub const fn scratch_floats(&self) -> usize {
        let ModelShape { rows, inputs, .. } = self.shape;
        let mut fronts = match self.networks {
            Networks::OfRows(_) => return floats_of_rows(inputs, self.relative),
            Networks::OfFrames(networks) => networks,
        };
        let mut most = 0;
        while let [(front, _), rest @ ..] = fronts {
            let floats = floats_of_front(front, inputs.saturating_mul(rows), self.relative);
            if floats > most {
                most = floats;
            }
            fronts = rest;
        }
        most
    }
}

/// Networks that decode a frame row by row.
struct Rows<'d, N> {
    networks: &'d [N],
    /// Number of readings a row.
    inputs: usize,
    /// Number of outputs a row.
    outputs: usize,
}

impl<N: Infer> Rows<'_, N> {
    /// Decodes the rows of a frame. The scratch is room for scaled inputs, and for readings relative to the baseline if
    /// the networks take them (`RELATIVE`). Returns whether an input was clamped.
    #[inline(always)]
    fn decode<const RELATIVE: bool>(
        &self,
        frame: Frame<'_>,
        [scaled, ratios]: [&mut [f32]; 2],
        estimate: &mut Estimate<'_>,
    ) -> bool {
        let mut any_clamped = false;
        // A model has at least one input and one output a row; `max` tells the compiler.
        let readings = frame.readings_ohm.chunks_exact(self.inputs.max(1));
        let outputs = estimate.outputs.chunks_exact_mut(self.outputs.max(1));
        let places = outputs.zip(estimate.status.iter_mut());
        let rows = self.networks.iter().zip(readings).zip(places);
        for (row, ((network, readings), (outputs, status))) in rows.enumerate() {
            let given = if RELATIVE {
                let start = row.saturating_mul(self.inputs);
                divide(readings, frame.reciprocals.get(start..).unwrap_or_default(), ratios);
                &*ratios
            } else {
                readings
            };
            let scaled = &mut *scaled;
            any_clamped |= network.infer_row(Row { inputs: given, scaled, outputs, status });
        }
        any_clamped
    }
}

/// Writes the `readings` relative to the baseline to `ratios`, from the baseline's `reciprocals`; NaN where there
/// is none.
#[cfg_attr(cortex_m4f, inline(never))]
fn divide(readings: &[f32], reciprocals: &[f32], ratios: &mut [f32]) {
    ratios.fill(f32::NAN);
    for ((ratio, reading), reciprocal) in ratios.iter_mut().zip(readings).zip(reciprocals) {
        *ratio = relative(*reading, *reciprocal);
    }
}

/// Networks that see whole frames, each of which gives some of the outputs.
struct WholeFrames<'d, 'a, N> {
    networks: &'d [(Front<'a>, N)],
    /// Whether inputs are relative to the baseline.
    relative: bool,
    /// Number of rows, which share a status.
    rows: usize,
}

impl<N: Infer> WholeFrames<'_, '_, N> {
    /// Decodes a frame. Returns whether an input of a network was clamped, and the frame was decoded. Not inlined, because
    /// decoding by rows would need its stack too.
    #[inline(never)]
    fn decode(&self, frame: Frame<'_>, scratch: &mut [f32], estimate: &mut Estimate<'_>) -> bool {
        let mut rest = &mut *estimate.outputs;
        let (mut any_clamped, mut worst) = (false, RowStatus::Decoded);
        for (front, network) in self.networks {
            let Some((outputs, more)) = rest.split_at_mut_checked(front.outputs) else { break };
            rest = more;
            let (clamped, status) = self.decode_part(front, network, frame, scratch, outputs);
            any_clamped |= clamped && status == RowStatus::Decoded;
            if severity(status) > severity(worst) {
                worst = status;
            }
        }
        let statuses = estimate.status.get_mut(..self.rows).unwrap_or_default();
        statuses.fill(worst);
        any_clamped && severity(worst) < severity(RowStatus::Overflow)
    }

    /// Decodes the `outputs` of one network, and returns whether an input was clamped, and their status.
    #[inline(always)]
    fn decode_part(
        &self,
        front: &Front<'_>,
        network: &N,
        frame: Frame<'_>,
        scratch: &mut [f32],
        outputs: &mut [f32],
    ) -> (bool, RowStatus) {
        let readings = frame.readings_ohm;
        let missing = (false, RowStatus::MissingReading);
        let split = |scratch, at| <[f32]>::split_at_mut_checked(scratch, at);
        let Some((scaled, more)) = split(scratch, front.inputs(readings.len())) else {
            return missing;
        };
        let features = front.projection.map_or(0, |it| it.features());
        let Some((features, seen)) = split(more, features) else { return missing };
        let reciprocals = self.relative.then_some(frame.reciprocals);
        let mut strength = 0.0;
        let inputs = match (&front.touch, reciprocals) {
            (Some(touch), _) => {
                let Some(seen) = seen.get_mut(..touch.inputs()) else { return missing };
                strength = touch.apply(readings, reciprocals, seen);
                &*seen
            }
            (None, Some(reciprocals)) => {
                let Some(seen) = seen.get_mut(..readings.len()) else { return missing };
                divide(readings, reciprocals, seen);
                &*seen
            }
            (None, None) => readings,
        };
        let inputs = match front.projection {
            Some(projection) => {
                projection.project(inputs, features);
                &*features
            }
            None => inputs,
        };
        let mut status = RowStatus::Decoded;
        let row = Row { inputs, scaled, outputs: &mut *outputs, status: &mut status };
        let clamped = network.infer_row(row);
        // Features can overflow although no reading is missing.
        if status == RowStatus::MissingReading && self.is_complete(frame) {
            status = RowStatus::Overflow;
        }
        if let (Some(touch), RowStatus::Decoded) = (&front.touch, status) {
            status = with_strength(touch, strength, network.can_overflow(), outputs);
        }
        (clamped, status)
    }

    /// Whether no reading of a frame is missing, nor its baseline.
    #[cold]
    fn is_complete(&self, frame: Frame<'_>) -> bool {
        let has_baseline = frame.reciprocals.len() == frame.readings_ohm.len();
        all_finite(frame.readings_ohm)
            && (!self.relative || has_baseline && all_finite(frame.reciprocals))
    }
}

/// Makes `outputs` of a network what they are at this `strength`: amounts are multiplied by it, and places are NaN
/// without a touch. Returns their status.
#[inline(always)]
fn with_strength(
    touch: &Touch<'_>,
    strength: f32,
    can_overflow: bool,
    outputs: &mut [f32],
) -> RowStatus {
    let Some(factor) = touch.factor(strength) else {
        outputs.fill(f32::NAN);
        return RowStatus::NoTouch;
    };
    if touch.kind() == Kind::Place {
        return RowStatus::Decoded;
    }
    #[cfg(cortex_m4f)]
    cortex_m4::multiply(outputs, factor);
    #[cfg(not(cortex_m4f))]
    outputs.iter_mut().for_each(|output| *output *= factor);
    if can_overflow && !all_finite(outputs) {
        outputs.fill(f32::NAN);
        return RowStatus::Overflow;
    }
    RowStatus::Decoded
}

/// Order of the statuses of networks that see the same frame: that of the frame is the highest.
fn severity(status: RowStatus) -> u8 {
    match status {
        RowStatus::Decoded => 0,
        RowStatus::NoTouch => 1,
        RowStatus::Overflow => 2,
        RowStatus::MissingReading => 3,
    }
}

/// Number of floats for decoding rows: scaled inputs, and readings relative to the baseline.
pub const fn floats_of_rows(inputs: usize, relative: bool) -> usize {
    inputs.saturating_add(if relative { inputs } else { 0 })
}

/// Number of floats for decoding whole frames of so many `readings` behind a `front`: scaled inputs, features, and shape
/// and strength or readings relative to the baseline.
pub const fn floats_of_front(front: &Front<'_>, readings: usize, relative: bool) -> usize {
    let seen = match &front.touch {
        Some(touch) => touch.inputs(),
        None if relative => readings,
        None => 0,
    };
    let features = match &front.projection {
        Some(projection) => projection.features(),
        None => 0,
    };
    front.inputs(readings).saturating_add(features).saturating_add(seen)
}

fn check_length<T>(what: &'static str, slice: &[T], expected: usize) -> Result<(), NetworkError> {
    let found = slice.len();
    if found == expected { Ok(()) } else { Err(NetworkError::Length { what, expected, found }) }
}
