//! Training of one network by K-means: 100,000 samples, 18 inputs and outputs, 256 centres.
//!
//! The samples are written to cargo's folder for temporary files, for `compare/training.py`.

use std::fs;
use std::hint::black_box;
use std::path::PathBuf;

use criterion::{Criterion, criterion_group, criterion_main};
use taxel_data::Stream;
use taxel_learn::Options;
use taxel_learn::train::kmeans::Search;
use taxel_learn::train::{InputScale, Samples};
use taxel_simulate::{World, synthesise};

const FRAMES: usize = 100_000;
const CENTRES: usize = 256;
const SPREAD: f64 = 0.8;
/// Search that makes all iterations and looks at all samples.
const SEARCH: Search = Search { restarts: 1, iterations: 30, enough: 0.0, most_points: usize::MAX };

fn leave(name: &str, values: &[f64]) {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("training-{name}.f64"));
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(path, bytes).expect("a writable folder for temporary files");
}

fn training(criterion: &mut Criterion) {
    // Samples of the fourth row-wire of the scene `press`.
    let world = World { read_rows: vec![3], ..World::press() };
    let table = synthesise(&world, Stream::Training, FRAMES).row_table(0);
    leave("inputs", &InputScale::new(&table).apply(&table.inputs.values));
    leave("outputs", &table.outputs.values);
    let options =
        Options { search: SEARCH, centres: CENTRES, spread: SPREAD, ..Options::of_rows() };
    let mut group = criterion.benchmark_group("training");
    group.sample_size(15);
    group.bench_function("whole", |bencher| {
        bencher.iter(|| {
            let samples = Samples::new(black_box(&table));
            samples.fit(&samples.centres(&options, 0), &options).expect("a network that fits")
        });
    });
    group.finish();
}

criterion_group!(benches, training);
criterion_main!(benches);
