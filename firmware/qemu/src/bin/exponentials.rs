//! Compares exponentials for the activations of networks in `f32`: that of the firmware, libm's and micromath's. Each has
//! its largest error against f64, and the instructions that it takes for one centre. QEMU counts time by instructions, so
//! that the figures are the same on any computer.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::{info, unwrap};
use qemu_image::clock::Clock;
use qemu_image::exit;
use taxel_core::Aligned;
use taxel_core::blob::Model;
use taxel_core::exp::{Exponential, Polynomial};
use taxel_core::rbf::{Network, float32};

static MODEL: Aligned<[u8; include_bytes!("../../../../testdata/hand-made.bin").len()]> =
    Aligned(*include_bytes!("../../../../testdata/hand-made.bin"));

/// libm's exponential.
struct Libm;

impl Exponential for Libm {
    fn exp(x: f32) -> f32 {
        libm::expf(x)
    }
}

/// micromath's exponential. Below −80 it is wrong by orders of magnitude, so that such arguments give 0.
struct Micromath;

impl Exponential for Micromath {
    fn exp(x: f32) -> f32 {
        if x < -80.0 { 0.0 } else { micromath::F32(x).exp().0 }
    }
}

/// No exponential: what a centre takes besides.
struct Nothing;

impl Exponential for Nothing {
    fn exp(x: f32) -> f32 {
        x
    }
}

/// Number of inferences whose time is taken.
const INFERENCES: u64 = 5000;
/// Nanoseconds of an instruction in the emulator (`-icount shift=5`).
const NS_PER_INSTRUCTION: u64 = 32;
/// Number of arguments from −80 to 0 whose error is taken.
const ARGUMENTS: u32 = 20_000;

/// Instructions of one inference of a row.
#[inline(never)]
fn instructions<E: Exponential>(network: float32::Network<'_>, clock: &mut Clock) -> u64 {
    let (scaled, mut outputs) = ([0.4; 18], [0.0; 18]);
    let network = network.with_exponential::<E>();
    let start_us = clock.now_us();
    for _ in 0..INFERENCES {
        black_box(&network).infer_scaled(black_box(&scaled), black_box(&mut outputs));
    }
    (clock.now_us() - start_us) * 1000 / NS_PER_INSTRUCTION / INFERENCES
}

/// Largest error of results, in billionths of them.
#[inline(never)]
fn error<E: Exponential>() -> u32 {
    let errors = (0..ARGUMENTS).map(|number| {
        let x = -80.0 * (number as f32 / ARGUMENTS as f32);
        let truth = libm::exp(x.into());
        libm::fabs(f64::from(E::exp(x)) / truth - 1.0)
    });
    (1e9 * errors.fold(0.0, f64::max)) as u32
}

fn compare<E: Exponential>(name: &str, network: float32::Network<'_>, clock: &mut Clock) {
    let besides = instructions::<Nothing>(network, clock);
    let centres = network.shape().centres as u64;
    let each = (instructions::<E>(network, clock) - besides + centres / 2) / centres;
    let billionths = error::<E>();
    info!(
        "{=str}: about {=u64} instructions, error up to {=u32} billionths",
        name, each, billionths
    );
}

#[entry]
fn main() -> ! {
    let model = unwrap!(Model::decode(&MODEL.0).ok());
    let Some(Network::F32(network)) = model.networks().next() else {
        defmt::panic!("the model is not in f32")
    };
    let mut clock = Clock::start();
    compare::<Polynomial>("polynomial", network, &mut clock);
    compare::<Libm>("libm", network, &mut clock);
    compare::<Micromath>("micromath", network, &mut clock);
    exit::success()
}
