//! What the studies find, on models that train in a moment.

use host_sim::experiment::Experiment;
use host_sim::metrics::Errors;
use taxel_data::progress::Silent;
use taxel_learn::Exponential;
use taxel_learn::decoders::linear;
use taxel_simulate::drift::Drift;
use taxel_simulate::readout::Circuit;

use crate::question::drift::{self, Line};
use crate::question::readout::{self, ReadoutResult, Stage};

const NETWORK: &str = "network";

fn z(errors: &[Errors]) -> f64 {
    errors.iter().find(|errors| errors.group == "dz_mm").unwrap().rmse
}

/// Rows 4 and 5 of `press`, without refinement.
fn small() -> Experiment {
    let mut scene = unrefined_press();
    scene.world.read_rows = vec![3, 4];
    (scene.training.frames, scene.training.test_frames) = (3000, 500);
    scene.training.centres = 12;
    scene
}

fn unrefined_press() -> Experiment {
    let mut scene = Experiment::load("press").unwrap();
    scene.training.refine = false;
    scene
}

#[test]
fn two_per_cent_of_drift_cost_readings_a_factor_and_relative_inputs_nothing() {
    let mut scene = unrefined_press();
    scene.world.read_rows = vec![3];
    (scene.training.frames, scene.training.test_frames) = (8000, 8000);
    let result = drift::measure(&scene, 0.02, &Silent).unwrap();
    let line = |decoder: &str, relative: bool, with_drift: bool| {
        let inputs = |it: &Line| (it.relative_inputs, it.trained_with_drift);
        let mut lines = result.lines.iter().filter(|it| it.decoder == decoder);
        lines.find(|it| inputs(it) == (relative, with_drift)).unwrap()
    };
    let ratio = |line: &Line| z(&line.drifted) / z(&line.undrifted);
    for decoder in [NETWORK, linear::NAME] {
        let (readings, relative) = (line(decoder, false, false), line(decoder, true, false));
        let trained = line(decoder, false, true);
        println!(
            "{decoder}: {:.4} → {:.4} mm, trained with drift {:.4} mm, relative {:.4} → {:.4} mm",
            z(&readings.undrifted),
            z(&readings.drifted),
            z(&trained.drifted),
            z(&relative.undrifted),
            z(&relative.drifted)
        );
        assert!(ratio(readings) > 2.0 && z(&trained.drifted) > 1.2 * z(&relative.drifted));
        assert!((ratio(relative) - 1.0).abs() < 0.001);
        // The noise of the baseline is a tenth of a reading's.
        assert!((z(&relative.drifted) / z(&readings.undrifted) - 1.0).abs() < 0.05);
    }
    assert_eq!(result.lines.iter().filter(|line| line.decoder == "mean").count(), 1);
}

#[test]
fn a_baseline_that_was_scanned_with_the_same_series_resistance_cancels_it() {
    let at = |relative_inputs: bool| {
        let mut scene = small();
        scene.training.relative_inputs = relative_inputs;
        // The readout does not drift.
        scene.world.drift = Some(Drift { gain: if relative_inputs { 0.05 } else { 0.0 } });
        let blob = scene.train(&Silent).unwrap();
        let result = readout::measure(&scene, &blob.prepare(Exponential::default()), 20).unwrap();
        let line = result.line(Circuit::ZeroPotential, Stage::Series).unwrap();
        assert!(line.readings.rms_percent > 10.0);
        z(&line.errors) / z(result.ideal_errors())
    };
    let (readings, relative) = (at(false), at(true));
    println!("z RMSE relative to ideal readings: {readings:.2} and {relative:.2}");
    assert!(readings > 3.0 && (0.8..1.25).contains(&relative));
}

fn z_rmse_mm(result: &ReadoutResult, circuit: Circuit, stage: Stage) -> f64 {
    let errors = &result.line(circuit, stage).unwrap().errors;
    errors.iter().find(|errors| errors.group == "dz_mm").unwrap().rmse
}

#[test]
fn cross_talk_ruins_the_divider_and_spares_zero_potential() {
    let scene = unrefined_press();
    let blob = scene.train(&Silent).unwrap();
    let model = blob.prepare(Exponential::default());
    let result = readout::measure(&scene, &model, 100).unwrap();
    let rms = |circuit, stage| result.line(circuit, stage).unwrap().readings.rms_percent;
    let z = |circuit, stage| z_rmse_mm(&result, circuit, stage);
    let (ideal_mm, mean_mm) = (self::z(result.ideal_errors()), self::z(result.mean_errors()));
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
