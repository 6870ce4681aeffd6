//! Contacts that move: posteriors of the outputs at a moment, given all frames that are finished by then.
//!
//! Some twelve numbers fix a contact and its path, and with them every reading of its trajectory. Their posterior is thin and
//! bent: its tops are looked for with a few frames first, and then with ever more; [maps](crate::maps) draw around them.
//! Draws are solved for with a few frames that stand for all, and weighted by the likelihood of all.

use rayon::prelude::*;
use taxel_data::{
    BadValue, LANES, Lanes, Purpose, Random, Stream, Values, normal_share_below, widest,
};
use taxel_simulate::contact::Contact;
use taxel_simulate::motion::{Draws, Motion};
use taxel_simulate::path::{NUMBERS, Path, Paths};
use taxel_simulate::sensor::{LaneModel, Sensor};
use taxel_simulate::timetable::Timetable;
use taxel_simulate::{Synthesis, World};

use crate::frame::{Frame, Memory, Rows};
use crate::limit::Posterior;
use crate::maps::Maps;
use crate::population::{Effort, Moments, moments, starts, weights};
use crate::samples::Samples;
use crate::slopes::{Local, locals, tops};
use crate::target::Target;
use crate::weights::effective;

/// Samples of the prior among which tops are looked for, and most of them that this begins from.
const PRIOR_SAMPLES: usize = 8192;
const MOST_STARTS: usize = 16;
/// Least number of frames that tops are looked for with, and how many times as many come next.
const FEW_FRAMES: usize = 6;
const GROWTH: usize = 4;
/// Logarithm of a top's share of the highest, below which it is left out, and distance of latents that are one top.
const NEGLIGIBLE: f64 = -15.0;
const ONE_TOP: f64 = 0.1;
/// Number of frames that stand for all while draws are solved for.
const STAND_FOR_ALL: usize = 12;
/// Effective sample size at which sampling ends, and most rounds of draws.
const WANTED: f64 = 100.0;
const ROUNDS: usize = 50;

/// Contacts that move, one a lane, as a scan finds them that starts at some time.
#[derive(Debug)]
struct Moved<'t> {
    contact: Contact,
    paths: Paths,
    /// Row-wires that are scanned, from 0, and when.
    wires: &'t [usize],
    timetable: &'t Timetable,
    start_s: f64,
}

impl Motion for Moved<'_> {
    fn range_mm(&self) -> [[f64; 2]; 3] {
        [[f64::NEG_INFINITY, f64::INFINITY]; 3]
    }

    fn check(&self) -> Result<(), BadValue> {
        Ok(())
    }

    fn place(&self, sensor: &Sensor, row: usize, _: &[Lanes], deformation_mm: &mut [[Lanes; 3]]) {
        let place = self.wires.iter().position(|wire| *wire == row).unwrap_or_default();
        let offset_s = self.timetable.row_offset_s(place, self.wires.len());
        let (centre_mm, dent_depth_mm) = self.paths.at(self.start_s + offset_s);
        let contact = Contact { centre_mm, dent_depth_mm, ..self.contact.clone() };
        contact.deform(sensor.row_electrodes_mm(row), deformation_mm);
    }
}

/// What the first frames of a trajectory tell of the outputs at a moment.
#[derive(Clone, Copy)]
struct Touch<'t> {
    world: &'t World,
    path: &'t Path,
    timetable: &'t Timetable,
    instant: &'t Timetable,
    /// Phases of the trajectory's own path in turns, from which those of others are told: along x, and of presses.
    phases: [f64; 2],
    deviation_ohm: &'t [f64],
    /// Readings in Ω of all frames.
    readings_ohm: &'t [f64],
    /// Number of frames that are finished. Of these, the last counts, and every so manieth before it. Each stands for so many.
    finished: usize,
    apart: usize,
    weight: f64,
}

