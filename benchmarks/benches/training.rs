//! Training one network: 100,000 samples, 18 inputs and outputs, 256 centres.
//!
//! Leaves its data and results in cargo's folder for temporary files, for `compare/training.py`.

use std::fs;
use std::hint::black_box;
use std::path::PathBuf;

use benchmarks::scene;
use criterion::{Criterion, criterion_group, criterion_main};
use host_sim::dataset::Block;
use host_sim::infer::{Kernel, infer};
use host_sim::random::{Purpose, Random, Stream};
use host_sim::synth::synthesise;
use host_sim::train::kmeans::{self, Search};
use host_sim::train::least_squares::{Factor, Regressors};
use host_sim::train::{FittedNetwork, INITIAL_COVARIANCE, InputScale, Options, Samples};

const FRAMES: usize = 100_000;
const TEST_FRAMES: usize = 20_000;
const CENTRES: usize = 256;
const SPREAD: f64 = 0.8;
/// All iterations are made, and all samples looked at.
const SEARCH: Search = Search { restarts: 1, iterations: 30, enough: 0.0, most_points: usize::MAX };

/// The fourth row-wire of the scene `press`.
fn samples(stream: Stream, frames: usize) -> Block {
    let mut scene = scene("press");
    scene.read_rows = vec![3];
    synthesise(&scene, stream, frames).block(0)
}

fn random() -> Random {
    Random::new(1, Stream::Training, Purpose::Centres, 0, 0)
}

fn train(block: &Block) -> FittedNetwork {
    let options = Options { search: SEARCH, ..Options::new(CENTRES, SPREAD, true, 1) };
    let samples = Samples::new(block);
    samples.fit(&samples.centres(&options, 0), &options).expect("a network that an f32 holds")
}

fn rmse(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / a.len() as f64).sqrt()
}

fn leave(name: &str, values: &[f64]) {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("training-{name}.f64"));
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(path, bytes).expect("a writable folder for temporary files");
}

fn training(criterion: &mut Criterion) {
    let (block, test) = (samples(Stream::Training, FRAMES), samples(Stream::Test, TEST_FRAMES));
    let inputs = block.inputs.names.len();
    let scale = InputScale::of(&block);
    let scaled = scale.apply(&block);
    let start = kmeans::plus_plus(&scaled, inputs, CENTRES, &mut random());
    let found = kmeans::refine(&scaled, inputs, &start, &SEARCH);
    let predicted = infer(&train(&block).network(), Kernel::default(), &test.inputs);
    leave("inputs", &scaled);
    leave("outputs", &block.outputs.values);
    leave("test-inputs", &scale.apply(&test));
    leave("test-outputs", &test.outputs.values);
    leave("start", &start);
    leave("centres", &found.centres);
    // What `compare/training.py` holds against scikit-learn's.
    let error = rmse(&predicted, &test.outputs.values);
    leave("results", &[found.inertia, found.iterations as f64, error]);

    let decay = 1.0 / (2.0 * SPREAD * SPREAD);
    let regressors = Regressors { centres: &found.centres, inputs, decay, affine_tail: true };
    let outputs = block.outputs.names.len();
    let mut group = criterion.benchmark_group("training");
    group.sample_size(15);
    group.bench_function("start", |bencher| {
        bencher.iter(|| kmeans::plus_plus(black_box(&scaled), inputs, CENTRES, &mut random()));
    });
    group.bench_function("iterations", |bencher| {
        bencher.iter(|| kmeans::refine(black_box(&scaled), inputs, &start, &SEARCH));
    });
    group.bench_function("weights", |bencher| {
        bencher.iter(|| {
            let design = regressors.of(black_box(&scaled));
            Factor::new(&design, &block.outputs.values, outputs, INITIAL_COVARIANCE).weights()
        });
    });
    group.bench_function("whole", |bencher| bencher.iter(|| train(black_box(&block))));
    group.finish();
}

criterion_group!(benches, training);
criterion_main!(benches);
