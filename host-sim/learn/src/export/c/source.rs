//! The header and the source file: which parts a model needs, and its numbers.

use std::fmt::Write as _;

use taxel_core::blob::Model;
use taxel_core::exp::{EXP_COEFFICIENTS, LN_2_PARTS};
use taxel_core::rbf::{Format, Network, fixed16, float32};

use super::name::Name;
use super::numbers::{array, float, floats, string, word, words};
use super::selftest;
use super::template::{Values, fill};
use crate::error::Result;

const HEADER: &str = include_str!("source/model.h");
const START: &str = include_str!("source/start.c");
const FLOAT32: &str = include_str!("source/float32.c");
const FIXED16: &str = include_str!("source/fixed16.c");
const DECODE: &str = include_str!("source/decode.c");
const CONFIDENCE: &str = include_str!("source/confidence.c");
const FILL: &str = include_str!("source/fill.c");
const END: &str = include_str!("source/end.c");

/// Flags of a model, by which parts of templates are chosen.
pub fn flags(model: &Model<'_>) -> Vec<&'static str> {
    let has = |format| model.networks().any(|network| network.format() == format);
    let (array, confidence) = (model.projection().is_some(), model.confidence().is_some());
    let fill = model.fill().is_some();
    let affine = model.networks().any(|network| network.has_affine_tail());
    let flags = [
        ("f32", has(Format::F32)),
        ("fixed16", has(Format::Fixed16)),
        ("affine", affine),
        ("rows", !array),
        ("array", array),
        ("relative", model.metadata().relative_inputs),
        ("confidence", confidence),
        ("fill", fill),
        ("project", array || confidence),
        ("root", confidence || fill),
        ("exp", confidence || has(Format::F32)),
    ];
    flags.into_iter().filter(|(_, set)| *set).map(|(flag, _)| flag).collect()
}

/// The header.
pub fn header(name: &Name, flags: &[&str], facts: &Values) -> String {
    fill(HEADER, name, flags, facts)
}

/// The source file.
pub fn code(model: &Model<'_>, name: &Name, flags: &[&str], facts: &mut Values) -> Result<String> {
    facts.set("SIZES", sizes(model));
    tell_constants(facts);
    facts.set("TESTS", selftest::arrays(model)?);
    let names = model.metadata().output_names.iter();
    facts.set(
        "NAMES",
        names.map(|name| format!("        {},\n", string(name))).collect::<Vec<_>>().concat(),
    );
    let has = |flag| flags.contains(&flag);
    let text = |template| fill(template, name, flags, facts);
    let mut code = text(START);
    for (format, template) in [("f32", FLOAT32), ("fixed16", FIXED16)] {
        if has(format) {
            code += &text(template);
        }
    }
    code += &networks(model);
    code += &text(DECODE);
    if has("confidence") {
        code += &confidence(model);
        code += &text(CONFIDENCE);
    }
    if let Some(fill) = model.fill() {
        let (readings, block) = (fill.readings(), fill.block());
        code += &floats("fill_mean", &block[..readings]);
        code += &floats("fill_scale", &block[readings..2 * readings]);
        code += &floats("fill_parts", &block[2 * readings..]);
        code += &text(FILL);
    }
    Ok(code + &text(END))
}

/// Macros of all sizes.
fn sizes(model: &Model<'_>) -> String {
    let shape = model.shape();
    let of_network = model.networks().next().map(|network| network.shape());
    let (inputs, outputs) = of_network.map_or((0, 0), |it| (it.inputs, it.outputs));
    let mut sizes = vec![
        ("ROWS", shape.rows),
        ("READINGS", shape.rows * shape.inputs),
        ("OUTPUTS", shape.rows * shape.outputs),
        ("INPUTS", inputs),
        ("NETWORK_OUTPUTS", outputs),
    ];
    if model.networks().any(|network| network.format() == Format::Fixed16) {
        sizes.push(("SQUARE_SHIFT", fixed16::square_shift(inputs) as usize));
    }
    if let Some(confidence) = model.confidence() {
        let of = confidence.sizes();
        sizes.extend([("DIRECTIONS", of.directions), ("COMPONENTS", of.components)]);
    }
    sizes.extend(model.fill().map(|fill| ("FACTORS", fill.factors())));
    let lines = sizes.iter().map(|(name, size)| format!("#define {name} {size}u\n"));
    lines.collect::<Vec<_>>().concat()
}

/// Constants of formulas.
fn tell_constants(facts: &mut Values) {
    let exp = ["EXP_6", "EXP_5", "EXP_4", "EXP_3", "EXP_2", "EXP_1", "EXP_0"];
    let floats = exp.into_iter().zip(EXP_COEFFICIENTS);
    for (key, value) in floats.chain(["LN_2_HIGH", "LN_2_LOW"].into_iter().zip(LN_2_PARTS)) {
        facts.set(key, float(value));
    }
    for (key, value) in ["CUBIC_3", "CUBIC_2", "CUBIC_1", "CUBIC_0"].into_iter().zip(fixed16::CUBIC)
    {
        facts.set(key, value);
    }
}

/// Tables of all networks and of what lies around them, and the function that infers by one of them.
fn networks(model: &Model<'_>) -> String {
    let any_affine = model.networks().any(|network| network.has_affine_tail());
    let (mut tables, mut cases) = (String::new(), Vec::new());
    for (index, network) in model.networks().enumerate() {
        let of = |part: &str| format!("network_{index}_{part}");
        let (kind, affine, fields) = match network {
            Network::F32(inner) => float32(inner.parameters(), &of, &mut tables),
            Network::Fixed16(inner) => fixed16(&inner.parameters(), &of, &mut tables),
        };
        let affine = match (any_affine, affine) {
            (false, _) => String::new(),
            (true, true) => format!(", {}", of("affine")),
            (true, false) => ", 0".into(),
        };
        // Writing to a string cannot fail.
        let _ = write!(
            tables,
            "static const struct {kind} network_{index} = {{\n    {fields}{affine}\n}};\n\n"
        );
        cases.push(format!("return infer_{kind}(&network_{index}, inputs, scratch, outputs);\n"));
    }
    if let Some(projection) = model.projection() {
        tables += &floats("projection", projection.block());
    } else {
        let rows = (0..model.shape().rows).filter_map(|row| model.network_of_row(row));
        tables += &array("uint8_t", "row_network", rows.map(|network| network.to_string()));
    }
    tables += "\nstatic int infer(unsigned network, const float *inputs, float *scratch, float *outputs)\n{\n";
    let last = cases.pop().unwrap_or_default();
    if cases.is_empty() {
        return tables + "    (void)network;\n    " + &last + "}\n\n";
    }
    tables += "    switch (network) {\n";
    for (index, case) in cases.iter().enumerate() {
        let _ = write!(tables, "    case {index}:\n        {case}");
    }
    tables + "    default:\n        " + &last + "    }\n}\n\n"
}

/// Name of a network's struct, whether it has an affine tail, and the fields of the struct before that.
type Parts = (&'static str, bool, String);

fn float32(p: &float32::Parameters<'_>, of: &dyn Fn(&str) -> String, tables: &mut String) -> Parts {
    let arrays = [
        ("minimum", p.input_minimum),
        ("per_span", p.input_per_span),
        ("centres", p.centres),
        ("decay", p.decay),
        ("weights", p.output_weights),
        ("bias", p.bias),
        ("affine", p.affine),
    ];
    write_floats(&arrays, of, tables);
    let count = p.decay.len();
    let (before, after) = (["minimum", "per_span", "centres", "decay"], ["weights", "bias"]);
    let fields = format!("{}, {count}, {}", listed(before, of), listed(after, of));
    ("float32", !p.affine.is_empty(), fields)
}

fn fixed16(p: &fixed16::Parameters<'_>, of: &dyn Fn(&str) -> String, tables: &mut String) -> Parts {
    let arrays =
        [("midpoint", p.input_midpoint), ("per_unit", p.input_per_unit), ("scale", p.output_scale)];
    write_floats(&arrays, of, tables);
    *tables += &words(&of("centres"), p.centres);
    *tables +=
        &array("uint32_t", &of("bias"), p.bias.iter().map(|bias| word(bias.cast_unsigned())));
    if !p.affine.is_empty() {
        *tables += &words(&of("affine"), p.affine);
    }
    let shape = taxel_core::rbf::Shape {
        inputs: p.input_midpoint.len(),
        centres: 0,
        outputs: p.bias.len(),
    };
    let groups = p.centres.len() / fixed16::words_at_once(shape).max(1);
    let (before, after) = (["midpoint", "per_unit"], ["centres", "bias", "scale"]);
    let decay = p.decay;
    let fields = format!("{}, {decay}u, {groups}, {}", listed(before, of), listed(after, of));
    ("fixed16", !p.affine.is_empty(), fields)
}

/// Names of arrays, as fields of a struct.
fn listed<const COUNT: usize>(parts: [&str; COUNT], of: &dyn Fn(&str) -> String) -> String {
    parts.map(of).join(", ")
}

/// Adds those of the arrays that are not empty.
fn write_floats(arrays: &[(&str, &[f32])], of: &dyn Fn(&str) -> String, tables: &mut String) {
    for (part, values) in arrays.iter().filter(|(_, values)| !values.is_empty()) {
        *tables += &floats(&of(part), values);
    }
}

/// Tables of the confidence, as its block has them one after the other.
fn confidence(model: &Model<'_>) -> String {
    let Some(confidence) = model.confidence() else { return String::new() };
    let (sizes, block) = (confidence.sizes(), confidence.block());
    let features = sizes.features();
    let component = 1 + features + features * (features + 1) / 2;
    let mut rest = block;
    let mut text = String::new();
    for (name, length) in [
        ("reading_mean", sizes.readings),
        ("reading_scale", sizes.readings),
        ("directions", (1 + sizes.readings) * sizes.directions),
        ("mixture", sizes.components * component),
        ("variances", sizes.components * sizes.outputs),
    ] {
        let (values, after) = rest.split_at(length);
        text += &floats(name, values);
        rest = after;
    }
    let threshold = block.last().copied().unwrap_or_default();
    let reading =
        if model.metadata().relative_inputs { "relative(readings, i)" } else { "readings[i]" };
    format!(
        "{text}#define NOVELTY_THRESHOLD {}\n#define READING(i) {reading}\n\n",
        float(threshold)
    )
}
