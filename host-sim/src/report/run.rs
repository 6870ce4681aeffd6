//! What the sections of `run` are made of.

use taxel_data::columns;
use taxel_data::dataset::UnusedInputs;
use taxel_evaluate::run::{DataSummary, RunResult};

use super::errors::Pictures;
use super::format::{grouped, noise, percent, significant};
use super::judged::Judged;

/// Model of a run, and its errors.
pub fn judged(result: &RunResult) -> Judged<'_> {
    let scene = result.scene.as_ref();
    let kind = if scene.is_some() { "Scene" } else { "Data" };
    let frames = result.model.test_frames;
    let sensor = scene.and_then(|scene| scene.sensor.as_ref());
    Judged {
        title: format!("{kind} “{}”", result.subject),
        details: details(result),
        verdict: &result.verdict,
        device: &result.device_cost,
        decoders: &result.decoders,
        linear_at_training: &[],
        limit: &result.limit,
        by_load: &result.by_load,
        by_row: &result.by_row,
        others: result.others.as_ref(),
        over_time: result.data.as_ref().and_then(|data| data.over_time.as_ref()),
        moving: result.moving.as_ref(),
        coverage: &[],
        percent_novel: None,
        frames,
        pictures: Some(Pictures { distribution: &result.distribution, frames, sensor }),
        table1: result.table1.as_ref(),
    }
}

fn details(result: &RunResult) -> Vec<(&'static str, String)> {
    let (scene, model) = (&result.scene, &result.model);
    let noise = scene.as_ref().map(|it| {
        format!("{} noise of {}", it.noise_kind.name(), noise(it.noise_kind, it.noise_level))
    });
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
        ("Readings", format!("{}{drift}", noise.as_deref().unwrap_or("as measured"))),
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
                significant(model.spread, 3)
            ),
        ),
        ("Blob", format!("{} bytes, CRC-32 {}", grouped(model.blob_bytes), model.model_crc)),
    ];
    facts.extend(result.features.iter().map(|choice| ("Chosen", choice.to_string())));
    facts.extend(result.data.iter().flat_map(left_out));
    facts
}

/// Lines and inputs of a data file that a model was not trained on.
fn left_out(data: &DataSummary) -> [(&'static str, String); 3] {
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
    [
        ("Lines left out", lines.join("; ")),
        ("Inputs left out", in_words(unused)),
        ("Constant inputs", columns::some_names(&data.constant_inputs)),
    ]
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
