//! How many errors a model's intervals cover, and which frames it finds novel: those with broken or touching wires, or
//! with two contacts.

use crate::anomaly::{self, Anomaly};
use serde::Serialize;
use taxel_data::random::Stream;
use taxel_evaluate::evaluate::confidence::{Coverage, coverage};
use taxel_evaluate::experiment::Experiment;
use taxel_learn::{Exponential, ModelBlob, PreparedModel};
use taxel_simulate::Synthesis;
use taxel_simulate::synth::BASELINE_FRAMES;

/// What a model's confidence is worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Confidence {
    pub subject: String,
    pub seed: u64,
    pub model_crc: String,
    pub frames: usize,
    pub coverage: Vec<Coverage>,
    pub detections: Vec<Detection>,
}

/// Judges the model in `blob` on so many test `frames`, and as many of every anomaly; `None` if it has no confidence.
pub fn judge(mut scene: Experiment, blob: &ModelBlob, frames: usize) -> Option<Confidence> {
    let model = blob.prepare(Exponential::default());
    let (own, level) =
        (f64::from(model.model().metadata().noise_level), scene.world.noise.total_level());
    if (own - level).abs() > 1e-3 * level {
        eprintln!(
            "note: the model was trained for noise of {:.2} %, and is judged at the scene's {:.2} %; see --noise",
            100.0 * own,
            100.0 * level
        );
    }
    scene.training.relative_inputs = model.model().metadata().relative_inputs;
    let test = scene.dataset(&Synthesis::new(&scene.world), Stream::Test, frames);
    let of_inputs = model.clone().of_inputs();
    let (deviations, _) = of_inputs.assess(&test.inputs.values)?;
    let ratios_95 = model.model().confidence().map_or(&[][..], |it| it.ratios_95());
    let estimates = of_inputs.decode_lines(&test.inputs.values);
    Some(Confidence {
        subject: scene.name.clone(),
        seed: scene.world.seed,
        model_crc: format!("{:08x}", model.model().crc()),
        frames,
        coverage: coverage(&test.outputs, &estimates, &deviations, ratios_95),
        detections: detections(&scene, &model, frames),
    })
}

/// Share of some frames that a model finds novel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Detection {
    pub anomaly: String,
    pub frames: usize,
    /// Share of them that are novel.
    pub percent_novel: f64,
}

/// Shares of the largest depth, and of the face's longer side, that two contacts have and are apart at least.
const CONDITIONS: [[f64; 2]; 5] = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.4], [0.2, 0.5], [0.3, 0.6]];

/// Judges which of the scene's frames `model` finds novel: usual ones, and so many `frames` of every anomaly.
///
/// A `model` without a confidence finds none.
fn detections(scene: &Experiment, model: &PreparedModel<'_>, frames: usize) -> Vec<Detection> {
    let world = &scene.world;
    let rest =
        Synthesis::new(world).drift(None).untouched().frames(Stream::Anomaly, BASELINE_FRAMES);
    let model = model.clone().with_baseline(&rest.inputs.means());
    let mut detections = Vec::new();
    for kind in Anomaly::ALL {
        let Some(drawn) = anomaly::frames(world, kind, frames) else { continue };
        let Some((_, novelty)) = model.assess(&drawn.readings_ohm) else { continue };
        let mut add = |anomaly: String, chosen: &mut dyn Iterator<Item = &f64>| {
            let novel: Vec<bool> = chosen.map(|novelty| *novelty > 0.0).collect();
            if novel.is_empty() {
                return;
            }
            let count = novel.iter().filter(|novel| **novel).count() as f64;
            let percent_novel = 100.0 * count / novel.len() as f64;
            detections.push(Detection { anomaly, frames: novel.len(), percent_novel });
        };
        if kind != Anomaly::TwoContacts {
            add(kind.description().into(), &mut novelty.iter());
            continue;
        }
        let [_, most_mm] = world.motion.range_mm()[2];
        let side_mm = world.sensor.size_mm[0].max(world.sensor.size_mm[1]);
        for [depth, apart] in CONDITIONS {
            let (depth_mm, apart_mm) = (depth * most_mm, apart * side_mm);
            let depth_text = format!(", {depth_mm:.1} mm deep or more");
            let apart_text = format!(", {apart_mm:.0} mm apart or more");
            let parts = [(depth > 0.0, &depth_text), (apart > 0.0, &apart_text)];
            let given =
                parts.into_iter().filter(|(given, _)| *given).map(|(_, text)| text.as_str());
            let text: String = [kind.description()].into_iter().chain(given).collect();
            let pairs = novelty.iter().zip(&drawn.contacts_mm);
            let mut chosen = pairs
                .filter(|(_, [apart, depth])| *apart >= apart_mm && *depth >= depth_mm)
                .map(|(novelty, _)| novelty);
            add(text, &mut chosen);
        }
    }
    detections
}
