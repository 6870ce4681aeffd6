//! Command `inspect`: content and cost of a weight blob.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::Result;
use crate::verdict::Warning;
use clap::Args;
use serde::Serialize;
use taxel_core::blob::{Metadata, Model};
use taxel_firmware::capacity::{Capacity, WEIGHT_RAM_BYTES};
use taxel_firmware::timing::ScanPlan;
use taxel_learn::ModelBlob;
use taxel_learn::cost::{Cost, DecoderRam, Design};
use taxel_rig::image;

use super::model_outputs::{self, ModelOutput};
use super::{Common, print};

/// Show a blob's shape, origin, training errors and needs on a device.
#[derive(Args)]
#[command(after_help = "Example: host-sim inspect press.bin")]
pub struct Arguments {
    /// Weight blob.
    model: PathBuf,
}

#[derive(Serialize)]
struct Summary {
    subject: String,
    format_version: u8,
    model_crc: String,
    scene_digest: String,
    rows: usize,
    inputs_per_row: usize,
    outputs_per_row: usize,
    /// Whether inputs are readings relative to the baseline, R/R₀.
    relative_inputs: bool,
    /// Features that all readings are projected to, for one network of all rows; 0 without a projection.
    projected_features: usize,
    /// Statistics of readings; `None` for a model without them.
    reading_model: Option<ReadingModelSummary>,
    networks: Vec<NetworkSummary>,
    noise_kind: String,
    noise_level: f32,
    seed: u64,
    training_frames: u32,
    blob_bytes: usize,
    /// Memory that decoding takes, and its parts.
    ram_bytes: usize,
    ram_parts_bytes: DecoderRam,
    /// Whether the images have room in RAM for a copy of the blob.
    weights_in_ram: bool,
    /// Why the images as they are cannot decode the model.
    needs: Vec<String>,
    /// Its scan on the NUCLEO-F446RE; `None` if that cannot scan it, or readings are not in Ω.
    scan: Option<ScanSummary>,
    /// What decoding a frame costs a Cortex-M4F.
    frame_cost: Cost,
    inputs: Vec<ColumnSummary>,
    outputs: Vec<ModelOutput>,
}

/// Wires that are scanned for a model, and how long that takes.
#[derive(Serialize)]
struct ScanSummary {
    rows: usize,
    columns: usize,
    /// Mean time, and that of the scans with idle samples.
    mean_us: u32,
    longest_us: u32,
}

/// Size of what fills missing readings.
#[derive(Serialize)]
struct ReadingModelSummary {
    factors: usize,
    /// Components that tell novelty and deviations; 0 without.
    components: usize,
    bytes: usize,
}

#[derive(Serialize)]
struct NetworkSummary {
    format: &'static str,
    centres: usize,
    /// Widths σ of the centres on scaled inputs; one for all of them, or one each.
    spread: Vec<f64>,
    affine_tail: bool,
}

impl NetworkSummary {
    /// Line for people.
    fn line(&self) -> String {
        let (low, high) = self
            .spread
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(low, high), w| (low.min(*w), high.max(*w)));
        let spread = if low == high { digits(low) } else { digits(low) + "…" + &digits(high) };
        let tail = if self.affine_tail { ", affine tail" } else { "" };
        format!("{}, K = {}, spread {spread}{tail}", self.format, self.centres)
    }
}

