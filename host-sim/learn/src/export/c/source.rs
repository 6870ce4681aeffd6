//! The header and the source file: which parts a model needs, and its numbers.

use std::fmt::Write as _;

use taxel_core::blob::{Columns, Front, Model};
use taxel_core::exp::{EXP_COEFFICIENTS, LN_2_PARTS};
use taxel_core::health::Limits;
use taxel_core::rbf::{Format, Network, fixed16, float32};
use taxel_core::reading_model::ReadingModel;
use taxel_core::touch::Kind;
use taxel_data::columns;

use super::name::Name;
use super::numbers::{array, float, floats, string, word, words};
use super::selftest;
use super::template::{Values, fill};
use crate::error::Result;

const HEADER: &str = include_str!("source/model.h");
const START: &str = include_str!("source/start.c");
const READINGS: &str = include_str!("source/readings.c");
const FLOAT32: &str = include_str!("source/float32.c");
const FIXED16: &str = include_str!("source/fixed16.c");
const PART: &str = include_str!("source/part.c");
const DECODE: &str = include_str!("source/decode.c");
const READING_MODEL: &str = include_str!("source/reading_model.c");
const END: &str = include_str!("source/end.c");

/// Flags of a model whose readings in Ω have `limits`, by which parts of templates are chosen.
pub fn flags(model: &Model<'_>, limits: Option<Limits>) -> Vec<&'static str> {
    let names = model.metadata().input_names;
    let is_f32 = model.networks().any(|network| network.format() == Format::F32);
    let array = model.whole_frames();
    let (fill, assess) = (model.reading_model().is_some(), model.assesses());
    let affine = model.networks().any(|network| network.has_affine_tail());
    let touches = model.fronts().any(|front| front.touch.is_some());
    let flags = [
        ("affine", affine),
        ("rows", !array),
        ("array", array),
        ("relative", model.metadata().relative_inputs),
        ("assess", assess),
        ("fill", fill),
        ("touches", touches),
        ("bits", assess || touches),
        ("reading", fill || touches),
        ("project", fill || model.fronts().any(|front| front.projection.is_some())),
        ("root", fill),
        ("exp", assess || is_f32),
        ("ohm", limits.is_some()),
        ("mixed", limits.is_some() && !names.iter().all(columns::is_judged_in_ohm)),
    ];
    those_set(&flags)
}

fn those_set(flags: &[(&'static str, bool)]) -> Vec<&'static str> {
    flags.iter().filter(|(_, set)| *set).map(|(flag, _)| *flag).collect()
}

/// Networks of one shape: those of all rows, or one that sees whole frames.
struct Part<'m> {
    networks: Vec<(usize, Network<'m>)>,
    /// What stands before the network of whole frames.
    front: Option<Front<'m>>,
    /// End of the names of its functions and tables.
    suffix: String,
}

impl<'m> Part<'m> {
    fn all(model: &Model<'m>) -> Vec<Self> {
        let networks = model.networks().enumerate();
        if !model.whole_frames() {
            let suffix = String::new();
            return vec![Self { networks: networks.collect(), front: None, suffix }];
        }
        let of_frames = |(network, front): ((usize, _), _)| {
            let suffix = format!("_{}", network.0);
            Self { networks: vec![network], front: Some(front), suffix }
        };
        networks.zip(model.fronts()).map(of_frames).collect()
    }

    fn has(&self, format: Format) -> bool {
        self.networks.iter().any(|(_, network)| network.format() == format)
    }

    /// Its own flags, in a model whose inputs may be `relative`.
    fn flags(&self, relative: bool) -> Vec<&'static str> {
        let kind = self.front.and_then(|front| front.touch).map(|touch| touch.kind());
        those_set(&[
            ("f32", self.has(Format::F32)),
            ("touch", kind.is_some()),
            ("ratios", kind.is_none() && relative),
            ("place", kind == Some(Kind::Place)),
            ("amount", kind == Some(Kind::Amount)),
            ("projection", self.front.is_some_and(|front| front.projection.is_some())),
        ])
    }

    /// Macros of its sizes, which are undefined behind it.
    fn sizes(&self, readings: usize) -> String {
        let Some((_, network)) = self.networks.first() else { return String::new() };
        let shape = network.shape();
        let mut sizes = vec![("INPUTS", shape.inputs), ("NETWORK_OUTPUTS", shape.outputs)];
        if let Some(front) = self.front {
            sizes.push(("SEEN", front.touch.map_or(readings, |it| it.inputs())));
            sizes.push(("PROJECTED", front.projection.map_or(0, |it| it.features())));
        }
        if self.has(Format::Fixed16) {
            sizes.push(("SQUARE_SHIFT", fixed16::square_shift(shape.inputs) as usize));
        }
        macros(&sizes)
    }
}

/// The header.
pub fn header(name: &Name, flags: &[&str], facts: &Values) -> String {
    fill(HEADER, name, flags, facts)
}

/// The source file.
pub fn code(
    model: &Model<'_>,
    name: &Name,
    limits: Option<Limits>,
    flags: &[&str],
    facts: &mut Values,
) -> Result<String> {
    let metadata = model.metadata();
    facts.set("SIZES", sizes(model));
    tell_constants(facts);
    facts.set("TESTS", selftest::arrays(model, limits)?);
    let listed = |names: Columns<'_>| -> String {
        names.iter().map(|name| format!("        {},\n", string(name))).collect::<Vec<_>>().concat()
    };
    facts.set("NAMES", listed(metadata.output_names));
    facts.set("READING_NAMES", listed(metadata.input_names));
    let in_ohm = metadata.input_names.iter().map(columns::is_judged_in_ohm);
    facts.set("IN_OHM", array("uint8_t", "in_ohm", in_ohm.map(|is| u8::from(is).to_string())));
    let sensor = if metadata.relative_inputs { "sensor, " } else { "" };
    let mut code = fill(START, name, flags, facts) + &fill(READINGS, name, flags, facts);
    let (mut calls, mut outputs, mut written) = (String::new(), 0, Vec::new());
    for part in Part::all(model) {
        let suffix = &part.suffix;
        facts.set("OF", suffix);
        code += &part.sizes(model.shape().rows * model.shape().inputs);
        let own = part.flags(model.metadata().relative_inputs);
        for (format, template) in [(Format::F32, FLOAT32), (Format::Fixed16, FIXED16)] {
            if part.has(format) {
                let first = if written.contains(&format) { "" } else { "first" };
                code += &fill(template, name, &[flags, &[first]].concat(), facts);
                written.push(format);
            }
        }
        code += &tables(model, &part);
        code += &fill(PART, name, &[flags, &own].concat(), facts);
        if let Some(front) = part.front {
            let given = format!("{sensor}readings, outputs + {outputs}, &worst, scratch");
            let _ = writeln!(calls, "    clamped |= decode_part{suffix}({given});");
            outputs += front.outputs;
        }
    }
    facts.set("PARTS", calls);
    let text = |template| fill(template, name, flags, facts);
    code += &text(DECODE);
    if let Some(reading_model) = model.reading_model() {
        code += &numbers(reading_model);
        code += &text(READING_MODEL);
    }
    Ok(code + &text(END))
}

/// Macros of the sizes of a model.
fn sizes(model: &Model<'_>) -> String {
    let shape = model.shape();
    let mut sizes = vec![
        ("ROWS", shape.rows),
        ("READINGS", shape.rows * shape.inputs),
        ("OUTPUTS", shape.rows * shape.outputs),
    ];
    if let Some(of) = model.reading_model().map(|it| it.sizes()) {
        sizes.extend([("FACTORS", of.factors), ("COMPONENTS", of.components)]);
    }
    macros(&sizes)
}

fn macros(sizes: &[(&str, usize)]) -> String {
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

/// Tables of the networks of a part and of what stands before them, and the function that infers by one of them.
fn tables(model: &Model<'_>, part: &Part<'_>) -> String {
    let any_affine = model.networks().any(|network| network.has_affine_tail());
    let (mut tables, mut cases) = (String::new(), Vec::new());
    let suffix = &part.suffix;
    for (index, network) in &part.networks {
        let of = |part: &str| format!("network_{index}_{part}");
        let (kind, affine, fields) = match network {
            Network::F32(inner) => float32(inner.parameters(), &of, &mut tables),
            Network::Fixed16(inner) => fixed16(&inner.parameters(), &of, &mut tables),
        };
        let call = format!("infer_{kind}{suffix}(&network_{index}, inputs, scratch, outputs)");
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
        cases.push(format!("return {call};\n"));
    }
    if let Some(front) = part.front {
        if let Some(touch) = front.touch {
            tables += &floats(&format!("touch{suffix}"), touch.block());
        }
        if let Some(projection) = front.projection {
            tables += &floats(&format!("projection{suffix}"), projection.block());
        }
    } else {
        let rows = (0..model.shape().rows).filter_map(|row| model.network_of_row(row));
        tables += &array("uint8_t", "row_network", rows.map(|network| network.to_string()));
    }
    let _ = write!(
        tables,
        "\nstatic int infer{suffix}(unsigned network, const float *inputs, float *scratch, float *outputs)\n{{\n"
    );
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

/// Tables of a reading model, as its block has them one after the other.
fn numbers(model: ReadingModel<'_>) -> String {
    let (sizes, mut rest) = (model.sizes(), model.block());
    let mut text = String::new();
    for (name, length) in [
        ("reading_mean", sizes.readings),
        ("reading_scale", sizes.readings),
        ("reading_parts", (1 + sizes.readings) * sizes.factors),
        ("mixture", sizes.components * sizes.component_floats()),
        ("variances", sizes.components * sizes.outputs),
    ] {
        let (values, after) = rest.split_at(length);
        if !values.is_empty() {
            text += &floats(name, values);
        }
        rest = after;
    }
    let threshold = rest.last().map(|it| format!("#define NOVELTY_THRESHOLD {}\n\n", float(*it)));
    text + &threshold.unwrap_or_default()
}
