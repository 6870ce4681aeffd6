//! Likelihood of a frame: what the sensor model and the noise say about readings.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use taxel_data::{LANES, Lanes, ln, widest};
use taxel_simulate::World;
use taxel_simulate::motion::Motion;
use taxel_simulate::outputs::Outputs;
use taxel_simulate::sensor::{LaneModel, Precision, Scratch};

use crate::target::Target;

/// Rows whose latents are sampled together, with the noise on their readings.
pub struct Rows<'w> {
    /// World of the frames.
    pub world: &'w World,
    /// How its electrodes move.
    pub motion: &'w dyn Motion,
    /// Forward model of its sensor.
    pub model: LaneModel<'w>,
    /// Row-wires, from 0.
    pub wires: &'w [usize],
    /// Standard deviation of each reading in Ω; empty for noise relative to the reading.
    pub deviation_ohm: &'w [f64],
}

/// Working memory of one thread.
pub struct Memory {
    deformation_mm: Vec<[Lanes; 3]>,
    resistance_ohm: Vec<Lanes>,
    scratch: Scratch,
}

impl Rows<'_> {
    /// Working memory for one thread.
    pub fn memory(&self) -> Memory {
        let sensor = &self.world.sensor;
        Memory {
            deformation_mm: vec![[[0.0; LANES]; 3]; sensor.electrodes_per_row_wire],
            resistance_ohm: vec![[0.0; LANES]; self.readings()],
            scratch: Scratch::default(),
        }
    }

    /// Number of latents.
    pub fn latents(&self) -> usize {
        self.motion.latents(self.wires.len() * self.world.sensor.electrodes_per_row_wire)
    }

    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.wires.len() * self.world.sensor.column_wires
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        let world = self.world;
        world.outputs.count(&world.sensor, self.wires.len())
    }

    /// Ideal readings in Ω at the `latents` of each lane, within 1e-6.
    pub fn ideal_ohm<'m>(&self, latents: &[Lanes], memory: &'m mut Memory) -> &'m [Lanes] {
        let Memory { deformation_mm, resistance_ohm, scratch } = memory;
        let of_rows = resistance_ohm.chunks_exact_mut(self.world.sensor.column_wires);
        for (&row, resistance_ohm) in self.wires.iter().zip(of_rows) {
            self.motion.place(&self.world.sensor, row, latents, deformation_mm);
            widest!({
                self.model.row_column_resistance_ohm(
                    row,
                    Precision::F32,
                    deformation_mm,
                    scratch,
                    resistance_ohm,
                );
            });
        }
        resistance_ohm
    }

    /// Natural logarithm of the likelihood of `readings_ohm`, but for a constant, where ideal readings are
    /// `ideal_ohm`.
    pub fn log_likelihood(&self, readings_ohm: &[f64], ideal_ohm: &[Lanes]) -> Lanes {
        widest!({
            if self.deviation_ohm.is_empty() {
                of_relative_noise(self.world.noise.total_level(), readings_ohm, ideal_ohm)
            } else {
                of_absolute_noise(self.deviation_ohm, readings_ohm, ideal_ohm)
            }
        })
    }
}

/// Likelihood of readings whose standard deviation is `level` times the ideal reading.
#[inline(always)]
fn of_relative_noise(level: f64, readings_ohm: &[f64], ideal_ohm: &[Lanes]) -> Lanes {
    let precision = 1.0 / level;
    let mut log = [0.0; LANES];
    // A product of eight ratios is far from the largest number, and saves seven logarithms.
    for (readings_ohm, ideal_ohm) in readings_ohm.chunks(8).zip(ideal_ohm.chunks(8)) {
        let mut product = [1.0; LANES];
        for (reading, ideal) in readings_ohm.iter().zip(ideal_ohm) {
            for lane in 0..LANES {
                let ratio = reading / ideal[lane];
                let off = (ratio - 1.0) * precision;
                log[lane] -= 0.5 * off * off;
                product[lane] *= ratio.abs();
            }
        }
        for lane in 0..LANES {
            // The density's factor 1/(p·R); the constant reading/p is left out.
            log[lane] += ln(product[lane].max(f64::MIN_POSITIVE));
        }
    }
    log
}

/// Likelihood of readings with these standard deviations.
#[inline(always)]
fn of_absolute_noise(deviation_ohm: &[f64], readings_ohm: &[f64], ideal_ohm: &[Lanes]) -> Lanes {
    let mut log = [0.0; LANES];
    for ((reading, ideal), deviation) in readings_ohm.iter().zip(ideal_ohm).zip(deviation_ohm) {
        let precision = 1.0 / deviation;
        for lane in 0..LANES {
            let off = (reading - ideal[lane]) * precision;
            log[lane] -= 0.5 * off * off;
        }
    }
    log
}

/// Posterior of the rows in one frame.
pub struct Frame<'f> {
    /// Rows that are sampled together.
    pub rows: &'f Rows<'f>,
    /// Their readings in Ω.
    pub readings_ohm: &'f [f64],
}

impl Target for Frame<'_> {
    type Memory = Memory;

    fn latents(&self) -> usize {
        self.rows.latents()
    }

    fn output_count(&self) -> usize {
        self.rows.outputs()
    }

    fn log_likelihood(&self, latents: &[Lanes], memory: &mut Memory) -> Lanes {
        self.rows.log_likelihood(self.readings_ohm, self.rows.ideal_ohm(latents, memory))
    }

    fn readings(&self) -> usize {
        self.rows.readings()
    }

    fn residuals(&self, latents: &[Lanes], memory: &mut Memory, residuals: &mut [Lanes]) -> Lanes {
        let (rows, readings_ohm) = (self.rows, self.readings_ohm);
        let ideal_ohm = rows.ideal_ohm(latents, memory);
        let level = rows.world.noise.total_level();
        for (k, (residual, ideal_ohm)) in residuals.iter_mut().zip(ideal_ohm).enumerate() {
            let reading = readings_ohm[k];
            match rows.deviation_ohm.get(k) {
                Some(deviation) => *residual = ideal_ohm.map(|ideal| (reading - ideal) / deviation),
                None => *residual = ideal_ohm.map(|ideal| (reading / ideal - 1.0) / level),
            }
        }
        rows.log_likelihood(readings_ohm, ideal_ohm)
    }

    fn outputs(&self, latents: &[Lanes], memory: &mut Memory, outputs: &mut [Lanes]) {
        let Rows { world, motion, wires, .. } = self.rows;
        let sensor = &world.sensor;
        let wanted = match &world.outputs {
            Outputs::Electrodes(wanted) => wanted,
            Outputs::Contact(wanted) => {
                let contact = motion.place_contact(sensor, latents);
                let columns = wanted.iter().flat_map(|it| it.of(contact.as_ref(), sensor));
                outputs.iter_mut().zip(columns).for_each(|(output, lanes)| *output = lanes);
                return;
            }
        };
        let factors = wanted.axes.iter().map(|axis| (axis.index(), wanted.per_mm(sensor, *axis)));
        let factors: Vec<(usize, f64)> = factors.collect();
        let of_rows = outputs.chunks_exact_mut(sensor.electrodes_per_row_wire * factors.len());
        for (&row, outputs) in wires.iter().zip(of_rows) {
            motion.place(sensor, row, latents, &mut memory.deformation_mm);
            let electrodes = outputs.chunks_exact_mut(factors.len());
            for (delta, outputs) in memory.deformation_mm.iter().zip(electrodes) {
                for ((axis, factor), output) in factors.iter().zip(outputs) {
                    *output = delta[*axis].map(|mm| factor * mm);
                }
            }
        }
    }
}
