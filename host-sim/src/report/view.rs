//! What the page of a model shows, whichever result it is from.

use taxel_data::columns;
use taxel_data::dataset::UnusedInputs;
use taxel_evaluate::by_load::LoadErrors;
use taxel_evaluate::evaluate::device_cost::DeviceCost;
use taxel_evaluate::evaluate::distribution::Distribution;
use taxel_evaluate::evaluate::moving_contacts::MovingContacts;
use taxel_evaluate::evaluate::table1::Table1;
use taxel_evaluate::metrics::{DecoderErrors, GroupRmse, LimitSummary};
use taxel_evaluate::others::Others;
use taxel_evaluate::over_time::OverTime;
use taxel_evaluate::run::{DataSummary, RunResult, SensorSketch};
use taxel_evaluate::verdict::Verdict;

use super::format::{grouped, noise, percent};

/// How a page was made, so that it can be made again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Made {
    pub command: String,
    /// Files beside the page that belong to it.
    pub files: Vec<String>,
}

/// Parts of a result that its page shows. What only a scene knows may be missing.
#[derive(Debug, Clone)]
pub struct View<'a> {
    /// Heading of the page.
    pub title: String,
    /// Facts about data and model: name and value.
    pub facts: Vec<(&'static str, String)>,
    /// What the model is worth.
    pub verdict: &'a Verdict,
    /// What it asks of a device.
    pub device: &'a DeviceCost,
    /// Errors of the model, and of decoders beside it.
    pub decoders: &'a [DecoderErrors],
    /// RMSE of the best linear decoder in the model's training, beside frames that came later; empty if it is not known.
    pub linear_at_training: &'a [GroupRmse],
    /// Least possible errors.
    pub limit: &'a LimitSummary,
    /// Errors by the depth of the contact, or of places by the force; empty for other outputs.
    pub by_load: &'a [LoadErrors],
    /// Errors on contacts that the model was not trained on.
    pub others: Option<&'a Others>,
    /// Errors and readings at rest by time, of a log.
    pub over_time: Option<&'a OverTime>,
    /// Errors on contacts that move, of a scene that has any.
    pub moving: Option<&'a MovingContacts>,
    /// Distribution of the model's errors.
    pub distribution: &'a Distribution,
    /// Number of frames that were decoded.
    pub frames: usize,
    /// Wires and electrodes of the sensor.
    pub sensor: Option<&'a SensorSketch>,
    /// Table 1: errors by noise and spread.
    pub table1: Option<&'a Table1>,
    pub made: &'a Made,
}

impl<'a> View<'a> {
    /// View of a run.
    pub fn of_run(result: &'a RunResult, made: &'a Made) -> Self {
        let scene = result.scene.as_ref();
        let noise = scene.map(|it| {
            format!("{} noise of {}", it.noise_kind.name(), noise(it.noise_kind, it.noise_level))
        });
        let kind = if scene.is_some() { "Scene" } else { "Data" };
        Self {
            title: format!("{kind} “{}”", result.subject),
            facts: facts(result, noise.as_deref()),
            verdict: &result.verdict,
            device: &result.device_cost,
            decoders: &result.decoders,
            linear_at_training: &[],
            limit: &result.limit,
            by_load: &result.by_load,
            others: result.others.as_ref(),
            over_time: result.data.as_ref().and_then(|data| data.over_time.as_ref()),
            moving: result.moving.as_ref(),
            distribution: &result.distribution,
            frames: result.model.test_frames,
            sensor: scene.and_then(|scene| scene.sensor.as_ref()),
            table1: result.table1.as_ref(),
            made,
        }
    }
}

fn facts(result: &RunResult, noise: Option<&str>) -> Vec<(&'static str, String)> {
    let (scene, model) = (&result.scene, &result.model);
    let [inputs, outputs] = model.ends("→");
    let drift = match scene.as_ref().map_or(0.0, |scene| scene.gain_drift) {
        0.0 => String::new(),
        gain => format!(", gain drift ±{}", percent(gain)),
    };
    let kind = if scene.is_some() { "Scene" } else { "Data" };
    let others = result.data.as_ref().map_or("new ones", |data| data.test_choice.as_str());
    let refined = if model.refined { " (refined)" } else { "" };
    let plural = if model.networks == 1 { "" } else { "s" };
    let mut facts = vec![
        (kind, format!("{}, digest {}, seed {}", result.subject, result.scene_digest, result.seed)),
        ("Readings", format!("{}{drift}", noise.unwrap_or("as measured"))),
        (
            "Frames",
            format!(
                "{} to train on, {} ({others}) to test",
                grouped(model.training_frames),
                grouped(model.test_frames)
            ),
        ),
        (
            "Model",
            format!(
                "{} network{plural}: {inputs} → K = {} → {outputs}; spread {}{refined}",
                model.networks,
                model.centres,
                super::format::significant(model.spread, 3)
            ),
        ),
        ("Blob", format!("{} bytes, CRC-32 {}", grouped(model.blob_bytes), model.model_crc)),
    ];
    facts.extend(result.data.iter().flat_map(left_out));
    facts
}

/// Lines and inputs of a data file that a model was not trained on.
fn left_out(data: &DataSummary) -> Vec<(&'static str, String)> {
    let (missing, unused) = (&data.lines_left_out, &data.unused_inputs);
    let outliers = if data.outliers.left_out { data.outliers.lines } else { 0 };
    let lines = [
        (missing.without_reading, "lack a reading"),
        (missing.without_output, "lack all outputs"),
        (outliers, "hold a value far from all others"),
    ];
    let lines = lines.iter().filter(|(count, _)| *count > 0);
    let lines: Vec<String> =
        lines.map(|(count, why)| format!("{} {why}", grouped(*count))).collect();
    let facts = [
        ("Lines left out", lines.join("; ")),
        ("Inputs left out", in_words(unused)),
        ("Constant inputs", columns::some_names(&data.constant_inputs)),
    ];
    facts.into_iter().filter(|(_, of)| !of.is_empty()).collect()
}

/// Inputs that can tell nothing, and why; empty if there are none.
pub fn in_words(unused: &UnusedInputs) -> String {
    let twins: Vec<String> =
        unused.duplicated.iter().map(|(name, of)| format!("{name} = {of}")).collect();
    let inputs = [
        (&unused.dead, "without values"),
        (&unused.constant, "never change"),
        (&twins, "are copies"),
    ];
    let inputs = inputs.iter().filter(|(names, _)| !names.is_empty());
    let inputs: Vec<String> =
        inputs.map(|(names, why)| format!("{} ({why})", columns::some_names(names))).collect();
    inputs.join("; ")
}
