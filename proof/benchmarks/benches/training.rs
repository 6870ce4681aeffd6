//! Training of one network: 100,000 samples, 18 inputs and outputs, 256 centres; and output weights by QR beside the
//! recursion, of 20,000 samples with fewer centres, on one thread.
//!
//! Data and results are written to cargo's folder for temporary files, for `compare/training.py`.

use std::fs;
use std::hint::black_box;
use std::path::PathBuf;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use taxel_data::dataset::RowTable;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::infer::infer;
use taxel_learn::train::kmeans::{self, Search};
use taxel_learn::train::least_squares::{Design, Factor, Recursion, Regressors};
use taxel_learn::train::{FittedNetwork, INITIAL_COVARIANCE, InputScale, Recursive, Samples};
use taxel_learn::{Exponential, Options};
use taxel_simulate::{World, synthesise};

const FRAMES: usize = 100_000;
const TEST_FRAMES: usize = 20_000;
const CENTRES: usize = 256;
const SPREAD: f64 = 0.8;
/// Search that makes all iterations and looks at all samples.
const SEARCH: Search = Search { restarts: 1, iterations: 30, enough: 0.0, most_points: usize::MAX };

/// Samples of the fourth row-wire of the scene `press`.
fn samples(stream: Stream, frames: usize) -> RowTable {
    let world = World { read_rows: vec![3], ..World::press() };
    synthesise(&world, stream, frames).row_table(0)
}

fn random() -> Random {
    Random::new(1, Stream::Training, Purpose::Centres, 0, 0)
}

fn train(table: &RowTable) -> FittedNetwork {
    let options =
        Options { search: SEARCH, centres: CENTRES, spread: SPREAD, ..Options::default() };
    let samples = Samples::new(table);
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
    let (table, test) = (samples(Stream::Training, FRAMES), samples(Stream::Test, TEST_FRAMES));
    let inputs = table.inputs.names.len();
    let scale = InputScale::new(&table);
    let scaled = scale.apply(&table.inputs.values);
    let start = kmeans::plus_plus(&scaled, inputs, CENTRES, &mut random());
    let found = kmeans::refine(&scaled, inputs, &start, &SEARCH);
    let predicted = infer(&train(&table).network(), Exponential::default(), &test.inputs.values);
    leave("inputs", &scaled);
    leave("outputs", &table.outputs.values);
    leave("test-inputs", &scale.apply(&test.inputs.values));
    leave("test-outputs", &test.outputs.values);
    leave("start", &start);
    leave("centres", &found.centres);
    // `compare/training.py` compares these with scikit-learn's.
    let error = rmse(&predicted, &test.outputs.values);
    leave("results", &[found.inertia, found.iterations as f64, error]);

    let decays = &[1.0 / (2.0 * SPREAD * SPREAD)];
    let regressors = Regressors { centres: &found.centres, inputs, decays, affine_tail: true };
    let outputs = table.outputs.names.len();
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
            Factor::new(&design, &table.outputs.values, outputs, INITIAL_COVARIANCE).weights()
        });
    });
    group.bench_function("whole", |bencher| bencher.iter(|| train(black_box(&table))));
    group.finish();
}

/// Time of a sample in both solvers of output weights.
fn solvers(criterion: &mut Criterion) {
    const SAMPLES: usize = 20_000;
    let table = samples(Stream::Training, SAMPLES);
    let (inputs, outputs) = (table.inputs.names.len(), table.outputs.names.len());
    let scaled = InputScale::new(&table).apply(&table.inputs.values);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut group = criterion.benchmark_group("solvers");
    group.sample_size(10).throughput(Throughput::Elements(SAMPLES as u64));
    for count in [48, 64, 200] {
        let centres = &kmeans::plus_plus(&scaled, inputs, count, &mut random());
        let decays = &[1.0 / (2.0 * SPREAD * SPREAD)];
        let design = Regressors { centres, inputs, decays, affine_tail: false }.of(&scaled);
        let targets = &table.outputs.values;
        group.bench_function(BenchmarkId::new("qr", count), |bencher| {
            let factor = || Factor::new(&design, black_box(targets), outputs, INITIAL_COVARIANCE);
            bencher.iter(|| one_thread.install(factor));
        });
        group.bench_function(BenchmarkId::new("rls", count), |bencher| {
            bencher.iter(|| {
                let (n, settings) = (design.regressors(), Recursive::default());
                let mut recursion = Recursion::new(n, outputs, INITIAL_COVARIANCE, &settings);
                recursion.absorb(&design, black_box(targets), 0..SAMPLES);
                recursion
            });
        });
    }
    group.finish();
}

criterion_group!(benches, training, solvers);
criterion_main!(benches);
