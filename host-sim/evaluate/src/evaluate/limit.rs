//! Limit of a scene: the least possible error by noise level, for the array and for each row alone, how near to it
//! models come, and what the sensor shows of its deformation at all.

use std::path::PathBuf;

use taxel_data::{Progress, Stream};
use taxel_learn::ModelBlob;
use taxel_limit::identify::{self, Observability, Prior};
use taxel_limit::reference::{EffectiveSamples, GroupLimit};
use taxel_limit::{Reference, Refusal};
use taxel_simulate::noise::NoiseKind;
use taxel_simulate::{Synthesis, World};

use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::metrics::{self, DecoderErrors, Measure};

/// What to compute.
#[derive(Debug, Clone, Copy)]
pub struct Plan<'p> {
    /// Noise levels, as fractions.
    pub noise_levels: &'p [f64],
    pub frames: usize,
    /// Models to judge beside the limit.
    pub models: &'p [Candidate],
}

/// Model that is judged beside the limit.
#[derive(Debug)]
pub struct Candidate {
    /// File that it was read from.
    pub file: PathBuf,
    pub blob: ModelBlob,
}

impl Candidate {
    /// Checks that it decodes the readings of `world` to its outputs.
    pub fn check(&self, world: &World) -> Result<()> {
        let model = self.blob.parse();
        let metadata = model.metadata();
        let inputs = metadata.input_names.iter().eq(world.reading_names().iter());
        let outputs = metadata.output_names.iter().eq(world.output_names().iter());
        if inputs && outputs {
            return Ok(());
        }
        let what = if inputs { "outputs" } else { "readings" };
        let message = format!(
            "the model has other {what} than the scene; train it on this scene and the same rows"
        );
        Err(Error::Unfit { path: self.file.clone(), message })
    }
}

/// Number of test frames, unless a user says otherwise: as many posteriors of rows where rows move independently.
pub fn usual_frames(world: &World) -> usize {
    if world.motion.has_independent_rows() { 400 / world.read_rows.len().min(400) } else { 400 }
}

/// Limit of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitResult {
    pub subject: String,
    /// Seed of every random draw.
    pub seed: u64,
    pub noise_kind: NoiseKind,
    pub frames: usize,
    /// Extent of the sensor in mm.
    pub size_mm: [f64; 3],
    /// Number of row-wires of the sensor, read or not.
    pub row_wires: usize,
    /// Results by noise level.
    pub levels: Vec<Level>,
}

/// Limit at one noise level.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Noise level p: a fraction, or in Ω for absolute noise.
    pub noise_level: f64,
    /// Limits: of all readings together, then of each row from its own readings if there are several.
    pub limits: Vec<Figures>,
    /// Errors of the plan's models on the same frames, with their ratios to the limit of all readings.
    pub decoders: Vec<DecoderErrors>,
    /// What all readings show.
    pub observability: Observability,
    /// What each row's readings show, if there are several rows.
    pub by_row: Vec<Observability>,
}

/// Limit of the electrodes of some rows, from the readings of these rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// Row-wires, from 1.
    pub row_wires: Vec<usize>,
    /// Limit by group of outputs; empty if it is refused.
    pub groups: Vec<GroupLimit>,
    /// Effective sample sizes of the posteriors.
    pub effective_samples: Option<EffectiveSamples>,
    /// Reason for refusing the figures.
    pub refused: Option<String>,
}

impl Figures {
    fn new(row_wires: &[usize], reference: &std::result::Result<Reference, Refusal>) -> Self {
        Self {
            row_wires: row_wires.iter().map(|row| row + 1).collect(),
            groups: reference.as_ref().map_or(Vec::new(), Reference::limits),
            effective_samples: reference.as_ref().ok().map(Reference::effective),
            refused: reference.as_ref().err().map(ToString::to_string),
        }
    }
}

/// Computes the limit of the experiment's scene.
///
/// # Errors
/// [`Error`] for a scene without noise, or a model of another scene.
pub fn compute(
    experiment: &Experiment,
    plan: &Plan<'_>,
    progress: &dyn Progress,
) -> Result<LimitResult> {
    let world = &experiment.world;
    plan.models.iter().try_for_each(|model| model.check(world))?;
    let prior = Prior::new(world);
    let levels = plan.noise_levels.iter().map(|noise_level| {
        let mut experiment = experiment.clone();
        experiment.world.set_noise_level(*noise_level)?;
        level(&experiment, &prior, plan, progress)
    });
    let levels = levels.collect::<Result<Vec<Level>>>()?;
    Ok(LimitResult {
        subject: experiment.name.clone(),
        seed: world.seed,
        noise_kind: world.noise.kind,
        frames: plan.frames,
        size_mm: world.sensor.size_mm,
        row_wires: world.sensor.row_wires,
        levels,
    })
}

fn level(
    experiment: &Experiment,
    prior: &Prior,
    plan: &Plan<'_>,
    progress: &dyn Progress,
) -> Result<Level> {
    let (world, frames) = (&experiment.world, plan.frames);
    let seen = |rows: &[usize]| {
        identify::observability(world, prior, rows)
            .map_err(|refusal| Error::Usage(format!("noise 0: {refusal}")))
    };
    let observability = seen(&world.read_rows)?;
    let several = if world.read_rows.len() > 1 { &world.read_rows[..] } else { &[] };
    let by_row = several.iter().map(|row| seen(&[*row])).collect::<Result<_>>()?;
    let all = Reference::new(world, frames, progress);
    let mut limits = vec![Figures::new(&world.read_rows, &all)];
    let width = world.output_names().len() / world.read_rows.len();
    for (place, &row) in several.iter().enumerate() {
        // A row that moves by itself is known from its own readings alone.
        let own = if world.motion.has_independent_rows() {
            all.as_ref().map(|all| all.columns(place * width, width)).map_err(Clone::clone)
        } else {
            Reference::new(&World { read_rows: vec![row], ..world.clone() }, frames, progress)
        };
        limits.push(Figures::new(&[row], &own));
    }
    let measure = Measure { limit: all.ok(), ..experiment.measure() };
    let decoders = plan.models.iter().map(|model| judge(model, experiment, frames, &measure));
    let decoders = decoders.collect();
    Ok(Level { noise_level: world.noise.total_level(), limits, decoders, observability, by_row })
}

/// Errors of a model on the experiment's first test frames.
fn judge(
    model: &Candidate,
    experiment: &Experiment,
    frames: usize,
    measure: &Measure,
) -> DecoderErrors {
    let decoder = model.blob.prepare().of_inputs();
    let mut experiment = experiment.clone();
    experiment.training.relative_inputs = decoder.model().metadata().relative_inputs;
    let test = experiment.dataset(&Synthesis::new(&experiment.world), Stream::Test, frames);
    DecoderErrors {
        decoder: model.file.display().to_string(),
        ..metrics::judge(&decoder, &test, measure)
    }
}
