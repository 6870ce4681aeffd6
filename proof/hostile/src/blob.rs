//! A blob whose CRC is right, whatever its body is: everything behind the CRC is reached.
//!
//! A model that is taken for sound must decode any frame to numbers or to a status that says why not, the same on a
//! host and on a device, to the bit.

use taxel_core::blob::Model;
use taxel_core::relative::reciprocal;
use taxel_core::{Decoder, Estimate, Frame, RowStatus};
use taxel_learn::ModelBlob;

use crate::draws::Draws;
use crate::seal;

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

/// Body of a blob, to which prefix and CRC are added.
pub fn check(body: &[u8]) -> bool {
    let bytes = seal::blob(body);
    let Ok(model) = Model::decode(&bytes) else {
        assert!(Decoder::<ROWS>::load(&bytes).is_err(), "loaded, though no model");
        return false;
    };
    look_at(&model);
    let Ok(decoder) = Decoder::<ROWS>::new(model) else { return true };
    let shape = model.shape();
    let (readings, outputs) = (shape.rows * shape.inputs, shape.rows * shape.outputs);
    if readings > MOST_NUMBERS || outputs > MOST_NUMBERS {
        return true;
    }
    let mut draws = Draws::new(u64::from(model.crc()));
    let baseline: Vec<f64> =
        (0..readings).map(|_| f64::from(draws.one_of(&READINGS[..8]))).collect();
    let reciprocals: Vec<f32> = baseline.iter().map(|ohm| reciprocal(*ohm as f32)).collect();
    let frames: Vec<f32> =
        (0..FRAMES).flat_map(|number| readings_of(number, readings, &mut draws)).collect();
    let mut on_device = Vec::new();
    for readings_ohm in frames.chunks_exact(readings) {
        let frame = Frame { readings_ohm, reciprocals: &reciprocals };
        let mut estimate = decoder.decode(frame).expect("a frame of the model's shape");
        check_estimate(&model, readings_ohm, &estimate.borrowed());
        on_device.extend(estimate.outputs.iter().map(|output| f64::from(*output)));
        assess(&decoder, frame, outputs);
        fill(&decoder, frame);
    }
    let blob = ModelBlob::of_bytes(&bytes).expect("a model, as the device says");
    let host = blob.prepare().with_baseline(&baseline);
    let frames: Vec<f64> = frames.into_iter().map(f64::from).collect();
    for (device, host) in on_device.iter().zip(host.decode_lines(&frames)) {
        let same = device.to_bits() == host.to_bits() || (device.is_nan() && host.is_nan());
        assert!(same, "the device says {device:e}, and the host {host:e}");
    }
    true
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

/// Readings of a frame: usual ones with a few others, any of the list, or any bits.
fn readings_of(number: usize, count: usize, draws: &mut Draws) -> Vec<f32> {
    let mut draw = || match number % 3 {
        0 if draws.below(40) > 0 => 50.0 + draws.below(2000) as f32 / 100.0,
        0 | 1 => draws.one_of(&READINGS),
        _ => f32::from_bits(draws.bits() as u32),
    };
    (0..count).map(|_| draw()).collect()
}

fn check_estimate(model: &Model<'_>, readings: &[f32], estimate: &Estimate<'_>) {
    let shape = model.shape();
    let whole_array = model.projection().is_some();
    for (row, status) in estimate.status.iter().enumerate() {
        let outputs = &estimate.outputs[row * shape.outputs..(row + 1) * shape.outputs];
        let of_row = row * shape.inputs..(row + 1) * shape.inputs;
        let seen = if whole_array { readings } else { &readings[of_row] };
        let is_complete = seen.iter().all(|reading| reading.is_finite());
        match status {
            RowStatus::Decoded => {
                assert!(outputs.iter().all(|y| y.is_finite()), "decoded to {outputs:?}");
                assert!(is_complete, "decoded without a reading");
            }
            RowStatus::Overflow | RowStatus::MissingReading => {
                assert!(outputs.iter().all(|y| y.is_nan()), "{status:?}, and {outputs:?}");
                let relative = model.metadata().relative_inputs;
                let is_missing = *status == RowStatus::MissingReading;
                assert!(relative || !is_missing || !is_complete, "missing in a whole frame");
            }
        }
    }
}

/// Confidence: a variance is never negative, so a deviation is a number from 0 on, or missing.
fn assess(decoder: &Decoder<'_, ROWS>, frame: Frame<'_>, outputs: usize) {
    let (mut deviation, mut scratch) = (vec![0.0; outputs], vec![0.0; decoder.scratch_floats()]);
    let novelty = decoder.assess_into(frame, &mut scratch, &mut deviation);
    let novelty = novelty.expect("the model's shape");
    if novelty.is_some_and(f32::is_finite) {
        assert!(!deviation.iter().any(|deviation| *deviation < 0.0), "{deviation:?}");
    }
}

/// Filling leaves the readings that are there, and counts those that were not.
fn fill(decoder: &Decoder<'_, ROWS>, frame: Frame<'_>) {
    let before = frame.readings_ohm;
    let (mut filled, mut scratch) = (before.to_vec(), vec![0.0; decoder.scratch_floats()]);
    let count = decoder.fill(&mut filled, &mut scratch);
    let missing = before.iter().filter(|reading| !reading.is_finite()).count();
    assert!(count == 0 || count == missing, "{count} of {missing} filled");
    for (before, after) in before.iter().zip(&filled) {
        let same = before.to_bits() == after.to_bits();
        assert!(same || (count > 0 && !before.is_finite()), "{before} became {after}");
    }
    let estimate = decoder.decode(Frame { readings_ohm: &filled, ..frame });
    let mut estimate = estimate.expect("a frame of the model's shape");
    check_estimate(decoder.model(), &filled, &estimate.borrowed());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The confidence needs more working space than decoding does, which must not be taken for readings.
    #[test]
    fn a_model_with_relative_inputs_and_a_confidence_decodes_whole_frames() {
        let blob = mock_board::blob_with_confidence(true);
        let decoder = Decoder::<2>::load(&blob).unwrap();
        for reading in [60.0, 1e6] {
            let (readings_ohm, reciprocals) = ([reading; 6], [reciprocal(60.0); 6]);
            let frame = Frame { readings_ohm: &readings_ohm, reciprocals: &reciprocals };
            let estimate = decoder.decode(frame).unwrap();
            assert_eq!(estimate.status, [RowStatus::Decoded; 2], "{reading} Ω");
        }
        assert!(check(seal::body(&blob)));
    }
}
