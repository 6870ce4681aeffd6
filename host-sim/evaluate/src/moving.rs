//! Errors on contacts that move, as a robot meets them: at every moment, the newest estimate that is finished against the
//! truth at that moment. So they include how long a scan and its decoding take, and how long an estimate is held until the
//! next.

use rayon::prelude::*;
use taxel_core::filter::{Settings, State};
use taxel_data::BadValue;
use taxel_data::dataset::Dataset;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::filtered::filter_frames;
use taxel_learn::{Decoder, Frames, Timing};
use taxel_limit::Reference;
use taxel_simulate::Synthesis;
use taxel_simulate::path::Path;
use taxel_simulate::timetable::Timetable;

use crate::experiment::Experiment;
use crate::metrics::{self, Blocks, Errors, Measure};

/// Time between two moments at which estimates are compared with the truth, in s: 1.5 ms times the golden section, so that
/// no period keeps step with them, and every age of an estimate counts.
pub(crate) const GRID_S: f64 = 0.001_5 * 0.618_033_988_749_895;
/// Time in s, and share of a trajectory, in which a filter may find its feet: the shorter of both is not judged.
const WARM_UP: (f64, f64) = (0.15, 0.25);

/// Mean age of the newest finished estimate in ms: the time since the middle of its scan. It is finished `finished_ms` after
/// the start of that scan, and held until the next one is, a period later.
pub fn age_ms(scan_ms: f64, finished_ms: f64, period_ms: f64) -> f64 {
    finished_ms - 0.5 * scan_ms + 0.5 * period_ms
}

/// Frames of contacts that move, and the truth that estimates are compared with.
#[derive(Debug, Clone)]
pub struct Moving {
    /// Frames of one trajectory after the other: what a decoder sees of them.
    pub frames: Dataset,
    /// When each scan of a trajectory reads.
    pub timetable: Timetable,
    /// Moments of a trajectory in s at which the truth is known.
    pub moments_s: Vec<f64>,
    /// True outputs at these moments, of one trajectory after the other.
    pub truth: Table,
}

impl Moving {
    /// Frames of `scene`, whose contacts move along `path`, from a `synthesis` of its world. A scan takes `scan_ms`, in so many
    /// `passes` over the rows, and one starts every `period_ms`.
    ///
    /// # Errors
    /// [`BadValue`] for a period at which a trajectory has too many frames, or not even four.
    pub fn new(
        scene: &Experiment,
        synthesis: &Synthesis<'_>,
        path: Path,
        ([scan_ms, period_ms], passes): ([f64; 2], usize),
    ) -> Result<Self, BadValue> {
        let period_s = period_ms / 1000.0;
        let timetable =
            Timetable::every(period_s, scan_ms / 1000.0, path.duration_s)?.in_passes(passes);
        if path.duration_s < 4.0 * period_s {
            let (value, least) = (format!("{} s", path.duration_s), 4.0 * period_s);
            let rule = format!("frames are {period_s:.4} s apart; give at least {least:.3} s");
            return Err(BadValue::new("motion.duration_s", value, rule));
        }
        // The first estimate is finished within two periods, whether or not scans and decoding overlap.
        let from_s = WARM_UP.0.min(WARM_UP.1 * path.duration_s).max(2.0 * period_s);
        let (first, last) = ((from_s / GRID_S).ceil(), (path.duration_s / GRID_S).floor());
        let moments_s: Vec<f64> =
            (first as usize..=last as usize).map(|moment| moment as f64 * GRID_S).collect();
        let trajectories = path.trajectories;
        let moved = synthesis.clone().along(path, timetable.clone());
        let frames = scene.dataset(&moved, Stream::Test, trajectories * timetable.scans());
        let instants = synthesis.clone().along(path, Timetable::instants(moments_s.clone()));
        let truth = instants.true_outputs(Stream::Test, trajectories * moments_s.len());
        Ok(Self { frames, timetable, moments_s, truth })
    }

    /// What a filter with these `settings` makes of the `estimates` of all frames (`frames × outputs`). It starts anew with
    /// each trajectory.
    pub fn filtered(&self, estimates: &[f64], settings: Settings) -> Vec<f64> {
        let (start_us, outputs) = (self.start_us().collect::<Vec<u64>>(), self.truth.names.len());
        let mut filtered = estimates.to_vec();
        filtered.par_chunks_exact_mut(start_us.len() * outputs).for_each(|trajectory| {
            let mut state = State::new(vec![[0.0; 2]; outputs]);
            filter_frames(&mut state, settings, &start_us, trajectory);
        });
        filtered
    }

    /// Estimates of all frames by a decoder that is told when each reading was taken.
    pub fn decoded(&self, decoder: &dyn Decoder) -> Vec<f64> {
        let (scans, frames) = (self.timetable.scans(), &self.frames);
        let start_us: Vec<u64> = self.start_us().cycle().take(frames.frames()).collect();
        let columns = frames.inputs.names.len() / frames.rows;
        let row_us = |row: usize| 1e6 * self.timetable.row_offset_s(row, frames.rows);
        let reading_offset_us: Vec<f64> =
            (0..frames.rows).flat_map(|row| vec![row_us(row); columns]).collect();
        let timing = Timing { start_us: &start_us, reading_offset_us: &reading_offset_us };
        let readings = Frames { readings: &frames.inputs.values, timing: Some(timing) };
        decoder.decode_frames(readings, scans).values
    }