impl Touch<'_> {
    /// Contacts and their paths at the `latents`. Paths have the latents of place and depth that still contacts have.
    fn moved<'m>(&'m self, latents: &[Lanes], timetable: &'m Timetable) -> Moved<'m> {
        let World { sensor, motion, read_rows: wires, .. } = self.world;
        let (contact, rest) = latents.split_at(motion.latents(0));
        let [x, y, .., depth, _, _] = contact else { unreachable!("a contact's latents") };
        let mut units = [rest[0], rest[1], *depth, *x, *y, rest[2], rest[3], rest[4], rest[5]];
        widest!(units.as_flattened_mut().iter_mut().for_each(|it| *it = normal_share_below(*it)));
        // A quarter of a turn has all half lengths. What resembles the own path is in the middle of the latents for phases.
        units[5].iter_mut().for_each(|it| *it *= 0.25);
        for (number, phase) in [6, 8].into_iter().zip(self.phases) {
            units[number].iter_mut().for_each(|it| *it += phase - 0.5);
        }
        let paths = self.path.place(sensor, motion.deepest_mm(), &units);
        let contact = motion.place_contact(sensor, contact).expect("a contact that moves");
        Moved { contact, paths, wires, timetable, start_s: timetable.starts_s[0] }
    }

    /// Frames that count.
    fn frames(&self) -> impl ExactSizeIterator<Item = usize> {
        (0..self.finished).rev().step_by(self.apart)
    }

    /// Rows whose electrodes move in this way.
    fn rows<'m>(&'m self, motion: &'m dyn Motion) -> Rows<'m> {
        let (world, model) = (self.world, LaneModel::new(&self.world.sensor));
        Rows { world, motion, model, wires: &world.read_rows, deviation_ohm: self.deviation_ohm }
    }

    /// Natural logarithm of the likelihood at the `latents`: the sum of what `each` gives for a frame, by its place among those
    /// that count.
    fn sum(&self, latents: &[Lanes], mut each: impl FnMut(usize, &Frame<'_>) -> Lanes) -> Lanes {
        let mut moved = self.moved(latents, self.timetable);
        let width = self.readings_ohm.len() / self.timetable.scans();
        let mut sum = [0.0; LANES];
        for (number, frame) in self.frames().enumerate() {
            moved.start_s = self.timetable.starts_s[frame];
            let readings_ohm = &self.readings_ohm[frame * width..][..width];
            let log = each(number, &Frame { rows: &self.rows(&moved), readings_ohm });
            sum.iter_mut().zip(log).for_each(|(sum, log)| *sum += self.weight * log);
        }
        sum
    }

    /// Tops of the posterior.
    fn tops(&self, random: &mut Random, memory: &mut Memory) -> Vec<Local> {
        let levels = (self.finished / FEW_FRAMES).max(1).ilog(GROWTH);
        let few = Self { apart: GROWTH.pow(levels), ..*self };
        let mut prior = Samples::new(self.latents(), 0.0);
        prior.places.resize_with(PRIOR_SAMPLES * self.latents(), || random.normal());
        prior.log_prior = vec![0.0; PRIOR_SAMPLES];
        prior.log_likelihood = few.log_likelihoods(&prior, memory);
        let mut places = starts(&prior, &Effort::new(self.latents()), random);
        places.truncate(MOST_STARTS);
        let mut found = vec![];
        for level in (0..=levels).rev() {
            found = tops(&Self { apart: GROWTH.pow(level), ..*self }, &places, memory);
            found.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
            let least = found[0].log_posterior() + NEGLIGIBLE;
            found.retain(|top| top.log_posterior() >= least);
            found.dedup_by(|a, b| (&a.place - &b.place).norm() < ONE_TOP);
            places = found.iter().map(|top| top.place.clone()).collect();
        }
        found
    }

    /// Natural logarithms of the likelihood of all `samples`, whose number is a multiple of [`LANES`].
    fn log_likelihoods(&self, samples: &Samples, memory: &mut Memory) -> Vec<f64> {
        let mut latents = vec![[0.0; LANES]; samples.latents];
        let of_lanes = |places: &[f64]| {
            for (lane, place) in places.chunks_exact(samples.latents).enumerate() {
                latents.iter_mut().zip(place).for_each(|(latent, x)| latent[lane] = *x);
            }
            self.log_likelihood(&latents, memory)
        };
        samples.places.chunks_exact(LANES * samples.latents).flat_map(of_lanes).collect()
    }

    /// Posterior of the outputs.
    fn posterior(&self, random: &mut Random) -> Posterior {
        let memory = &mut self.rows(&*self.world.motion).memory();
        let tops = self.tops(random, memory);
        let few = Self { apart: (self.finished / STAND_FOR_ALL).max(1), ..*self };
        let few = Self { weight: self.finished as f64 / few.frames().len() as f64, ..few };
        let tops = locals(&few, tops.iter().map(|top| &top.place), memory);
        let maps = Maps::new(&few, tops, memory);
        let mut kept = [Samples::new(self.latents(), 0.0)];
        for _ in 0..ROUNDS {
            let mut drawn = maps.draw(&few, random, memory);
            drawn.log_likelihood = self.log_likelihoods(&drawn, memory);
            kept[0].append(&drawn);
            if effective(&weights(&kept)) >= WANTED {
                break;
            }
        }
        let Moments { effective, mean, variance, fourth } = moments(&[*self], &kept, memory);
        Posterior { effective: vec![effective; mean.len()], mean, variance, fourth }
    }
}

