//! Decoder by the sensor's equations alone, without training: row by row, the deformations that they give for readings.
//!
//! [`Equations::exact`] solves 1/R = Σ 1/r for the 3N unknowns of a row, from rest. It knows nothing of noise, so it
//! shows what noise makes of the equations; and nothing of the scene, so it cannot tell apart deformations that read
//! alike. [`Equations::damped`] knows the noise, and mean and covariance of the scene's deformations: it stops on the way
//! from the mean to an exact solution where the readings are met within their noise.

use nalgebra::DMatrix;
use rayon::prelude::*;
use taxel_learn::{Estimates, FrameDecoder, Frames};
use taxel_simulate::sensor::Vector3;
use taxel_simulate::{Synthesis, World};

use taxel_limit::identify::Prior;
use taxel_limit::solve::{Solution, Unknowns, solve};

/// Name of the decoder that solves the equations exactly.
pub const EXACT: &str = "equations";
/// Name of the decoder that is damped by noise and scene.
pub const DAMPED: &str = "damped";
/// Largest residual of ln R at a solution: rounding is a thousandth of it.
pub const EXACT_RESIDUAL: f64 = 1e-12;

/// Model of readings: those of a row for its deformation.
pub trait RowModel: Sync {
    /// Writes the logarithms of the readings in Ω of the row that is read as number `place` (from 0), and their
    /// derivatives by each entry of `deformation_mm` in 1/mm, one line a reading. NaN where there is no logarithm.
    fn log_readings(
        &self,
        place: usize,
        deformation_mm: &[f64],
        logs: &mut [f64],
        slopes: &mut DMatrix<f64>,
    );
}

/// The sensor's own equations.
impl RowModel for World {
    fn log_readings(
        &self,
        place: usize,
        deformation_mm: &[f64],
        logs: &mut [f64],
        slopes: &mut DMatrix<f64>,
    ) {
        let (moved, _): (&[Vector3], _) = deformation_mm.as_chunks();
        self.sensor.row_column_resistance_ohm(self.read_rows[place], moved, logs);
        logs.iter_mut().for_each(|reading| *reading = reading.ln());
        let derivatives = self.sensor.log_resistance_derivatives(self.read_rows[place], moved);
        for (k, line) in derivatives.iter().enumerate() {
            line.iter().enumerate().for_each(|(i, slope)| slopes[(k, i)] = *slope);
        }
    }
}

/// Decoder that solves equations for the deformation of every row that a world reads: the sensor's, or those of another
/// [`RowModel`].
///
/// Its outputs are all deformations, in the order of [`deformation_names`](taxel_simulate::sensor::Sensor::deformation_names).
#[derive(Clone)]
pub struct Equations<'w> {
    name: &'static str,
    world: &'w World,
    model: &'w dyn RowModel,
    damping: Option<Damping>,
}

/// What damps the solution.
#[derive(Debug, Clone)]
struct Damping {
    noise_level: f64,
    /// Span in Ω of every reading that noise is relative to; empty if it is relative to the reading.
    spans_ohm: Vec<f64>,
    /// Mean of each row's deformation in mm, and a factor of its covariance.
    rows: Vec<(Vec<f64>, DMatrix<f64>)>,
}

impl<'w> Equations<'w> {
    /// Decoder that solves the equations exactly.
    pub fn exact(world: &'w World) -> Self {
        Self { name: EXACT, world, model: world, damping: None }
    }

    /// Decoder that minimises the squared residuals over their noise and the squared distance from the mean over the
    /// covariance of the scene's deformations: the most probable deformation, were the scene's normal.
    ///
    /// `noise_level` is the relative deviation of readings from the equations; with noise relative to the span, in spans.
    pub fn damped(world: &'w World, noise_level: f64) -> Self {
        let (prior, of_row) = (Prior::new(world), 3 * world.sensor.electrodes_per_row_wire);
        let rows = (0..world.read_rows.len()).map(|place| prior.of_row(place, of_row));
        let damping = Damping {
            noise_level,
            spans_ohm: Synthesis::new(world).noise_span_ohm(),
            rows: rows.collect(),
        };
        Self { name: DAMPED, world, model: world, damping: Some(damping) }
    }

    /// Replaces the sensor's equations by those of `model`; the decoder is called `name`.
    pub fn of_model(self, name: &'static str, model: &'w dyn RowModel) -> Self {
        Self { name, model, ..self }
    }

