//! Accuracy that the project promises, on the reference scene `press`.

use host_sim::dataset::{Block, Dataset};
use host_sim::evaluate::metrics::{self, Definition, Errors, Measure};
use host_sim::evaluate::table1;
use host_sim::infer::{Kernel, infer};
use host_sim::progress::Progress;
use host_sim::random::Stream;
use host_sim::scene::Scene;
use host_sim::synth;
use host_sim::train::linear::LinearDecoder;
use host_sim::train::{self, Options};

fn row_4(scene: &str, noise_level: f64, frames: usize, stream: Stream) -> (Scene, Dataset) {
    let mut scene = Scene::load(scene).unwrap();
    scene.read_rows = vec![3];
    scene.set_noise_level(noise_level).unwrap();
    let dataset = synth::synthesise(&scene, stream, frames);
    (scene, dataset)
}

fn errors(truth: &Block, estimate: &[f64]) -> Vec<Errors> {
    let measure = Measure { full_scale: vec![1.0; 18], thickness_mm: Some(5.0) };
    metrics::by_group(&truth.outputs, estimate, &measure)
}

/// Errors of the network and of the best linear decoder on fresh frames of row 4.
fn network_and_linear(scene: &str, noise_level: f64) -> (Vec<Errors>, Vec<Errors>) {
    let (scene, training) = row_4(scene, noise_level, 20_000, Stream::Training);
    let (_, test) = row_4(&scene.name, noise_level, 20_000, Stream::Test);
    let t = &scene.training;
    assert!(t.centres <= 128 && t.affine_tail);
    let options = Options::new(t.centres, t.spread, t.affine_tail, scene.seed);
    let trained = train::train(&training, &options, &Progress::silent()).unwrap();
    let network = &trained.networks[0];
    let (training, test) = (training.block(0), test.block(0));
    let estimate = infer(&network.network(), Kernel::default(), &test.inputs);
    let linear = LinearDecoder::fit(&training).predict(&test);
    (errors(&test, &estimate), errors(&test, &linear))
}

#[test]
fn one_row_of_press_is_decoded_close_to_the_limit() {
    // The least possible error of any decoder is 0.046 and 0.064 mm.
    for (noise_level, most_mm) in [(0.005, 0.050), (0.01, 0.069)] {
        let (network, _) = network_and_linear("press", noise_level);
        let z = network.iter().find(|e| e.group == "dz_mm").unwrap();
        println!("press, row 4, noise {noise_level}: z RMSE {:.4} mm", z.rmse);
        assert!(z.rmse <= most_mm, "noise {noise_level}: {} mm", z.rmse);
    }
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
fn no_cell_of_the_papers_table_is_worse_than_the_mean_by_more_than_two_per_cent() {
    let table = table1::compute(&Scene::load("paper").unwrap(), &Progress::silent()).unwrap();
    let (mut worst, mut cells) = (0.0_f64, 0);
    for column in &table.columns {
        for cell in &column.cells {
            for (network, mean) in cell.network.iter().zip(&column.mean) {
                // R² is the RMSE again, on a scale where the mean is 0.
                for definition in Definition::ALL.iter().filter(|d| **d != Definition::RSquared) {
                    let pair = (definition.of(network), definition.of(mean));
                    let (Some(network), Some(mean)) = pair else { continue };
                    worst = worst.max(network / mean);
                    cells += 1;
                }
            }
        }
    }
    println!("{cells} cells; the worst is {worst:.4} × the mean's error");
    assert_eq!(cells, 10 * 4 * (4 + 4 + 5));
    assert!(worst <= 1.02, "{worst}");
}
