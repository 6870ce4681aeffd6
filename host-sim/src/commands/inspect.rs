//! Command `inspect`: content and cost of a weight blob.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::Result;
use crate::report::format::with_unit;
use crate::report::{Digits, Sections, TableOf};
use crate::verdict::Warning;
use clap::Args;
use serde_json::json;
use taxel_core::blob::{Metadata, Model};
use taxel_evaluate::device::BOARD_CLOCK_MHZ;
use taxel_firmware::capacity::Capacity;
use taxel_firmware::timing::ScanPlan;
use taxel_learn::ModelBlob;
use taxel_learn::cost::{Cost, DecoderRam, Design};
use taxel_rig::image;

use super::model_outputs;
use super::{Common, print};

/// Show a blob's shape, origin, training errors, and what it needs on a device.
#[derive(Args)]
#[command(after_help = "Example: taxel inspect press.bin")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    let blob = ModelBlob::read(&arguments.model)?;
    Ok(print::sections(common, &sections_of(&blob)))
}

fn sections_of(blob: &ModelBlob) -> Sections {
    let (model, design) = (blob.parse(), Design::new(blob));
    let (shape, metadata) = (model.shape(), model.metadata());
    let mut result = Sections::new(format!("Model of “{}”", metadata.name));
    result.value("subject", metadata.name);
    result.fact("format_version", "format of the blob", "", taxel_core::blob::FORMAT_VERSION);
    result.fact("model_crc", "CRC-32", "", format!("{:08x}", model.crc()));
    result.fact("training_frames", "training frames", "", metadata.training_frames);
    result.fact(
        "scene_digest",
        "digest of their source",
        "",
        format!("{:016x}", metadata.scene_digest),
    );
    result.fact("seed", "seed", "", metadata.seed);
    result.fact("noise_kind", "noise", "", format!("{:?}", metadata.noise_kind).to_lowercase());
    result.fact("noise_level", "level of noise", "", metadata.noise_level);
    result.fact("rows", "rows", "", shape.rows);
    result.fact("inputs_per_row", "readings a row", "", shape.inputs);
    result.fact("outputs_per_row", "outputs a row", "", shape.outputs);
    result.fact(
        "relative_inputs",
        "readings relative to the baseline",
        "",
        metadata.relative_inputs,
    );
    let projections = model.fronts().filter_map(|it| it.projection);
    let features = projections.map(|it| it.features()).max().unwrap_or(0);
    result.fact("projected_features", "features of all rows’ readings", "", features);
    reading_model(&mut result, &model);
    let bytes = model.tracker().map(|tracker| 4 * tracker.block().len());
    result.fact("tracker", "tracker of a contact", "bytes", bytes);
    networks(&mut result, &model);
    costs(&mut result, blob, &model, &design);
    let columns = metadata.input_names.iter().zip(metadata.input_units.iter());
    let columns: Vec<_> =
        columns.map(|(name, unit)| json!({ "name": name, "unit": unit })).collect();
    result.value("inputs", &columns);
    result.line("inputs", ends(&metadata.input_names.iter().collect::<Vec<_>>()));
    let outputs = model_outputs::of(&model);
    result.value("outputs", &outputs);
    let caption = match outputs.len().saturating_sub(SHOWN) {
        0 => "Outputs.".to_owned(),
        more => format!("Outputs; --json lists {more} more."),
    };
    let shown = &outputs[..outputs.len().min(SHOWN)];
    let table = TableOf::new(shown, caption)
        .names("output", "output", |it| with_unit(&it.name, &it.unit))
        .numbers("training_rmse", "training RMSE", "", Digits::Significant(3), |it| {
            Some(it.training_rmse.into())
        })
        .numbers("full_scale", "full scale", "", Digits::Significant(4), |it| {
            Some(it.full_scale.into())
        });
    result.table(table);
    result
}

/// Adds the size of what fills missing readings.
fn reading_model(result: &mut Sections, model: &Model<'_>) {
    let Some(it) = model.reading_model() else {
        return result.value("reading_model", &());
    };
    let (factors, components, bytes) =
        (it.sizes().factors, it.sizes().components, 4 * it.block().len());
    let summary = json!({ "factors": factors, "components": components, "bytes": bytes });
    result.value("reading_model", &summary);
    let more = match components {
        0 => String::new(),
        _ => format!(", novelty and deviations by {components} components"),
    };
    let text = format!("fills missing readings by {factors} factors{more}, {bytes} bytes");
    result.line("reading model", text);
}

