//! Inference over whole tables, to the bit as on the device.
//!
//! Many lines are computed side by side, one in each lane of the processor's vectors. A lane goes through the device's
//! operations in the device's order.

use std::borrow::Cow;

use taxel_core::blob::Front;
use taxel_core::projection::Projection;
use taxel_core::rbf::Network;
use taxel_core::reading_model::{ReadingModel, Sizes};
use taxel_core::touch::Touch;
use taxel_data::simd::LANES;
use taxel_data::widest;

pub use self::column::Column;
use self::column::{blank, give, poison, take};
use crate::parallel;

mod column;
pub mod pairs;
mod float32;
mod fixed16;
mod front;

/// Lines that one thread takes at a time.
const LINES_AT_ONCE: usize = 4 * LANES;

/// Infers the outputs of `network` for every line of `readings` (`lines × inputs`): `lines × outputs`.
///
/// All outputs of a line are NaN if a reading is missing.
pub fn infer(network: &Network<'_>, readings: &[f64]) -> Vec<f64> {
    decode(&[], &[*network], readings)
}

/// Whether the device would take `reading` for missing: NaN, or beyond f32.
pub fn is_missing(reading: f64) -> bool {
    !(reading as f32).is_finite()
}

/// Decodes `inputs` of a model (`frames × inputs`) to outputs (`frames × outputs`), with `networks` of rows in turn, or with
/// those behind `fronts`.
///
/// All outputs of a network are NaN in frames where it misses an input or one of them overflows. Those that are places are
/// NaN without a touch as well.
pub(crate) fn decode(fronts: &[Front<'_>], networks: &[Network<'_>], inputs: &[f64]) -> Vec<f64> {
    let (mut parts, mut width, mut outputs) = (Vec::new(), 0, 0);
    for (index, network) in networks.iter().enumerate() {
        let front = fronts.get(index).copied();
        let first_input = if front.is_some() { 0 } else { width };
        parts.push(Part { network, front, first_input, first_output: outputs });
        width = first_input + parts[index].inputs();
        outputs += network.shape().outputs;
    }
    let steps = [width, outputs].map(|step| step.max(1));
    let mut values = vec![0.0; inputs.len() / steps[0] * outputs];
    parallel::fill(&mut values, LINES_AT_ONCE * steps[1], &|index, values| {
        let inputs = parallel::piece(inputs, LINES_AT_ONCE * steps[0], index);
        parts.iter().for_each(|part| part.decode(inputs, values, steps));
    });
    values
}

/// A network of a model, with its place in the lines of the model's tables.
struct Part<'n> {
    network: &'n Network<'n>,
    /// What stands before a network that sees whole frames.
    front: Option<Front<'n>>,
    first_input: usize,
    first_output: usize,
}

impl Part<'_> {
    /// Number of the model's inputs that it sees.
    fn inputs(&self) -> usize {
        self.front.and_then(|front| readings(&front)).unwrap_or(self.network.shape().inputs)
    }

    /// Decodes its `inputs` to its `outputs`, in lines that start every so many (`steps`) of the model's.
    fn decode(&self, inputs: &[f64], outputs: &mut [f64], steps: [usize; 2]) {
        let (network, shape) = (self.network, self.network.shape());
        let mut given = Given::new(self.front.as_ref(), self.inputs());
        let mut inferred = Column::zeros(shape.outputs);
        let mut scratch = fixed16::Scratch::new(shape);
        let [of_inputs, of_outputs] = steps.map(|step| step * LANES);
        for (inputs, outputs) in inputs.chunks(of_inputs).zip(outputs.chunks_mut(of_outputs)) {
            given.take(&inputs[self.first_input..], steps[0]);
            widest!({
                let strength = given.make();
                let scaled = given.inputs();
                let missing = poison(scaled);
                match network {
                    Network::F32(it) => float32::infer(it, scaled, &mut inferred),
                    Network::Fixed16(it) => fixed16::infer(it, scaled, &mut scratch, &mut inferred),
                }
                if let Some((touch, strength)) = strength {
                    front::with_strength(touch, &strength, &mut inferred);
                }
                let overflow = poison(&inferred);
                blank(&mut inferred, &missing);
                blank(&mut inferred, &overflow);
            });
            give(&inferred, &mut outputs[self.first_output..], steps[1]);
        }
    }
}

