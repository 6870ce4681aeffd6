//! The firmware's readout on the virtual board: the errors that it adds, and the difference between
//! circuits.

use crate::common::{Folder, small_scene, unrefined};
use crate::quantisation::{output_bounds, reading_bound_ohm};
use host_sim::evaluate::readout::{self, ReadoutResult, Stage};
use host_sim::experiment::Experiment;
use model_core::rbf::Format;
use taxel_data::progress::Silent;
use taxel_data::table::Table;
use taxel_learn::{Exponential, ModelBlob};
use taxel_simulate::World;
use taxel_simulate::readout::{Circuit, Readout};
use taxel_simulate::virtual_board::{self, SeriesResistance, VirtualBoard, all_readings};

const FRAMES: usize = 40;

/// Scene and model of `run press`, with direct distances, for which the bound is derived.
fn press() -> (Experiment, ModelBlob) {
    let mut scene = unrefined("press");
    scene.training.format = Format::F32Direct;
    let model = scene.train(&Silent).unwrap();
    (scene, model)
}

/// Scans `readings` through `circuit` by a converter of so many bits, with no other fault.
fn scanned(world: &World, circuit: Circuit, bits: u8, readings: &Table) -> Table {
    let readout = Readout { circuit: Some(circuit), adc_bits: Some(bits), ..Readout::default() };
    let board = VirtualBoard::with_readout(world, &readout).unwrap();
    virtual_board::scan(&board, SeriesResistance::NONE, readings).unwrap()
}

/// Ratios of |a − b| to `bound`, pair by pair.
fn shares(a: &Table, b: &Table, bound: &Table) -> Vec<f64> {
    let pairs = a.values.iter().zip(&b.values).zip(&bound.values);
    pairs.map(|((a, b), bound)| (a - b).abs() / bound).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |a, b| a.max(*b))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn every_output_stays_within_the_bound_of_quantisation_and_coarser_converters_do_not() {
    let (scene, blob) = press();
    let model = blob.prepare(Exponential::default());
    let ideal = all_readings(&scene.world, FRAMES);
    let decode = |readings: &Table| model.decode_table(readings);
    // Measured: 0.034 and 0.0055 mm on average.
    for (circuit, most_mm) in [(Circuit::Divider, 0.05), (Circuit::ZeroPotential, 0.01)] {
        let bound_ohm = ideal.values.iter().map(|ohm| reading_bound_ohm(circuit, *ohm, 12));
        let bound_ohm = Table { names: ideal.names.clone(), values: bound_ohm.collect() };
        let bound = output_bounds(model.model(), circuit, 12, &ideal);
        let truth = decode(&ideal);
        let [fine, ten, nine] =
            [12, 10, 9].map(|bits| scanned(&scene.world, circuit, bits, &ideal));

        let of_readings = shares(&fine, &ideal, &bound_ohm);
        let of_outputs = shares(&decode(&fine), &truth, &bound);
        println!(
            "{}: bound {:.4} mm (mean), {:.4} mm (largest); readings reach {:.3} of theirs, outputs \
             {:.3}, on average {:.4}",
            circuit.name(),
            mean(&bound.values),
            largest(&bound.values),
            largest(&of_readings),
            largest(&of_outputs),
            mean(&of_outputs),
        );
        assert_eq!(of_outputs.len(), FRAMES * 144);
        assert!(largest(&of_readings) <= 1.0 && largest(&of_outputs) <= 1.0);
        // The bound is not far off. (The idle sample is the same in all frames, a quarter of a count
        // off: together with half a count of the sample, three quarters of the bound.)
        assert!(largest(&of_readings) > 0.7, "{}", largest(&of_readings));
        assert!(mean(&of_outputs) > 1e-3, "{}", mean(&of_outputs));
        assert!(mean(&bound.values) < most_mm, "{} mm", mean(&bound.values));

        // Two bits fewer exceed the bound of readings; three bits fewer exceed that of many outputs.
        let beyond = |shares: &[f64]| shares.iter().filter(|share| **share > 1.0).count();
        let readings_beyond = beyond(&shares(&ten, &ideal, &bound_ohm));
        let outputs_beyond = [&ten, &nine].map(|r| beyond(&shares(&decode(r), &truth, &bound)));
        println!(
            "  beyond: {readings_beyond} readings by 10 bits, {outputs_beyond:?} outputs by 10 and 9"
        );
        assert!(readings_beyond > FRAMES * 144 / 3, "{readings_beyond}");
        assert!(outputs_beyond[1] > FRAMES, "{outputs_beyond:?}");
    }
}

fn z_rmse_mm(result: &ReadoutResult, circuit: Circuit, stage: Stage) -> f64 {
    let errors = &result.line(circuit, stage).unwrap().errors;
    errors.iter().find(|errors| errors.group == "dz_mm").unwrap().rmse
}

