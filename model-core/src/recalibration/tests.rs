use super::*;
use crate::blob::{Floats, Metadata, ModelParts, encode_to_vec};
use crate::rbf::Shape;
use crate::rbf::direct::{self, Parameters};
use crate::{AlignedBytes, Decoder};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const ROWS: usize = 2;
const INPUTS: usize = 3;
const OUTPUTS: usize = 2;
const READINGS: usize = ROWS * INPUTS;
const ALL: usize = ROWS * OUTPUTS;

fn uniform(random: &mut Xoshiro256PlusPlus) -> f32 {
    (random.next_u64() >> 40) as f32 / (1_u64 << 24) as f32
}

/// A smooth model of two rows of three readings from 50 Ω to 60 Ω, with these training errors.
fn blob(row_network: &[u8], errors: [f32; ALL]) -> AlignedBytes {
    let number = |i: usize| ((i * 37) % 101) as f32 / 50.0 - 1.0;
    let list = |from: usize, count: usize| (from..from + count).map(number).collect::<Vec<_>>();
    let [centres, weights, affine] = [list(60, 12), list(20, 8), list(40, 6)];
    let network = |bias: &'static [f32; 2]| {
        let parameters = Parameters {
            input_minimum: &[50.0; INPUTS],
            input_per_span: &[0.1; INPUTS],
            centres: &centres,
            decay: &[0.5],
            output_weights: &weights,
            bias,
            affine: &affine,
        };
        let shape = Shape { inputs: INPUTS, centres: 4, outputs: OUTPUTS };
        direct::Network::try_new(shape, parameters).unwrap().into()
    };
    let networks = [network(&[0.5, -0.5]), network(&[1.0, 2.0])];
    let shape = ModelShape { rows: ROWS, inputs: INPUTS, outputs: OUTPUTS };
    let training_rmse = Floats::of(&errors);
    let metadata = Metadata { training_rmse, ..Metadata::unnamed(shape) };
    let count = 1 + usize::from(*row_network.iter().max().unwrap());
    let parts = ModelParts {
        projection: None,
        expansion: None,
        confidence: None,
        fill: None,
        networks: &networks[..count],
        row_network,
        metadata,
    };
    encode_to_vec(&parts).unwrap()
}

fn decode(blob: &[u8], readings: &[f32; READINGS]) -> [f32; ALL] {
    let decoder = Decoder::<ROWS>::load(blob).unwrap();
    decoder.decode(&readings[..]).unwrap().outputs.try_into().unwrap()
}

const ERROR: f32 = 0.02;
const SHIFTS: [f32; READINGS] = [6.0, -7.0, 3.0, -4.0, 8.0, 0.0];

/// A bench with a model, readings that are shifted by some Ω, and a recalibration that is going on.
struct Bench {
    blob: AlignedBytes,
    memory: Vec<f32>,
    random: Xoshiro256PlusPlus,
}

impl Bench {
    fn new() -> Self {
        let blob = blob(&[0, 1], [ERROR; ALL]);
        let floats = Recalibration::floats(&Model::decode(&blob).unwrap()).unwrap();
        Self { blob, memory: vec![0.0; floats], random: Xoshiro256PlusPlus::seed_from_u64(5) }
    }

    /// What the sensor read in training for a press, and what it is.
    fn draw(&mut self) -> ([f32; READINGS], [f32; ALL]) {
        let readings = core::array::from_fn(|_| 50.0 + 10.0 * uniform(&mut self.random));
        (readings, decode(&self.blob, &readings))
    }
}

fn shifted(readings: &[f32; READINGS], by: f32) -> [f32; READINGS] {
    core::array::from_fn(|i| readings[i] + by * SHIFTS[i])
}

/// Adds a press whose readings are shifted `by` that many times [`SHIFTS`].
fn press(
    recalibration: &mut Recalibration<'_>,
    blob: &[u8],
    (readings, stated): ([f32; READINGS], [f32; ALL]),
    by: f32,
) -> Result<(), RecalibrationError> {
    let readings = shifted(&readings, by);
    let decoded = decode(blob, &readings);
    let press =
        Press { readings_ohm: &readings, reciprocals: &[], decoded: &decoded, stated: &stated };
    let model = Model::decode(blob).unwrap();
    let mut scratch = vec![0.0; Recalibration::scratch_floats(&model).unwrap()];
    recalibration.add(&model, &press, &mut scratch)
}