/// Adds the networks; those that are alike have one line.
fn networks(result: &mut Sections, model: &Model<'_>) {
    let (mut networks, mut lines) = (vec![], vec![]);
    for network in model.networks() {
        let (format, centres) = (network.format().name(), network.shape().centres);
        let (spread, affine_tail): (Vec<f64>, bool) =
            (network.widths().map(as_given).collect(), network.has_affine_tail());
        let [low, high] =
            [f64::min, f64::max].map(|of| spread.iter().copied().reduce(of).unwrap_or(0.0));
        let widths = if low == high { digits(low) } else { digits(low) + "…" + &digits(high) };
        let tail = if affine_tail { ", affine tail" } else { "" };
        lines.push(format!("{format}, K = {centres}, spread {widths}{tail}"));
        networks.push(json!({
            "format": format, "centres": centres, "spread": spread, "affine_tail": affine_tail
        }));
    }
    result.value("networks", &networks);
    for alike in lines.chunk_by(|a, b| a == b) {
        result.line("networks", format!("{} × {}", alike.len(), alike[0]));
    }
}

/// Adds what the model takes of a device.
fn costs(result: &mut Sections, blob: &ModelBlob, model: &Model<'_>, design: &Design) {
    result.fact("blob_bytes", "flash", "bytes", blob.bytes().len());
    let ram = DecoderRam::new(design);
    result.fact("ram_bytes", "RAM for decoding", "bytes", ram.bytes());
    result.value("ram_parts_bytes", &ram);
    result.fact("weights_in_ram", "the images copy the blob to RAM", "", design.weights_in_ram);
    let needs = needs(model, design, blob.bytes().len());
    result.value("needs", &needs);
    needs.into_iter().for_each(|need| result.line("device", need));
    let scan = scan(model);
    let summary = scan.map(|(rows, columns, plan)| {
        let (mean_us, longest_us) = (plan.scan_us(), plan.longest_us());
        result.line(
            "scan",
            format!(
                "{rows} × {columns} wires, {mean_us} µs by the converters of a NUCLEO-F446RE, {longest_us} µs at most"
            ),
        );
        json!({ "rows": rows, "columns": columns, "mean_us": mean_us, "longest_us": longest_us })
    });
    result.value("scan", &summary);
    let mut cost = |key: &'static str, name: &'static str, cost: Cost| {
        result.value(key, &cost);
        let Cost { instructions, cycles } = cost;
        let us = cycles as f64 / BOARD_CLOCK_MHZ;
        let text = format!(
            "{instructions} instructions, {cycles} cycles ({us:.0} µs at {BOARD_CLOCK_MHZ} MHz)"
        );
        result.line(name, text);
    };
    cost("frame_cost", "a frame", Cost::of_frame(design));
    if let Some(tracker) = model.tracker() {
        cost("tracked_frame_cost", "a tracked frame", Cost::of_tracker(tracker.sizes()));
    }
}

/// Why the images as they are cannot decode a `model`, with a blob of so many bytes, or not as it was trained.
fn needs(model: &Model<'_>, design: &Design, bytes: usize) -> Vec<String> {
    let too_large = Warning::larger_than_slot(bytes, design);
    let too_large = too_large.map(|warning| format!("no device can use it: {}", warning.text));
    too_large
        .into_iter()
        .chain(image::needed(model, Capacity::PAPER))
        .chain(other_unit(model))
        .collect()
}

/// Says so if the readings are not in Ω, in which a board measures.
fn other_unit(model: &Model<'_>) -> Option<String> {
    let Metadata { input_names, input_units, .. } = model.metadata();
    let in_ohm = input_names.iter().all(|name| name.ends_with("_ohm"))
        || input_units.iter().any(|unit| unit == "Ω");
    (!in_ohm).then(|| {
        "a board measures Ω, and this model was trained on other readings: send it those (docs/link.md), or train on what \
         the board records"
            .into()
    })
}

/// Numbers of rows and columns that are scanned for a `model`, and the scan on the NUCLEO-F446RE with one sample a reading.
/// `None` if that cannot scan it, or readings are not in Ω.
fn scan(model: &Model<'_>) -> Option<(usize, usize, ScanPlan)> {
    if other_unit(model).is_some() {
        return None;
    }
    let room = image::capacity_for(model, Capacity::PAPER).ok()?;
    let cells = room.cells(model.metadata().input_names, model.shape());
    let cells: Vec<_> = cells.collect::<std::result::Result<_, _>>().ok()?;
    let rows = cells.iter().map(|(row, _)| row).collect::<BTreeSet<_>>().len();
    let columns = cells.iter().map(|(_, column)| column).collect::<BTreeSet<_>>().len();
    Some((rows, columns, ScanPlan::of_nucleo_onchip(rows as u16, columns as u16, 1)))
}

/// Width with the digits that f32 surely holds: the blob's number lies a little beside the one that was given.
fn as_given(width: f32) -> f64 {
    let digits = format!("{width:.5e}").parse();
    digits.unwrap_or(width.into())
}

/// Four decimals of a width at most.
fn digits(width: f64) -> String {
    let text = format!("{width:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Most outputs that are listed for people.
const SHOWN: usize = 24;

fn ends(names: &[&str]) -> String {
    match names {
        [first, .., last] if names.len() > 6 => format!("{first} … {last} ({})", names.len()),
        _ => names.join(", "),
    }
}
