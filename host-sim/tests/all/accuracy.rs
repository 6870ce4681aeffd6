//! Accuracy that the project promises, on the reference scene `press`.

use crate::common::unrefined;
use host_sim::experiment::Experiment;
use host_sim::metrics::{self, Errors};
use taxel_data::{Dataset, Silent, Stream};
use taxel_learn::decoders::LINEAR;
use taxel_simulate::synthesise;

fn row_4(scene: &str, noise_level: f64) -> Experiment {
    let mut scene = unrefined(scene);
    scene.world.read_rows = vec![3];
    scene.world.set_noise_level(noise_level).unwrap();
    scene.frames = 20_000;
    scene
}

/// Errors of the network and of the best linear decoder on fresh frames of row 4.
fn network_and_linear(scene: &str, noise_level: f64) -> (Vec<Errors>, Vec<Errors>) {
    let scene = row_4(scene, noise_level);
    let frames = |stream, count| -> Dataset { synthesise(&scene.world, stream, count) };
    let (training, test) = (frames(Stream::Training, 20_000), frames(Stream::Test, 5000));
    assert!(scene.training.options.centres <= 128);
    let blob = scene.train(&Silent).unwrap();
    let measure = scene.measure();
    let network = metrics::judge(&blob.prepare(), &test, &measure);
    let linear = metrics::judge(LINEAR.fit(&training).unwrap().as_ref(), &test, &measure);
    (network.errors, linear.errors)
}

#[test]
fn one_row_of_press_is_decoded_close_to_the_limit() {
    // The least possible error of any decoder is 0.046 mm.
    let (network, _) = network_and_linear("press", 0.005);
    let z = network.iter().find(|e| e.group == "dz_mm").unwrap();
    println!("press, row 4: z RMSE {:.4} mm", z.rmse);
    assert!(z.rmse <= 0.050, "{} mm", z.rmse);
}

#[test]
fn without_noise_no_axis_is_behind_the_best_linear_decoder() {
    for scene in ["press", "paper"] {
        let (network, linear) = network_and_linear(scene, 0.0);
        assert_eq!(network.len(), 3);
        for (network, linear) in network.iter().zip(&linear) {
            println!(
                "{scene} {}: {:.5} against {:.5} mm",
                network.group, network.rmse, linear.rmse
            );
            assert!(network.rmse <= linear.rmse, "{scene} {}", network.group);
        }
    }
}

#[test]
fn a_few_frames_without_noise_train_a_network_for_others_too() {
    let mut scene = unrefined("press");
    scene.world.set_noise_level(0.0).unwrap();
    (scene.frames, scene.training.options.centres) = (300, 8);
    let test = synthesise(&scene.world, Stream::Test, 2000);
    let blob = scene.train(&Silent).unwrap();
    let errors = metrics::judge(&blob.prepare(), &test, &scene.measure());
    let z = errors.errors.iter().find(|errors| errors.group == "dz_mm").unwrap();
    // 0.127 mm if nothing holds the affine tail; 0.029 mm as measured.
    assert!(z.rmse < 0.06, "{} mm", z.rmse);
}
