//! Blobs of any bytes behind the magic and the version, with the length and the CRC that belong to them, so that all
//! checks behind these are reached.
//!
//! A model that is taken for sound decodes any frame to numbers or to a status that says why not, the same on a host and
//! on a device, to the bit. Filling leaves the readings that are there.
#![no_main]

use libfuzzer_sys::fuzz_target;
use taxel_core::blob::{FORMAT_VERSION, Model};
use taxel_core::checksum::CRC_32;
use taxel_core::relative::reciprocal;
use taxel_core::{AlignedBytes, Decoder, Estimate, Frame, RowStatus};
use taxel_learn::ModelBlob;

/// Most rows of a model that is loaded, as on the devices.
const ROWS: usize = 8;
/// Most readings and outputs of a frame that is decoded.
const MOST_NUMBERS: usize = 4096;
/// Frames that each model decodes.
const FRAMES: usize = 3;

/// Readings that a sensor may show, in Ω, and those that a fault or an attacker may.
const READINGS: [f32; 16] = [
    60.0,
    55.3,
    61.0,
    57.5,
    0.0,
    -0.0,
    -60.0,
    1e-45,
    -1e-38,
    1e30,
    -1e30,
    f32::MAX,
    f32::MIN,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
];

// Bytes are a whole blob, so that those in testdata are seeds.
fuzz_target!(|bytes: &[u8]| {
    if bytes.len() < 13 {
        return;
    }
    let mut blob = bytes.to_vec();
    blob[..4].copy_from_slice(b"TAXL");
    blob[4] = FORMAT_VERSION;
    blob[5..9].copy_from_slice(&(bytes.len() as u32).to_le_bytes());
    let end = blob.len() - 4;
    let crc = CRC_32.checksum(&blob[..end]).to_le_bytes();
    blob[end..].copy_from_slice(&crc);
    let blob = AlignedBytes::copy_of(&blob);
    match Model::decode(&blob) {
        Ok(model) => decode(&blob, model),
        Err(_) => assert!(Decoder::<ROWS>::load(&blob).is_err(), "loaded, though no model"),
    }
});

fn decode(blob: &AlignedBytes, model: Model<'_>) {
    look_at(&model);
    let Ok(decoder) = Decoder::<ROWS>::new(model) else { return };
    let shape = model.shape();
    let (readings, outputs) = (shape.rows * shape.inputs, shape.rows * shape.outputs);
    if readings > MOST_NUMBERS || outputs > MOST_NUMBERS {
        return;
    }
    let mut draws = Draws(model.crc().into());
    let baseline: Vec<f64> = (0..readings).map(|_| draws.reading(8).into()).collect();
    let reciprocals: Vec<f32> = baseline.iter().map(|ohm| reciprocal(*ohm as f32)).collect();
    let frames: Vec<f32> =
        (0..FRAMES).flat_map(|number| readings_of(number, readings, &mut draws)).collect();
    let mut on_device = Vec::new();
    for readings_ohm in frames.chunks_exact(readings) {
        let frame = Frame { readings_ohm, reciprocals: &reciprocals };
        let mut estimate = decoder.decode(frame).expect("a frame of the model's shape");
        check(&model, readings_ohm, &estimate.borrowed());
        on_device.extend(estimate.outputs.iter().map(|output| f64::from(*output)));
        assess(&decoder, frame, outputs);
        fill(&decoder, frame);
    }
    let blob = ModelBlob::of_bytes(blob).expect("a model, as the device says");
    let host = blob.prepare().with_baseline(&baseline);
    let frames: Vec<f64> = frames.into_iter().map(f64::from).collect();
    for (device, host) in on_device.iter().zip(host.decode_lines(&frames)) {
        let same = device.to_bits() == host.to_bits() || (device.is_nan() && host.is_nan());
        assert!(same, "the device says {device:e}, and the host {host:e}");
    }
}

/// Draws that depend on a seed alone: SplitMix64 (Steele, Lea & Flood, OOPSLA 2014).
struct Draws(u64);