    /// Solves the equations of the row that is read as number `place` (from 0), for its readings in Ω. An exact search
    /// begins at `start` (mm, one entry an electrode and axis), a damped one at the scene's mean.
    ///
    /// # Panics
    /// If the world reads no such row, or the row has other numbers of readings and unknowns.
    pub fn solve_row(&self, place: usize, readings_ohm: &[f64], start: &[f64]) -> Solution {
        let columns = self.world.sensor.column_wires;
        assert_eq!(readings_ohm.len(), columns, "one reading a column-wire");
        let logs: Vec<f64> = readings_ohm.iter().map(|reading| reading.ln()).collect();
        let largest = self.world.sensor.largest_deformation_mm();
        let Some(damping) = &self.damping else {
            // A uniform deformation in the box has this deviation.
            let unknowns = Unknowns { start, deviation: largest / 3.0_f64.sqrt(), largest };
            return solve(&unknowns, columns, (0.0, EXACT_RESIDUAL), |at, residuals, slopes| {
                self.evaluate(place, at, &logs, residuals, slopes);
            });
        };
        let (mean, factor) = &damping.rows[place];
        let weights: Vec<f64> = match damping.spans_ohm.get(place * columns..(place + 1) * columns)
        {
            Some(spans_ohm) => readings_ohm.iter().zip(spans_ohm).map(|(r, s)| r / s).collect(),
            None => vec![1.0; columns],
        };
        let deformation_mm = |at: &[f64]| -> Vec<f64> {
            let moved = factor * nalgebra::DVector::from_row_slice(at);
            mean.iter().zip(&moved).map(|(mean, moved)| mean + moved).collect()
        };
        let (start, mut of_mm) = (vec![0.0; mean.len()], DMatrix::zeros(columns, mean.len()));
        let unknowns = Unknowns { start: &start, deviation: 1.0, largest: f64::INFINITY };
        let least = damping.noise_level.powi(2);
        let exact = (least, EXACT_RESIDUAL);
        let mut found = solve(&unknowns, columns, exact, |at, residuals, slopes| {
            self.evaluate(place, &deformation_mm(at), &logs, residuals, &mut of_mm);
            for (k, weight) in weights.iter().enumerate() {
                residuals[k] *= weight;
                of_mm.row_mut(k).scale_mut(*weight);
            }
            of_mm.mul_to(factor, slopes);
        });
        found.place = deformation_mm(&found.place);
        found.place.iter_mut().for_each(|mm| *mm = mm.clamp(-largest, largest));
        found
    }

    /// Determinant of ∂ln R/∂Δ of the row that is read as number `place`; `None` unless there are as many readings as
    /// unknowns. Where its sign changes, deformations fold over others that read alike.
    ///
    /// # Panics
    /// If the world reads no such row, or the row has another number of unknowns.
    pub fn determinant(&self, place: usize, deformation_mm: &[f64]) -> Option<f64> {
        let columns = self.world.sensor.column_wires;
        let mut slopes = DMatrix::zeros(columns, deformation_mm.len());
        let is_square = slopes.is_square();
        self.evaluate(
            place,
            deformation_mm,
            &vec![0.0; columns],
            &mut vec![0.0; columns],
            &mut slopes,
        );
        is_square.then(|| slopes.determinant())
    }

    /// Writes the residuals of ln R and their derivatives by Δ in 1/mm.
    fn evaluate(
        &self,
        place: usize,
        deformation_mm: &[f64],
        logs: &[f64],
        residuals: &mut [f64],
        slopes: &mut DMatrix<f64>,
    ) {
        self.model.log_readings(place, deformation_mm, residuals, slopes);
        residuals.iter_mut().zip(logs).for_each(|(predicted, log)| *predicted -= log);
    }

    /// Solves the equations of all rows of all frames, one after the other.
    ///
    /// # Panics
    /// If `readings_ohm` are no whole frames.
    pub fn solve_all(&self, readings_ohm: &[f64]) -> Vec<Solution> {
        let rest = vec![0.0; 3 * self.world.sensor.electrodes_per_row_wire];
        let rows = readings_ohm.par_chunks_exact(self.world.sensor.column_wires).enumerate();
        rows.map(|(n, row)| self.solve_row(n % self.world.read_rows.len(), row, &rest)).collect()
    }
}

impl FrameDecoder for Equations<'_> {
    type State = ();

    fn name(&self) -> &str {
        self.name
    }

    fn inputs(&self) -> usize {
        self.world.read_rows.len() * self.world.sensor.column_wires
    }

    fn decode(&self, (): &mut (), frames: Frames<'_>) -> Estimates {
        let solved = self.solve_all(frames.readings);
        Estimates::of_values(solved.into_iter().flat_map(|solution| solution.place).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_data::random::Stream;
    use taxel_learn::Decoder;

    fn readings(world: &World, place: usize, deformation_mm: &[f64]) -> Vec<f64> {
        let mut readings_ohm = vec![0.0; world.sensor.column_wires];
        let (moved, _) = deformation_mm.as_chunks();
        let row = world.read_rows[place];
        world.sensor.row_column_resistance_ohm(row, moved, &mut readings_ohm);
        readings_ohm
    }

    #[test]
    fn small_deformations_are_solved_to_a_millionth_of_a_millimetre_in_every_row() {
        let world = World::paper();
        let equations = Equations::exact(&world);
        let small: Vec<f64> = (0..18).map(|i| 0.02 * f64::from((7 * i) % 11 - 5)).collect();
        for row in 0..8 {
            let found = equations.solve_row(row, &readings(&world, row, &small), &[0.0; 18]);
            let off =
                found.place.iter().zip(&small).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(found.converged && off < 1e-6, "row {row}: {off} mm, {} steps", found.steps);
        }
    }

    #[test]
    fn noise_ruins_the_exact_solution_and_not_the_damped_one() {
        let world = World { read_rows: vec![3], ..World::press() };
        let frames = Synthesis::new(&world).frames(Stream::Test, 60);
        let rmse = |decoder: &Equations<'_>| {
            let estimates = decoder.decode_all(&frames.inputs.values, 1).values;
            let squares = frames.outputs.squared_errors(&estimates);
            let z: f64 = squares.iter().skip(2).step_by(3).sum();
            (z / (6.0 * 60.0)).sqrt()
        };
        let (exact, damped) =
            (rmse(&Equations::exact(&world)), rmse(&Equations::damped(&world, 0.005)));
        assert!(exact > 0.3 && damped < 0.07, "{exact} {damped}");
    }
}
