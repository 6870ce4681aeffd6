//! Several networks of whole frames, two of them behind a touch: how a decoder decodes with them, and their blob.

use crate::common::worked_bytes;
use taxel_core::blob::{
    DecodeError, EncodeError, Front, Metadata, Model, ModelParts, ModelShape, encode_to_vec,
};
use taxel_core::projection::Projection;
use taxel_core::rbf::{Network, NetworkError, Shape, fixed16, float32};
use taxel_core::touch::{Kind, Touch, binary_logarithm};
use taxel_core::{AlignedBytes, Decoder, Frame, OwnedEstimate, RowStatus};

/// Touch of four readings: strengths, then levels 10 to 40 Ω with thresholds of 1 Ω.
#[rustfmt::skip]
pub const TOUCH: [f32; 13] = [1.0, 8.0, 2.0, 16.0, 0.0, 10.0, 1.0, 20.0, 1.0, 30.0, 1.0, 40.0, 1.0];
/// Projection of its five inputs: the first feature is the centroid of cells 1 to 4, the second the logarithm.
pub const CENTROID: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.0, 4.0, 0.0, 0.0, 1.0];
/// Changes of 3, 0.5, 6 and 0 Ω, so that the strength is 1 + 2 + 5.
const TOUCHED: [f32; 4] = [13.0, 20.5, 36.0, 40.0];

fn front(kind: Kind, projection: Option<Projection<'_>>) -> Front<'_> {
    Front { outputs: 1, touch: Touch::new(kind, &TOUCH).ok(), projection }
}

/// A network of one output, the affine tail and the bias alone.
fn linear(minimum: &[f32], per_span: &[f32], affine: &[f32], bias: f32) -> Network<'static> {
    let shape = Shape { inputs: affine.len(), centres: 1, outputs: 1 };
    let parameters = float32::Parameters {
        input_minimum: minimum,
        input_per_span: per_span,
        centres: &vec![0.0; affine.len()],
        decay: &[1.0],
        output_weights: &[0.0],
        bias: &[bias],
        affine,
    };
    let words: &'static [u32] = parameters.words().collect::<Vec<_>>().leak();
    float32::Network::of_words(shape, true, words).unwrap().into()
}

/// An amount of shape and logarithm of the strength.
fn amount(bias: f32) -> Network<'static> {
    let per_span = [0.5, 0.5, 0.5, 0.5, 0.125];
    linear(&[-1.0, -1.0, -1.0, -1.0, 0.0], &per_span, &[1.0, 0.0, 2.0, 0.0, 4.0], bias)
}

/// A blob of one row and four readings, with these networks behind these fronts.
fn encoded(
    networks: &[Network<'_>],
    fronts: &[Front<'_>],
    relative_inputs: bool,
) -> Result<AlignedBytes, EncodeError> {
    let shape = ModelShape { rows: 1, inputs: 4, outputs: networks.len() };
    let metadata = Metadata { relative_inputs, ..Metadata::unnamed(shape) };
    encode_to_vec(&ModelParts { fronts, ..ModelParts::new(networks, &[0], metadata) })
}

/// A place behind touch and projection, an amount with this `bias` behind a touch, and a sum of the readings.
pub fn three(bias: f32, relative_inputs: bool) -> AlignedBytes {
    let place = linear(&[0.0; 2], &[0.25, 0.125], &[2.0, 1.0], 0.5);
    let sum = linear(&[0.0; 4], &[0.015_625; 4], &[1.0; 4], 0.0);
    let plain = Front { outputs: 1, touch: None, projection: None };
    let of_place = front(Kind::Place, Projection::new(5, 2, &CENTROID).ok());
    let fronts = [of_place, front(Kind::Amount, None), plain];
    encoded(&[place, amount(bias), sum], &fronts, relative_inputs).unwrap()
}

fn decoded<'f>(blob: &[u8], frame: impl Into<Frame<'f>>) -> OwnedEstimate {
    Decoder::<1>::load(blob).unwrap().decode(frame).unwrap()
}

#[test]
fn three_networks_of_a_frame_decode_as_computed_by_hand() {
    // Shape 1/4, 0, 5/8, 0; logarithm of 8 + 8: 4. So the centroid is 17/8, scaled to 17/32.
    let expected = vec![0.5 + 17.0 / 16.0 + 0.5, 8.0 * (0.625 + 1.625 + 2.0 - 1.0), 109.5 / 64.0];
    let expected = OwnedEstimate { outputs: expected, status: vec![RowStatus::Decoded] };
    assert_eq!(decoded(&three(-1.0, false), &TOUCHED[..]), expected);
    let twice = TOUCHED.map(|reading| 2.0 * reading);
    let frame = Frame { reciprocals: &[0.5; 4], ..twice[..].into() };
    assert_eq!(decoded(&three(-1.0, true), frame), expected);
    // A touch nine times as strong, 64, is beyond the largest strength.
    let strong = decoded(&three(-1.0, false), &[29.0, 20.5, 76.0, 40.0][..]);
    let scaled = [18.0_f32, 45.0].map(|part| 0.5 * (part / 64.0 + 1.0));
    let amount = scaled[0] + 2.0 * scaled[1] + 0.5 * binary_logarithm(72.0) - 1.0;
    assert!((strong.outputs[1] - 16.0 * amount).abs() < 1e-4, "{strong:?} {amount}");
}

#[test]
fn without_a_touch_places_alone_are_missing() {
    let at_rest = decoded(&three(-1.0, false), &[10.0, 20.0, 30.0, 40.0][..]);
    assert_eq!(at_rest.status, [RowStatus::NoTouch]);
    let amount = 0.5 + 1.0 + 0.5 * binary_logarithm(9.0) - 1.0;
    assert!(at_rest.outputs[0].is_nan() && at_rest.outputs[2] == 100.0 / 64.0);
    assert!((at_rest.outputs[1] - amount).abs() < 1e-6, "{at_rest:?} {amount}");
}

#[test]
fn a_missing_reading_or_baseline_leaves_every_output_missing() {
    for missing in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut frame = TOUCHED;
        frame[1] = missing;
        let of_reading = decoded(&three(-1.0, false), &frame[..]);
        let reciprocals = &[0.5, missing, 0.5, 0.5];
        let of_baseline = decoded(&three(-1.0, true), Frame { reciprocals, ..TOUCHED[..].into() });
        for estimate in [of_reading, of_baseline] {
            assert_eq!(estimate.status, [RowStatus::MissingReading]);
            assert!(estimate.outputs.iter().all(|output| output.is_nan()));
        }
    }
}

