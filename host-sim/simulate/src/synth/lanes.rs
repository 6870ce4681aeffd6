//! Synthesis of some trajectories, one a lane: drawn, computed, disturbed, and laid out frame after
//! frame.

use taxel_data::random::RandomLanes;
use taxel_data::{LANES, Lanes, Purpose, Stream, widest};

use super::Synthesis;
use crate::contact::Contact;
use crate::motion::{Draws, Trajectories};
use crate::outputs::{ContactOutput, ElectrodeOutputs, Outputs, Quantity};
use crate::path::Path;
use crate::rubber::Response;
use crate::sensor::{LaneModel, Precision, Scratch};

/// Settings that all lanes of a synthesis share.
pub(super) struct LaneSynthesis<'s> {
    synthesis: &'s Synthesis<'s>,
    stream: Stream,
    model: LaneModel<'s>,
    /// What the level of noise is a multiple of in every channel that is read, in Ω; empty for relative noise.
    noise_unit_ohm: Vec<f64>,
    /// Index of each output of a row among electrodes and axes, and factor on its deformation.
    outputs: Vec<(usize, f64)>,
    /// Whether outputs of electrodes are of what pushes them, and not of where they are.
    of_load: bool,
    /// Quantities of the contact, if they are the outputs.
    of_contact: &'s [ContactOutput],
}

/// Working memory that the trajectories of one thread use in turn.
pub(super) struct Workspace {
    /// Deformation in mm, by electrode of a row and axis.
    deformation_mm: Vec<[Lanes; 3]>,
    /// Resistance in Ω, by column-wire.
    resistance_ohm: Vec<Lanes>,
    /// Factor on all readings of each trajectory, if the gain drifts.
    gain: Option<Lanes>,
    /// Noise with a memory on every reading of a scan, of variance 1; empty if there is none.
    correlated: Vec<Lanes>,
    scratch: Scratch,
}

/// Rubber under one row-wire that remembers. It is told of the load in steps of its own, so that what it reaches does not
/// depend on when it is looked at.
struct Memory {
    response: Box<dyn Response>,
    step_s: f64,
    /// Number of times at which it was told of the load; the first is 0.
    told: usize,
}

impl Memory {
    /// Goes on to the last of its steps up to `time_s`; `load` writes the deformation that is wanted at a time.
    fn go_on(
        &mut self,
        time_s: f64,
        deformation_mm: &mut [[Lanes; 3]],
        mut load: impl FnMut(f64, &mut [[Lanes; 3]]),
    ) {
        while self.told as f64 * self.step_s <= time_s {
            load(self.told as f64 * self.step_s, deformation_mm);
            let step_s = if self.told == 0 { 0.0 } else { self.step_s };
            self.response.advance(step_s, deformation_mm);
            self.told += 1;
        }
    }

    /// Replaces the deformation that is wanted at `time_s`, after the last step, by the one that is reached.
    fn reach(&self, time_s: f64, deformation_mm: &mut [[Lanes; 3]]) {
        let last_s = (self.told - 1) as f64 * self.step_s;
        self.response.reach(time_s - last_s, deformation_mm);
    }
}

impl<'s> LaneSynthesis<'s> {
    /// Synthesis of frames of `stream`, with noise in units of `noise_unit_ohm` where that is not empty.
    pub(super) fn new(
        synthesis: &'s Synthesis<'s>,
        stream: Stream,
        noise_unit_ohm: Vec<f64>,
    ) -> Self {
        let sensor = &synthesis.world.sensor;
        let (mut outputs, mut of_contact) = (Vec::new(), &[][..]);
        let mut of_load = false;
        match &*synthesis.outputs {
            Outputs::Electrodes(wanted @ ElectrodeOutputs { quantity, .. }) => {
                of_load = *quantity == Quantity::Force;
                for electrode in 0..sensor.electrodes_per_row_wire {
                    let axes = wanted.axes.iter();
                    outputs.extend(
                        axes.map(|axis| {
                            (3 * electrode + axis.index(), wanted.per_mm(sensor, *axis))
                        }),
                    );
                }
            }
            Outputs::Contact(wanted) => of_contact = wanted.as_slice(),
        }
        let model = LaneModel::new(sensor);
        Self { synthesis, stream, model, noise_unit_ohm, outputs, of_load, of_contact }
    }