#[derive(Serialize)]
struct ColumnSummary {
    name: String,
    unit: String,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<()> {
    let blob = ModelBlob::read(&arguments.model)?;
    let summary = summarise(&blob);
    print::result(common, &summary, || page_of(&summary))
}

fn summarise(blob: &ModelBlob) -> Summary {
    let (model, design) = (blob.parse(), Design::new(blob));
    let (shape, metadata) = (model.shape(), model.metadata());
    let networks = model.networks().map(|network| NetworkSummary {
        format: network.format().name(),
        centres: network.shape().centres,
        spread: network.widths().map(as_given).collect(),
        affine_tail: network.has_affine_tail(),
    });
    let column =
        |(name, unit): (&str, &str)| ColumnSummary { name: name.into(), unit: unit.into() };
    let ram = DecoderRam::new(&design);
    Summary {
        subject: metadata.name.into(),
        format_version: taxel_core::blob::FORMAT_VERSION,
        model_crc: format!("{:08x}", model.crc()),
        scene_digest: format!("{:016x}", metadata.scene_digest),
        rows: shape.rows,
        inputs_per_row: shape.inputs,
        outputs_per_row: shape.outputs,
        reading_model: model.reading_model().map(|it| ReadingModelSummary {
            factors: it.sizes().factors,
            components: it.sizes().components,
            bytes: 4 * it.block().len(),
        }),
        relative_inputs: metadata.relative_inputs,
        projected_features: model
            .fronts()
            .filter_map(|it| it.projection)
            .map(|it| it.features())
            .max()
            .unwrap_or(0),
        networks: networks.collect(),
        noise_kind: format!("{:?}", metadata.noise_kind).to_lowercase(),
        noise_level: metadata.noise_level,
        seed: metadata.seed,
        training_frames: metadata.training_frames,
        blob_bytes: blob.bytes().len(),
        ram_bytes: ram.bytes(),
        ram_parts_bytes: ram,
        weights_in_ram: design.weights_in_ram,
        needs: needs(&model, &design, blob.bytes().len()),
        scan: scan(&model),
        frame_cost: Cost::of_frame(&design),
        inputs: metadata.input_names.iter().zip(metadata.input_units.iter()).map(column).collect(),
        outputs: model_outputs::of(&model),
    }
}

/// Why the images as they are cannot decode a `model`, with a blob of so many bytes, or not as it was trained.
fn needs(model: &Model<'_>, design: &Design, bytes: usize) -> Vec<String> {
    let too_large = Warning::larger_than_slot(bytes, design);
    let too_large = too_large.map(|warning| format!("no device takes it: {}", warning.text));
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

/// Scan for a `model`, with one sample a reading.
fn scan(model: &Model<'_>) -> Option<ScanSummary> {
    if other_unit(model).is_some() {
        return None;
    }
    let room = image::capacity_for(model, Capacity::PAPER).ok()?;
    let cells = room.cells(model.metadata().input_names, model.shape());
    let cells: Vec<_> = cells.collect::<std::result::Result<_, _>>().ok()?;
    let rows = cells.iter().map(|(row, _)| row).collect::<BTreeSet<_>>().len();
    let columns = cells.iter().map(|(_, column)| column).collect::<BTreeSet<_>>().len();
    let plan = ScanPlan::of_nucleo(rows as u16, columns as u16, 1);
    Some(ScanSummary { rows, columns, mean_us: plan.scan_us(), longest_us: plan.longest_us() })
}

/// Cost of a frame for people.
fn costs(Cost { instructions, cycles }: Cost) -> String {
    format!(
        "{instructions} instructions, {cycles} cycles ({:.0} µs at 168 MHz)",
        cycles as f64 / 168.0
    )
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

fn page_of(s: &Summary) -> print::Page {
    let mut page = print::Page::default();
    let mut line = |label: &str, value: String| page.line(format_args!("{label:<17} {value}"));
    line("model", format!("{:?}, format {}, CRC-32 {}", s.subject, s.format_version, s.model_crc));
    line("trained on", format!("{} frames, digest {}", s.training_frames, s.scene_digest));
    let noise = match s.noise_kind.as_str() {
        "none" => "none added".to_owned(),
        "absolute" => format!("absolute {} Ω", s.noise_level),
        kind => format!("{kind} {}", s.noise_level),
    };
    line("noise and seed", format!("{noise}, seed {}", s.seed));
    line(
        "shape",
        format!("{} × ({} readings → {} outputs)", s.rows, s.inputs_per_row, s.outputs_per_row),
    );
    if s.projected_features > 0 {
        let (readings, features) = (s.rows * s.inputs_per_row, s.projected_features);
        line("projection", format!("{readings} readings → {features} features for all rows"));
    }
    if let Some(ReadingModelSummary { factors, components, bytes }) = s.reading_model {
        let more = if components == 0 {
            String::new()
        } else {
            format!(", novelty and deviations by {components} components")
        };
        let what = format!("fills missing readings by {factors} factors{more}, {bytes} bytes");
        line("reading model", what);
    }
    let networks: Vec<String> = s.networks.iter().map(NetworkSummary::line).collect();
    let mut index = 0;
    for alike in networks.chunk_by(|a, b| a == b) {
        let last = index + alike.len() - 1;
        let label = if last == index {
            format!("network {index}")
        } else {
            format!("networks {index}–{last}")
        };
        line(&label, alike[0].clone());
        index = last + 1;
    }
    line("flash", format!("{} bytes", s.blob_bytes));
    let ram = &s.ram_parts_bytes;
    let parts = [
        ("decoder", ram.decoder),
        ("frame", ram.frame),
        ("estimate", ram.estimate),
        ("scaled readings", ram.scaled_readings),
        ("features", ram.features),
        ("touch", ram.touch),
        ("relative inputs", ram.relative_inputs),
        ("activations", ram.activations),
    ];
    let parts: Vec<String> = parts
        .iter()
        .filter(|(_, bytes)| *bytes > 0)
        .map(|(name, bytes)| format!("{name} {bytes}"))
        .collect();
    let weights = if s.weights_in_ram {
        format!("the images copy the blob's {} bytes to RAM, and decode there", s.blob_bytes)
    } else {
        format!(
            "decoded from flash: the blob does not fit into the images' {WEIGHT_RAM_BYTES} bytes"
        )
    };
    line("RAM", format!("{} bytes: {}", s.ram_bytes, parts.join(", ")));
    line("weights", weights);
    for need in &s.needs {
        line("device", need.clone());
    }
    if let Some(ScanSummary { rows, columns, mean_us, longest_us }) = s.scan {
        line(
            "scan",
            format!(
                "{rows} × {columns} wires, {mean_us} µs by converters around a NUCLEO-F446RE, {longest_us} µs at most"
            ),
        );
    }
    line("a frame", costs(s.frame_cost));
    let relative = if s.relative_inputs { "; relative to the baseline, R/R₀" } else { "" };
    let names = ends(&s.inputs.iter().map(|c| c.name.as_str()).collect::<Vec<_>>());
    line("inputs", format!("{names}{relative}"));
    page.line(format_args!("{:<17} {:>13} {:>11}", "output", "training RMSE", "full scale"));
    for output in s.outputs.iter().take(SHOWN) {
        let ModelOutput { name, unit, training_rmse, full_scale } = output;
        page.line(format_args!("{name:<17} {training_rmse:>13.4} {full_scale:>11.4} {unit}"));
    }
    if s.outputs.len() > SHOWN {
        page.line(format_args!("… {} more: --json lists them all", s.outputs.len() - SHOWN));
    }
    page
}

fn ends(names: &[&str]) -> String {
    match names {
        [first, .., last] if names.len() > 6 => format!("{first} … {last} ({})", names.len()),
        _ => names.join(", "),
    }
}
