//! Blobs of random designs, with numbers that make no difference to their cost.

use std::ops::RangeInclusive;

use taxel_core::blob::{Floats, Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::projection::Projection;
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_data::{Purpose, Random, Stream};
use taxel_learn::cost::{Design, NetworkDesign};

use crate::process::Outcome;

/// Most bytes of parameters: the image's slot holds 131,072, with names and headers.
const MOST_BYTES: usize = 80_000;

/// Most readings, and most outputs, of a frame that the image has room for.
const MOST_OF_FRAME: usize = 2000;

/// Middle of every input's training range.
const MIDDLE: f32 = 60.0;

/// Sizes of a design: each is drawn from one of these ranges.
type Ranges = &'static [RangeInclusive<usize>];

/// Ranges of rows, inputs, outputs and centres.
pub type Sizes = [Ranges; 4];

/// Designs as users have them.
pub const USUAL: Sizes = [&[1..=16], &[1..=64], &[1..=48], &[4..=256]];

/// Designs that bring out every branch of the code: sizes at which it changes are frequent. Of `f32`, those of 18
/// inputs and outputs are.
pub const TELLING: Sizes = [
    &[1..=1, 2..=8],
    &[1..=17, 1..=17, 18..=18, 18..=18, 19..=40, 100..=150],
    &[1..=6, 7..=17, 18..=18, 18..=18, 19..=72],
    &[1..=48, 1..=48, 120..=140, 250..=264, 500..=530],
];

/// So many random designs that fit the image, of all formats in turn, whose rows share one network. `part` names those of
/// one purpose.
pub fn random(count: usize, sizes: Sizes, part: u64) -> Vec<Design> {
    let mut random = Random::new(1, Stream::Test, Purpose::Centres, part, 0);
    let mut fitting = std::iter::repeat_with(|| draw(sizes, &mut random)).flatten();
    let formats = Format::ALL.into_iter().cycle().take(count);
    formats
        .filter_map(|format| fitting.find(|design| design.networks[0].format == format))
        .collect()
}

fn draw(sizes: Sizes, random: &mut Random) -> Option<Design> {
    let format = Format::ALL[random.below(Format::ALL.len())];
    let [rows, inputs, outputs, centres] = sizes.map(|ranges| {
        let range = &ranges[random.below(ranges.len())];
        range.start() + random.below(range.end() - range.start() + 1)
    });
    let [tail, array, relative] = [0.5, 0.3, 0.3].map(|part| random.unit() < part);
    let shape = ModelShape { rows, inputs, outputs };
    let design = if array { Design::of_array } else { Design::of_rows };
    let mut design = design(shape, format, centres, tail);
    design.networks.truncate(1);
    design.row_network.fill(0);
    design.relative_inputs = relative;
    let fits = design.parameter_bytes() <= MOST_BYTES;
    let fits = fits && rows * inputs <= MOST_OF_FRAME && rows * outputs <= MOST_OF_FRAME;
    fits.then(|| design.in_ram_if_it_fits())
}

/// A blob of this `design`, whose rows share one network.
///
/// # Errors
/// The design is beyond what a format or the blob holds.
pub fn blob(design: &Design) -> Outcome<Vec<u8>> {
    let failed = |cause: &dyn ToString| format!("{design:?}: {}", cause.to_string());
    let first = design.networks.first().ok_or("no network")?;
    let words = words(first);
    let network = network(first, &words).map_err(|cause| failed(&cause))?;
    let ModelShape { rows, inputs, .. } = design.shape;
    let readings = rows * inputs;
    let features = if design.projection { design.features() } else { inputs };
    // Feature i is reading i of the first row.
    let mut block = vec![0.0; features * (1 + readings)];
    (0..features).for_each(|i| block[features * (1 + i) + i] = 1.0);
    let projection = Projection::new(readings, features, &block).map_err(|it| failed(&it))?;
    let parts = ModelParts {
        projection: design.projection.then_some(projection),
        confidence: None,
        linear_rmse: Floats(&[]),
        fill: None,
        networks: &[network],
        row_network: &vec![0; rows],
        metadata: Metadata {
            relative_inputs: design.relative_inputs,
            ..Metadata::unnamed(design.shape)
        },
    };
    encode_to_vec(&parts).map(|bytes| bytes.to_vec()).map_err(|cause| failed(&cause))
}

/// The block of a network.
fn words(design: &NetworkDesign) -> Vec<u32> {
    let Shape { inputs, centres, outputs } = design.shape;
    let (middle, per_unit) = (vec![MIDDLE; inputs], vec![1e8; inputs]);
    let bias = vec![0.5; outputs];
    let tail = if design.affine_tail { inputs * outputs } else { 0 };
    match design.format {
        Format::F32 => {
            // Exponentials branch by their arguments: these are spread as a trained network's are.
            let mut random = Random::new(1, Stream::Training, Purpose::Centres, 0, 0);
            let mut centre = |_| {
                let spread = random.between([0.0, 3.0]);
                (0..inputs).map(|_| (0.5 + spread * (random.unit() - 0.5)) as f32).collect()
            };
            let places: Vec<Vec<f32>> = (0..centres).map(&mut centre).collect();
            let parameters = float32::Parameters {
                input_minimum: &vec![MIDDLE - 10.0; inputs],
                input_per_span: &vec![0.05; inputs],
                centres: &places.concat(),
                decay: &vec![12.0 / inputs as f32; centres],
                output_weights: &vec![0.5; centres * outputs],
                bias: &bias,
                affine: &vec![0.25; tail],
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
    let NetworkDesign { format, shape, affine_tail } = *design;
    let network = match format {
        Format::F32 => float32::Network::of_words(shape, affine_tail, words).map(Network::from),
        Format::Fixed16 => fixed16::Network::try_new(shape, affine_tail, words).map(Network::from),
    };
    network.map_err(|cause| cause.to_string())
}

#[cfg(test)]
mod tests {
    use taxel_learn::ModelBlob;

    use super::*;

    #[test]
    fn a_blob_has_the_design_that_was_drawn() {
        for design in [random(30, USUAL, 1), random(30, TELLING, 2)].concat() {
            let blob = ModelBlob::of_bytes(&blob(&design).unwrap()).unwrap();
            let found = Design { weights_in_ram: design.weights_in_ram, ..Design::new(&blob) };
            assert_eq!(found, design);
        }
    }
}