impl Target for Touch<'_> {
    type Memory = Memory;

    fn latents(&self) -> usize {
        self.world.motion.latents(0) + NUMBERS - 3
    }

    fn readings(&self) -> usize {
        self.frames().len() * self.rows(&*self.world.motion).readings()
    }

    fn output_count(&self) -> usize {
        self.rows(&*self.world.motion).outputs()
    }

    fn log_likelihood(&self, latents: &[Lanes], memory: &mut Memory) -> Lanes {
        self.sum(latents, |_, frame| frame.log_likelihood(latents, memory))
    }

    fn residuals(&self, latents: &[Lanes], memory: &mut Memory, residuals: &mut [Lanes]) -> Lanes {
        let root = self.weight.sqrt();
        self.sum(latents, |number, frame| {
            let residuals = &mut residuals[number * frame.readings()..][..frame.readings()];
            let log = frame.residuals(latents, memory, residuals);
            residuals.as_flattened_mut().iter_mut().for_each(|residual| *residual *= root);
            log
        })
    }

    fn outputs(&self, latents: &[Lanes], memory: &mut Memory, outputs: &mut [Lanes]) {
        let moved = self.moved(latents, self.instant);
        Frame { rows: &self.rows(&moved), readings_ohm: &[] }.outputs(latents, memory, outputs);
    }
}

/// True outputs of `world` at `moments_s`, each of a trajectory of its own among the test frames, and their posteriors: given
/// those of its scans by the `timetable` that are finished by then, `finished_s` after they start.
pub fn posteriors(
    (world, path): (&World, &Path),
    (timetable, finished_s): (&Timetable, f64),
    moments_s: &[f64],
) -> (Values, Vec<Posterior>) {
    let scanned = Synthesis::new(world).along(*path, timetable.clone());
    let units_ohm = scanned.noise_unit_ohm();
    let deviation_ohm: Vec<f64> = units_ohm.iter().map(|unit| world.noise.level * unit).collect();
    let frames = scanned.frames(Stream::Test, moments_s.len() * timetable.scans()).inputs;
    let of_moment = |(number, readings_ohm): (usize, &[f64])| {
        let own = Path::draw(&mut Draws::new(world.seed, Stream::Test, number));
        let is_finished = |start_s: &f64| start_s + finished_s <= moments_s[number] + 1e-9;
        let instant = Timetable::instants(vec![moments_s[number]]);
        let touch = Touch {
            world,
            path,
            timetable,
            instant: &instant,
            phases: [own[6][0], own[8][0]],
            deviation_ohm: &deviation_ohm,
            readings_ohm,
            finished: timetable.starts_s.partition_point(is_finished),
            apart: 1,
            weight: 1.0,
        };
        let part = number as u64;
        let mut random = Random::new(world.seed, Stream::Test, Purpose::Posterior, part, 0);
        let posterior = touch.posterior(&mut random);
        let truth = Synthesis::new(world).along(*path, instant);
        (truth.frames_from(Stream::Test, number, 1).outputs.values.into_vec(), posterior)
    };
    let of_trajectory = timetable.scans() * frames.names.len();
    let trajectories = frames.values.par_chunks_exact(of_trajectory).enumerate();
    let (truth, posteriors): (Vec<_>, Vec<_>) = trajectories.map(of_moment).unzip();
    (truth.concat().into(), posteriors)
}