    /// Start of each scan of a trajectory in µs.
    fn start_us(&self) -> impl Iterator<Item = u64> + Clone {
        self.timetable.starts_s.iter().map(|start_s| (start_s * 1e6).round() as u64)
    }

    /// Newest finished estimates at all moments, of the `estimates` of all frames (`frames × outputs`): an estimate is
    /// finished `finished_ms` after the start of its scan.
    pub fn held(&self, estimates: &[f64], finished_ms: f64) -> Vec<f64> {
        let (outputs, scans) = (self.truth.names.len(), self.timetable.scans());
        let newest = |moment_s: &f64| {
            let is_finished = |start_s: &f64| start_s + finished_ms / 1000.0 <= moment_s + 1e-9;
            self.timetable.starts_s.partition_point(is_finished).saturating_sub(1)
        };
        let newest: Vec<usize> = self.moments_s.iter().map(newest).collect();
        let of_trajectory = |estimates: &[f64]| {
            let of = |scan: &usize| estimates[scan * outputs..][..outputs].to_vec();
            newest.iter().flat_map(of).collect::<Vec<f64>>()
        };
        estimates.chunks_exact(scans * outputs).flat_map(of_trajectory).collect()
    }

    /// Errors of the newest finished estimates at all moments, of the `estimates` of all frames (`frames × outputs`), and their
    /// ratios to the limit of contacts that move, if the `measure` has it.
    pub fn errors(
        &self,
        estimates: &[f64],
        finished_ms: f64,
        measure: &Measure,
    ) -> (Vec<Errors>, Blocks) {
        let held = self.held(estimates, finished_ms);
        let (mut errors, blocks) = metrics::with_blocks(&self.truth, &held, measure);
        let limits = measure.limit.iter().flat_map(Reference::limits);
        for (errors, limit) in errors.iter_mut().zip(limits) {
            let ratio = errors.rmse / limit.limit;
            let of_blocks = blocks.get(&errors.group).into_iter().flatten().copied();
            let share = metrics::standard_error(of_blocks) / errors.rmse;
            let share = share.hypot(limit.limit_standard_error / limit.limit);
            errors.ratio_to_limit = Some(ratio);
            errors.ratio_standard_error = Some(ratio * share);
        }
        (errors, blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(scan_ms: f64, period_ms: f64) -> Moving {
        let mut scene = Experiment::load("moving").unwrap();
        scene.world.path.as_mut().unwrap().trajectories = 3;
        let (path, synthesis) = (scene.world.path.unwrap(), Synthesis::new(&scene.world));
        Moving::new(&scene, &synthesis, path, ([scan_ms, period_ms], 1)).unwrap()
    }

    #[test]
    fn the_newest_finished_estimate_is_held_until_the_next_one() {
        let moving = moving(3.0, 5.0);
        assert_eq!((moving.timetable.scans(), moving.frames.frames()), (120, 360));
        let (first, moments) = (moving.moments_s[0], moving.moments_s.len());
        assert!((0.15..0.151).contains(&first) && moments == 486, "{first} {moments}");
        // Each estimate is the number of its frame.
        let numbers: Vec<f64> = (0..360).flat_map(|frame| [f64::from(frame); 48]).collect();
        let held: Vec<f64> = moving.held(&numbers, 4.0).iter().copied().step_by(48).collect();
        // Frame 29 starts at 145 ms and is finished at 149, frame 30 at 154, frame 31 at 159.
        let due = |at_s: f64| ((at_s * 1000.0 - 4.0) / 5.0).floor();
        let due: Vec<f64> = moving.moments_s.iter().map(|at_s| due(*at_s)).collect();
        assert_eq!((due[0], due[5], held[..486] == due), (29.0, 30.0, true));
        assert_eq!((held[485], held[486]), (119.0, 120.0 + 29.0));
        assert_eq!(age_ms(3.0, 4.0, 5.0), 5.0);
    }

    #[test]
    fn an_estimate_that_is_exact_when_read_has_an_error_when_used() {
        let measure = Experiment::load("moving").unwrap().measure();
        let rmse = |scan_ms, period_ms, finished_ms| {
            let moving = moving(scan_ms, period_ms);
            moving.errors(&moving.frames.outputs.values, finished_ms, &measure).0[0].rmse
        };
        let (soon, late) = (rmse(0.01, 1.0, 0.01), rmse(0.01, 1.0, 4.01));
        let slow = rmse(6.0, 6.0, 6.0);
        // At a moment the newest estimates are 0 to 1 ms and 4 to 5 ms old: 0.587 and 4.52 ms as root mean squares. Those of
        // rows read over 6 ms are 0 to 12 ms old.
        assert!((0.000_7..0.002).contains(&soon), "{soon} mm");
        assert!((late / soon - 7.7).abs() < 0.25 && slow > 1.1 * late, "{soon} {late} {slow}");
    }
}
