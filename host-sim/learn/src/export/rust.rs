//! Models as Rust source: statics of fixed size.

use std::fmt::{self, Write as _};

use taxel_core::blob::Model;
use taxel_core::rbf::float32::{self, Parameters};
use taxel_core::rbf::{Format, Network};

use super::text::{columns, rows_of};

/// Part of a model that [`Fixed`](taxel_core::Fixed) has no room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unheld {
    /// Projection of all readings to one network's inputs.
    Projection,
    /// Inputs relative to the baseline.
    RelativeInputs,
    /// Deviations and novelty.
    Confidence,
    /// Filling of missing readings.
    Fill,
    /// Network in another number format than `f32`.
    Format(Format),
}

impl fmt::Display for Unheld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Projection => f.write_str("a projection of the whole array"),
            Self::RelativeInputs => f.write_str("inputs relative to the baseline"),
            Self::Confidence => f.write_str("a confidence"),
            Self::Fill => f.write_str("a fill of missing readings"),
            Self::Format(format) => write!(f, "networks in the number format {}", format.name()),
        }
    }
}

/// Rust source of a `model`: a static [`Fixed`](taxel_core::Fixed) for each network, and a function `decode` from the
/// readings of a frame to its outputs, with the bits that [`Decoder`](taxel_core::Decoder) gives.
///
/// The static of a row-wire is called `ROW_1`, `ROW_2` and so on; rows that share a network share the first one's.
/// Numbers are written with the digits that tell them from their neighbours in f32.
///
/// # Errors
/// The first part of the model that a `Fixed` has no room for.
pub fn source(model: &Model<'_>) -> Result<String, Unheld> {
    let networks = held(model)?;
    let mut source = header(model);
    for (index, network) in networks.iter().enumerate() {
        let rows: Vec<usize> = rows_of(model, index).collect();
        write_static(&mut source, &rows, network);
    }
    write_decode(&mut source, model);
    Ok(source)
}

/// Networks of `model`, if a `Fixed` has room for all of it.
fn held<'a>(model: &Model<'a>) -> Result<Vec<float32::Network<'a>>, Unheld> {
    let parts = [
        (model.whole_frames(), Unheld::Projection),
        (model.metadata().relative_inputs, Unheld::RelativeInputs),
        (model.confidence().is_some(), Unheld::Confidence),
        (model.fill().is_some(), Unheld::Fill),
    ];
    if let Some((_, part)) = parts.into_iter().find(|(present, _)| *present) {
        return Err(part);
    }
    let in_f32 = |network: Network<'a>| match network {
        Network::F32(network) => Ok(network),
        Network::Fixed16(_) => Err(Unheld::Format(network.format())),
    };
    model.networks().map(in_f32).collect()
}

/// Comment on the model: its name and CRC, a call, and its columns.
fn header(model: &Model<'_>) -> String {
    let (shape, metadata) = (model.shape(), model.metadata());
    let [inputs, outputs] =
        [shape.inputs, shape.outputs].map(|count| format!("[[f32; {count}]; {}]", shape.rows));
    let columns =
        |names, units| columns(names, units, "//     ", |it| it.escape_debug().to_string());
    format!(
        "// Model {:?} in arrays of fixed size, as `host-sim export` wrote it; CRC-32 of its blob: {:08x}.\n\
         // To decode a frame, with this file as module `model`:\n\
         //     let outputs: {outputs} = model::decode(&readings); // readings: {inputs}\n\
         // Readings, row after row, with their units:\n{}\
         // Outputs, row after row, with their units:\n{}\
         use taxel_core::Fixed;\n",
        metadata.name,
        model.crc(),
        columns(metadata.input_names, metadata.input_units),
        columns(metadata.output_names, metadata.output_units),
    )
}

/// Adds the static of a `network` that decodes these `rows`; nothing if it decodes none.
fn write_static(source: &mut String, rows: &[usize], network: &float32::Network<'_>) {
    let Some(first) = rows.first() else { return };
    let (shape, p) = (network.shape(), network.parameters());
    let Parameters { input_minimum, input_per_span, centres, decay, output_weights, bias, .. } = *p;
    let affine = match p.affine {
        [] => &vec![0.0; shape.inputs * shape.outputs][..],
        affine => affine,
    };
    let rows: Vec<String> = rows.iter().map(ToString::to_string).collect();
    let plural = if rows.len() == 1 { "" } else { "s" };
    // Writing to a string cannot fail.
    let _ = write!(
        source,
        "\n/// Network of row{plural} {}.\n\
         #[rustfmt::skip]\n\
         #[allow(clippy::approx_constant, clippy::unreadable_literal)]\n\
         pub static ROW_{first}: Fixed<{}, {}, {}> = Fixed {{\n\
         \x20   input_minimum: {input_minimum:?},\n\
         \x20   input_per_span: {input_per_span:?},\n\
         \x20   centres: [\n{}    ],\n\
         \x20   decay: {decay:?},\n\
         \x20   output_weights: [\n{}    ],\n\
         \x20   bias: {bias:?},\n\
         \x20   affine: [\n{}    ],\n\
         }}\n\
         .checked();\n",
        rows.join(", "),
        shape.inputs,
        shape.centres,
        shape.outputs,
        lines(centres, shape.inputs),
        lines(output_weights, shape.outputs),
        lines(affine, shape.outputs),
    );
}

/// Arrays of `length` numbers, one a line.
fn lines(values: &[f32], length: usize) -> String {
    let lines = values.chunks_exact(length).map(|line| format!("        {line:?},\n"));
    lines.collect::<Vec<_>>().concat()
}

fn write_decode(source: &mut String, model: &Model<'_>) {
    let shape = model.shape();
    let network_of = |row| {
        let index = model.network_of_row(row).unwrap_or_default();
        rows_of(model, index).next().unwrap_or_default()
    };
    let rows: Vec<String> = (1..=shape.rows).map(|row| format!("row_{row}")).collect();
    let calls = rows.iter().enumerate();
    let calls = calls.map(|(row, name)| format!("ROW_{}.infer({name})", network_of(row)));
    let _ = write!(
        source,
        "\n/// Outputs of a frame from its readings, row after row. A row with a reading that is not finite has NaN.\n\
         #[rustfmt::skip]\n\
         #[must_use]\n\
         pub fn decode(readings: &[[f32; {}]; {}]) -> [[f32; {}]; {}] {{\n\
         \x20   let [{}] = readings;\n\
         \x20   [{}]\n\
         }}\n",
        shape.inputs,
        shape.rows,
        shape.outputs,
        shape.rows,
        rows.join(", "),
        calls.collect::<Vec<_>>().join(", "),
    );
}

/// Number of bytes that the statics of `model`'s networks take.
#[must_use]
pub fn weight_bytes(model: &Model<'_>) -> usize {
    let floats = |network: Network<'_>| float32::Network::block_words(network.shape(), true);
    4 * model.networks().map(floats).sum::<usize>()
}
