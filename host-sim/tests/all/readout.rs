//! The firmware's readout on the virtual board: the errors that it adds, and the difference between
//! circuits.

use crate::common::{Folder, small_scene, unrefined};
use crate::quantisation::{output_bounds, reading_bound_ohm};
use host_sim::experiment::Experiment;
use model_core::rbf::Format;
use taxel_data::progress::Silent;
use taxel_data::table::Table;
use taxel_learn::{Exponential, ModelBlob};
use taxel_simulate::World;
use taxel_simulate::readout::{Circuit, Readout};
use taxel_simulate::virtual_board::{self, SeriesResistance, VirtualBoard, all_readings};

const FRAMES: usize = 300;

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

#[test]
fn a_readout_that_cannot_be_is_refused() {
    let folder = Folder::new("readout-refusals");
    let refused = |arguments: &[&str], says: &[&str]| {
        let before = folder.names();
        let output = folder.run(arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        says.iter().for_each(|says| assert!(stderr.contains(says), "{says:?} not in {stderr:?}"));
        assert!(output.stdout.is_empty() && folder.names() == before);
    };
    for (field, says) in [
        ("circuit = \"bridge\"", &["unknown variant `bridge`", "zero-potential"][..]),
        ("sampler = \"ads1115\"", &["unknown variant `ads1115`", "mcp3208"]),
        ("row_drive = \"relay\"", &["unknown variant `relay`", "shift-register"]),
        ("adc_bits = 16", &["readout.adc_bits = 16", "from 4 to 12"]),
        ("oversampling = 0", &["readout.oversampling = 0", "from 1 to 256"]),
        ("settling_us = 20000", &["readout.settling_us = 20000", "to 10000"]),
        ("line_ohm = -1.0", &["readout.line_ohm = -1", "from 0"]),
        ("op_amp_offset_v = 0.5", &["readout.op_amp_offset_v = 0.5", "to 0.1"]),
        ("adc_noise_counts = nan", &["readout.adc_noise_counts = NaN"]),
        ("time_constant_us = 1e9", &["readout.time_constant_us = 1000000000"]),
        ("row_switch_ohm = 0.3", &["readout.row_switch_ohm = 0.3", "readout.cross_talk = true"]),
        ("adc = 12", &["unknown field `adc`", "adc_bits"]),
    ] {
        folder.write(
            "scene.toml",
            small_scene().replace("[readout]", &format!("[readout]\n{field}")),
        );
        refused(
            &["synth", "scene.toml", "-n", "1", "-o", "f.csv"],
            &[says, &["scene.toml"]].concat(),
        );
    }
    folder.write("scene.toml", small_scene());
    folder.succeed(&["train", "scene.toml", "-n", "100", "-o", "m.bin"]);
    let other = &["m.bin", "not those of scene press"][..];
    refused(&["readout", "press", "--model", "m.bin"], other);
    refused(&["readout", "scene.toml", "--frames", "0"], &["--frames = 0"]);
    folder.write("wide.toml", small_scene().replace("column_wires = 18", "column_wires = 19"));
    refused(&["readout", "wide.toml"], &["19 column-wires", "18"]);
    // A wait shorter than the time constant needs: the board refuses, and the command fails.
    let hasty = "[readout]\ntime_constant_us = 5.0\nsettling_us = 10";
    folder.write("hasty.toml", small_scene().replace("[readout]", hasty));
    let output = folder.run(&["readout", "hasty.toml", "--model", "m.bin"]);
    assert_eq!(output.status.code(), Some(1));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("settling takes 46 µs"), "{stderr}");
}
