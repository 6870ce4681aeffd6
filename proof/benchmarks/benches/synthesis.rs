//! Synthesis of a scene's frames: deformations drawn, readings computed, noise added.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use taxel_data::random::Stream;
use taxel_simulate::{World, synthesise};

/// Frames in one measurement; `compare/synthesis.py` divides by it.
const FRAMES: usize = 16_384;

fn frames_of_a_scene(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("synthesis");
    group.sample_size(20).throughput(Throughput::Elements(FRAMES as u64));
    for (name, world) in [("paper", World::paper()), ("press", World::press())] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| synthesise(black_box(&world), Stream::Training, FRAMES));
        });
    }
    group.finish();
}

criterion_group!(benches, frames_of_a_scene);
criterion_main!(benches);
