//! The trade between speed and accuracy, on a small plan.

use host_sim::evaluate::trade::{self, Limits, Plan, Trade};
use host_sim::infer::Kernel;
use host_sim::model::LoadedModel;
use host_sim::progress::Progress;
use host_sim::random::Stream;
use host_sim::scene::Scene;
use host_sim::{Result, synth};

fn press() -> Scene {
    let mut scene = Scene::load("press").unwrap();
    (scene.training.frames, scene.training.test_frames) = (1500, 500);
    scene
}

fn compute(scene: &Scene, limits: Limits) -> Result<Trade> {
    let plan = Plan { centres: vec![16, 64], samples_averaged: vec![1, 16], clock_mhz: 100.0 };
    trade::compute(scene, &plan, "dz_mm", &limits, &Progress::silent())
}

#[test]
fn every_knob_has_its_points_and_the_front_is_what_nothing_beats() {
    let trade = compute(&press(), Limits::default()).unwrap();
    assert_eq!(trade.chosen, None);
    let count = |kernel: &str| trade.points.iter().filter(|p| p.kernel == kernel).count();
    for kernel in ["fixed16", "f32-direct", "f32-direct-libm", "f32-direct-micromath"] {
        assert_eq!(count(kernel), 2 * 2 * 2, "{kernel}"); // K, tail, samples
    }
    // Only where rounding is proved harmless.
    assert!((1..=8).contains(&count("f32")), "{}", count("f32"));

    let rank = |p: &trade::Point| (p.frame.cycles, p.samples_averaged, p.rmse("dz_mm"));
    for point in &trade.points {
        let own = rank(point);
        let beaten =
            trade.points.iter().map(rank).any(|other| {
                other != own && other.0 <= own.0 && other.1 <= own.1 && other.2 <= own.2
            });
        assert_eq!(point.on_front, !beaten, "{}", point.name());
        assert_eq!(point.frame_us, point.frame.cycles as f64 / 100.0);
        assert!(point.ratio_to_best.iter().all(|ratio| *ratio >= 1.0));
    }
    for group in 0..3 {
        let least = trade.points.iter().map(|p| p.ratio_to_best[group]).fold(f64::MAX, f64::min);
        assert_eq!(least, 1.0);
    }

    // More samples, less error; 16 bits as good as 32.
    let find = |kernel: &str, centres, samples| {
        let wanted = |p: &&trade::Point| {
            (p.kernel.as_str(), p.centres, p.samples_averaged, p.affine_tail)
                == (kernel, centres, samples, true)
        };
        trade.points.iter().find(wanted).unwrap()
    };
    let [once, often] = [1, 16].map(|samples| find("fixed16", 64, samples).rmse("dz_mm"));
    assert!(often < 0.8 * once, "{often} against {once}");
    let (fixed, float) = (find("fixed16", 64, 1), find("f32-direct", 64, 1));
    assert!(fixed.rmse("dz_mm") < 1.01 * float.rmse("dz_mm"));
    assert!(fixed.frame.cycles < float.frame.cycles / 3);
    assert!(fixed.flash_bytes < 6 * float.flash_bytes / 10);
}

#[test]
fn the_chosen_blob_is_what_the_table_says() {
    let scene = press();
    let limits = Limits { error: Some(0.055), ..Limits::default() };
    let trade = compute(&scene, limits).unwrap();
    let chosen = trade.chosen.unwrap();
    let point = &trade.points[chosen];
    assert!(point.rmse("dz_mm") <= 0.055);
    for other in &trade.points {
        let cheaper = other.frame.cycles < point.frame.cycles && other.rmse("dz_mm") <= 0.055;
        assert!(!cheaper, "{} is cheaper", other.name());
    }
    let model = LoadedModel::from_bytes("chosen.bin".as_ref(), trade.blob(chosen)).unwrap();
    assert_eq!(model.bytes().len(), point.flash_bytes);
    let mut averaged = scene.clone();
    averaged.noise.level /= (point.samples_averaged as f64).sqrt();
    let test = synth::synthesise(&averaged, Stream::Test, scene.training.test_frames);
    let estimate = model.decode(Kernel::Polynomial, &test.inputs);
    let errors = test.outputs.squared_errors(&estimate.values);
    let z = errors.iter().skip(2).step_by(3);
    let count = errors.len() / 3 * test.frames();
    let rmse = (z.sum::<f64>() / count as f64).sqrt();
    assert!((rmse - point.rmse("dz_mm")).abs() < 1e-12, "{rmse}");
}

#[test]
fn limits_that_nothing_meets_and_scenes_that_were_not_measured_are_refused() {
    let scene = press();
    let limits = Limits { error: Some(1e-6), cycles: Some(20_000), flash_bytes: None };
    let message = compute(&scene, limits).unwrap_err().to_string();
    let told = ["--max-error 0.000001 --max-cycles 20000", "smallest error", "loosen"];
    assert!(told.iter().all(|part| message.contains(part)), "{message}");
    for error in [0.0, -1.0, f64::NAN] {
        let limits = Limits { error: Some(error), ..Limits::default() };
        let message = compute(&scene, limits).unwrap_err().to_string();
        assert!(message.contains("--max-error"), "{message}");
    }

    let mut other = scene.clone();
    other.read_rows.pop();
    let message = compute(&other, Limits::default()).unwrap_err().to_string();
    assert!(message.contains("7 rows of 18 readings"), "{message}");
    let plan = Plan { centres: vec![20], samples_averaged: vec![1], clock_mhz: 1.0 };
    let outcome = trade::compute(&scene, &plan, "dz_mm", &Limits::default(), &Progress::silent());
    let message = outcome.unwrap_err().to_string();
    assert!(message.contains("--centres 20") && message.contains("[16, 32"), "{message}");
}