#[test]
fn an_amount_that_overflows_by_the_strength_is_nan_alone() {
    let estimate = decoded(&three(3e38, false), &TOUCHED[..]);
    assert_eq!(estimate.status, [RowStatus::Overflow]);
    let finite: Vec<_> = estimate.outputs.iter().map(|output| output.is_finite()).collect();
    assert_eq!(finite, [true, false, true]);
}

#[test]
fn an_output_in_fixed16_that_could_overflow_is_refused_at_load() {
    let shape = Shape { inputs: 5, centres: 1, outputs: 1 };
    let with_scale = |scale: f32| {
        let mut centres = [0; 16 * 4 + 8];
        centres[..64].iter_mut().step_by(4).for_each(|exponent| *exponent = 1 << 30);
        let parameters = fixed16::Parameters {
            input_midpoint: &[0.0; 5],
            input_per_unit: &[1.0; 5],
            decay: 1 << 31,
            bias: &[1],
            output_scale: &[scale],
            affine: &[],
            centres: &centres,
        };
        let words: Vec<u32> = parameters.words().collect();
        let network = fixed16::Network::try_new(shape, false, &words).unwrap();
        encoded(&[network.into()], &[front(Kind::Amount, None)], false).map(drop)
    };
    // 2³¹ units times the largest strength, 2⁴, are 2³⁵.
    assert_eq!(with_scale(2_f32.powi(92)), Ok(()));
    let cause = NetworkError::NotFinite { what: "the largest output" };
    let refused = EncodeError::Refused(DecodeError::Network { index: 0, cause });
    assert_eq!(with_scale(2_f32.powi(93)), Err(refused));
}

#[test]
fn a_front_has_the_bytes_of_the_specification_and_is_read_back() {
    let blob = three(-1.0, false);
    let bytes = worked_bytes("worked front");
    let start = blob.windows(4).position(|it| it == [4, 1, 1, 2]).unwrap();
    assert_eq!(blob[start..][..bytes.len()], bytes);
    let model = Model::decode(&blob).unwrap();
    let touches: Vec<_> = model.fronts().map(|it| it.touch.map(|it| it.kind())).collect();
    assert_eq!(touches, [Some(Kind::Place), Some(Kind::Amount), None]);
    let centroid = model.fronts().find_map(|front| front.projection);
    assert_eq!(centroid, Projection::new(5, 2, &CENTROID).ok());
}

#[test]
fn networks_that_do_not_fit_their_fronts_are_refused() {
    let (network, of_amount) = (amount(0.0), front(Kind::Amount, None));
    let refused = |networks: usize, fronts: &[Front<'_>]| {
        encoded(&vec![network; networks], fronts, false).map(drop).unwrap_err()
    };
    let unfit = |index| EncodeError::UnfitFront { index };
    assert_eq!(refused(2, &[of_amount]), unfit(1));
    assert_eq!(refused(1, &[Front { outputs: 2, ..of_amount }]), unfit(0));
    let plain = Front { outputs: 1, touch: None, projection: None };
    assert_eq!(refused(2, &[of_amount, plain]), unfit(1), "five readings instead of four");
    let most = DecodeError::Malformed { section: "list of networks" };
    assert_eq!(refused(5, &[of_amount; 5]), EncodeError::Refused(most));
}

#[test]
fn a_network_of_places_clamps_nothing_without_a_touch() {
    let place = linear(&[10.0, 0.0], &[0.25, 0.125], &[2.0, 1.0], 0.5);
    let of_place = front(Kind::Place, Projection::new(5, 2, &CENTROID).ok());
    let blob = encoded(&[place], &[of_place], false).unwrap();
    let decoder = Decoder::<1>::load(&blob).unwrap();
    let clamps = |frame: &[f32]| {
        let mut estimate = OwnedEstimate { outputs: vec![0.0], status: vec![RowStatus::Decoded] };
        let mut scratch = vec![0.0; decoder.scratch_floats()];
        decoder.decode_into(frame.into(), &mut scratch, &mut estimate.borrowed()).unwrap()
    };
    assert!(clamps(&TOUCHED) && !clamps(&[10.0, 20.0, 30.0, 40.0]));
}
