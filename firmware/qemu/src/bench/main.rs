//! Decodes with every number format and exponential, for `cargo xtask cycles`, which traces this program and
//! counts the instructions of each region. The model lies in slot A, and may have any shape.
#![no_std]
#![no_main]

mod kernel;
mod region;

mod inputs;

mod frames;

use core::hint::black_box;

use board_common::region::take_weights;
use cortex_m_rt::entry;
use defmt::{info, unwrap};
use qemu_image::checks::Numbers;
use qemu_image::exit;
use qemu_image::slot::Slot;
use taxel_core::blob::Model;
use taxel_core::exp::{Libm, Micromath, Polynomial};
use taxel_core::rbf::{Format, Network};
use taxel_core::scale::UNITS;

use frames::Arena;
use kernel::{COLS, F32, F32Direct, Fixed16, Formatted, Kernel, OUTPUTS, Portable};
use region::{calibrate, region};

/// Baseline of every reading, for models with relative inputs.
const BASELINE_OHM: f32 = 60.0;

/// Measures one inference and one row of the paper's shape with every kernel (number format and exponential), in
/// the order of the table.
#[inline(never)]
fn measure_every_kernel(model: &Model<'_>, network: &Network<'_>, frame: &[[f32; COLS]]) {
    let bench = Bench { network, frame };
    bench.measure::<Formatted<F32, Polynomial>>("f32");
    bench.measure::<Portable<F32>>("f32-portable");
    bench.measure::<Formatted<Fixed16, Polynomial>>("fixed16");
    bench.measure::<Portable<Fixed16>>("fixed16-portable");
    bench.measure::<Formatted<F32Direct, Polynomial>>("f32-direct");
    bench.measure::<Formatted<F32Direct, Libm>>("f32-direct-libm");
    bench.measure::<Formatted<F32Direct, Micromath>>("f32-direct-micromath");
    let mut outputs = [[0.0; OUTPUTS]; ROWS];
    match network.format() {
        Format::F32 => region("f32-portable", "frame", || {
            Portable::<F32>::decode(black_box(model), black_box(frame), black_box(&mut outputs));
        }),
        Format::Fixed16 => region("fixed16-portable", "frame", || {
            Portable::<Fixed16>::decode(
                black_box(model),
                black_box(frame),
                black_box(&mut outputs),
            );
        }),
        Format::F32Direct => (),
    }
}

/// Number of rows of the paper's sensor.
const ROWS: usize = 8;

/// Inputs of the measurement of one row: its network, and the frame whose first row is decoded.
struct Bench<'a> {
    network: &'a Network<'a>,
    frame: &'a [[f32; COLS]],
}

impl Bench<'_> {
    /// Measures one kernel, if the network has its number format.
    #[inline(never)] // so that the stack holds only one kernel's values at a time
    fn measure<K: Kernel>(&self, name: &str) {
        let (network, readings) = (self.network, unwrap!(self.frame.first()));
        if network.format() != K::FORMAT {
            return;
        }
        let (mut scaled, mut outputs) = ([0.0; COLS], [0.0; OUTPUTS]);
        unwrap!(network.scale(readings, &mut scaled).ok());
        region(name, "inference", || {
            K::infer(black_box(network), black_box(&mut scaled), black_box(&mut outputs));
        });
        region(name, "row", || {
            let (scaled, outputs) = (black_box(&mut scaled), black_box(&mut outputs));
            K::infer_row(black_box(network), black_box(readings), scaled, outputs);
        });
    }
}

#[entry]
fn main() -> ! {
    calibrate();
    // SAFETY: the slots, and the RAM for weights, are taken here only.
    let (([slot, _], ..), ram) = unsafe { (Slot::take(), take_weights()) };
    let mut arena = Arena(bytemuck::cast_slice_mut(ram));
    let length = unwrap!(Model::declared_length(slot.bytes()), "slot A holds no model");
    let blob = unwrap!(slot.bytes().get(..length), "the model in slot A is cut off");
    let model = unwrap!(checked(blob), "the model in slot A is unsound");
    // The first row's network is measured for all.
    let network = model.network_of_row(0).and_then(|index| model.networks().nth(index));
    let network = unwrap!(network, "the model has no network for its first row");
    info!("centres {=usize}", network.shape().centres);
    let frame = frames::frame(&model, &mut arena);
    let shape = model.shape();
    let is_papers = (shape.rows, shape.inputs, shape.outputs) == (ROWS, COLS, OUTPUTS);
    if model.projection().is_none() {
        if is_papers && !model.metadata().relative_inputs {
            measure_every_kernel(&model, &network, frame.as_chunks().0);
        } else {
            measure_inference(&network, &mut arena);
        }
    }
    frames::measure(&model, frame, &mut arena);
    exit::success()
}

/// Parses `blob` to a model; it is checked only here.
#[inline(never)] // frees the stack that checking needs
fn checked(blob: &[u8]) -> Option<Model<'_>> {
    Model::decode(blob).ok()
}

/// Measures one inference of a network of any shape, with the firmware's exponential.
#[inline(never)]
fn measure_inference(network: &Network<'_>, arena: &mut Arena) {
    let shape = network.shape();
    let (scaled, outputs) = (arena.take(shape.inputs), arena.take(shape.outputs));
    let mut numbers = Numbers::new(3);
    scaled.fill_with(|| 0.9 * UNITS * numbers.draw());
    region(network.format().name(), "inference", || {
        infer(black_box(network), black_box(scaled), black_box(outputs));
    });
}

#[inline(never)]
fn infer(network: &Network<'_>, scaled: &mut [f32], outputs: &mut [f32]) {
    let _ = network.infer_scaled_with::<Polynomial>(scaled, outputs);
}