#[test]
fn cross_talk_ruins_the_divider_and_spares_zero_potential() {
    let (scene, blob) = press();
    let model = blob.prepare(Exponential::default());
    let result = readout::measure(&scene, &model, 100).unwrap();
    let rms = |circuit, stage| result.line(circuit, stage).unwrap().readings.rms_percent;
    let z = |circuit, stage| z_rmse_mm(&result, circuit, stage);
    let of_z = |errors: &[host_sim::metrics::Errors]| {
        errors.iter().find(|errors| errors.group == "dz_mm").unwrap().rmse
    };
    let (ideal_mm, mean_mm) = (of_z(result.ideal_errors()), of_z(result.mean_errors()));
    let (divider, zero_potential) = (Circuit::Divider, Circuit::ZeroPotential);

    // Measured: 6.5 % against 0.014 %, and 0.022 % once all series resistance is known.
    assert!((5.0..8.0).contains(&rms(divider, Stage::CrossTalk)));
    assert!(rms(divider, Stage::Quantised) < 0.1);
    assert!(rms(zero_potential, Stage::CrossTalk) < 0.02);
    assert!(rms(divider, Stage::CrossTalk) > 100.0 * rms(zero_potential, Stage::CrossTalk));
    // Switches and leads cost 13 %, which correction recovers.
    assert!((10.0..17.0).contains(&rms(zero_potential, Stage::Series)));
    assert!(rms(zero_potential, Stage::Corrected) < 0.04);
    assert!(rms(zero_potential, Stage::Everything) < 0.06);
    assert!(rms(divider, Stage::Corrected) > 5.0);
    // A correction that is a tenth wrong leaves more error than all other faults.
    assert!((0.5..2.5).contains(&rms(zero_potential, Stage::Miscalibrated)));

    assert!(z(divider, Stage::Everything) > 3.0 * mean_mm);
    assert!(z(zero_potential, Stage::Everything) < 1.05 * ideal_mm);
    assert!(ideal_mm < 0.3 * mean_mm);
    assert!(z(zero_potential, Stage::Miscalibrated) > 1.5 * ideal_mm);
    assert!(result.lines.iter().all(|line| line.readings.missing == 0));
}

#[test]
fn users_see_every_circuit_and_stage() {
    let folder = Folder::new("readout");
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-o", "m.bin"]);
    let arguments = ["readout", "scene.toml", "--model", "m.bin", "--frames", "20"];
    let page = folder.succeed(&arguments);
    for says in ["ideal readings", "predicting the mean", "divider", "zero-potential", "dz_mm RMSE"]
    {
        assert!(page.contains(says), "{says:?} is not in {page}");
    }
    let result = folder.succeed(&[&arguments[..], &["--json"]].concat());
    let result: serde_json::Value = serde_json::from_str(&result).unwrap();
    let lines = result["lines"].as_array().unwrap();
    assert_eq!(lines.len(), 2 * Stage::ALL.len());
    assert_eq!(lines[6]["circuit"], "zero-potential");
    assert_eq!(result["frames"], 20);
    // Without --model the same model is trained, and the same seed draws the same frames.
    let trained = folder.succeed(&["readout", "scene.toml", "--frames", "20"]);
    assert_eq!(trained, page);
    assert_ne!(folder.succeed(&[&arguments[..], &["--seed", "7"]].concat()), page);
}

#[test]
fn a_scenes_own_values_replace_the_typical_ones() {
    let folder = Folder::new("readout-own");
    let own = "[readout]\ncross_talk = true\nrow_switch_ohm = 5.0\nline_ohm = 0.0\n\
               sampler = \"on-chip\"\nrow_drive = \"shift-register\"";
    folder.write("scene.toml", small_scene().replace("[readout]", own));
    let json = folder.succeed(&["readout", "scene.toml", "--frames", "5", "--json"]);
    let result: serde_json::Value = serde_json::from_str(&json).unwrap();
    let uncorrected = &result["lines"][6 + 2];
    assert_eq!(uncorrected["stage"], "series");
    // A series resistance of 5 Ω lies before the 3.1 Ω of a row.
    let rms_percent = uncorrected["readings"]["rms_percent"].as_f64().unwrap();
    assert!((140.0..190.0).contains(&rms_percent), "{rms_percent}");
}

#[test]
fn a_wait_shorter_than_the_time_constant_needs_fails() {
    let folder = Folder::new("readout-hasty");
    let hasty = "[readout]\ntime_constant_us = 5.0\nsettling_us = 10";
    folder.write("hasty.toml", small_scene().replace("[readout]", hasty));
    let said = folder.fail(&["readout", "hasty.toml"], 1);
    assert!(said.contains("settling takes 46 µs"), "{said}");
}
