//! Blobs of any design, with numbers that make no difference to their cost.

use model_core::blob::{Metadata, ModelParts, encode_to_vec};
use model_core::confidence::Confidence;
use model_core::expansion::Expansion;
use model_core::projection::Projection;
use model_core::rbf::{Format, Network, Shape, direct, expanded, fixed16};
use model_core::scale::UNITS;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::cost::{Design, NetworkDesign};

use crate::process::Outcome;

/// Middle of every input's training range.
const MIDDLE: f32 = 60.0;

/// A blob of this `design`.
pub fn blob(design: &Design) -> Outcome<Vec<u8>> {
    blob_with(design, None)
}

/// A blob of this `design`, with a `confidence`.
pub fn blob_with(design: &Design, confidence: Option<Confidence<'_>>) -> Outcome<Vec<u8>> {
    let words: Vec<Vec<u32>> = design.networks.iter().map(words).collect();
    let networks = design.networks.iter().zip(&words);
    let networks: Vec<Network<'_>> =
        networks.map(|(design, words)| network(design, words)).collect::<Outcome<_>>()?;
    let row_network: Vec<u8> = if design.projection {
        vec![0; design.shape.rows]
    } else {
        design.row_network.iter().map(|index| *index as u8).collect()
    };
    let readings = design.shape.rows * design.shape.inputs;
    let features = if design.projection { design.features() } else { design.shape.inputs };
    // Feature i is reading i of the first row.
    let mut block = vec![0.0; features * (1 + readings)];
    (0..features).for_each(|i| block[features * (1 + i) + i] = 1.0);
    let projection =
        Projection::new(readings, features, &block).map_err(|cause| cause.to_string())?;
    let (components, outputs) =
        (design.components.unwrap_or(1), design.shape.rows * design.shape.outputs);
    let parts_of_components = vec![0.25; outputs * (1 + components)];
    let expansion = Expansion::new(components, outputs, &parts_of_components)
        .map_err(|cause| cause.to_string())?;
    let mut metadata = Metadata::unnamed(design.shape);
    metadata.relative_inputs = design.relative_inputs;
    let parts = ModelParts {
        projection: design.projection.then_some(projection),
        expansion: design.components.map(|_| expansion),
        confidence,
        fill: None,
        networks: &networks,
        row_network: &row_network,
        metadata,
    };
    encode_to_vec(&parts).map(|bytes| bytes.to_vec()).map_err(|cause| cause.to_string())
}

/// The block of a network.
fn words(design: &NetworkDesign) -> Vec<u32> {
    let Shape { inputs, centres, outputs } = design.shape;
    let (middle, per_unit) = (vec![MIDDLE; inputs], vec![1e8; inputs]);
    let bias = vec![0.5; outputs];
    let tail = if design.affine_tail { inputs * outputs } else { 0 };
    match design.format {
        Format::F32Direct => {
            let widths = if design.common_width { 1 } else { centres };
            // Exponentials branch by their arguments: these are spread as a trained network's are.
            let mut random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
            let mut centre = |_| {
                let spread = random.between([0.0, 3.0]);
                (0..inputs).map(|_| (0.5 + spread * (random.unit() - 0.5)) as f32).collect()
            };
            let places: Vec<Vec<f32>> = (0..centres).map(&mut centre).collect();
            let parameters = direct::Parameters {
                input_minimum: &vec![MIDDLE - 10.0; inputs],
                input_per_span: &vec![0.05; inputs],
                centres: &places.concat(),
                decay: &vec![12.0 / inputs as f32; widths],
                output_weights: &vec![0.5; centres * outputs],
                bias: &bias,
                affine: &vec![0.25; tail],
            };
            parameters.words().collect()
        }
        Format::F32 => {
            let stored = centres.next_multiple_of(expanded::CENTRES_AT_ONCE);
            let parameters = expanded::Parameters {
                input_midpoint: &middle,
                input_per_unit: &per_unit,
                decay: 1.0 / inputs as f32 / UNITS / UNITS,
                bias: &bias,
                affine: &vec![0.0; tail],
                exponents: &vec![0.0; stored * (1 + inputs)],
                output_weights: &vec![0.25; stored * outputs],
            };
            parameters.words().collect()
        }
        Format::Fixed16 => {
            let mut group = vec![0; fixed16::words_at_once(design.shape)];
            let lines = group.chunks_exact_mut(1 + inputs.div_ceil(2));
            lines.take(fixed16::CENTRES_AT_ONCE).for_each(|line| line[0] = 1 << 26);
            let tail = if design.affine_tail { inputs.div_ceil(2) * outputs } else { 0 };
            let parameters = fixed16::Parameters {
                input_midpoint: &middle,
                input_per_unit: &per_unit,
                decay: 1 << 20,
                bias: &vec![1; outputs],
                output_scale: &vec![1e-6; outputs],
                affine: &vec![0; tail],
                centres: &group.repeat(centres.div_ceil(fixed16::CENTRES_AT_ONCE)),
            };
            parameters.words().collect()
        }
    }
}

fn network<'w>(design: &NetworkDesign, words: &'w [u32]) -> Outcome<Network<'w>> {
    let NetworkDesign { format, shape, affine_tail, common_width } = *design;
    let network = match format {
        Format::F32Direct => {
            direct::Network::of_words(shape, common_width, affine_tail, words).map(Network::from)
        }
        Format::F32 => expanded::Network::try_new(shape, affine_tail, words).map(Network::from),
        Format::Fixed16 => fixed16::Network::try_new(shape, affine_tail, words).map(Network::from),
    };
    network.map_err(|cause| format!("{format:?} {shape:?}: {cause}"))
}

#[cfg(test)]
mod tests {
    use model_core::blob::ModelShape;
    use taxel_learn::ModelBlob;

    use super::*;

    fn check(design: &Design) {
        let blob = ModelBlob::of_bytes(&blob(design).unwrap()).unwrap();
        assert_eq!(Design::of(&blob), *design);
        let names_and_headers = blob.bytes().len() - design.parameter_bytes();
        assert!(names_and_headers < 350, "{names_and_headers}");
    }

    #[test]
    fn a_blob_has_the_design_that_was_asked_for() {
        let shape = ModelShape { rows: 3, inputs: 7, outputs: 5 };
        for format in Format::ALL {
            for affine_tail in [false, true] {
                for design in [Design::of_rows, Design::of_array] {
                    let mut design = design(shape, format, 21, affine_tail);
                    design.relative_inputs = affine_tail;
                    check(&design);
                    if design.projection {
                        check(&design.with_components(4));
                    }
                }
            }
        }
    }
}