impl Draws {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^ (bits >> 31)
    }

    /// One of the first so many readings.
    fn reading(&mut self, count: u64) -> f32 {
        READINGS[(self.bits() % count) as usize]
    }
}

/// Readings of a frame: usual ones with a few others, any of the list, or any bits.
fn readings_of(number: usize, count: usize, draws: &mut Draws) -> Vec<f32> {
    let mut draw = || match number % 3 {
        0 if !draws.bits().is_multiple_of(40) => 50.0 + (draws.bits() % 2000) as f32 / 100.0,
        0 | 1 => draws.reading(16),
        _ => f32::from_bits(draws.bits() as u32),
    };
    (0..count).map(|_| draw()).collect()
}

/// Uses everything that a model offers.
fn look_at(model: &Model<'_>) {
    let networks = model.network_count();
    assert_eq!(model.networks().count(), networks, "as many networks as it says");
    for network in model.networks() {
        for input in 0..network.shape().inputs {
            let _ = network.training_range(input);
        }
        assert!(network.widths().all(|width| !width.is_nan()), "a width that is no number");
    }
    for row in 0..model.shape().rows {
        assert!(model.network_of_row(row).is_some_and(|network| network < networks), "row {row}");
    }
    let metadata = model.metadata();
    assert_eq!(metadata.output_names.iter().count(), metadata.output_units.iter().count());
}

fn check(model: &Model<'_>, readings: &[f32], estimate: &Estimate<'_>) {
    let shape = model.shape();
    let whole_array = model.whole_frames();
    for (row, status) in estimate.status.iter().enumerate() {
        let outputs = &estimate.outputs[row * shape.outputs..(row + 1) * shape.outputs];
        let of_row = row * shape.inputs..(row + 1) * shape.inputs;
        let seen = if whole_array { readings } else { &readings[of_row] };
        let is_complete = seen.iter().all(|reading| reading.is_finite());
        if *status == RowStatus::Decoded {
            assert!(outputs.iter().all(|y| y.is_finite()), "decoded to {outputs:?}");
            assert!(is_complete, "decoded without a reading");
        } else if *status == RowStatus::NoTouch {
            assert!(whole_array && is_complete, "no touch of {seen:?}");
        } else {
            // A frame's status is that of one of its networks.
            let is_partial = whole_array && *status == RowStatus::Overflow;
            assert!(is_partial || outputs.iter().all(|y| y.is_nan()), "{status:?}: {outputs:?}");
            let relative = model.metadata().relative_inputs;
            let is_missing = *status == RowStatus::MissingReading;
            assert!(relative || !is_missing || !is_complete, "missing in a whole frame");
        }
    }
}

/// Assessing: a variance is never negative, so a deviation is a number from 0 on, or missing.
fn assess(decoder: &Decoder<'_, ROWS>, frame: Frame<'_>, outputs: usize) {
    let (mut deviation, mut scratch) = (vec![0.0; outputs], vec![0.0; decoder.scratch_floats()]);
    let novelty = decoder.assess_into(frame, &mut scratch, &mut deviation);
    if novelty.expect("the model's shape").is_some_and(f32::is_finite) {
        assert!(!deviation.iter().any(|deviation| *deviation < 0.0), "{deviation:?}");
    }
}

/// Filling leaves the readings that are there, and counts those that were not.
fn fill(decoder: &Decoder<'_, ROWS>, frame: Frame<'_>) {
    let before = frame.readings_ohm;
    let (mut filled, mut scratch) = (before.to_vec(), vec![0.0; decoder.scratch_floats()]);
    let count = decoder.fill(&mut filled, frame.reciprocals, &mut scratch);
    let missing = before.iter().filter(|reading| !reading.is_finite()).count();
    assert!(count <= missing, "{count} of {missing} filled");
    for (before, after) in before.iter().zip(&filled) {
        let same = before.to_bits() == after.to_bits();
        assert!(same || !before.is_finite() && after.is_finite(), "{before} became {after}");
    }
    let estimate = decoder.decode(Frame { readings_ohm: &filled, ..frame });
    check(decoder.model(), &filled, &estimate.expect("the model's shape").borrowed());
}
