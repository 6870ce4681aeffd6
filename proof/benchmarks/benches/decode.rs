//! Decoding of a table on one core, in each number format.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use taxel_core::rbf::Format;
use taxel_data::{Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, pack};
use taxel_simulate::{Synthesis, World};

/// Lines in a table; `compare/decode.py` divides by it.
const LINES: usize = 8192;
const TRAINING_FRAMES: usize = 2000;
const CENTRES: [usize; 2] = [64, 256];
/// Noise with which every number format holds the network.
const NOISE: f64 = 0.05;

fn decode(criterion: &mut Criterion) {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let world = World { read_rows: vec![3], ..World::press() };
    let frames = |stream, count| Synthesis::new(&world).noise_level(NOISE).frames(stream, count);
    let dataset = frames(Stream::Training, TRAINING_FRAMES);
    let readings = frames(Stream::Test, LINES).inputs.values;
    let origin = Origin::of_data("row", 0, world.seed, &dataset);
    let mut group = criterion.benchmark_group("decode");
    group.sample_size(30).throughput(Throughput::Elements(LINES as u64));
    for format in Format::ALL {
        for centres in CENTRES {
            let options = Options { format, centres, ..Options::of_rows() };
            let trained = train(&dataset, &options, &Silent).expect("a network");
            let blob = pack(&trained, &dataset, &origin).expect("a blob");
            let model = blob.prepare();
            assert!(model.model().networks().all(|network| network.format() == format));
            group.bench_function(BenchmarkId::new(format.name(), centres), |bencher| {
                one_thread.install(|| bencher.iter(|| model.decode_lines(black_box(&readings))));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, decode);
criterion_main!(benches);
