//! Frames of a library's self-test, and what taxel-core makes of them.

use taxel_core::blob::Model;
use taxel_core::health::Limits;
use taxel_core::rbf::NetworkError;
use taxel_core::relative::reciprocal;
use taxel_core::touch::{Strengths, Touch};
use taxel_core::{Decoder, Frame, OwnedEstimate, RowStatus};
use taxel_data::exp;

use super::numbers::{array, table, word};
use crate::error::{Error, Result};
use crate::health::fault;
use crate::prepared::MOST_ROWS;

/// Sweeps that bring readings to given features.
const SWEEPS: usize = 30;

/// Definitions of the tests' arrays in C, and their number. Readings in Ω have `limits`.
///
/// # Errors
/// Never, for a model that was checked.
pub fn arrays(model: &Model<'_>, limits: Option<Limits>) -> Result<String> {
    let decoder =
        Decoder::<MOST_ROWS>::new(*model).map_err(|cause| Error::failed(cause.to_string()))?;
    let refused = |cause: NetworkError| Error::failed(cause.to_string());
    let (baseline, frames) = frames(model, limits);
    let reciprocals: Vec<f32> = baseline.iter().map(|it| reciprocal(*it)).collect();
    let mut scratch = vec![0.0; decoder.scratch_floats()];
    let shape = model.shape();
    let mut estimate = OwnedEstimate {
        outputs: vec![0.0; shape.rows * shape.outputs],
        status: vec![RowStatus::Decoded; shape.rows],
    };
    let mut deviation = estimate.outputs.clone();
    let [mut outputs, mut deviations, mut filled, mut status] = [const { Vec::new() }; 4];
    let [mut clamped, mut novelty] = [const { Vec::new() }; 2];
    for frame in &frames {
        let believed = within(model, frame, limits);
        let given = Frame { readings_ohm: &believed, reciprocals: &reciprocals };
        let any_clamped = decoder.decode_into(given, &mut scratch, &mut estimate.borrowed());
        clamped.push(u8::from(any_clamped.map_err(refused)?).to_string());
        status.push(estimate.status.iter().map(|it| (*it as u8).to_string()).collect());
        outputs.push(bits(&estimate.outputs));
        let novel = decoder.assess_into(given, &mut scratch, &mut deviation).map_err(refused)?;
        novelty.extend(novel.map(|it| word(it.to_bits())));
        deviations.push(bits(&deviation));
        let mut readings = believed.clone();
        decoder.fill(&mut readings, &reciprocals, &mut scratch);
        filled.push(bits(&readings));
    }
    let readings: Vec<Vec<String>> = frames.iter().map(|frame| bits(frame)).collect();
    let mut text = format!("#define TESTS {}\n", frames.len());
    text += &table("uint32_t", "test_readings", &readings);
    text += &table("uint32_t", "test_outputs", &outputs);
    text += &table("uint8_t", "test_status", &status);
    text += &array("uint8_t", "test_clamped", clamped);
    if !novelty.is_empty() {
        text += &table("uint32_t", "test_deviations", &deviations);
        text += &array("uint32_t", "test_novelty", novelty);
    }
    if model.reading_model().is_some() {
        text += &table("uint32_t", "test_filled", &filled);
    }
    if model.metadata().relative_inputs {
        text += &array("uint32_t", "test_baseline", bits(&baseline));
    }
    Ok(text)
}

/// Readings of a frame, those outside of `limits` missing.
fn within(model: &Model<'_>, frame: &[f32], limits: Option<Limits>) -> Vec<f32> {
    let names = model.metadata().input_names;
    let believed = |(reading, name): (&f32, &str)| {
        fault(name, f64::from(*reading), limits).map_or(*reading, |_| f32::NAN)
    };
    frame.iter().zip(names.iter()).map(believed).collect()
}

fn bits(values: &[f32]) -> Vec<String> {
    values.iter().map(|value| word(value.to_bits())).collect()
}

