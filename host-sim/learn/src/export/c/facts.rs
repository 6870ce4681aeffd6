//! What a library says of its model: sizes, cost, columns.

use std::collections::HashSet;
use std::fmt::Write as _;

use taxel_core::blob::Model;
use taxel_core::health::Limits;
use taxel_core::{RowStatus, scratch_floats};

use super::name::Name;
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

    /// Bytes of RAM that a caller's arrays take, with the baseline; the self-test has such arrays of its own.
    fn arrays_bytes(&self) -> usize {
        let shape = self.model.shape();
        let (readings, outputs) = (shape.rows * shape.inputs, shape.rows * shape.outputs);
        let baseline = if self.model.metadata().relative_inputs { readings } else { 0 };
        4 * (readings + baseline + outputs + scratch_floats(&self.model)) + shape.rows
    }

    /// Bytes of RAM that a caller and the library take.
    fn ram_bytes(&self) -> usize {
        let (shape, model) = (self.model.shape(), &self.model);
        let deviations = if model.assesses() { 4 * shape.rows * shape.outputs } else { 0 };
        self.arrays_bytes() + deviations
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

    /// Sets the values that templates of a library called `name` ask for. Readings in Ω have `limits`.
    pub fn tell(&self, values: &mut Values, name: &Name, limits: Option<Limits>) {
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
        values.set("AND_BASELINE", said(relative, ", baseline"));
        let sensor = format!("const {}_t *sensor, ", name.lower());
        values.set("SENSOR", if relative { &sensor } else { "" });
        values.set("GIVEN", said(relative, "sensor, "));
        values.set("GIVE", said(relative, "&sensor, "));
        if let Some(Limits { shorted_below_ohm, open_above_ohm }) = limits {
            // Infinite readings are missing anyway.
            let [low, high] =
                [shorted_below_ohm, open_above_ohm].map(|it| it.clamp(f32::MIN, f32::MAX));
            values.set("SHORTED_BELOW", format!("{low:?}f"));
            values.set("OPEN_ABOVE", format!("{high:?}f"));
            values.set("SHORTED_BELOW_OHM", low);
            values.set("OPEN_ABOVE_OHM", high);
        }
        values.set("OR_BEYOND", said(limits.is_some(), ", or outside the limits"));
        values.set("OUTPUT_NUMBERS", output_numbers(metadata.output_names.iter(), name));
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

/// Macros of the numbers of outputs, by their names. One that is there already has its number behind it.
fn output_numbers<'n>(names: impl Iterator<Item = &'n str>, library: &Name) -> String {
    let (mut lines, mut taken) = (String::new(), HashSet::new());
    for (number, name) in names.enumerate() {
        let letter = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
        let mut macro_name: String = name.chars().map(letter).collect();
        if !taken.insert(macro_name.clone()) {
            let _ = write!(macro_name, "_{number}");
            taken.insert(macro_name.clone());
        }
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "#define {}_OUTPUT_{macro_name} {number}u", library.upper());
    }
    lines
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
