//! Readings that no sensor gives, decoded by a Cortex-M4 in QEMU and by the host: to the last bit the same, whether the
//! floating-point unit keeps subnormals or flushes them to zero.

use std::fmt::Display;
use std::time::Duration;

use firmware::link::message::{Configuration, EstimateReport, Report, Request};
use model_core::blob::Floats;
use model_core::{AlignedBytes, Decoder, OwnedEstimate};
use taxel_data::random::{Purpose, Random, Stream};

use super::running::{ROWS, Running, Setup};
use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::promises::inference::extreme;
use crate::tools::{Tools, tested_model};

pub const EXTREMES: Promise = Promise {
    name: "inference-emulator",
    text: "any reading: a Cortex-M4's bits, subnormals or not",
    share: 1,
    check,
};

/// A model of each number format.
const MODELS: [&str; 3] = ["kernels-f32.bin", "kernels-fixed16.bin", "kernels-f32-direct.bin"];
/// Frames for each model and mode, in the first round and in those after it.
const FRAMES: [u64; 2] = [20, 500];
/// Longest time that an answer takes.
const ANSWER: Duration = Duration::from_millis(500);

/// Bit of FPSCR that flushes subnormals to zero.
const FLUSH_TO_ZERO: u32 = 1 << 24;
/// Bits of FPSCR that round to zero instead of to the nearest: the planted fault.
const ROUND_TO_ZERO: u32 = 3 << 22;

fn check(effort: &Effort, tools: &Tools) -> Result<Found, String> {
    let image = tools.image("qemu-app")?;
    let mut found = Found {
        cases: 0,
        worst: 0.0,
        bound: 0.0,
        unit: "outputs",
        seed: effort.seed(),
        note: String::new(),
    };
    let mut first = effort.seed();
    for round in 0.. {
        let seeds = first..first + FRAMES[usize::from(round > 0)];
        for name in MODELS {
            let blob = tested_model(name)?;
            let setup = Setup::new(&image, &blob)?;
            let mut running = Running::start(&setup)?;
            for flush in [0, FLUSH_TO_ZERO] {
                let planted = if effort.is_planted() { ROUND_TO_ZERO } else { 0 };
                let mode = (FLUSH_TO_ZERO | ROUND_TO_ZERO, flush | planted);
                for (seed, wrong) in decode(&mut running, &blob, mode, seeds.clone())? {
                    found.cases += 1;
                    if wrong > found.worst as usize {
                        (found.worst, found.seed) = (wrong as f64, seed);
                        let kept = if flush == 0 { "kept" } else { "flushed to zero" };
                        found.note = format!("{name}, subnormals {kept}");
                    }
                }
            }
        }
        first = seeds.end;
        if effort.is_over() {
            break;
        }
    }
    Ok(found)
}

/// Lets a device and the host decode a frame for each of the `seeds`, with some bits of FPSCR set to a value. Returns the
/// number of outputs that differ in each.
fn decode(
    running: &mut Running,
    blob: &AlignedBytes,
    (bits, value): (u32, u32),
    seeds: impl Iterator<Item = u64>,
) -> Result<Vec<(u64, usize)>, String> {
    let failed = |cause: &dyn Display| format!("the emulator: {cause}");
    if !running.answers() {
        return Err("the emulator: no answer".to_owned());
    }
    let gdb = &mut running.gdb;
    gdb.stop().map_err(|cause| failed(&cause))?;
    gdb.change_fpscr(|fpscr| fpscr & !bits | value).map_err(|cause| failed(&cause))?;
    gdb.run().map_err(|cause| failed(&cause))?;
    let configuration = Configuration {
        send_estimates: false,
        shorted_below_ohm: f32::NEG_INFINITY,
        open_above_ohm: f32::INFINITY,
        ..Configuration::DEFAULT
    };
    let configure = Request::Configure { configuration, lease_ms: 0 };
    let done = running.device.ask_plainly(&configure, |report| {
        matches!(report, Report::Configuration { .. }).then_some(())
    });
    done.map_err(|cause| failed(&cause))?;
    let decoder = Decoder::<ROWS>::load(blob).map_err(|cause| cause.to_string())?;
    let wrong = seeds.map(|seed| {
        let readings_ohm = frame(&decoder, seed);
        let right = decoder.decode(&readings_ohm[..]).map_err(|cause| cause.to_string())?;
        let request = Request::Decode { frame: 0, readings_ohm: Floats::of(&readings_ohm) };
        let wrong = running.device.ask(&request, ANSWER, |report| match report {
            Report::Estimate(estimate) => Some(differing(estimate, &right)),
            _ => None,
        });
        let wrong = wrong.map_err(|cause| failed(&cause))?;
        wrong.map(|wrong| (seed, wrong)).map_err(|refusal| format!("refused: {refusal:?}"))
    });
    let wrong = wrong.collect::<Result<_, String>>()?;
    let gdb = &mut running.gdb;
    gdb.stop().map_err(|cause| failed(&cause))?;
    let fpscr = gdb.fpscr().map_err(|cause| failed(&cause))?;
    gdb.run().map_err(|cause| failed(&cause))?;
    if fpscr & bits != value {
        return Err(format!("FPSCR was set otherwise meanwhile: {fpscr:08x}"));
    }
    Ok(wrong)
}

/// Readings about the training ranges of the model's first network, and far beyond.
fn frame(decoder: &Decoder<'_, ROWS>, seed: u64) -> Vec<f32> {
    let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 1, 0);
    let network = decoder.model().networks().next().expect("a network");
    let inputs = decoder.shape().inputs;
    let readings = 0..decoder.shape().rows * inputs;
    readings.map(|i| extreme(network.training_range(i % inputs), &mut random)).collect()
}

/// Number of outputs whose bits, or whose row's status, are not the `right` ones.
fn differing(found: &EstimateReport<'_>, right: &OwnedEstimate) -> usize {
    let outputs = right.outputs.len() / right.status.len();
    let status = |row: usize| found.row_status.get(row) == Some(&(right.status[row] as u8));
    let mut of_device = found.outputs.iter();
    let is_same = |(i, right): (usize, &f32)| {
        let bits = of_device.next().map(f32::to_bits);
        bits == Some(right.to_bits()) && status(i / outputs)
    };
    right.outputs.iter().enumerate().map(is_same).filter(|same| !same).count()
}