/// The blob with the shifts of the recalibration, made in pieces of `piece` bytes.
fn patched(recalibration: &mut Recalibration<'_>, blob: &[u8], piece: usize) -> AlignedBytes {
    let model = Model::decode(blob).unwrap();
    let mut new = blob.to_vec();
    for (i, bytes) in new.chunks_mut(piece).enumerate() {
        recalibration.patch(&model, blob, i * piece, bytes);
    }
    let end = new.len() - 4;
    let crc = crate::checksum::CRC_32.checksum(&new[..end]);
    new[end..].copy_from_slice(&crc.to_le_bytes());
    AlignedBytes::copy_of(&new)
}

#[test]
fn shifted_readings_are_decoded_as_before_after_presses() {
    let mut bench = Bench::new();
    let mut memory = core::mem::take(&mut bench.memory);
    let blob = Model::decode(&bench.blob).map(|_| bench.blob.clone()).unwrap();
    let model = Model::decode(&blob).unwrap();
    let mut recalibration = Recalibration::start(&model, &mut memory).unwrap();
    for _ in 0..200 {
        let drawn = bench.draw();
        press(&mut recalibration, &blob, drawn, 1.0).unwrap();
    }
    let progress = recalibration.progress(&model);
    assert_eq!((progress.networks, progress.excited), (2, 2));
    assert!(progress.error_before > 5.0 && progress.error_after < 0.5, "{progress:?}");
    recalibration.finish(&model).unwrap();
    let new = patched(&mut recalibration, &blob, 64);
    assert_eq!(&*patched(&mut recalibration, &blob, 12), &*new);
    for _ in 0..100 {
        let (readings, stated) = bench.draw();
        let found = decode(&new, &shifted(&readings, 1.0));
        for (found, stated) in found.iter().zip(stated) {
            assert!((found - stated).abs() < 0.5 * ERROR, "{found} for {stated}");
        }
    }
    // Nothing but the zeros of inputs differs, and the CRC.
    let differing = new.iter().zip(&*blob).filter(|(new, old)| new != old).count();
    assert!(differing <= 4 * READINGS + 4);
}

#[test]
fn presses_that_are_alike_or_few_give_no_model() {
    let mut bench = Bench::new();
    let mut memory = core::mem::take(&mut bench.memory);
    let blob = bench.blob.clone();
    let model = Model::decode(&blob).unwrap();
    let mut recalibration = Recalibration::start(&model, &mut memory).unwrap();
    let not_excited = Err(RecalibrationError::NotExcited { unit: 0 });
    assert_eq!(recalibration.finish(&model), not_excited);
    let one = bench.draw();
    for _ in 0..500 {
        press(&mut recalibration, &blob, one, 1.0).unwrap();
    }
    assert_eq!(recalibration.finish(&model), not_excited);
    assert_eq!(recalibration.progress(&model).excited, 0);
    // Two different presses are too few as well.
    let mut memory = vec![0.0; 100];
    let mut recalibration = Recalibration::start(&model, &mut memory).unwrap();
    for _ in 0..2 {
        let drawn = bench.draw();
        press(&mut recalibration, &blob, drawn, 1.0).unwrap();
        assert_eq!(recalibration.finish(&model), not_excited);
    }
}

#[test]
fn a_sensor_that_has_not_changed_keeps_its_model() {
    let mut bench = Bench::new();
    let mut memory = core::mem::take(&mut bench.memory);
    let blob = bench.blob.clone();
    let model = Model::decode(&blob).unwrap();
    let mut recalibration = Recalibration::start(&model, &mut memory).unwrap();
    for _ in 0..200 {
        let (readings, mut stated) = bench.draw();
        for stated in &mut stated {
            *stated += 2.0 * ERROR * (uniform(&mut bench.random) - 0.5);
        }
        press(&mut recalibration, &blob, (readings, stated), 0.0).unwrap();
    }
    assert_eq!(recalibration.finish(&model), Err(RecalibrationError::NotBetter));
}

