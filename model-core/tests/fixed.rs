//! Networks of fixed size infer what networks of slices infer, to the bit.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_core::blob::{Metadata, ModelParts, ModelShape, encode_to_vec};
use taxel_core::rbf::Shape;
use taxel_core::rbf::float32::{Network, Parameters};
use taxel_core::{Decoder, Fixed};

const SHAPE: Shape = Shape { inputs: 7, centres: 5, outputs: 3 };
type Small = Fixed<7, 5, 3>;

struct Numbers(Xoshiro256PlusPlus);

impl Numbers {
    /// Next number about `middle`, at most `reach` from it.
    fn draw(&mut self, middle: f32, reach: f32) -> f32 {
        let half = (1_u32 << 31) as f32;
        middle + reach * (self.0.next_u32() as f32 / half - 1.0)
    }

    fn array<const N: usize>(&mut self, middle: f32, reach: f32) -> [f32; N] {
        core::array::from_fn(|_| self.draw(middle, reach))
    }
}

fn numbers() -> Numbers {
    Numbers(Xoshiro256PlusPlus::seed_from_u64(1))
}

fn network(numbers: &mut Numbers) -> Small {
    Small {
        input_minimum: numbers.array(54.0, 1.0),
        input_per_span: numbers.array(0.08, 0.01),
        centres: core::array::from_fn(|_| numbers.array(0.5, 0.5)),
        decay: numbers.array(0.75, 0.5),
        output_weights: core::array::from_fn(|_| numbers.array(0.0, 1.0)),
        bias: numbers.array(0.0, 1.0),
        affine: core::array::from_fn(|_| numbers.array(0.0, 0.1)),
    }
    .checked()
}

/// Number of frames that `fixed` infers otherwise than a decoder of the `parameters` does: of frames within the
/// training range, far beyond it, and with readings that are missing or infinite.
fn different(fixed: &Small, parameters: Parameters<'_>, numbers: &mut Numbers) -> usize {
    let network = Network::try_new(SHAPE, parameters).unwrap();
    let shape = ModelShape { rows: 1, inputs: 7, outputs: 3 };
    let blob =
        encode_to_vec(&ModelParts::new(&[network.into()], &[0], Metadata::unnamed(shape))).unwrap();
    let decoder = Decoder::<1>::load(&blob).unwrap();
    let odd =
        [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -0.0, 1e-45];
    let frames = (0..1000).map(|frame: usize| {
        let mut readings = numbers.array(60.0, [5.0, 9.0, 1e3, 3e38][frame % 4]);
        if frame.is_multiple_of(5) {
            readings[frame / 5 % 7] = odd[frame / 5 % odd.len()];
        }
        let of_blob = decoder.decode(&readings[..]).unwrap();
        let bits = |outputs: &[f32]| outputs.iter().map(|y| y.to_bits()).collect::<Vec<_>>();
        bits(&fixed.infer(&readings)) != bits(&of_blob.outputs)
    });
    frames.filter(|different| *different).count()
}

#[test]
fn a_network_of_fixed_size_infers_as_its_blob() {
    let mut numbers = numbers();
    let own_widths = network(&mut numbers);
    assert_eq!(different(&own_widths, own_widths.parameters(), &mut numbers), 0);
    // A tail of zeros and a width repeated change no bit.
    let plain = Small { decay: [0.7; 5], affine: [[0.0; 3]; 7], ..network(&mut numbers) };
    let parameters = Parameters { decay: &[0.7; 5], affine: &[], ..plain.parameters() };
    assert_eq!(different(&plain, parameters, &mut numbers), 0);
    let overflows = Small { output_weights: [[3e38; 3]; 5], ..network(&mut numbers) };
    assert_eq!(different(&overflows, overflows.parameters(), &mut numbers), 0);
    assert!(overflows.infer(&[60.0; 7]).iter().all(|y| y.is_nan()));
}

#[test]
fn numbers_that_are_not_sound_are_named() {
    let sound = || network(&mut numbers());
    let mut decay = sound();
    decay.decay[4] = 0.0;
    let mut span = sound();
    span.input_per_span[0] = -0.1;
    let mut weight = sound();
    weight.output_weights[2][1] = f32::INFINITY;
    let mut tail = sound();
    tail.affine[6][2] = f32::NAN;
    for (network, says) in [
        (decay, "a decay is not a positive number"),
        (span, "a span is negative"),
        (weight, "a weight is not finite"),
        (tail, "the affine tail is not finite"),
    ] {
        let cause = std::panic::catch_unwind(|| network.checked()).unwrap_err();
        let cause = cause.downcast_ref::<&str>().unwrap();
        assert!(cause.contains(says), "{cause}");
    }
}
