//! A decoder tells whether it clamped an input of a row that it decoded.

use proptest::prelude::*;
use taxel_core::blob::{Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_core::relative::{reciprocal, relative};
use taxel_core::scale::{CLAMP, HALF_RANGE, UNITS};
use taxel_core::{AlignedBytes, Decoder, Estimate, Frame, RowStatus};

const ROWS: usize = 2;
const INPUTS: usize = 3;
const SHAPE: Shape = Shape { inputs: INPUTS, centres: 4, outputs: 1 };

/// How a network scales an input: what it subtracts, and the factor.
type Scaling = ([f32; INPUTS], [f32; INPUTS]);

/// How a network of `format` scales inputs whose training ranges begin at `minimum` and have the length `span`.
fn scaling(format: Format, minimum: [f32; INPUTS], span: [f32; INPUTS]) -> Scaling {
    let place = |input: usize| match format {
        Format::F32 => (minimum[input], 1.0 / span[input]),
        Format::Fixed16 => (minimum[input] + 0.5 * span[input], UNITS / HALF_RANGE / span[input]),
    };
    ([0, 1, 2].map(|input| place(input).0), [0, 1, 2].map(|input| place(input).1))
}

/// A group of sixteen centres in 16-bit fixed point: exponents that do not depend on the inputs, and weights.
fn sixteen_centres() -> [u32; 16 * 3 + 8] {
    core::array::from_fn(|word| match word {
        0..48 if word % 3 == 0 => 1 << 30,
        0..48 => 0,
        _ => 1,
    })
}

/// A blob of two rows with one network, whose outputs do not matter.
fn blob(format: Format, (from, by): &Scaling, relative_inputs: bool) -> AlignedBytes {
    let words: Vec<u32> = match format {
        Format::F32 => float32::Parameters {
            input_minimum: from,
            input_per_span: by,
            centres: &[0.5; 12],
            decay: &[2.0; 4],
            output_weights: &[0.5; 4],
            bias: &[1.0],
            affine: &[],
        }
        .words()
        .collect(),
        Format::Fixed16 => fixed16::Parameters {
            input_midpoint: from,
            input_per_unit: by,
            decay: 1 << 31,
            bias: &[1],
            output_scale: &[1e-3],
            affine: &[],
            centres: &sixteen_centres(),
        }
        .words()
        .collect(),
    };
    let network: Network<'_> = match format {
        Format::F32 => float32::Network::of_words(SHAPE, false, &words).unwrap().into(),
        Format::Fixed16 => fixed16::Network::try_new(SHAPE, false, &words).unwrap().into(),
    };
    let shape = ModelShape { rows: ROWS, inputs: INPUTS, outputs: 1 };
    let metadata = Metadata { relative_inputs, ..Metadata::unnamed(shape) };
    let networks = &[network];
    encode_to_vec(&ModelParts::new(networks, &[0; ROWS], metadata)).unwrap()
}

/// What `decoder` says of a frame.
fn clamps(decoder: &Decoder<'_, ROWS>, frame: Frame<'_>) -> (bool, [RowStatus; ROWS]) {
    let (mut outputs, mut status) = ([0.0; ROWS], [RowStatus::Overflow; ROWS]);
    let mut estimate = Estimate { outputs: &mut outputs, status: &mut status };
    let clamped = decoder.decode_into(frame, &mut [0.0; 2 * INPUTS], &mut estimate).unwrap();
    (clamped, status)
}

/// Whether an `input` that is scaled so is clamped, by comparisons in f64.
fn is_clamped(format: Format, input: f32, from: f32, by: f32) -> bool {
    let scaled = f64::from((input - from) * by);
    let [low, high] = match format {
        Format::F32 => CLAMP.map(f64::from),
        Format::Fixed16 => [-f64::from(UNITS), f64::from(UNITS)],
    };
    scaled < low || scaled >= high
}

/// The number that is `steps` away from `value` among those of f32.
fn stepped(value: f32, steps: i32) -> f32 {
    f32::from_bits(value.to_bits().wrapping_add_signed(steps))
}

#[test]
fn a_channel_that_never_changed_is_never_clamped() {
    for format in Format::ALL {
        let (from, mut by) = scaling(format, [50.0; 3], [8.0; 3]);
        by[1] = 0.0;
        let blob = blob(format, &(from, by), false);
        let decoder = Decoder::load(&blob).unwrap();
        for reading in [-1e30, 0.0, 1e30] {
            assert!(!clamps(&decoder, [54.0, reading, 54.0, 54.0, reading, 54.0][..].into()).0);
        }
    }
}

#[test]
fn only_rows_that_are_decoded_are_told_of() {
    for format in Format::ALL {
        let blob = blob(format, &scaling(format, [50.0; 3], [8.0; 3]), false);
        let decoder = Decoder::load(&blob).unwrap();
        for missing in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let frame = [missing, 90.0, 54.0, 54.0, 54.0, 54.0];
            let status = [RowStatus::MissingReading, RowStatus::Decoded];
            assert_eq!(clamps(&decoder, frame[..].into()), (false, status), "{format:?}");
        }
    }
}

proptest! {
    #[test]
    fn a_frame_is_clamped_where_a_scaled_input_is_beyond_the_clamp(
        format in prop::sample::select(&Format::ALL[..]),
        relative_inputs: bool,
        minimum in prop::array::uniform3(-1e3..1e3_f32),
        span in prop::array::uniform3(1e-2..1e4_f32),
        place in 0..ROWS * INPUTS,
        upper: bool,
        steps in -6..=6_i32,
        share in prop::option::of(-0.2..1.2_f32),
    ) {
        let scaling = scaling(format, minimum, span);
        let blob = blob(format, &scaling, relative_inputs);
        let decoder = Decoder::load(&blob).unwrap();
        // One reading at an end of the clamp, or a few steps of f32 from it, or anywhere; the others in the middle.
        let reciprocals = [reciprocal(64.0); ROWS * INPUTS];
        let per_input = if relative_inputs { 64.0 } else { 1.0 };
        let at = |input: usize, share: f32| per_input * (minimum[input] + share * span[input]);
        let mut frame = [0, 1, 2, 0, 1, 2].map(|input| at(input, 0.5));
        let end = CLAMP[usize::from(upper)];
        frame[place] = share.map_or_else(
            || stepped(at(place % INPUTS, end), steps),
            |share| at(place % INPUTS, share),
        );
        let inputs = frame.map(|reading| {
            if relative_inputs { relative(reading, reciprocals[0]) } else { reading }
        });
        let expected = inputs.iter().enumerate().any(|(place, input)| {
            is_clamped(format, *input, scaling.0[place % INPUTS], scaling.1[place % INPUTS])
        });
        let given = Frame { reciprocals: &reciprocals, ..frame[..].into() };
        prop_assert_eq!(clamps(&decoder, given), (expected, [RowStatus::Decoded; ROWS]));
    }
}