/// Number of readings that something stands before a network for; `None` if the network is given them.
fn readings(front: &Front<'_>) -> Option<usize> {
    let of_touch = front.touch.map(|touch| touch.readings());
    of_touch.or(front.projection.map(|projection| projection.readings()))
}

/// What a network is given of lines side by side.
struct Given<'n> {
    touch: Option<Touch<'n>>,
    projection: Option<Projection<'n>>,
    /// Readings, which become shape and strength.
    readings: Vec<Column>,
    features: Vec<Column>,
}

impl<'n> Given<'n> {
    fn new(front: Option<&Front<'n>>, readings: usize) -> Self {
        let touch = front.and_then(|front| front.touch);
        let projection = front.and_then(|front| front.projection);
        let features = Column::zeros(projection.map_or(0, |it| it.features()));
        let readings = Column::zeros(readings + usize::from(touch.is_some()));
        Self { touch, projection, readings, features }
    }

    /// Takes the readings of up to [`LANES`] lines, which start every `step` values.
    fn take(&mut self, lines: &[f64], step: usize) {
        let count = self.readings.len() - usize::from(self.touch.is_some());
        take(lines, step, &mut self.readings[..count]);
    }

    /// Makes the inputs of the network, and the strength of each line's touch.
    #[inline(always)]
    fn make(&mut self) -> Option<(Touch<'n>, Column)> {
        let strength = self.touch.map(|touch| (touch, front::apply(touch, &mut self.readings)));
        if let Some(projection) = self.projection {
            front::project(projection, &self.readings, &mut self.features);
        }
        strength
    }

    /// Inputs of the network, once they are made.
    #[inline(always)]
    fn inputs(&mut self) -> &mut [Column] {
        if self.projection.is_some() { &mut self.features } else { &mut self.readings }
    }
}

/// Inputs of the network behind `front` for `readings` (`frames × readings`), `frames × inputs`, and the strength of each
/// frame's touch; none without it. Readings that the network is given are not copied.
pub(crate) fn given<'r>(front: &Front<'_>, readings: &'r [f64]) -> (Cow<'r, [f64]>, Vec<f32>) {
    let Some(width) = self::readings(front) else { return (readings.into(), vec![]) };
    let inputs = front.inputs(width);
    let of_piece = |lines: &[f64]| {
        let mut values = vec![0.0; lines.len() / width * inputs];
        let mut strengths = Vec::new();
        let mut given = Given::new(Some(front), width);
        let places = values.chunks_mut(LANES * inputs);
        for (lines, places) in lines.chunks(LANES * width).zip(places) {
            given.take(lines, width);
            let made = widest!({ given.make() });
            give(given.inputs(), places, inputs);
            if let Some((_, strength)) = made {
                strengths.extend_from_slice(&strength.0[..lines.len() / width]);
            }
        }
        (values, strengths)
    };
    let pieces = parallel::pieces(readings, LINES_AT_ONCE * width, &of_piece);
    let (values, strengths): (Vec<_>, Vec<_>) = pieces.into_iter().unzip();
    (values.concat().into(), strengths.concat())
}

/// Deviations (`lines × outputs`) and novelty of every line of `inputs`, as a device computes them.
pub(crate) fn assess_lines(model: ReadingModel<'_>, inputs: &[f64]) -> (Vec<f32>, Vec<f64>) {
    let Sizes { readings, outputs, .. } = model.sizes();
    let of_piece = |lines: &[f64]| {
        let mut scratch = vec![0.0; model.sizes().scratch_floats()];
        let mut deviations = vec![0.0; lines.len() / readings * outputs];
        let lines = lines.chunks_exact(readings).zip(deviations.chunks_exact_mut(outputs));
        let assess = |(line, deviation): (&[f64], &mut [f32])| {
            let line: Vec<f32> = line.iter().map(|reading| *reading as f32).collect();
            let novelty = model.assess(&line, None, &mut scratch, deviation);
            f64::from(novelty.expect("lengths of the model").expect("a model with components"))
        };
        let novelty: Vec<f64> = lines.map(assess).collect();
        (deviations, novelty)
    };
    let (deviations, novelty): (Vec<_>, Vec<_>) =
        parallel::pieces(inputs, LINES_AT_ONCE * readings, &of_piece).into_iter().unzip();
    (deviations.concat(), novelty.concat())
}