    /// Working memory for one thread.
    pub(super) fn workspace(&self) -> Workspace {
        let sensor = &self.synthesis.world.sensor;
        Workspace {
            deformation_mm: vec![[[0.0; LANES]; 3]; sensor.electrodes_per_row_wire],
            resistance_ohm: vec![[0.0; LANES]; sensor.column_wires],
            gain: None,
            correlated: match self.synthesis.noise.correlated_level {
                0.0 => Vec::new(),
                _ => vec![[0.0; LANES]; self.synthesis.read_rows.len() * sensor.column_wires],
            },
            scratch: Scratch::default(),
        }
    }

    /// Fills `readings` and `outputs` with the frames of the trajectories from number `first` on. There
    /// are at most [`LANES`] trajectories, the last of which may be cut short. Without room for readings, these are not
    /// computed.
    pub(super) fn fill(
        &self,
        workspace: &mut Workspace,
        first: usize,
        readings: &mut [f64],
        outputs: &mut [f64],
    ) {
        let Synthesis { world, motion, path, timetable, read_rows, .. } = self.synthesis;
        let mut draws = Draws::new(world.seed, self.stream, first);
        workspace.gain = self.synthesis.drift.map(|drift| drift.factors(&mut draws));
        let mut trajectories = motion.start(&world.sensor, &mut draws);
        let deepest_mm = motion.deepest_mm();
        let paths = path.map(|path| path.place(&world.sensor, deepest_mm, &Path::draw(&mut draws)));
        let electrodes = world.sensor.electrodes_per_row_wire;
        let move_to = |trajectories: &mut dyn Trajectories, time_s: f64| {
            if let Some(paths) = &paths {
                let (centre_mm, depth_mm) = paths.at(time_s);
                trajectories.move_to(centre_mm, depth_mm);
            }
        };
        let memory = || {
            let (response, step_s) =
                (world.rubber.at_rest(electrodes)?, path.as_ref()?.fine_step_s());
            Some(Memory { response, step_s, told: 0 })
        };
        let mut memories: Vec<Option<Memory>> = read_rows.iter().map(|_| memory()).collect();
        for (step, start_s) in timetable.starts_s.iter().enumerate() {
            for (place, &row) in read_rows.iter().enumerate() {
                let deformation_mm = &mut workspace.deformation_mm;
                let time_s = start_s + timetable.row_offset_s(place, read_rows.len());
                let mut load = |time_s: f64, deformation_mm: &mut [[Lanes; 3]]| {
                    move_to(&mut *trajectories, time_s);
                    trajectories.deform(row, &mut draws, deformation_mm);
                };
                match &mut memories[place] {
                    None => load(time_s, deformation_mm),
                    Some(memory) => {
                        memory.go_on(time_s, deformation_mm, &mut load);
                        load(time_s, deformation_mm);
                        if self.of_load {
                            self.write_row(deformation_mm, step, place, outputs);
                        }
                        memory.reach(time_s, deformation_mm);
                    }
                }
                widest!({
                    if !readings.is_empty() {
                        self.read_row(workspace, (first, step), (place, row), readings);
                    }
                    if !self.of_load || memories[place].is_none() {
                        self.write_row(&workspace.deformation_mm, step, place, outputs);
                    }
                });
            }
            if !self.of_contact.is_empty() {
                move_to(&mut *trajectories, start_s + 0.5 * timetable.scan_s);
                self.write_contact(trajectories.contact(), step, outputs);
            }
        }
    }

    /// Computes, disturbs and lays out the readings of one row at one step.
    #[inline(always)]
    fn read_row(
        &self,
        workspace: &mut Workspace,
        (first, step): (usize, usize),
        (place, row): (usize, usize),
        readings: &mut [f64],
    ) {
        let Synthesis { world, read_rows, .. } = self.synthesis;
        let (steps, rows) = (self.synthesis.steps(), read_rows.len());
        let columns = world.sensor.column_wires;
        let Workspace { deformation_mm, resistance_ohm, gain, correlated, scratch } = workspace;
        self.model.row_column_resistance_ohm(
            row,
            Precision::F64,
            deformation_mm,
            scratch,
            resistance_ohm,
        );
        let ideal_ohm = if correlated.is_empty() { Vec::new() } else { resistance_ohm.clone() };
        self.disturb((place, row), (first, step), resistance_ohm);
        if let Some(states) = correlated.get_mut(place * columns..(place + 1) * columns) {
            self.add_correlated((place, row), (first, step), (states, &ideal_ohm), resistance_ohm);
        }
        if let Some(gain) = gain {
            for readings in resistance_ohm.iter_mut() {
                readings.iter_mut().zip(&*gain).for_each(|(reading, gain)| *reading *= gain);
            }
        }
        let lines = readings.chunks_exact_mut(columns);
        let line_of_lanes = lines.skip(step * rows + place).step_by(steps * rows);
        for (lane, readings) in line_of_lanes.enumerate() {
            for (place, lanes) in readings.iter_mut().zip(&*resistance_ohm) {
                *place = lanes[lane];
            }
        }
    }