/// A baseline, and frames: two within the range of training, the second with a reading far beyond it; the first one with
/// a missing reading; and, if networks see the shape of a touch, one without a touch.
fn frames(model: &Model<'_>, limits: Option<Limits>) -> (Vec<f32>, Vec<Vec<f32>>) {
    let shape = model.shape();
    let count = shape.rows * shape.inputs;
    let relative = model.metadata().relative_inputs;
    let usual = limits
        .map_or(40.0, |it| 40.0_f32.max(1.2 * it.shorted_below_ohm).min(0.8 * it.open_above_ohm));
    let about = |i: usize| if relative { usual * (1.0 + 0.02 * (i % 7) as f32) } else { 1.0 };
    let baseline: Vec<f32> = (0..count).map(about).collect();
    let readings = |inputs: Vec<f32>| -> Vec<f32> {
        inputs.iter().zip(&baseline).map(|(input, baseline)| input * baseline).collect()
    };
    let touch = model.fronts().find_map(|front| front.touch);
    let frame = |number: usize| {
        readings(match touch {
            Some(touch) => of_touch(&touch, number),
            None if model.whole_frames() => of_array(model, number * count),
            None => of_rows(model, number * count),
        })
    };
    let (within, mut beyond) = (frame(0), frame(1));
    beyond[count - 1] *= 4.0;
    let mut missing = within.clone();
    missing[0] = f32::NAN;
    let at_rest = touch.map(|it| readings(pairs(&it).iter().map(|[level, _]| *level).collect()));
    (baseline, [within, beyond, missing].into_iter().chain(at_rest).collect())
}

/// Numbers from 0 to 1 that are spread well: multiples of the golden ratio, without their whole part.
fn spread(index: usize) -> f64 {
    (index as f64 * 0.618_033_988_75).fract()
}

/// Inputs of networks of single rows, or of one that is given all readings, within their range of training.
fn of_rows(model: &Model<'_>, start: usize) -> Vec<f32> {
    let (shape, networks) = (model.shape(), model.networks().collect::<Vec<_>>());
    let input = |place: usize| {
        let network = networks[model.network_of_row(place / shape.inputs).unwrap_or_default()];
        let inputs = network.shape().inputs;
        let [low, high] = network.training_range(place % inputs).map(f64::from);
        (low + (high - low) * spread(start + place)) as f32
    };
    (0..shape.rows * shape.inputs).map(input).collect()
}

/// Level at rest and threshold of each reading.
fn pairs<'m>(touch: &Touch<'m>) -> &'m [[f32; 2]] {
    let block = touch.block();
    block[block.len() - 2 * touch.readings()..].as_chunks().0
}

/// Inputs of a touch of half the largest strength, which spreads over neighbouring readings. Its `number` says where, and
/// to which side it moves them if they may move to either.
fn of_touch(touch: &Touch<'_>, number: usize) -> Vec<f32> {
    let Strengths { most, side, .. } = touch.strengths();
    let strength = 0.5 * f64::from(most);
    let side = if side == 0.0 { [1.0, -1.0][number % 2] } else { f64::from(side) };
    let count = touch.readings();
    let centre = count as f64 * spread(1 + number);
    let share = |reading: usize| exp(-(reading as f64 - centre).powi(2) / 4.0);
    let sum: f64 = (0..count).map(share).sum();
    let input = |(reading, [level, threshold]): (usize, &[f32; 2])| {
        let change = f64::from(*threshold) + strength * share(reading) / sum;
        (f64::from(*level) + side * change) as f32
    };
    pairs(touch).iter().enumerate().map(input).collect()
}

/// Readings of an array whose features are within their range of training, by Kaczmarz's method from a mean frame on, if
/// the model knows one. Without a projection, the readings themselves are.
fn of_array(model: &Model<'_>, start: usize) -> Vec<f32> {
    let projection = model.fronts().find_map(|front| front.projection);
    let (Some(projection), Some(network)) = (projection, model.networks().next()) else {
        return of_rows(model, start);
    };
    let (features, count) = (projection.features(), projection.readings());
    let mean = model.reading_model().map(|it| it.block());
    let mut readings: Vec<f64> = match mean {
        Some(block) => block[..count].iter().copied().map(f64::from).collect(),
        None => vec![0.0; count],
    };
    let (offsets, parts) = projection.block().split_at(features);
    for turn in 0..SWEEPS * features {
        let feature = turn % features;
        let [low, high] = network.training_range(feature).map(f64::from);
        let wanted = low + (high - low) * (0.25 + 0.5 * spread(start + feature));
        let along: Vec<f64> =
            parts.iter().skip(feature).step_by(features).copied().map(f64::from).collect();
        let square: f64 = along.iter().map(|part| part * part).sum();
        let found: f64 = along.iter().zip(&readings).map(|(part, it)| part * it).sum();
        let step = (wanted - found - f64::from(offsets[feature])) / square.max(f64::MIN_POSITIVE);
        readings.iter_mut().zip(&along).for_each(|(reading, part)| *reading += step * part);
    }
    readings.iter().map(|reading| *reading as f32).collect()
}
