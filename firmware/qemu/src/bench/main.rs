//! Decodes with every number format and exponential, for `cargo xtask cycles`, which traces this program and
//! counts the instructions of each region. The model lies in slot A.
#![no_std]
#![no_main]

mod kernel;
mod region;

mod inputs;

use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::{assert, info, unwrap};
use model_core::blob::Model;
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::gate::{Gate, Rest};
use model_core::rbf::{Format, Network};
use model_core::scale::UNITS;
use model_core::{Decoder, RowStatus};
use qemu_image::checks::Numbers;
use qemu_image::exit;
use qemu_image::slot::Slot;

use kernel::{
    COLS, Decoded, F32, F32Direct, Fixed16, Formatted, Frame, Kernel, OUTPUTS, Portable, ROWS,
    SCRATCH, decoder,
};
use region::{calibrate, region};

/// Most inputs, and most outputs, of a network of another shape than the paper's.
const MOST: usize = 160;

/// Tolerance of the gate: 3.5 times a noise of 0.5 %.
const REST_TOLERANCE: f32 = 0.0175;

/// Inputs of the measurement: the model, and the frame that is decoded.
struct Bench<'a> {
    model: &'a Model<'a>,
    network: Network<'a>,
    scaled: [f32; COLS],
    frame: Frame,
}

/// Measures every kernel (number format and exponential), in the order of the table.
fn measure_every_kernel(bench: &Bench<'_>) {
    bench.measure::<Formatted<F32, Polynomial>>("f32");
    bench.measure::<Portable<F32>>("f32-portable");
    bench.measure::<Formatted<Fixed16, Polynomial>>("fixed16");
    bench.measure::<Portable<Fixed16>>("fixed16-portable");
    bench.measure::<Formatted<F32Direct, Polynomial>>("f32-direct");
    bench.measure::<Formatted<F32Direct, Libm>>("f32-direct-libm");
    bench.measure::<Formatted<F32Direct, Micromath>>("f32-direct-micromath");
}

impl Bench<'_> {
    /// Measures one kernel in every scope, if the model has its number format.
    #[inline(never)] // so that the stack holds only one kernel's values at a time
    fn measure<K: Kernel>(&self, name: &str) {
        let Some(decoder) = K::of(self.model, self.network.format()) else { return };
        let (mut scaled, mut outputs) = (self.scaled, [0.0; OUTPUTS]);
        region(name, "inference", || {
            K::infer(black_box(&self.network), black_box(&mut scaled), black_box(&mut outputs));
        });
        let readings = &self.frame[0];
        region(name, "row", || {
            let (scaled, outputs) = (black_box(&mut scaled), black_box(&mut outputs));
            K::infer_row(black_box(&self.network), black_box(readings), scaled, outputs);
        });
        let mut outcome = Decoded::NOTHING;
        region(name, "frame", || {
            K::decode(black_box(&decoder), black_box(&self.frame), black_box(&mut outcome));
        });
        assert!(outcome.status == [RowStatus::Decoded; ROWS], "a row was not decoded");
    }

    /// Measures the gate with the kernel that the firmware runs, on two frames: one with all rows at rest, and one
    /// with all rows touched at their last readings, so that the gate looks at all readings.
    #[inline(never)]
    fn measure_gate(&self) {
        let Some(decoder) = decoder(self.model) else { return };
        let name = self.network.format().name();
        let rest = at_rest(&decoder, &self.frame);
        let mut scratch = [0.0; SCRATCH];
        let mut awake = self.frame;
        for row in &mut awake {
            row[COLS - 1] *= 1.0 + 2.0 * REST_TOLERANCE;
        }
        let gate = gate(&self.frame, &rest);
        let mut outcome = rest;
        for (scope, frame, status) in [
            ("resting-frame", &self.frame, RowStatus::AtRest),
            ("awake-frame", &awake, RowStatus::Decoded),
        ] {
            region(name, scope, || {
                let (frame, outcome) = (black_box(frame), black_box(&mut outcome));
                let (decoder, gate) = (black_box(&decoder), black_box(gate));
                outcome.decode::<Polynomial>(decoder, frame, gate, &mut scratch);
            });
            assert!(outcome.status == [status; ROWS], "a row is not {=str}", scope);
        }
    }
}

/// What the sensor shows at rest, if `frame` is its baseline.
fn at_rest(decoder: &Decoder<'_, ROWS>, frame: &Frame) -> Decoded {
    let mut rest = Decoded::NOTHING;
    rest.decode::<Polynomial>(decoder, frame, None, &mut [0.0; SCRATCH]);
    rest
}

