//! Data files: reading and writing of CSV.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use taxel_data::csv_file;
use taxel_data::data_file::DataFile;
use taxel_data::random::Stream;
use taxel_simulate::{World, synthesise};

/// Frames in the file: 288 numbers each, 24 MB together.
const FRAMES: usize = 4096;

fn csv(criterion: &mut Criterion) {
    let path = std::env::temp_dir().join(format!("taxel-csv-{}.csv", std::process::id()));
    let frames = synthesise(&World::press(), Stream::Training, FRAMES);
    let names = frames.inputs.names.iter().chain(&frames.outputs.names).map(String::as_str);
    let lines = frames.inputs.lines().zip(frames.outputs.lines());
    let lines = lines.map(|(readings, outputs)| readings.iter().chain(outputs).copied());
    csv_file::write(&path, names, lines).expect("a writable folder for temporary files");
    let length = || std::fs::metadata(&path).expect("the file written above").len();
    let mut group = criterion.benchmark_group("csv");
    group.sample_size(20).throughput(Throughput::Bytes(length()));
    group.bench_function("read", |bencher| {
        bencher.iter(|| DataFile::read(black_box(&path)).expect("the file written above"));
    });
    let table = &frames.inputs;
    let lines = || table.lines().map(|line| line.iter().copied());
    let names = || table.names.iter().map(String::as_str);
    let write = |path: &Path| csv_file::write(path, names(), lines()).expect("a writable folder");
    write(&path);
    group.throughput(Throughput::Bytes(length()));
    group.bench_function("write", |bencher| bencher.iter(|| write(black_box(&path))));
    group.finish();
    let _ = std::fs::remove_file(&path); // a file left behind does no harm
}

criterion_group!(benches, csv);
criterion_main!(benches);
