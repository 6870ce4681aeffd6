//! Models as Rust source: statics of fixed size, and functions that decode with them.

use std::fmt;

use taxel_core::blob::{Front, Model, ModelShape};
use taxel_core::rbf::{Format, Network, Shape, fixed16, float32};
use taxel_core::scratch_floats;

use super::text::{columns, rows_of};

/// Numbers on a line.
const ON_A_LINE: usize = 8;

/// What stands before each item that holds numbers.
const ATTRIBUTES: &str =
    "#[rustfmt::skip]\n#[allow(clippy::approx_constant, clippy::unreadable_literal)]\n";

/// Part that a model does not have.
const NONE: &str = "None";

/// Rust source of a `model`: statics of all its numbers, a [`Fixed`](taxel_core::Fixed) of them, and functions that call it,
/// with the bits that [`Decoder`](taxel_core::Decoder) gives.
///
/// There is a function `decode`; `fill` of a model with a reading model, and `assess` if that tells novelty and deviations. Numbers
/// are written with the digits that tell them from their neighbours in f32.
#[must_use]
pub fn source(model: &Model<'_>) -> String {
    let of_format = |format| model.networks().any(|network| network.format() == format);
    let [is_f32, is_fixed16] = [Format::F32, Format::Fixed16].map(of_format);
    let kind = match (is_f32, is_fixed16) {
        (true, true) => "rbf::Network<'static>",
        (true, false) => "rbf::float32::Network<'static>",
        (false, _) => "rbf::fixed16::Network<'static>",
    };
    let (mut source, mut networks) = (header(model), Vec::new());
    for (index, network) in model.networks().enumerate() {
        let doc = format!("Network of {}", decoded(model, index));
        let name = format!("NETWORK_{index}");
        let (kind, value) = match network {
            Network::F32(inner) => float32(&inner),
            Network::Fixed16(inner) => fixed16(&inner),
        };
        source += &item(&doc, &name, &kind, &value);
        networks.push(match network {
            Network::F32(_) if is_fixed16 => format!("rbf::Network::F32({name}.network())"),
            Network::Fixed16(_) if is_f32 => format!("rbf::Network::Fixed16({name}.network())"),
            _ => format!("{name}.network()"),
        });
    }
    source + &fixed(model, &networks, kind) + &functions(model)
}

/// Comment on the model: its name and CRC, a call, and its columns.
fn header(model: &Model<'_>) -> String {
    let metadata = model.metadata();
    let columns =
        |names, units| columns(names, units, "//     ", |it| it.escape_debug().to_string());
    format!(
        "// Model {:?} in arrays of fixed size, as `taxel export` wrote it; CRC-32 of its blob: {:08x}.\n\
         // Readings, row after row, with their units:\n{}\
         // Outputs, row after row, with their units:\n{}\
         #[allow(unused_imports)]\n\
         use taxel_core::{{blob, projection, rbf, rbf::arrays, reading_model, touch}};\n",
        metadata.name,
        model.crc(),
        columns(metadata.input_names, metadata.input_units),
        columns(metadata.output_names, metadata.output_units),
    )
}

/// What the network of this `index` decodes.
fn decoded(model: &Model<'_>, index: usize) -> String {
    if model.whole_frames() {
        return "whole frames".into();
    }
    let rows: Vec<String> = rows_of(model, index).map(|row| row.to_string()).collect();
    format!("row{} {}", if rows.len() == 1 { "" } else { "s" }, rows.join(", "))
}

/// Type and value of a network in `f32`.
fn float32(network: &float32::Network<'_>) -> (String, String) {
    let (Shape { inputs, centres, outputs }, p) = (network.shape(), network.parameters());
    let tail = p.affine.len() / outputs;
    let value = format!(
        "arrays::F32 {{\n\
         \x20   input_minimum: {:?},\n\
         \x20   input_per_span: {:?},\n\
         \x20   centres: {},\n\
         \x20   decay: {:?},\n\
         \x20   output_weights: {},\n\
         \x20   bias: {:?},\n\
         \x20   affine: {},\n\
         }}",
        p.input_minimum,
        p.input_per_span,
        arrays(p.centres.chunks_exact(inputs)),
        p.decay,
        arrays(p.output_weights.chunks_exact(outputs)),
        p.bias,
        arrays(p.affine.chunks_exact(outputs)),
    );
    (format!("arrays::F32<{inputs}, {centres}, {outputs}, {tail}>"), value)
}