    /// Lays out the outputs of one row at one step, if they are wanted.
    #[inline(always)]
    fn write_row(
        &self,
        deformation_mm: &[[Lanes; 3]],
        step: usize,
        place: usize,
        outputs: &mut [f64],
    ) {
        if self.outputs.is_empty() {
            return;
        }
        let (steps, rows) = (self.synthesis.steps(), self.synthesis.read_rows.len());
        let (width, of_electrodes) = (self.outputs.len(), deformation_mm.as_flattened());
        let lines = outputs.chunks_exact_mut(width);
        let line_of_lanes = lines.skip(step * rows + place).step_by(steps * rows);
        for (lane, outputs) in line_of_lanes.enumerate() {
            for (output, (place, factor)) in outputs.iter_mut().zip(&self.outputs) {
                *output = factor * of_electrodes[*place][lane];
            }
        }
    }

    /// Lays out the quantities of the contact at one step.
    fn write_contact(&self, contact: Option<&Contact>, step: usize, outputs: &mut [f64]) {
        let sensor = &self.synthesis.world.sensor;
        let columns: Vec<Lanes> =
            self.of_contact.iter().flat_map(|quantity| quantity.of(contact, sensor)).collect();
        let lines = outputs.chunks_exact_mut(columns.len());
        let line_of_lanes = lines.skip(step).step_by(self.synthesis.steps());
        for (lane, outputs) in line_of_lanes.enumerate() {
            for (output, lanes) in outputs.iter_mut().zip(&columns) {
                *output = lanes[lane];
            }
        }
    }

    /// Adds white noise to the readings of one row at one step.
    #[inline(always)]
    fn disturb(
        &self,
        (place, row): (usize, usize),
        (first, step): (usize, usize),
        resistance_ohm: &mut [Lanes],
    ) {
        let Synthesis { world, noise, noise_purpose, .. } = self.synthesis;
        let (level, columns) = (noise.level, world.sensor.column_wires);
        if level == 0.0 {
            return;
        }
        // Noise is drawn by frame, whichever trajectory the frame belongs to.
        let steps = self.synthesis.steps();
        let mut random = RandomLanes::every(first * steps + step, steps);
        random.start(world.seed, self.stream, *noise_purpose, row as u64);
        let mut normals = [[0.0; LANES]; 2];
        for (pair, readings) in resistance_ohm.chunks_mut(2).enumerate() {
            let [even, odd] = &mut normals;
            random.normal_pair(even, odd);
            for (side, (readings, normals)) in readings.iter_mut().zip(&normals).enumerate() {
                let unit = self.noise_unit_ohm.get(place * columns + 2 * pair + side);
                for (reading, normal) in readings.iter_mut().zip(normals) {
                    *reading += level * unit.unwrap_or(reading) * normal;
                }
            }
        }
    }

    /// Adds noise with a memory to the readings of one row at one step. Its `states` start stationary, and run from scan to
    /// scan with the correlation that the time between them leaves.
    fn add_correlated(
        &self,
        (place, row): (usize, usize),
        (first, step): (usize, usize),
        (states, ideal_ohm): (&mut [Lanes], &[Lanes]),
        resistance_ohm: &mut [Lanes],
    ) {
        let Synthesis { world, noise, noise_purpose, timetable, .. } = self.synthesis;
        let purpose = match noise_purpose {
            Purpose::Baseline => Purpose::CorrelatedBaseline,
            _ => Purpose::CorrelatedNoise,
        };
        let decay = if step == 0 { 0.0 } else { noise.correlation(timetable.since_last_s(step)) };
        let (level, fresh) = (noise.correlated_level, (1.0 - decay * decay).sqrt());
        let steps = self.synthesis.steps();
        let mut random = RandomLanes::every(first * steps + step, steps);
        random.start(world.seed, self.stream, purpose, row as u64);
        let mut normals = [[0.0; LANES]; 2];
        for (column, (state, readings)) in states.iter_mut().zip(resistance_ohm).enumerate() {
            if column % 2 == 0 {
                let [even, odd] = &mut normals;
                random.normal_pair(even, odd);
            }
            let unit = self.noise_unit_ohm.get(place * world.sensor.column_wires + column);
            for (lane, reading) in readings.iter_mut().enumerate() {
                state[lane] = decay * state[lane] + fresh * normals[column % 2][lane];
                *reading += level * unit.unwrap_or(&ideal_ohm[column][lane]) * state[lane];
            }
        }
    }
}
