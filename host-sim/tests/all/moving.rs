//! Contacts that move: what commands say of them, and what a trade makes of them.

use host_sim::evaluate::trade::{self, Bounds, Device, Plan, Trade};
use host_sim::experiment::Experiment;
use host_sim::subject::Subject;
use taxel_core::filter::Settings;
use taxel_data::Silent;
use taxel_evaluate::moving::Moving;
use taxel_learn::ModelBlob;
use taxel_simulate::Synthesis;
use taxel_simulate::path::Path;

use crate::common::{Folder, small_scene, unrefined};

/// The scene `press` with few frames, and contacts that move fast if they move.
fn scene(moves: bool) -> Experiment {
    let mut scene = unrefined("press");
    (scene.training.frames, scene.training.test_frames) = (1500, 80);
    let path = Path { trajectories: 6, duration_s: 0.3, ..Path::at(100.0, 5.0) };
    scene.world.path = moves.then_some(path);
    scene
}

fn traded(moves: bool, bounds: Bounds) -> Trade {
    let plan = Plan {
        centres: vec![16],
        column_steps: vec![1],
        samples_averaged: vec![1, 4],
        device: Device::default(),
        worst_case: false,
    };
    let subject = Subject::Scene(Box::new(scene(moves)));
    let mut trade = trade::compute(&subject, &plan, "dz_mm", &bounds, &Silent).unwrap();
    trade.choose(&bounds).unwrap();
    trade
}

#[test]
fn four_samples_are_chosen_for_still_contacts_and_one_for_moving_ones() {
    // Whatever has the least error.
    let any = Bounds { latency_ms: Some(100.0), ..Bounds::default() };
    let of_chosen = |trade: &Trade| trade.points[trade.chosen.unwrap()].samples_averaged;
    let still = traded(false, any);
    assert_eq!((of_chosen(&still), still.motion.is_none()), (4, true));
    let moving = traded(true, any);
    assert_eq!((of_chosen(&moving), moving.motion.unwrap().trajectories), (1, 6));
    let (with, without): (Vec<_>, Vec<_>) = moving.points.iter().partition(|p| p.filter.is_some());
    assert_eq!((with.len(), with.len()), (without.len(), still.points.len()));
    assert!(moving.readings.iter().all(|of| of.limit.groups.is_empty()));

    // Errors are those of the model's newest estimates, as they are and filtered.
    let scene = scene(true);
    let path = scene.world.path.unwrap();
    for (i, point) in moving.points.iter().enumerate().filter(|(_, point)| !point.each_row) {
        let samples = point.samples_averaged as f64;
        let synthesis = Synthesis::new(&scene.world).noise_level(0.005 / samples.sqrt());
        let (times, blob) = (point.times, ModelBlob::of_bytes(moving.blob(i)).unwrap());
        // Decoders that take about as long share their frames: periods are 2 % apart.
        let period_ms = ((times.period_ms().ln() / 0.02).ceil() * 0.02).exp();
        let scan = ([times.scan_ms.unwrap(), period_ms], 1);
        let seen = Moving::new(&scene, &synthesis, path, scan);
        let seen = seen.unwrap();
        let model = blob.prepare();
        let estimates = model.decode_lines(&seen.frames.inputs.values);
        let us = |ms: f64| (1000.0 * ms).round() as u32;
        let filter = point.filter.map(|filter| Settings {
            time_constant_us: us(filter.time_constant_ms),
            lead_us: us(filter.lead_ms),
        });
        let estimates = seen.filtered(&estimates, filter.unwrap_or_default());
        let errors = seen.errors(&estimates, times.frame_ms, &scene.measure());
        assert_eq!(errors, point.errors, "{}", point.name());
    }
}

#[test]
fn commands_tell_the_error_as_a_robot_meets_it_beside_the_age_of_an_estimate() {
    let folder = Folder::new("moving-commands");
    let motion = "[motion]\nspeed_mm_per_s = [50.0, 50.0]\npress_rate_hz = [3.0, 3.0]\ntrajectories = 4\n[noise]";
    folder.write("small.toml", small_scene().replace("[noise]", motion));
    folder.write("still.toml", small_scene());
    let run = folder.json(&["run", "small.toml"]);
    let moving = &run["moving"];
    let rmse = |of: &serde_json::Value| of["errors"][2]["rmse"].as_f64().unwrap();
    let ways = moving["ways"].as_array().unwrap();
    assert_eq!(
        (ways.len(), ways[0]["filter"].is_null(), ways[1]["filter"].is_null()),
        (2, true, false)
    );
    assert!(rmse(&ways[0]) < rmse(&moving["decoders"][0]), "{moving}");
    assert!(ways[0]["age_ms"].as_f64().unwrap() > 1.0);
    assert_eq!(moving["shown"]["time_s"].as_array().unwrap().len(), 486);
    let text = folder.succeed(&["run", "small.toml"]);
    assert!(
        text.contains(
            "As a robot meets it, on 4 contacts that slide at 50 mm/s and press 3 times a second"
        ),
        "{text}"
    );
    let page = std::fs::read_to_string(folder.path("out/small/report.html")).unwrap();
    assert!(page.contains("Contacts that move") && page.contains("while a contact slides"));
    assert!(folder.json(&["run", "still.toml"])["moving"].is_null());

    let trade = ["trade", "still.toml", "--centres", "12", "--no-refine"];
    let fast = [&trade[..], &["--motion", "50mm/s,3Hz", "--max-error", "1"]].concat();
    let traded = folder.json(&fast);
    assert_eq!(traded["motion"]["speed_mm_per_s"], serde_json::json!([50.0, 50.0]));
    let chosen = traded["chosen"].as_u64().unwrap() as usize;
    assert_eq!(traded["points"][chosen]["samples_averaged"], 1);
    for (motion, refusal) in [
        ("50mm/s", "give a speed and a rate of presses"),
        ("50mm/s,-1Hz", "press_rate_hz = [-1.0, -1.0]"),
    ] {
        let refused = folder.fail(&[&trade[..], &["--motion", motion]].concat(), 2);
        assert!(refused.contains(refusal), "{refused}");
    }
}
