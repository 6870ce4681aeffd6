//! What a library says of its model: sizes, cost, columns.

use taxel_core::blob::Model;
use taxel_core::{RowStatus, scratch_floats};

use super::numbers::comment;
use super::template::Values;
use crate::cost::{Cost, Design};
use crate::export::constant_bytes;
use crate::export::text::columns;
use crate::packing::ModelBlob;

/// Facts of a model.
pub struct Facts<'b> {
    model: Model<'b>,
    constant_bytes: usize,
    /// What a frame costs Taxel's own firmware.
    cost: Cost,
}

impl<'b> Facts<'b> {
    /// Facts of the model in `blob`.
    pub fn new(blob: &'b ModelBlob) -> Self {
        let design = Design::new(blob);
        let cost = Cost::of_frame(&design);
        Self { model: blob.parse(), constant_bytes: constant_bytes(blob), cost }
    }

    /// Bytes of RAM that a caller's arrays take; the self-test has such arrays of its own.
    fn arrays_bytes(&self) -> usize {
        let shape = self.model.shape();
        let (readings, outputs) = (shape.rows * shape.inputs, shape.rows * shape.outputs);
        4 * (readings + outputs + scratch_floats(&self.model)) + shape.rows
    }

    /// Bytes of RAM that a caller and the library take.
    fn ram_bytes(&self) -> usize {
        let (shape, model) = (self.model.shape(), &self.model);
        let baseline =
            if model.metadata().relative_inputs { 4 * shape.rows * shape.inputs } else { 0 };
        let deviations = if model.assesses() { 4 * shape.rows * shape.outputs } else { 0 };
        self.arrays_bytes() + baseline + deviations
    }

    fn networks(&self) -> String {
        let of_network = |network: taxel_core::rbf::Network<'_>| {
            let shape = network.shape();
            let tail = if network.has_affine_tail() { " and a linear part" } else { "" };
            let (inputs, centres, outputs) = (shape.inputs, shape.centres, shape.outputs);
            let format = network.format().name();
            format!(
                "{}, {}, {}{tail} in {format}",
                counted(inputs, "input"),
                counted(centres, "centre"),
                counted(outputs, "output")
            )
        };
        let mut networks: Vec<String> = self.model.networks().map(of_network).collect();
        let count = networks.len();
        networks.dedup();
        let times = if count > 1 { format!("{count} networks: ") } else { String::new() };
        times + &networks.join("; ")
    }

    /// Sets the values that templates ask for.
    pub fn tell(&self, values: &mut Values) {
        let (model, shape) = (&self.model, self.model.shape());
        let metadata = model.metadata();
        let has = |part: bool| i32::from(part);
        let relative = metadata.relative_inputs;
        let said = |is_so: bool, text: &'static str| if is_so { text } else { "" };
        let title = comment(metadata.name);
        values.set("TITLE", format!("Model {title}, CRC-32 of its blob {:08x}", model.crc()));
        values.set("SHORT_TITLE", &title);
        values.set("CRC", format!("{:08x}", model.crc()));
        values.set("ROWS", shape.rows);
        values.set("READINGS", shape.rows * shape.inputs);
        values.set("OUTPUTS", shape.rows * shape.outputs);
        values.set("SCRATCH", scratch_floats(model));
        values.set("RELATIVE", has(relative));
        values.set("CONFIDENCE", has(model.assesses()));
        values.set("FILL", has(model.reading_model().is_some()));
        values.set("BUT_BASELINE", said(relative, " but the baseline"));
        values.set("AND_BASELINE", said(relative, ", baseline"));
        values.set("FORGETS", said(relative, " It forgets the baseline."));
        for (key, status) in [
            ("DECODED", RowStatus::Decoded),
            ("MISSING_READING", RowStatus::MissingReading),
            ("OVERFLOW", RowStatus::Overflow),
            ("NO_TOUCH", RowStatus::NoTouch),
        ] {
            values.set(key, status as u8);
        }
        let array = model.whole_frames();
        values.set("OR_ANOTHER_ROWS", said(array, ", or one of another row"));
        values.set("NETWORKS", self.networks());
        values.set("CONSTANT_BYTES", self.constant_bytes);
        values.set("ROW_READINGS", shape.inputs);
        values.set("ROW_OUTPUTS", shape.outputs);
        values.set("RAM_BYTES", self.ram_bytes());
        values.set("TEST_BYTES", self.arrays_bytes());
        values.set("AND_DEVIATIONS", said(model.assesses(), ", deviations"));
        values.set("CYCLES", self.cost.cycles);
        let listed = |names, units| columns(names, units, " *     ", comment);
        values.set(
            "COLUMNS",
            format!(
                " * Readings, row after row, with their units:\n{} * Outputs, row after row, with their units:\n{}",
                listed(metadata.input_names, metadata.input_units),
                listed(metadata.output_names, metadata.output_units)
            ),
        );
        values.set(
            "COST",
            format!(
                " * Network: {}.\n * Cost, as predicted: {} bytes of constants in flash; {} bytes of RAM with the caller's \
                 arrays, and {} more\n * for the self-test, if it is called. Taxel's own firmware takes {} cycles a frame \
                 on a Cortex-M4F; this C takes\n * up to 2.3 times as many.\n",
                self.networks(),
                self.constant_bytes,
                self.ram_bytes(),
                self.arrays_bytes(),
                self.cost.cycles
            ),
        );
        values.set("WHAT_READINGS", first_and_last(metadata.input_names.iter()));
        values.set("WHAT_OUTPUTS", first_and_last(metadata.output_names.iter()));
    }
}

/// A number of things, in words.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The first and the last of names, for a line.
fn first_and_last<'n>(mut names: impl Iterator<Item = &'n str>) -> String {
    let first = comment(names.next().unwrap_or_default());
    names.last().map_or(first.clone(), |last| format!("{first} to {}", comment(last)))
}