/// Type and value of a network in `fixed16`.
fn fixed16(network: &fixed16::Network<'_>) -> (String, String) {
    let (Shape { inputs, centres, outputs }, p) = (network.shape(), network.parameters());
    let (pairs, groups) = (inputs.div_ceil(2), centres.div_ceil(fixed16::CENTRES_AT_ONCE));
    let tail = p.affine.len() / pairs;
    let weights = fixed16::CENTRES_AT_ONCE / 2;
    let group = |group: &[u32]| {
        let (exponents, of_outputs) = group.split_at(fixed16::CENTRES_AT_ONCE * (1 + pairs));
        let exponent = |line: &[u32]| {
            format!(
                "        arrays::Exponent {{ b: {}, a: {:?} }},\n",
                line[0],
                in_pairs(&line[1..])
            )
        };
        let exponents: String = exponents.chunks_exact(1 + pairs).map(exponent).collect();
        let of_outputs = arrays(of_outputs.chunks_exact(weights).map(in_pairs));
        format!(
            "        arrays::Group {{ exponents: [\n{exponents}        ], weights: {of_outputs} }},\n"
        )
    };
    let of_groups: String = p.centres.chunks_exact(p.centres.len() / groups).map(group).collect();
    let value = format!(
        "arrays::Fixed16 {{\n\
         \x20   input_midpoint: {:?},\n\
         \x20   input_per_unit: {:?},\n\
         \x20   decay: {},\n\
         \x20   bias: {:?},\n\
         \x20   output_scale: {:?},\n\
         \x20   affine: {},\n\
         \x20   groups: [\n{of_groups}    ],\n\
         }}",
        p.input_midpoint,
        p.input_per_unit,
        p.decay,
        p.bias,
        p.output_scale,
        arrays(p.affine.chunks_exact(pairs).map(in_pairs)),
    );
    let sizes = format!("{inputs}, {centres}, {outputs}, {pairs}, {groups}, {tail}");
    (format!("arrays::Fixed16<{sizes}>"), value)
}

/// The two `i16` of each word, the low half first.
fn in_pairs(words: &[u32]) -> Vec<[i16; 2]> {
    words.iter().map(|word| [*word as i16, (*word >> 16) as i16]).collect()
}

/// Statics of what stands before the network of this `index`, which sees whole frames, and the expression of it.
fn front(index: usize, front: &Front<'_>) -> (String, String) {
    let (mut items, [mut touch, mut projection]) = (String::new(), [NONE, NONE].map(String::from));
    if let Some(it) = front.touch {
        let (name, kind) = (format!("TOUCH_{index}"), it.kind());
        let doc = "Shape and strength of a touch: `Strengths`, then level at rest and threshold of each reading";
        items += &flat(doc, &name, it.block());
        touch = format!("Some(touch::Touch::of_array(touch::Kind::{kind:?}, &{name}))");
    }
    if let Some(it) = front.projection {
        let (name, features) = (format!("PROJECTION_{index}"), it.features());
        let kind = format!("[[f32; {features}]; {}]", it.block().len() / features);
        let doc = "Features: what they begin with, then what a unit of each number adds to them";
        items += &item(doc, &name, &kind, &arrays(it.block().chunks_exact(features)));
        projection = format!("Some(projection::Projection::of_array(&{name}))");
    }
    let outputs = front.outputs;
    let front = "blob::Front";
    (items, format!("{front} {{ outputs: {outputs}, touch: {touch}, projection: {projection} }}"))
}

