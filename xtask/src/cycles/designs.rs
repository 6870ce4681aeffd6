//! Designs of models to be measured: many for the prices of code, and others to check these.

use model_core::blob::ModelShape;
use model_core::rbf::Format;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::cost::Design;

/// Most bytes of parameters: the image's slot holds 131,072, with names and headers, and a second network of half as
/// many centres.
const MOST_BYTES: usize = 80_000;

/// Most readings, and most outputs, of a frame that the image has room for.
const MOST_OF_FRAME: usize = 2000;

/// Ranges of a design's sizes, each with its weight.
type Ranges<'r> = &'r [(usize, [usize; 2])];

/// Numbers of designs by format: enough for every piece of its code.
const FOR_PRICES: [(Format, usize); 3] =
    [(Format::F32, 360), (Format::Fixed16, 260), (Format::F32Direct, 180)];

/// Number of designs that check the prices.
const TO_CHECK: usize = 40;

/// Designs that bring out every branch of the code: sizes at which it changes are frequent.
pub fn for_prices() -> Vec<Design> {
    const ROWS: Ranges<'_> = &[(2, [1, 1]), (2, [2, 8])];
    const INPUTS: Ranges<'_> =
        &[(5, [1, 17]), (3, [18, 18]), (4, [19, 40]), (1, [60, 70]), (1, [100, 150])];
    const OUTPUTS: Ranges<'_> =
        &[(5, [1, 6]), (3, [7, 17]), (3, [18, 18]), (3, [19, 40]), (1, [41, 72])];
    const CENTRES: Ranges<'_> = &[(6, [1, 48]), (2, [120, 140]), (2, [250, 264]), (1, [500, 530])];
    // `f32-direct` has code of its own for 18 inputs and outputs.
    const MOSTLY_18: Ranges<'_> = &[(2, [18, 18]), (2, [1, 20]), (1, [21, 60])];
    let drawn = FOR_PRICES.iter().zip(0..).flat_map(|(&(format, count), part)| {
        let [inputs, outputs] =
            if format == Format::F32Direct { [MOSTLY_18; 2] } else { [INPUTS, OUTPUTS] };
        let mut random = Random::new(1, Stream::Training, Purpose::Centres, 0, part);
        let ranges = [ROWS, inputs, outputs, CENTRES];
        (0..count).map(move |_| draw(format, ranges, &mut random))
    });
    // Projections to every group of features, of odd and even numbers of readings.
    let features = (1..=24).flat_map(|inputs| [1, 2].map(|rows| (rows, inputs)));
    let arrays = features.map(|(rows, inputs)| {
        let shape = ModelShape { rows, inputs, outputs: 4 };
        Design::of_array(shape, Format::Fixed16, 16, false)
    });
    // Expansions, to outputs that are taken in groups of every size.
    let expanded = (1..=24).flat_map(|outputs| [1, 2, 3].map(|rows| (rows, outputs)));
    let expansions = expanded.map(|(rows, outputs)| {
        let shape = ModelShape { rows, inputs: 18, outputs };
        let format = Format::ALL[rows % Format::ALL.len()];
        Design::of_array(shape, format, 16, false).with_components(1 + outputs % 5)
    });
    drawn.chain(arrays).chain(expansions).collect()
}

/// Designs as users have them, of all formats in turn. In every third, rows have two networks by turns.
pub fn to_check() -> Vec<Design> {
    const SIZES: [Ranges<'_>; 4] =
        [&[(1, [1, 16])], &[(1, [1, 64])], &[(1, [1, 48])], &[(1, [4, 256])]];
    let mut random = Random::new(2, Stream::Test, Purpose::Centres, 0, 0);
    let design = |i: usize| {
        let mut design = draw(Format::ALL[i % Format::ALL.len()], SIZES, &mut random);
        if i.is_multiple_of(3) && !design.projection {
            let mut other = design.networks[0];
            other.format = Format::ALL[(i / 3) % Format::ALL.len()];
            other.shape.centres = other.shape.centres.div_ceil(2);
            (other.affine_tail, other.common_width) = (!other.affine_tail, true);
            design.networks.push(other);
            design.row_network = (0..design.shape.rows).map(|row| row % 2).collect();
        }
        design.in_ram_if_it_fits()
    };
    (0..TO_CHECK).map(design).collect()
}

/// A design of this `format`, with rows, inputs, outputs and centres from `ranges`, that fits the image. Its rows share
/// one network.
fn draw(format: Format, ranges: [Ranges<'_>; 4], random: &mut Random) -> Design {
    loop {
        let [rows, inputs, outputs, centres] = ranges.map(|ranges| size(ranges, random));
        let [tail, array, relative, widths] = [0.5, 0.3, 0.3, 0.3].map(|part| random.unit() < part);
        let shape = ModelShape { rows, inputs, outputs };
        let design = if array { Design::of_array } else { Design::of_rows };
        let mut design = design(shape, format, centres, tail);
        design.networks.truncate(1);
        design.row_network.fill(0);
        design.relative_inputs = relative;
        if array && widths {
            design = design.with_components(1 + centres % (rows * outputs));
        }
        if format == Format::F32Direct && widths && centres > 1 {
            design.networks[0].common_width = false;
        }
        let fits = design.parameter_bytes() <= MOST_BYTES;
        if fits && rows * inputs <= MOST_OF_FRAME && rows * outputs <= MOST_OF_FRAME {
            return design.in_ram_if_it_fits();
        }
    }
}

/// A size from one of `ranges`, both ends included.
fn size(ranges: Ranges<'_>, random: &mut Random) -> usize {
    let total: usize = ranges.iter().map(|(weight, _)| weight).sum();
    let mut at = random.below(total);
    for &(weight, [least, most]) in ranges {
        if at < weight {
            return least + random.below(most - least + 1);
        }
        at -= weight;
    }
    1
}