fn gate<'a>(baseline: &'a Frame, rest: &'a Decoded) -> Option<Gate<'a>> {
    let (outputs, status) = (rest.outputs.as_flattened(), &rest.status);
    let rest = Rest { baseline_ohm: baseline.as_flattened(), outputs, status };
    Gate::new(rest, REST_TOLERANCE)
}

/// Measures one network for all rows, on whole frames: without a gate and, if `gated`, behind it.
#[inline(never)]
fn measure_array<E: ExpKernel>(model: &Model<'_>, frame: &Frame, name: &str, gated: bool) {
    let decoder = unwrap!(decoder(model));
    let rest = at_rest(&decoder, frame);
    let mut outcome = rest;
    let mut scratch = [0.0; SCRATCH];
    let mut awake = *frame;
    awake[ROWS - 1][COLS - 1] *= 1.0 + 2.0 * REST_TOLERANCE;
    let gate = gate(frame, &rest);
    for (scope, frame, gate, status) in [
        ("array-frame", frame, None, RowStatus::Decoded),
        ("array-resting-frame", frame, gate, RowStatus::AtRest),
        ("array-awake-frame", &awake, gate, RowStatus::Decoded),
    ] {
        if gate.is_some() && !gated {
            continue;
        }
        region(name, scope, || {
            let (frame, outcome) = (black_box(frame), black_box(&mut outcome));
            let (decoder, gate) = (black_box(&decoder), black_box(gate));
            outcome.decode::<E>(decoder, frame, gate, &mut scratch);
        });
        assert!(outcome.status == [status; ROWS], "a row is not as in {=str}", scope);
    }
}

#[entry]
fn main() -> ! {
    calibrate();
    // SAFETY: the slots are taken here only.
    let ([slot, _], _) = unsafe { Slot::take() };
    let length = unwrap!(Model::declared_length(slot.bytes()), "slot A holds no model");
    let blob = unwrap!(slot.bytes().get(..length), "the model in slot A is cut off");
    let model = unwrap!(checked(blob), "the model in slot A is unsound");
    let shape = model.shape();
    // The first row is measured for all.
    let network = model.network_of_row(0).and_then(|index| model.networks().nth(index));
    let network = unwrap!(network, "the model has no network for its first row");
    info!("centres {=usize}", network.shape().centres);
    if (shape.rows, shape.inputs, shape.outputs) != (ROWS, COLS, OUTPUTS) {
        measure_inference(&network);
        exit::success();
    }
    if model.projection().is_some() {
        measure_arrays(&model, &network);
    } else {
        measure_rows(&model, network);
    }
    exit::success()
}

/// Parses `blob` to a model; it is checked only here.
#[inline(never)] // frees the stack that checking needs
fn checked(blob: &[u8]) -> Option<Model<'_>> {
    Model::decode(blob).ok()
}

/// Measures one inference of a network of another shape than the paper's.
#[inline(never)]
fn measure_inference(network: &Network<'_>) {
    let (mut scaled, mut outputs) = ([0.0; MOST], [0.0; MOST]);
    let mut numbers = Numbers::new(3);
    scaled.fill_with(|| 0.9 * UNITS * numbers.draw());
    let shape = network.shape();
    let scaled = unwrap!(scaled.get_mut(..shape.inputs), "the model has too many inputs");
    let outputs = unwrap!(outputs.get_mut(..shape.outputs), "the model has too many outputs");
    region(network.format().name(), "inference", || {
        infer(black_box(network), black_box(scaled), black_box(outputs));
    });
}

#[inline(never)]
fn infer(network: &Network<'_>, scaled: &mut [f32], outputs: &mut [f32]) {
    let _ = network.infer_scaled(scaled, outputs);
}

#[inline(never)] // so that the stack holds only one of the two functions' values
fn measure_rows(model: &Model<'_>, network: Network<'_>) {
    // Made in place, because two frames would not fit the stack beside all else.
    let frame = inputs::frame(model, &mut Numbers::new(3));
    let mut bench = Bench { model, network, scaled: [0.0; COLS], frame };
    unwrap!(bench.network.scale(&bench.frame[0], &mut bench.scaled).ok());
    measure_every_kernel(&bench);
    bench.measure_gate();
}

#[inline(never)]
fn measure_arrays(model: &Model<'_>, network: &Network<'_>) {
    let frame = inputs::frame(model, &mut Numbers::new(3));
    let name = network.format().name();
    measure_array::<Polynomial>(model, &frame, name, true);
    if network.format() == Format::F32Direct {
        measure_array::<Libm>(model, &frame, "f32-direct-libm", false);
        measure_array::<Micromath>(model, &frame, "f32-direct-micromath", false);
    }
}