#[test]
fn an_unusable_press_is_refused_and_changes_nothing() {
    let mut bench = Bench::new();
    let mut memory = core::mem::take(&mut bench.memory);
    let blob = bench.blob.clone();
    let model = Model::decode(&blob).unwrap();
    let mut recalibration = Recalibration::start(&model, &mut memory).unwrap();
    for _ in 0..20 {
        let drawn = bench.draw();
        press(&mut recalibration, &blob, drawn, 1.0).unwrap();
    }
    let before = recalibration.memory.to_vec();
    let (readings, stated) = bench.draw();
    for bad in [f32::NAN, f32::INFINITY, -1e30, 1e30, 5000.0] {
        let unusable = Err(RecalibrationError::UnusablePress);
        let stated = [bad.max(1e3) * 1e3; ALL];
        assert_eq!(press(&mut recalibration, &blob, (readings, stated), 1.0), unusable);
        assert_eq!(press(&mut recalibration, &blob, ([bad; READINGS], stated), 1.0), unusable);
        assert_eq!(recalibration.memory, before);
    }
    // A reading that is missing in one row spares the other row's.
    let mut half = readings;
    half[1] = f32::NAN;
    assert_eq!(press(&mut recalibration, &blob, (half, stated), 1.0), Ok(()));
    let one = before.len() / 2;
    assert_eq!(recalibration.memory[..one], before[..one]);
    assert_ne!(recalibration.memory[one..], before[one..]);
    // Misstated presses within reason do little harm.
    for i in 0..200 {
        let (readings, stated) = bench.draw();
        let stated = if i % 20 == 0 { bench.draw().1 } else { stated };
        press(&mut recalibration, &blob, (readings, stated), 1.0).unwrap();
    }
    recalibration.finish(&model).unwrap();
    let new = patched(&mut recalibration, &blob, 64);
    for _ in 0..100 {
        let (readings, stated) = bench.draw();
        let found = decode(&new, &shifted(&readings, 1.0));
        assert!(
            found.iter().zip(stated).all(|(found, stated)| (found - stated).abs() < 2.0 * ERROR)
        );
    }
}

#[test]
fn a_hundred_thousand_presses_at_rest_do_no_harm() {
    let mut bench = Bench::new();
    let mut memory = core::mem::take(&mut bench.memory);
    let blob = bench.blob.clone();
    let model = Model::decode(&blob).unwrap();
    let mut recalibration = Recalibration::start(&model, &mut memory).unwrap();
    let rest = bench.draw();
    for _ in 0..100_000 {
        let mut noisy = rest;
        for reading in &mut noisy.0 {
            *reading *= 1.0 + 0.01 * (uniform(&mut bench.random) - 0.5);
        }
        press(&mut recalibration, &blob, noisy, 1.0).unwrap();
    }
    assert!(recalibration.memory.iter().all(|value| value.is_finite() && value.abs() < 1e6));
    for _ in 0..200 {
        let drawn = bench.draw();
        press(&mut recalibration, &blob, drawn, 1.0).unwrap();
    }
    assert!(recalibration.progress(&model).error_after < 0.5);
}

#[test]
fn models_without_what_is_needed_are_refused() {
    let shared = blob(&[0, 0], [ERROR; ALL]);
    let shared = Model::decode(&shared).unwrap();
    assert_eq!(Recalibration::floats(&shared), Err(RecalibrationError::SharedNetworks));
    let silent = blob(&[0, 1], [0.0; ALL]);
    let silent = Model::decode(&silent).unwrap();
    assert_eq!(Recalibration::floats(&silent), Err(RecalibrationError::Unsuitable));
    // Rows may have each other's networks.
    let crossed = blob(&[1, 0], [ERROR; ALL]);
    let crossed = Model::decode(&crossed).unwrap();
    let floats = Recalibration::floats(&crossed).unwrap();
    assert_eq!(floats, ROWS * (6 + INPUTS + OUTPUTS + 4));
    let mut memory = vec![0.0; floats - 1];
    let started = Recalibration::start(&crossed, &mut memory).map(|_| ());
    assert_eq!(started, Err(RecalibrationError::NoRoom { floats }));
}

#[test]
fn the_shift_of_an_input_that_never_changed_is_left_out() {
    assert_eq!(moved((50.0, 0.1), 0.5), 55.0);
    assert_eq!(moved((50.0, 0.0), 0.5), 50.0);
    assert_eq!(moved((50.0, 1e-38), 1e30), 50.0);
}
