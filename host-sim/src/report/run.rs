//! What the sections of `run` are made of.

use taxel_data::columns;
use taxel_data::dataset::UnusedInputs;
use taxel_evaluate::run::RunResult;

use super::errors::Pictures;
use super::format::{counted, grouped, noise, percent, significant};
use super::judged::{self, Judged};
use super::sections::Sections;
use super::table1;

/// Sections of a run.
pub fn sections(result: &RunResult) -> Sections {
    let mut sections = judged::sections(&of_run(result), made(result));
    sections.value("subject", &result.subject);
    sections.value("scene_digest", &result.scene_digest);
    sections.value("seed", &result.seed);
    sections.value("scene", &result.scene);
    sections.value("data", &result.data);
    sections.value("model", &result.model);
    sections.value("features", &result.features);
    sections.value("distribution", &result.distribution);
    match &result.table1 {
        Some(table) => sections.object("table1", &table1::values(table)),
        None => sections.value("table1", &()),
    }
    sections
}

/// Model of a run, and its errors.
pub fn of_run(result: &RunResult) -> Judged<'_> {
    let scene = result.scene.as_ref();
    let frames = result.model.test_frames;
    let sensor = scene.and_then(|scene| scene.sensor.as_ref());
    Judged {
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

/// How data and model were made.
fn made(result: &RunResult) -> Sections {
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
    let spread = significant(model.spread, 3);
    let networks = counted(model.networks, "network");
    let [training, test] = [model.training_frames, model.test_frames].map(grouped);
    let mut made = Sections::new(format!("{kind} “{}”", result.subject));
    made.line(
        kind,
        format!("{}, digest {}, seed {}", result.subject, result.scene_digest, result.seed),
    );
    made.line("Readings", format!("{}{drift}", noise.as_deref().unwrap_or("as measured")));
    made.line("Frames", format!("{training} to train on, {test} ({others}) to test"));
    let shape = format!("{inputs} → K = {} → {outputs}", model.centres);
    made.line("Model", format!("{networks}: {shape}; spread {spread}{refined}"));
    let blob = grouped(model.blob_bytes);
    made.line("Blob", format!("{blob} bytes, CRC-32 {}", model.model_crc));
    made.line("Chosen", result.features.as_ref().map_or(String::new(), ToString::to_string));
    if let Some(data) = &result.data {
        let missing = &data.lines_left_out;
        let outliers = if data.outliers.left_out { data.outliers.lines } else { 0 };
        let lines = [
            (missing.unreadable.as_ref().map_or(0, |it| it.lines), "are cut or garbled"),
            (missing.without_reading, "lack a reading"),
            (missing.without_output, "lack all outputs"),
            (outliers, "hold a value far from all others"),
        ];
        made.line("Lines left out", reasons(&lines));
        made.line("Inputs left out", in_words(&data.unused_inputs));
        made.line("Constant inputs", columns::some_names(&data.constant_inputs));
    }
    made
}

/// Counts that are not 0, with what they count.
pub fn reasons(counts: &[(usize, &str)]) -> String {
    let counts = counts.iter().filter(|(count, _)| *count > 0);
    let counts = counts.map(|(count, what)| format!("{} {what}", grouped(*count)));
    counts.collect::<Vec<_>>().join("; ")
}

/// Inputs that can tell nothing, and why; empty if there are none.
pub fn in_words(unused: &UnusedInputs) -> String {
    let twins: Vec<String> =
        unused.duplicated.iter().map(|(name, of)| format!("{name} = {of}")).collect();
    let inputs = [
        (&unused.dead, "without values"),
        (&unused.constant, "never change"),
        (&unused.flickering, "flicker"),
        (&twins, "are copies"),
    ];
    let inputs = inputs.iter().filter(|(names, _)| !names.is_empty());
    let inputs: Vec<String> =
        inputs.map(|(names, why)| format!("{} ({why})", columns::some_names(names))).collect();
    inputs.join("; ")
}
