//! Effect of rubber that creeps on decoders of moving contacts, and what training with it gains.

use serde::Serialize;
use taxel_data::progress::Progress;
use taxel_learn::decoders::{BASELINES, mean};
use taxel_learn::{Decoder, Exponential};
use taxel_simulate::Synthesis;
use taxel_simulate::outputs::{ContactOutput, Outputs};
use taxel_simulate::path::Path;
use taxel_simulate::rubber::{Elastic, Kind, StandardLinearSolid};
use taxel_simulate::timetable::Timetable;

use taxel_evaluate::error::Result;
use taxel_evaluate::evaluate::trade::{Device, Wires};
use taxel_evaluate::experiment::Experiment;
use taxel_evaluate::metrics::{self, Errors};
use taxel_evaluate::moving::Moving;
use taxel_evaluate::training_set::TrainingSet;

/// Rubber, unless the scene or a user says otherwise: a fifth of each deformation comes by creep, in about the time of a
/// press, where it does most harm.
pub const TYPICAL: StandardLinearSolid =
    StandardLinearSolid { instant_share: 0.8, time_constant_ms: 100.0 };
/// Scans of a trajectory that are trained on, evenly over its duration: so that frames are of many contacts.
const TRAINED_SCANS: usize = 10;

/// Contacts that a decoder is trained on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TrainedOn {
    Still,
    /// Moving, on rubber that follows at once.
    Moving,
    /// Moving, on rubber that creeps.
    Creeping,
}

/// Errors of one decoder on the same moving contacts, on rubber that follows at once and on rubber that creeps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    pub decoder: String,
    pub trained_on: TrainedOn,
    /// Whether the creep is taken back from its estimates, which knows the rubber.
    pub creep_undone: bool,
    pub at_once: Judged,
    pub creeping: Judged,
}

/// Errors of the estimates of all scans.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Errors against what was true when each row was read.
    pub when_read: Vec<Errors>,
    /// Errors of the newest finished estimate against the truth, at every moment.
    pub when_used: Vec<Errors>,
}

/// Results of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RubberResult {
    pub subject: String,
    pub seed: u64,
    pub instant_share: f64,
    pub time_constant_ms: f64,
    pub scan_ms: f64,
    pub training_frames: usize,
    pub trajectories: usize,
    /// Lines by decoder: for the scene's own outputs, then for the contact's force.
    pub outputs: Vec<Vec<Line>>,
}

/// Trains decoders of `scene`, whose contacts move along `path`, on still contacts, on moving ones, and on moving ones on
/// rubber that creeps as `solid` does. Judges each on the same moving contacts, on both kinds of rubber.
pub fn measure(
    scene: &Experiment,
    path: Path,
    solid: StandardLinearSolid,
    progress: &dyn Progress,
) -> Result<RubberResult> {
    let wires =
        Wires { rows: scene.world.read_rows.len(), columns: scene.world.sensor.column_wires };
    let scan_ms = Device::default().scan_ms(Some(wires), 1).unwrap_or_default();
    let force = Outputs::Contact(vec![ContactOutput::Force]);
    let outputs = [scene.world.outputs.clone(), force].into_iter().map(|outputs| {
        let mut own = scene.clone();
        own.world.outputs = outputs;
        lines(&own, path, solid, scan_ms, progress)
    });
    Ok(RubberResult {
        subject: scene.name.clone(),
        seed: scene.world.seed,
        instant_share: solid.instant_share,
        time_constant_ms: solid.time_constant_ms,
        scan_ms,
        training_frames: scene.training.frames,
        trajectories: path.trajectories,
        outputs: outputs.collect::<Result<_>>()?,
    })
}

