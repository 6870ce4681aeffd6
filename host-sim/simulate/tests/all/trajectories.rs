//! Frames of trajectories: paths, noise with a memory, and rubber with one.

use taxel_data::{Stream, Table};
use taxel_simulate::drift::Drift;
use taxel_simulate::noise::{Noise, NoiseKind};
use taxel_simulate::outputs::{ContactOutput, ElectrodeOutputs, Outputs, Quantity};
use taxel_simulate::path::Path;
use taxel_simulate::rubber::StandardLinearSolid;
use taxel_simulate::sensor::Axis;
use taxel_simulate::timetable::Timetable;
use taxel_simulate::{Synthesis, World};

use crate::synth::{check_standard_normal, moments, ratios};

/// Contacts of `press` along a path.
fn moving(speed_mm_per_s: f64, press_rate_hz: f64) -> World {
    World { path: Some(Path::at(speed_mm_per_s, press_rate_hz)), ..World::press() }
}

#[test]
fn a_moving_contact_is_read_row_by_row_at_its_own_times() {
    let world = moving(80.0, 4.0);
    let path = world.path.unwrap();
    world.check_path(&path).unwrap();
    let timetable = Timetable::every(0.006, 0.004, 0.06).unwrap();
    let synthesis = Synthesis::new(&world).ideal().along(path, timetable.clone());
    assert_eq!(synthesis.steps(), 10);
    let scanned = synthesis.frames(Stream::Test, 70 * 10);
    // What rows are given is what a scan of that instant gives all of them.
    for place in [0, 3, 7] {
        let offset_s = timetable.row_offset_s(place, 8);
        let at = timetable.starts_s.iter().map(|start_s| start_s + offset_s).collect();
        let instants = synthesis.clone().timed(Timetable::instants(at));
        let seen = instants.frames(Stream::Test, 70 * 10);
        assert_eq!(scanned.row_table(place), seen.row_table(place));
        assert_eq!(instants.true_outputs(Stream::Test, 70 * 10), seen.outputs);
        assert_ne!(scanned.row_table(5), seen.row_table(5));
    }
    // A trajectory is the same however many are asked for.
    assert_eq!(synthesis.frames(Stream::Test, 25).inputs.values, scanned.inputs.values[..25 * 144]);
}

#[test]
fn a_trajectory_has_noise_per_frame_and_drift_per_session() {
    let world = World { drift: Some(Drift { gain: 0.02 }), ..moving(30.0, 2.0) };
    let path = world.path.unwrap();
    let timetable = Timetable::every(0.001, 0.0005, 0.02).unwrap();
    let noisy = Synthesis::new(&world).along(path, timetable.clone());
    let ideal = noisy.clone().ideal();
    let frames = 40 * 20;
    let [noisy, ideal] = [noisy, ideal].map(|it| it.frames(Stream::Test, frames).inputs);
    let found = moments(&noisy, &ideal, |ideal_ohm, _| 0.005 * ideal_ohm);
    check_standard_normal(found, noisy.values.len(), "of a trajectory");
    // The gain drifts from one trajectory to the next, and not within one.
    let undrifted = World { drift: None, ..world.clone() };
    let undrifted = Synthesis::new(&undrifted).ideal().along(path, timetable);
    let undrifted = undrifted.frames(Stream::Test, frames).inputs;
    let gains: Vec<f64> = ratios(&ideal, &undrifted).map(|line| line[77]).collect();
    for trajectory in gains.chunks(20) {
        assert!(trajectory.iter().all(|gain| (gain / trajectory[0] - 1.0).abs() < 1e-14));
    }
    assert!((gains[0] / gains[20] - 1.0).abs() > 1e-6);
    let baselines = Synthesis::new(&world).along(path, Timetable::still());
    assert_eq!(baselines.baselines(Stream::Test, 3, 100).len(), 3);
}

#[test]
fn the_centre_of_a_contact_that_is_lifted_is_missing() {
    let mut world = World { path: moving(40.0, 5.0).path, ..World::contact() };
    world.read_rows = vec![2, 3];
    let path = world.path.unwrap();
    let timetable = Timetable::every(0.002, 0.001, 0.6).unwrap();
    let synthesis = Synthesis::new(&world).ideal().along(path, timetable.clone());
    let outputs = synthesis.frames(Stream::Test, 300 * 8).outputs;
    let depth = outputs.names.iter().position(|name| name == "contact_depth_mm").unwrap();
    let lifted = outputs.lines().filter(|line| line[depth] == 0.0).count();
    assert!((400..900).contains(&lifted), "{lifted} of 2400");
    assert!(outputs.lines().all(|line| line[0].is_nan() == (line[depth] == 0.0)));
    // The contact of a scan is the one in its middle.
    let middle = timetable.starts_s.iter().map(|start_s| start_s + 0.0005).collect();
    let middle = synthesis.clone().timed(Timetable::instants(middle));
    let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
    let there = middle.true_outputs(Stream::Test, 300 * 8);
    assert!(outputs.values.iter().zip(there.values.iter()).all(same));
}

