//! Decodes with every number format, for `cargo xtask cycles`, which traces this program and
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
use taxel_core::rbf::Network;
use taxel_core::scale::UNITS;

use frames::Arena;
use kernel::{COLS, OUTPUTS};
use region::{calibrate, region};

/// Baseline of every reading, for models with relative inputs.
const BASELINE_OHM: f32 = 60.0;

/// Measures one inference and one row of the paper's shape, in `fixed16` also by the compiled twin of the assembly.
#[inline(never)]
fn measure_row(model: &Model<'_>, network: &Network<'_>, frame: &[[f32; COLS]]) {
    let readings = unwrap!(frame.first());
    let (mut scaled, mut outputs) = ([0.0; COLS], [0.0; OUTPUTS]);
    unwrap!(network.scale(readings, &mut scaled).ok());
    let name = network.format().name();
    region(name, "inference", || {
        kernel::infer(black_box(network), black_box(&mut scaled), black_box(&mut outputs));
    });
    region(name, "row", || {
        let (scaled, outputs) = (black_box(&mut scaled), black_box(&mut outputs));
        kernel::infer_row(black_box(network), black_box(readings), scaled, outputs);
    });
    let Network::Fixed16(network) = network else { return };
    unwrap!(Network::from(*network).scale(readings, &mut scaled).ok());
    region("fixed16-portable", "inference", || {
        let (scaled, outputs) = (black_box(&mut scaled), black_box(&mut outputs));
        kernel::infer_portably(black_box(network), scaled, outputs);
    });
    region("fixed16-portable", "row", || {
        let (scaled, outputs) = (black_box(&mut scaled), black_box(&mut outputs));
        kernel::infer_row_portably(black_box(network), black_box(readings), scaled, outputs);
    });
    let mut outputs = [[0.0; OUTPUTS]; ROWS];
    region("fixed16-portable", "frame", || {
        kernel::decode_portably(black_box(model), black_box(frame), black_box(&mut outputs));
    });
}

/// Number of rows of the paper's sensor.
const ROWS: usize = 8;

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
            measure_row(&model, &network, frame.as_chunks().0);
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

/// Measures one inference of a network of any shape.
#[inline(never)]
fn measure_inference(network: &Network<'_>, arena: &mut Arena) {
    let shape = network.shape();
    let (scaled, outputs) = (arena.take(shape.inputs), arena.take(shape.outputs));
    let mut numbers = Numbers::new(3);
    scaled.fill_with(|| 0.9 * UNITS * numbers.draw());
    region(network.format().name(), "inference", || {
        kernel::infer(black_box(network), black_box(scaled), black_box(outputs));
    });
}