/// Lines of one kind of outputs.
fn lines(
    scene: &Experiment,
    path: Path,
    solid: StandardLinearSolid,
    scan_ms: f64,
    progress: &dyn Progress,
) -> Result<Vec<Line>> {
    let on = |rubber: Kind| {
        let mut scene = scene.clone();
        scene.world.rubber = rubber;
        scene
    };
    let scenes = [on(Elastic {}.into()), on(solid.into())];
    let moving = |scene: &Experiment| {
        Moving::new(scene, &Synthesis::new(&scene.world), path, ([scan_ms, scan_ms], 1))
    };
    let tests = [moving(&scenes[0])?, moving(&scenes[1])?];
    let measure = scene.measure();
    let judge = |test: &Moving, estimates: &[f64]| Judged {
        when_read: metrics::by_group(&test.frames.outputs, estimates, &measure),
        when_used: test.errors(estimates, scan_ms, &measure),
    };
    let of_force = matches!(scene.world.outputs, Outputs::Contact(_));
    let mut lines: Vec<Line> = Vec::new();
    for trained_on in [TrainedOn::Still, TrainedOn::Moving, TrainedOn::Creeping] {
        let scene = &scenes[usize::from(trained_on == TrainedOn::Creeping)];
        let mut synthesis = Synthesis::new(&scene.world);
        if trained_on != TrainedOn::Still {
            synthesis = synthesis.along(path, trained_scans(path, scan_ms));
        }
        let mut training = TrainingSet::of_scene(scene, synthesis);
        training.confidence = false;
        training.fill = false;
        let blob = training.blob(&scene.options(), progress)?;
        let network = blob.prepare(Exponential::default()).of_inputs();
        let first = lines.is_empty();
        let baselines = BASELINES.iter().filter(|baseline| first || baseline.name != mean::NAME);
        let baselines: Vec<Box<dyn Decoder>> = baselines.map(|b| b.fit(&training.frames)).collect();
        let decoders =
            std::iter::once(&network as &dyn Decoder).chain(baselines.iter().map(AsRef::as_ref));
        for decoder in decoders {
            let estimates = tests
                .each_ref()
                .map(|test| decoder.decode_all(&test.frames.inputs.values, 1).values);
            let mut line = |estimates: [&[f64]; 2], creep_undone: bool| {
                let [at_once, creeping] = [0, 1].map(|it| judge(&tests[it], estimates[it]));
                let decoder = decoder.name().to_owned();
                lines.push(Line { decoder, trained_on, creep_undone, at_once, creeping });
            };
            line(estimates.each_ref().map(Vec::as_slice), false);
            if of_force && trained_on != TrainedOn::Creeping && decoder.name() != mean::NAME {
                let undone =
                    [0, 1].map(|it| undo_creep(&estimates[it], &tests[it].timetable, solid));
                line(undone.each_ref().map(Vec::as_slice), true);
            }
        }
    }
    Ok(lines)
}

/// Times of the scans that are trained on, in the middle of equal parts of a trajectory.
fn trained_scans(path: Path, scan_ms: f64) -> Timetable {
    let part_s = path.duration_s / TRAINED_SCANS as f64;
    let starts_s = (0..TRAINED_SCANS).map(|part| (part as f64 + 0.5) * part_s).collect();
    Timetable { starts_s, scan_s: scan_ms / 1000.0, passes: 1 }
}

/// Loads that change linearly from scan to scan, of which rubber like `solid` reaches the `estimates` of one output, scan
/// after scan and trajectory after trajectory. Each trajectory starts at rest.
fn undo_creep(estimates: &[f64], timetable: &Timetable, solid: StandardLinearSolid) -> Vec<f64> {
    let behind = 1.0 - solid.instant_share;
    let trajectories = estimates.chunks_exact(timetable.scans());
    trajectories
        .flat_map(|reached| {
            // Load, and the part of it that has come by creep.
            let (mut before, mut crept) = (0.0, 0.0);
            reached.iter().enumerate().map(move |(scan, reached)| {
                let constants = timetable.since_last_s(scan) * 1000.0 / solid.time_constant_ms;
                let rest = (-constants).exp();
                let lag = if constants > 0.0 { (1.0 - rest) / constants } else { 1.0 };
                let of_past = lag * before + rest * (crept - before);
                let load = (reached - behind * of_past) / (1.0 - behind * lag);
                crept = load * (1.0 - lag) + of_past;
                before = load;
                load
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_is_found_from_what_it_has_reached_by_creep() {
        let solid = StandardLinearSolid { instant_share: 0.6, time_constant_ms: 30.0 };
        let timetable = Timetable::every(0.01, 0.0, 0.05).unwrap();
        // A load of 2 that is there from the beginning, and a ramp of 100 a second.
        let reached = |time_s: f64| {
            let rest = (-time_s / 0.03_f64).exp();
            [2.0 * (1.0 - 0.4 * rest), 100.0 * (time_s - 0.4 * 0.03 * (1.0 - rest))]
        };
        let of = |output: usize| timetable.starts_s.iter().map(move |it| reached(*it)[output]);
        let estimates: Vec<f64> = of(0).chain(of(1)).collect();
        let loads = undo_creep(&estimates, &timetable, solid);
        let ramp = timetable.starts_s.iter().map(|time_s| 100.0 * time_s);
        for (load, expected) in loads.iter().zip([2.0; 5].into_iter().chain(ramp)) {
            assert!((load - expected).abs() < 1e-12, "{loads:?}");
        }
    }
}