/// Static of the whole model, whose networks are these expressions of this `kind`, and statics of its other parts.
fn fixed(model: &Model<'_>, networks: &[String], kind: &str) -> String {
    let (mut items, mut reading_model) = (String::new(), NONE.to_owned());
    if let Some(it) = model.reading_model() {
        items += &flat("Block of `ReadingModel::new`", "READING_MODEL", it.block());
        let sizes = format!("reading_model::{:?}", it.sizes());
        reading_model =
            format!("Some(reading_model::ReadingModel::of_array({sizes}, &READING_MODEL))");
    }
    let mut listed = Vec::new();
    for (index, of_frames) in model.fronts().enumerate() {
        let (of_front, front) = front(index, &of_frames);
        items += &of_front;
        listed.push(format!("        ({front}, {}),\n", networks[index]));
    }
    let is_array = model.whole_frames();
    let of_rows = (0..model.shape().rows).filter(|_| !is_array);
    for network in of_rows.filter_map(|row| model.network_of_row(row)) {
        listed.push(format!("        {},\n", networks[network]));
    }
    let ModelShape { rows, inputs, outputs } = model.shape();
    let (relative, scratch) = (model.metadata().relative_inputs, scratch_floats(model));
    let value = format!(
        "taxel_core::Fixed {{\n\
         \x20   networks: taxel_core::Networks::{}(&[\n{}    ]),\n\
         \x20   relative_inputs: {relative},\n\
         \x20   reading_model: {reading_model},\n\
         }}\n.checked()",
        if is_array { "OfFrames" } else { "OfRows" },
        listed.concat(),
    );
    let kind = format!("taxel_core::Fixed<{kind}, {rows}, {inputs}, {outputs}, {scratch}>");
    items + &item("The model", "MODEL", &kind, &value)
}

/// Functions that call the model.
fn functions(model: &Model<'_>) -> String {
    let ModelShape { rows, inputs, outputs } = model.shape();
    let readings = format!("[[f32; {inputs}]; {rows}]");
    let (more, given, doc) = if model.metadata().relative_inputs {
        let doc = " `reciprocals` are those of the baseline (`taxel_core::relative::reciprocal`).";
        (format!(", reciprocals: &{readings}"), "Some(reciprocals)", doc)
    } else {
        (String::new(), "None", "")
    };
    let decode = format!(
        "\n/// Decodes a frame of readings, row after row. A reading that is not finite is missing.{doc}\n\
         #[must_use]\n\
         pub fn decode(readings: &{readings}{more}) -> taxel_core::Decoded<{rows}, {outputs}> {{\n\
         \x20   MODEL.decode(readings, {given})\n\
         }}\n"
    );
    let assess = model.assesses().then(|| {
        format!(
            "\n/// Writes the deviation of each output of a frame, and returns its novelty in nats: above 0, it is unlike the\n\
             /// frames of training.{doc}\n\
             #[allow(dead_code)]\n\
             pub fn assess(readings: &{readings}{more}, deviation: &mut [[f32; {outputs}]; {rows}]) -> f32 {{\n\
             \x20   MODEL.assess(readings, {given}, deviation)\n\
             }}\n"
        )
    });
    let fill = model.reading_model().map(|_| {
        format!(
            "\n/// Replaces missing readings by those expected from the others, and returns their number.{doc}\n\
             #[allow(dead_code)]\n\
             pub fn fill(readings: &mut {readings}{more}) -> usize {{\n\
             \x20   MODEL.fill(readings, {given})\n\
             }}\n"
        )
    });
    decode + &assess.unwrap_or_default() + &fill.unwrap_or_default()
}

/// Static array of floats.
fn flat(doc: &str, name: &str, values: &[f32]) -> String {
    let floats: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    let lines = floats.chunks(ON_A_LINE).map(|line| format!("    {},\n", line.join(", ")));
    let value = format!("[\n{}]", lines.collect::<Vec<_>>().concat());
    item(doc, name, &format!("[f32; {}]", values.len()), &value)
}

/// An array of arrays, each on a line.
fn arrays(lines: impl Iterator<Item = impl fmt::Debug>) -> String {
    let lines = lines.map(|line| format!("        {line:?},\n"));
    format!("[\n{}    ]", lines.collect::<Vec<_>>().concat())
}

/// A static.
fn item(doc: &str, name: &str, kind: &str, value: &str) -> String {
    format!("\n/// {doc}.\n{ATTRIBUTES}pub static {name}: {kind} = {value};\n")
}