/// World of `press` with noise of a memory.
fn remembering(level: f64, correlated_level: f64, time_constant_ms: f64) -> World {
    let noise =
        Noise { correlated_level, time_constant_ms, ..Noise::white(NoiseKind::Relative, level) };
    let world = World { noise, ..World::press() };
    world.check().unwrap();
    world
}

#[test]
fn correlated_noise_has_its_level_and_its_time_constant() {
    for (level, correlated_level, time_constant_ms) in
        [(0.0, 0.01, 20.0), (0.005, 0.005, 20.0), (0.005, 0.005, 2.0), (0.005, 0.0, 0.0)]
    {
        let world = remembering(level, correlated_level, time_constant_ms);
        let period_s = 0.1 * f64::max(time_constant_ms, 20.0) / 1000.0;
        // Trajectories of 50 scans, which are synthesised side by side.
        let (scans, frames) = (50, 1500);
        let times = Timetable::every(period_s, 0.0, scans as f64 * period_s).unwrap();
        let log = Synthesis::new(&world).untouched().timed(times);
        let readings = log.frames(Stream::Training, frames).inputs;
        let ideal = log.clone().ideal().frames(Stream::Training, frames).inputs;
        let noise: Vec<f64> = ratios(&readings, &ideal).flatten().map(|it| it - 1.0).collect();
        // Mean product of a reading's noise with its own so many frames later.
        let covariance = |frames: usize| {
            let of_trajectories = noise.chunks(scans * readings.names.len());
            let products: Vec<f64> = of_trajectories
                .flat_map(|noise| noise.iter().zip(&noise[frames * readings.names.len()..]))
                .map(|(a, b)| a * b)
                .collect();
            products.iter().sum::<f64>() / products.len() as f64
        };
        let total = world.noise.total_level().powi(2);
        assert!((covariance(0) / total - 1.0).abs() < 0.05, "{}", covariance(0));
        for frames in [1, 5, 10] {
            let shared =
                correlated_level.powi(2) * world.noise.correlation(frames as f64 * period_s);
            let found = covariance(frames);
            assert!((found - shared).abs() < 0.03 * total, "{frames} frames: {found}, {shared}");
        }
        let few = log.frames(Stream::Training, 20).inputs.values;
        assert_eq!(few, readings.values[..few.len()]);
    }
}

#[test]
fn correlated_noise_hardly_averages_out_in_a_baseline() {
    let world = remembering(0.003, 0.004, 2000.0);
    let still = Synthesis::new(&world).untouched();
    let ideal = still.clone().ideal().frames(Stream::Test, 400).inputs;
    let squares = |readings: &Table| {
        let sum: f64 = ratios(readings, &ideal).flatten().map(|it| (it - 1.0).powi(2)).sum();
        (sum / readings.values.len() as f64).sqrt()
    };
    let noisy = still.frames(Stream::Test, 400).inputs;
    assert!((squares(&noisy) / 0.005 - 1.0).abs() < 0.02, "{}", squares(&noisy));
    // A hundred scans take 1 s.
    let left = world.noise.averaged(100, 0.01).total_level();
    let baselines = still.baselines(Stream::Test, 400, 100);
    assert!((0.0036..0.0039).contains(&left), "{left}");
    assert!((squares(&baselines) / left - 1.0).abs() < 0.02, "{}", squares(&baselines));
    // Of scans that follow one another slowly, less is left.
    let timetable = Timetable::every(0.2, 0.005, 0.4).unwrap();
    let slow = still.clone().along(Path::at(50.0, 2.0), timetable);
    let left_of_slow = world.noise.averaged(100, 0.2).total_level();
    let rest = slow.baselines(Stream::Test, 800, 100);
    let rest = Table { values: rest.lines().step_by(2).flatten().copied().collect(), ..rest };
    assert!(left_of_slow < 0.5 * left);
    assert!((squares(&rest) / left_of_slow - 1.0).abs() < 0.02, "{}", squares(&rest));
    // Its draws are its own.
    let together: f64 = ratios(&noisy, &ideal)
        .flatten()
        .zip(ratios(&baselines, &ideal).flatten())
        .map(|(a, b)| (a - 1.0) * (b - 1.0))
        .sum();
    assert!(together.abs() / 57_600.0 < 0.05 * 0.005 * left, "{together}");
}

/// Rubber that reaches half of a deformation at once, and the rest with a time constant of 50 ms.
const CREEPING: StandardLinearSolid =
    StandardLinearSolid { instant_share: 0.5, time_constant_ms: 50.0 };

