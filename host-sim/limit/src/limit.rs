//! The limit as a decoder: the posterior mean E[Δ | readings] of every frame.

use rayon::prelude::*;
use taxel_data::digest::digest;
use taxel_data::{LANES, Lanes, Progress, Purpose, Random, Silent, Stream};
use taxel_learn::{Estimates, FrameDecoder, Frames};
use taxel_simulate::sensor::LaneModel;
use taxel_simulate::{Synthesis, World};

use crate::error::Refusal;
use crate::frame::{Frame, Memory, Rows};
use crate::population::{Effort, moments, sample};
use crate::samples::Samples;

/// Name of the decoder in tables and results.
pub const NAME: &str = "limit";
/// Largest number of latents that are sampled together.
pub const MOST_LATENTS: usize = 32;
/// Samples of the prior from which every frame's population starts.
const PRIOR_SAMPLES: usize = 16_384;

/// Decoder with the least possible mean square error: the posterior mean of a world's own prior and noise.
///
/// It knows the sensor's equations, how electrodes move, and the noise: what a trained decoder has to find out. It
/// models ideal readings with the world's noise, of which a still frame has both parts at once, and which is what [`Synthesis`] draws; circuits of a readout are
/// no part of it. It is slow: about 10 ms a frame of one contact.
#[derive(Debug, Clone)]
pub struct Limit {
    world: World,
    /// Worlds of each kind of motion alone, with its share.
    kinds: Vec<(f64, World)>,
    /// Rows that are sampled together, from 0; each group is independent of the others.
    groups: Vec<Group>,
}

#[derive(Debug, Clone)]
struct Group {
    rows: Vec<usize>,
    /// Standard deviation of each reading in Ω; empty for noise relative to the reading.
    deviation_ohm: Vec<f64>,
    /// Samples of the prior of each kind of motion.
    priors: Vec<PriorSamples>,
}

/// Samples of the prior, in lanes, with their ideal readings.
#[derive(Debug, Clone)]
pub struct PriorSamples {
    /// Latents, without likelihoods.
    pub samples: Samples,
    /// Ideal readings in Ω of each [`LANES`] samples, one after the other.
    pub ideal_ohm: Vec<Lanes>,
}

/// Posterior of one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Posterior {
    /// Posterior mean of each output, in its unit.
    pub mean: Vec<f64>,
    /// Posterior variance of each output, in its unit squared.
    pub variance: Vec<f64>,
    /// Fourth central moment of each output in the posterior.
    pub fourth: Vec<f64>,
    /// Effective sample size behind each output.
    pub effective: Vec<f64>,
}

impl Limit {
    /// Prepares the limit of still frames of `world` at its noise. The rubber does not matter: it is at the end of all creep.
    ///
    /// # Errors
    /// [`Refusal`] for a world with something that is not modelled, or without noise.
    pub fn new(world: &World) -> Result<Self, Refusal> {
        let motion = &world.motion;
        if world.drift.is_some() {
            return Err(Refusal::Drift);
        }
        if world.noise.is_none() {
            return Err(Refusal::NoNoise);
        }
        let together = if motion.has_independent_rows() { 1 } else { world.read_rows.len() };
        let electrodes = together * world.sensor.electrodes_per_row_wire;
        let kinds = world.kinds();
        let latents = kinds.iter().map(|(_, kind)| kind.motion.latents(electrodes)).max();
        let latents = latents.unwrap_or(0);
        if latents > MOST_LATENTS {
            return Err(Refusal::TooManyLatents { latents, most: MOST_LATENTS });
        }
        let units_ohm = Synthesis::new(world).noise_unit_ohm();
        let deviations_ohm: Vec<f64> =
            units_ohm.iter().map(|unit| (world.noise.total_level() * unit).max(1e-12)).collect();
        let groups = world.read_rows.chunks(together).enumerate().map(|(place, rows)| {
            let readings = together * world.sensor.column_wires;
            let deviation_ohm = if deviations_ohm.is_empty() {
                Vec::new()
            } else {
                deviations_ohm[place * readings..][..rows.len() * world.sensor.column_wires]
                    .to_vec()
            };
            let of_kind = |(share, kind): &(f64, World)| PriorSamples::new(kind, *share, rows);
            let priors = kinds.iter().map(of_kind).collect();
            Group { rows: rows.to_vec(), deviation_ohm, priors }
        });
        Ok(Self { groups: groups.collect(), kinds, world: world.clone() })
    }

    /// World whose limit it is.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Standard deviation of each reading of a frame in Ω; empty for noise relative to the reading.
    pub fn deviation_ohm(&self) -> Vec<f64> {
        self.groups.iter().flat_map(|group| &group.deviation_ohm).copied().collect()
    }

