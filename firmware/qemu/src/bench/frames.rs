//! Frames of any shape.

use core::hint::black_box;

use defmt::{assert, unwrap};
use qemu_image::checks::Numbers;
use taxel_core::blob::{Model, ModelShape};
use taxel_core::filter::{Settings, State};
use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Estimate, RowStatus};

use super::region::region;
use super::{BASELINE_OHM, inputs};

/// Most rows of a model.
const MOST_ROWS: usize = 32;

/// RAM of which slices are taken one after the other.
pub struct Arena(pub &'static mut [f32]);

impl Arena {
    /// Takes so many `floats`, filled with 0.
    pub fn take(&mut self, floats: usize) -> &'static mut [f32] {
        let (taken, rest) = unwrap!(
            core::mem::take(&mut self.0).split_at_mut_checked(floats),
            "the model's frames are too large for the RAM"
        );
        self.0 = rest;
        taken.fill(0.0);
        taken
    }
}

/// A frame in Ω within the training range of `model`, row after row.
#[inline(never)]
pub fn frame(model: &Model<'_>, arena: &mut Arena) -> &'static mut [f32] {
    let ModelShape { rows, inputs, .. } = model.shape();
    let features = model.projection().map_or(inputs, |projection| projection.features());
    let (frame, features) = (arena.take(rows * inputs), arena.take(features));
    inputs::fill(model, frame, features, &mut Numbers::new(3));
    frame
}

/// Outputs and status of all rows.
struct Outcome {
    outputs: &'static mut [f32],
    status: [RowStatus; MOST_ROWS],
    rows: usize,
}

impl Outcome {
    fn new(shape: ModelShape, arena: &mut Arena) -> Self {
        let (rows, status) = (shape.rows, [RowStatus::MissingReading; MOST_ROWS]);
        Self { outputs: arena.take(rows * shape.outputs), status, rows }
    }

    fn status(&self) -> &[RowStatus] {
        self.status.get(..self.rows).unwrap_or_default()
    }

    fn estimate(&mut self) -> Estimate<'_> {
        let status = self.status.get_mut(..self.rows).unwrap_or_default();
        Estimate { outputs: self.outputs, status }
    }

    /// Decodes `frame` as the firmware does.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the firmware's call alone is measured")]
    fn decode(
        &mut self,
        decoder: &Decoder<'_, MOST_ROWS>,
        frame: taxel_core::Frame<'_>,
        scratch: &mut [f32],
    ) {
        let mut estimate = self.estimate();
        let _ = decoder.decode_into(frame, scratch, &mut estimate);
    }
}

/// What is decoded in every scope.
struct Bench<'a> {
    decoder: Decoder<'a, MOST_ROWS>,
    frame: &'a [f32],
    reciprocals: &'a [f32],
    outcome: Outcome,
    scratch: &'a mut [f32],
}

/// Measures frames of `model`.
#[inline(never)]
pub fn measure(model: &Model<'_>, frame: &[f32], arena: &mut Arena) {
    let mut bench = bench(model, frame, arena);
    let format = unwrap!(model.networks().next()).format();
    bench.measure(format.name());
    bench.filter(format.name(), arena);
    if model.confidence().is_some() {
        bench.assess(format.name(), arena);
    }
}

#[inline(never)] // frees the stack that building the decoder needs
fn bench<'a>(model: &Model<'a>, frame: &'a [f32], arena: &mut Arena) -> Bench<'a> {
    let shape = model.shape();
    let decoder = unwrap!(Decoder::new(*model).ok(), "the model has too many rows");
    let relative = model.metadata().relative_inputs;
    let reciprocals = arena.take(if relative { frame.len() } else { 0 });
    reciprocals.fill(reciprocal(BASELINE_OHM));
    let scratch = arena.take(decoder.scratch_floats());
    let outcome = Outcome::new(shape, arena);
    Bench { decoder, frame, reciprocals, outcome, scratch }
}

impl Bench<'_> {
    #[inline(never)]
    fn measure(&mut self, name: &str) {
        let Self { decoder, frame, reciprocals, outcome, scratch } = self;
        let scope = if decoder.model().projection().is_some() { "array-frame" } else { "frame" };
        let frame = taxel_core::Frame { readings_ohm: frame, reciprocals };
        region(name, scope, || {
            outcome.decode(black_box(decoder), black_box(frame), black_box(scratch));
        });
        let all = outcome.status().iter().all(|row| *row == RowStatus::Decoded);
        assert!(all, "a row is not decoded in {=str}", scope);
    }

    /// Measures the filter in time of a frame a millisecond after another.
    #[inline(never)]
    fn filter(&mut self, name: &str, arena: &mut Arena) {
        let settings = Settings { time_constant_us: 5000, lead_us: 1000 };
        let tracks = arena.take(2 * self.outcome.outputs.len()).as_chunks_mut().0;
        let mut state = State::new(tracks);
        let mut estimate = self.outcome.estimate();
        state.filter(settings, 0, &mut estimate);
        region(name, "filter", || {
            black_box(&mut state).filter(black_box(settings), 1000, black_box(&mut estimate));
        });
    }

    /// Measures how far off the frame's outputs may be, and how novel it is.
    #[inline(never)]
    fn assess(&mut self, name: &str, arena: &mut Arena) {
        let deviation = arena.take(self.outcome.outputs.len());
        let frame = taxel_core::Frame { readings_ohm: self.frame, reciprocals: self.reciprocals };
        let mut novelty = None;
        region(name, "confidence", || {
            let frame = black_box(frame);
            novelty =
                self.decoder.assess_into(frame, black_box(self.scratch), deviation).ok().flatten();
        });
        let sound = novelty.is_some_and(|nats| nats > -1e3 && nats < 1e3);
        assert!(sound && deviation.iter().all(|value| *value > 0.0), "the frame is not near");
    }
}
