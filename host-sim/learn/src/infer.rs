//! Inference over whole tables, to the bit as on the device.
//!
//! Many lines are computed side by side, one in each lane of the processor's vectors. A lane goes through the device's
//! operations in the device's order.

use taxel_core::blob::Front;
use taxel_core::confidence::{Confidence, Sizes};
use taxel_core::rbf::Network;
use taxel_data::simd::LANES;
use taxel_data::widest;

use self::column::{Column, blank, give, poison, take};
use crate::parallel;

mod column;
mod pairs;
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
        match self.front {
            Some(Front { touch: Some(touch), .. }) => touch.readings(),
            Some(Front { projection: Some(projection), .. }) => projection.readings(),
            _ => self.network.shape().inputs,
        }
    }

    /// Decodes its `inputs` to its `outputs`, in lines that start every so many (`steps`) of the model's.
    fn decode(&self, inputs: &[f64], outputs: &mut [f64], steps: [usize; 2]) {
        let (network, shape) = (self.network, self.network.shape());
        let touch = self.front.and_then(|front| front.touch);
        let projection = self.front.and_then(|front| front.projection);
        let seen = self.inputs();
        let mut given = Column::zeros(seen + usize::from(touch.is_some()));
        let mut features = Column::zeros(projection.map_or(0, |it| it.features()));
        let mut inferred = Column::zeros(shape.outputs);
        let mut scratch = fixed16::Scratch::new(shape);
        let [of_inputs, of_outputs] = steps.map(|step| step * LANES);
        for (inputs, outputs) in inputs.chunks(of_inputs).zip(outputs.chunks_mut(of_outputs)) {
            take(&inputs[self.first_input..], steps[0], &mut given[..seen]);
            widest!({
                let strength = touch.map(|touch| front::apply(touch, &mut given));
                let scaled = match projection {
                    Some(projection) => {
                        front::project(projection, &given, &mut features);
                        &mut features
                    }
                    None => &mut given,
                };
                let missing = poison(scaled);
                match network {
                    Network::F32(it) => float32::infer(it, scaled, &mut inferred),
                    Network::Fixed16(it) => fixed16::infer(it, scaled, &mut scratch, &mut inferred),
                }
                if let (Some(touch), Some(strength)) = (touch, strength) {
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

/// Deviations (`lines × outputs`) and novelty of every line of `inputs`, as a device computes them.
pub(crate) fn assess_lines(confidence: Confidence<'_>, inputs: &[f64]) -> (Vec<f32>, Vec<f64>) {
    let Sizes { readings, outputs, .. } = confidence.sizes();
    let of_piece = |lines: &[f64]| {
        let mut scratch = vec![0.0; confidence.sizes().scratch_floats()];
        let mut deviations = vec![0.0; lines.len() / readings * outputs];
        let lines = lines.chunks_exact(readings).zip(deviations.chunks_exact_mut(outputs));
        let assess = |(line, deviation): (&[f64], &mut [f32])| {
            let line = line.iter().map(|reading| *reading as f32);
            let novelty = confidence.assess(line, &mut scratch, deviation);
            f64::from(novelty.expect("lengths of the confidence"))
        };
        let novelty: Vec<f64> = lines.map(assess).collect();
        (deviations, novelty)
    };
    let (deviations, novelty): (Vec<_>, Vec<_>) =
        parallel::pieces(inputs, LINES_AT_ONCE * readings, &of_piece).into_iter().unzip();
    (deviations.concat(), novelty.concat())
}
