//! What decoding costs on a Cortex-M4F, predicted from a model's [`Design`]: instructions, cycles, flash and RAM.
//!
//! Instructions are a linear formula of a model's sizes, with five constants for each number format, and more for inputs that
//! do not fit registers. `cargo xtask cycles` counts models in QEMU, and fails if a prediction is off by more than a tenth.
//! `docs/cycles.md` says more.

mod design;
mod memory;

pub use design::{Design, FrontDesign, NetworkDesign, Sides};
pub use memory::DecoderRam;
use serde::Serialize;
use taxel_core::blob::ModelShape;
use taxel_core::rbf::Format;
use taxel_core::track;

/// Instructions of one number format's code, and their cycles.
struct Price {
    /// Instructions of a frame, and of each network of it: one a row, or one behind a projection.
    frame: f64,
    network: f64,
    /// Instructions of each centre, of each input of a centre, and of each output of a centre. The affine tail costs as
    /// much as a centre's outputs for each input.
    centre: f64,
    centre_input: f64,
    centre_output: f64,
    /// Cycles of an instruction on average, with memory that never waits.
    cycles: f64,
}

const F32: Price = Price {
    frame: 250.0,
    network: 800.0,
    centre: 82.0,
    centre_input: 5.1,
    centre_output: 8.0,
    cycles: 1.85,
};

/// Networks of 18 inputs and 18 outputs in `f32`, whose loops the compiler unrolls.
const F32_OF_18: Price = Price {
    frame: 250.0,
    network: 880.0,
    centre: 90.4,
    centre_input: 0.0,
    centre_output: 3.42,
    cycles: 1.95,
};

const FIXED16: Price = Price {
    frame: 250.0,
    network: 240.0,
    centre: 11.6,
    centre_input: 0.59,
    centre_output: 0.77,
    cycles: 1.63,
};

/// Inputs of a network in `fixed16` that stay in registers. Each other one costs instructions for each centre, and so many
/// times as many for each output of the tail.
const REGISTERS: usize = 18;
const STREAMED: f64 = 0.7;
const STREAMED_OUTPUT: f64 = 2.5;

/// Instructions of a touch: of a frame, of each reading (to one side, to both, and to both without a threshold), and of
/// each output.
const TOUCH: f64 = 150.0;
const TOUCHED: [f64; 3] = [8.4, 10.7, 6.3];
const TOUCHED_OUTPUT: f64 = 1.5;
/// Instructions of each reading that a touch takes relative to the baseline.
const TOUCHED_RELATIVE: f64 = 1.2;
/// Instructions of a projection for each reading, and for each product of a reading and a feature.
const PROJECTED: [f64; 2] = [4.0, 2.05];
/// Instructions of each reading that is made relative to the baseline.
const RELATIVE: f64 = 12.0;
/// Instructions of the filter in time: of a frame, of each row and of each output; and cycles of one.
const FILTER: [f64; 3] = [163.0, 24.0, 26.0];
const FILTER_CYCLES: f64 = 1.7;

/// Instructions of a tracker that follows a contact which presses all electrodes: of a frame, of each electrode, of each
/// reading, of each group of columns, and of each electrode and group; and cycles of one.
const TRACKER: [f64; 5] = [27_500.0, 146.0, 25.0, 300.0, 53.0];
const TRACKER_CYCLES: f64 = 1.85;

/// Instructions of what stands before a `network`, for so many `readings` of a frame.
fn before(network: &NetworkDesign, readings: f64, relative: bool) -> f64 {
    let Some(front) = network.front else { return 0.0 };
    let of_reading = match (front.touch, relative) {
        (Some(sides), relative) => {
            TOUCHED[sides as usize] + if relative { TOUCHED_RELATIVE } else { 0.0 }
        }
        (None, true) => RELATIVE,
        (None, false) => 0.0,
    };
    let of_outputs = TOUCHED_OUTPUT * network.shape.outputs as f64;
    let (touch, seen) =
        front.touch.map_or((0.0, readings), |_| (TOUCH + of_outputs, readings + 1.0));
    let [reading, product] = PROJECTED;
    let projection = match network.features() {
        0 => 0.0,
        features => seen * (reading + product * features as f64),
    };
    touch + of_reading * readings + projection
}

/// Cost of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles with memory that never waits.
    pub cycles: u64,
}

impl Cost {
    /// Cost of decoding a frame by a model of this `design`.
    #[must_use]
    pub fn of_frame(design: &Design) -> Self {
        let readings = (design.shape.rows * design.shape.inputs) as f64;
        let rows_relative = design.relative_inputs && !design.whole_frames();
        let mut instructions = if rows_relative { RELATIVE * readings } else { 0.0 };
        let mut cycles = 0.0;
        for (place, network) in design.row_networks().enumerate() {
            let NetworkDesign { format, shape, affine_tail, .. } = network;
            instructions += before(network, readings, design.relative_inputs);
            let [inputs, centres, outputs] =
                [shape.inputs, shape.centres, shape.outputs].map(|count| count as f64);
            let streamed = shape.inputs.saturating_sub(REGISTERS) as f64;
            let (price, streamed) = match format {
                Format::Fixed16 => {
                    (&FIXED16, STREAMED * streamed * (centres + STREAMED_OUTPUT * outputs))
                }
                Format::F32 if (shape.inputs, shape.outputs) == (18, 18) => (&F32_OF_18, 0.0),
                Format::F32 => (&F32, 0.0),
            };
            let lines = centres + if *affine_tail { inputs } else { 0.0 };
            let frame = if place == 0 { price.frame } else { 0.0 };
            instructions += frame
                + price.network
                + streamed
                + centres * (price.centre + price.centre_input * inputs)
                + price.centre_output * lines * outputs;
            cycles = price.cycles;
        }
        Self::new(instructions, cycles)
    }

    /// Cost of the [filter in time](taxel_core::filter) of estimates of this `shape`.
    #[must_use]
    pub fn of_filter(shape: ModelShape) -> Self {
        let [frame, row, output] = FILTER;
        let (rows, outputs) = (shape.rows as f64, (shape.rows * shape.outputs) as f64);
        Self::new(frame + row * rows + output * outputs, FILTER_CYCLES)
    }

    /// Cost of [tracking](taxel_core::track) a contact, of a sensor of these sizes.
    #[must_use]
    pub fn of_tracker(sizes: track::Sizes) -> Self {
        let [frame, electrode, cell, group, share] = TRACKER;
        let groups = sizes.rows.saturating_mul(sizes.groups());
        let shares = sizes.all_electrodes().saturating_mul(sizes.groups());
        let counts = [1, sizes.all_electrodes(), sizes.cells(), groups, shares];
        let each = counts.into_iter().zip([frame, electrode, cell, group, share]);
        let instructions = each.map(|(count, each)| count as f64 * each).sum();
        Self::new(instructions, TRACKER_CYCLES)
    }

    fn new(instructions: f64, cycles: f64) -> Self {
        let [instructions, cycles] =
            [instructions, instructions * cycles].map(|count| count.round() as u64);
        Self { instructions, cycles }
    }

    /// Cost of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            instructions: self.instructions + other.instructions,
            cycles: self.cycles + other.cycles,
        }
    }
}