#[test]
fn rubber_with_a_memory_follows_the_integral_over_its_past() {
    let elastic = moving(100.0, 5.0);
    let world = World { rubber: CREEPING.into(), ..elastic.clone() };
    world.check().unwrap();
    let path = world.path.unwrap();
    let scans = Timetable::every(0.0056, 0.005, 0.3).unwrap();
    let scanned = Synthesis::new(&world).ideal().along(path, scans.clone());
    let scanned = scanned.frames(Stream::Test, 70 * scans.scans());
    let truth_at = |world: &World, starts_s: Vec<f64>| {
        let frames = 70 * starts_s.len();
        let instants = Synthesis::new(world).along(path, Timetable::instants(starts_s));
        instants.true_outputs(Stream::Test, frames)
    };
    // At the time of its reading, whatever is read before: row 4 is read at 7/16 of a scan.
    let of_row = |line: &[f64]| line[3 * 18..4 * 18].to_vec();
    for scan in [0, 1, 29, 53] {
        let at = truth_at(&world, vec![scans.starts_s[scan] + scans.row_offset_s(3, 8)]);
        let of_scans = scanned.outputs.lines().skip(scan).step_by(scans.scans());
        for (seen, there) in of_scans.zip(at.lines()) {
            assert_eq!(of_row(seen), of_row(there));
        }
    }
    // Memories go on in straight steps of up to 1 ms: 0.05 µm of dents of 1 mm.
    // v = ∫ w(t′)·exp((t′ − t)/τ) dt′/τ by Simpson's rule, of what elastic rubber does at steps of 0.1 ms.
    let (steps, step_s) = (2500, 1e-4);
    let wanted = truth_at(&elastic, (0..=steps).map(|step| step as f64 * step_s).collect());
    let reached = truth_at(&world, vec![steps as f64 * step_s]);
    let (mut largest_mm, mut furthest_mm) = (0.0_f64, 0.0_f64);
    for trajectory in [0, 5, 69] {
        for (output, reached_mm) in reached.line(trajectory).iter().enumerate() {
            let wanted_mm = |step: usize| wanted.line(trajectory * (steps + 1) + step)[output];
            let crept_mm: f64 = (0..=steps)
                .map(|step| {
                    let end = step == 0 || step == steps;
                    let weight = if end { 1.0 } else { [2.0, 4.0][step % 2] };
                    let age = (steps - step) as f64 * step_s / 0.05;
                    weight * wanted_mm(step) * (-age).exp() * step_s / (3.0 * 0.05)
                })
                .sum();
            let expected_mm = 0.5 * wanted_mm(steps) + 0.5 * crept_mm;
            largest_mm = largest_mm.max((reached_mm - expected_mm).abs());
            furthest_mm = furthest_mm.max((reached_mm - wanted_mm(steps)).abs());
        }
    }
    assert!(largest_mm < 5e-5 && furthest_mm > 0.05, "{largest_mm} mm, {furthest_mm} mm");
}

#[test]
fn rubber_with_a_memory_delays_electrodes_and_not_the_contact() {
    let elastic = moving(60.0, 3.0);
    let world = World { rubber: CREEPING.into(), ..elastic.clone() };
    let path = world.path.unwrap();
    let timetable = Timetable::every(0.01, 0.008, 0.2).unwrap();
    let frames = |world: &World, outputs: Outputs| {
        let synthesis = Synthesis::new(world).ideal().outputs(outputs);
        let synthesis = synthesis.along(path, timetable.clone());
        synthesis.frames(Stream::Test, 20 * 20)
    };
    let forces = || ElectrodeOutputs { quantity: Quantity::Force, axes: vec![Axis::X, Axis::Z] };
    let contact = || Outputs::Contact(vec![ContactOutput::Centre, ContactOutput::Force]);
    for outputs in [forces().into(), contact()] {
        let [remembering, at_once] = [&world, &elastic].map(|it| frames(it, outputs.clone()));
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        assert!(remembering.outputs.values.iter().zip(at_once.outputs.values.iter()).all(same));
        assert_ne!(remembering.inputs.values, at_once.inputs.values);
    }
    // Readings are those of the electrodes' places.
    let moved = frames(&world, Outputs::all_deformations());
    let lines = moved.inputs.lines().zip(moved.outputs.lines()).step_by(57);
    for (readings_ohm, deformation_mm) in lines {
        let (row_mm, _) = deformation_mm[2 * 18..].as_chunks::<3>();
        for (found, expected) in
            readings_ohm[36..].iter().zip(world.sensor.linearise(2, &row_mm[..6]))
        {
            assert!((found / expected.resistance_ohm - 1.0).abs() < 1e-12);
        }
    }
    // Still contacts were held for long, and nothing presses an untouched sensor.
    let still = |world: &World| Synthesis::new(world).frames(Stream::Test, 10);
    assert_eq!(still(&world), still(&elastic));
    let untouched = |world: &World| {
        Synthesis::new(world).untouched().timed(timetable.clone()).frames(Stream::Test, 40)
    };
    assert_eq!(untouched(&world), untouched(&elastic));
}

#[test]
fn rubber_with_a_memory_is_refused_for_unsupported_outputs() {
    let refused = |world: World| world.check().unwrap_err().to_string();
    let creeping = World { rubber: CREEPING.into(), ..moving(50.0, 3.0) };
    let wanted = vec![ContactOutput::Depth, ContactOutput::Force];
    let message = refused(World { outputs: Outputs::Contact(wanted), ..creeping.clone() });
    assert!(message.contains("outputs.contact") && message.contains("[rubber]"), "{message}");
    let path = Path { duration_s: 3600.0, ..creeping.path.unwrap() };
    let message = refused(World { path: Some(path), ..creeping });
    assert!(message.contains("motion.duration_s") && message.contains("3600000 steps"));
}