    /// Samples the posterior of every frame of `readings_ohm`, frame after frame.
    ///
    /// Draws depend on the world's seed and the frame's readings, not on its place or the number of threads.
    pub fn posteriors(&self, readings_ohm: &[f64], progress: &dyn Progress) -> Vec<Posterior> {
        let rows: Vec<Vec<Rows<'_>>> = self.groups.iter().map(|group| self.rows(group)).collect();
        let width = FrameDecoder::inputs(self);
        let frames = readings_ohm.par_chunks_exact(width.max(1));
        progress.stage("least possible error", readings_ohm.len() / width.max(1));
        let decode = |readings_ohm: &[f64]| {
            let mut posterior = Posterior::default();
            let mut from = 0;
            for (group, rows) in self.groups.iter().zip(&rows) {
                let readings_ohm = &readings_ohm[from..from + rows[0].readings()];
                from += readings_ohm.len();
                self.decode_group(&group.priors, rows, readings_ohm, &mut posterior);
            }
            progress.step();
            posterior
        };
        frames.map(decode).collect()
    }

    /// Rows of a group, with each kind of motion.
    fn rows<'l>(&'l self, group: &'l Group) -> Vec<Rows<'l>> {
        let of_kind = |(_, world): &'l (f64, World)| Rows {
            world,
            motion: &*world.motion,
            model: LaneModel::new(&world.sensor),
            wires: &group.rows,
            deviation_ohm: &group.deviation_ohm,
        };
        self.kinds.iter().map(of_kind).collect()
    }

    /// Appends the posterior of one group of rows.
    fn decode_group(
        &self,
        priors: &[PriorSamples],
        rows: &[Rows<'_>],
        readings_ohm: &[f64],
        posterior: &mut Posterior,
    ) {
        let mut memory: Memory = rows[0].memory();
        let frames: Vec<Frame<'_>> = rows.iter().map(|rows| Frame { rows, readings_ohm }).collect();
        let bytes: Vec<u8> = readings_ohm.iter().flat_map(|r| r.to_le_bytes()).collect();
        let (seed, part) =
            (self.world.seed, rows[0].wires.first().map_or(0, |row| *row as u64 + 1));
        let mut random = Random::new(seed, Stream::Test, Purpose::Posterior, digest(&bytes), part);
        let start = |(prior, rows): (&PriorSamples, &Rows<'_>)| {
            let mut start = prior.samples.clone();
            for ideal_ohm in prior.ideal_ohm.chunks_exact(readings_ohm.len()) {
                start.log_likelihood.extend(rows.log_likelihood(readings_ohm, ideal_ohm));
            }
            start
        };
        let starts: Vec<Samples> = priors.iter().zip(rows).map(start).collect();
        let effort = Effort::new(rows.iter().map(Rows::latents).max().unwrap_or(0));
        let samples = sample(&frames, &starts, &effort, &mut random, &mut memory);
        let moments = moments(&frames, &samples, &mut memory);
        posterior.effective.extend(std::iter::repeat_n(moments.effective, moments.mean.len()));
        posterior.mean.extend(moments.mean);
        posterior.variance.extend(moments.variance);
        posterior.fourth.extend(moments.fourth);
    }
}

impl PriorSamples {
    /// Draws samples of the prior of `rows` (from 0), for the motion of `world` with this share in a mix.
    pub fn new(world: &World, share: f64, rows: &[usize]) -> Self {
        let model = LaneModel::new(&world.sensor);
        let rows = Rows { world, motion: &*world.motion, model, wires: rows, deviation_ohm: &[] };
        let n = rows.latents();
        let part = rows.wires.first().map_or(0, |row| *row as u64 + 1);
        let draw = |memory: &mut Memory, number: usize| {
            let (seed, number) = (world.seed, number as u64);
            let mut random = Random::new(seed, Stream::Span, Purpose::Posterior, number, part);
            let mut latents = vec![[0.0; LANES]; n];
            latents.as_flattened_mut().fill_with(|| random.normal());
            let ideal_ohm = rows.ideal_ohm(&latents, memory).to_vec();
            (latents, ideal_ohm)
        };
        let numbers = (0..PRIOR_SAMPLES / LANES).into_par_iter();
        let drawn: Vec<(Vec<Lanes>, Vec<Lanes>)> =
            numbers.map_init(|| rows.memory(), draw).collect();
        let mut samples = Samples::new(n, share.ln());
        let mut ideal_ohm = Vec::with_capacity(drawn.len() * rows.readings());
        for (latents, readings) in drawn {
            for lane in 0..LANES {
                samples.places.extend(latents.iter().map(|latent| latent[lane]));
            }
            ideal_ohm.extend(readings);
        }
        samples.log_prior = vec![0.0; PRIOR_SAMPLES];
        Self { samples, ideal_ohm }
    }
}

impl FrameDecoder for Limit {
    type State = ();

    fn name(&self) -> &str {
        NAME
    }

    fn inputs(&self) -> usize {
        self.world.read_rows.len() * self.world.sensor.column_wires
    }

    fn decode(&self, (): &mut (), frames: Frames<'_>) -> Estimates {
        let posteriors = self.posteriors(frames.readings, &Silent);
        let (mut values, mut deviation) = (Vec::new(), Vec::new());
        for posterior in posteriors {
            values.extend(posterior.mean);
            deviation.extend(posterior.variance.iter().map(|variance| variance.sqrt()));
        }
        Estimates { values, deviation: Some(deviation), novelty: None }
    }
}
