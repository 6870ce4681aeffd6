//! Identifiability: which directions of the deformation show in the readings, and which the noise hides.
//!
//! The sensor is linearised at the scene's mean deformation: δy = J·δΔ, where y is ln R for relative noise. With the
//! prior covariance C = L·Lᵀ of the deformation and the noise's standard deviation p of y, the matrix A = J·L/p has the
//! *signal-to-noise ratios* of the sensor as singular values: how far, in standard deviations of the noise, a typical
//! deformation along a direction moves the readings. A direction is *observable* if that is more than 1: then readings
//! tell more about it than the prior does. Were deformations normal and the sensor linear, the posterior covariance
//! would be L·(I + AᵀA)⁻¹·Lᵀ.

use nalgebra::{Cholesky, DMatrix};
use taxel_data::Stream;
use taxel_simulate::outputs::Outputs;
use taxel_simulate::sensor::{Axis, Vector3};
use taxel_simulate::{Synthesis, World};

use crate::error::Refusal;

/// Frames from which the prior's mean and covariance are computed.
const PRIOR_FRAMES: usize = 20_000;
/// Axes, in their order.
const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

/// Directions that some readings show.
#[derive(Debug, Clone, PartialEq)]
pub struct Observability {
    /// Row-wires (from 1) that are read.
    pub row_wires: Vec<usize>,
    /// Number of readings.
    pub readings: usize,
    /// Number of unknowns: three an electrode.
    pub unknowns: usize,
    /// Singular values of ∂ln R/∂Δ in 1/mm, descending.
    pub singular_values_per_mm: Vec<f64>,
    /// Signal-to-noise ratios, descending: singular values of A = J·L/p.
    pub signal_to_noise: Vec<f64>,
    /// Number of observable directions: those with a signal-to-noise ratio above 1.
    pub observable: usize,
    /// What is known by axis.
    pub axes: Vec<AxisKnowledge>,
    /// What is known of each electrode, row-wire after row-wire.
    pub electrodes: Vec<ElectrodeKnowledge>,
}

/// What readings tell about the deformation along one axis, if all were linear and normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisKnowledge {
    /// Axis.
    pub axis: Axis,
    /// RMSE of predicting the prior's mean, in mm.
    pub prior_rmse_mm: f64,
    /// RMSE of the posterior mean, in mm.
    pub rmse_mm: f64,
    /// Share of the prior's variance that the readings take away: 0 is invisible, 1 is known.
    pub known: f64,
}

/// What readings tell about one electrode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectrodeKnowledge {
    /// Position x and y at rest, in mm.
    pub position_mm: [f64; 2],
    /// Share of the prior's variance that the readings take away, along x, y and z.
    pub known: [f64; 3],
}

/// Mean and covariance of a world's deformations, for all rows that it reads.
#[derive(Debug, Clone)]
pub struct Prior {
    mean_mm: Vec<f64>,
    covariance_mm2: DMatrix<f64>,
}

impl Prior {
    /// Moments of the deformations that `world` draws.
    pub fn new(world: &World) -> Self {
        let synthesis = Synthesis::new(world).ideal().drift(None);
        let frames = synthesis.outputs(Outputs::all_deformations());
        let deformation_mm = frames.frames(Stream::Span, PRIOR_FRAMES).outputs;
        let (mean_mm, n) = (deformation_mm.means(), deformation_mm.names.len());
        let centred = DMatrix::from_fn(n, PRIOR_FRAMES, |i, frame| {
            deformation_mm.values[frame * n + i] - mean_mm[i]
        });
        let mut covariance_mm2 = &centred * centred.transpose() / PRIOR_FRAMES as f64;
        if world.motion.has_independent_rows() {
            // Independent unknowns: what the sample says beside the diagonal is chance.
            covariance_mm2 = DMatrix::from_diagonal(&covariance_mm2.diagonal());
        }
        Self { mean_mm, covariance_mm2 }
    }
}

/// Directions of the deformation that the readings of `row_wires` (from 0) show.
///
/// # Errors
/// [`Refusal`] for a world without noise.
///
/// # Panics
/// If the world does not read one of the rows.
pub fn observability(
    world: &World,
    prior: &Prior,
    row_wires: &[usize],
) -> Result<Observability, Refusal> {
    if world.noise.is_none() {
        return Err(Refusal::NoNoise);
    }
    let sensor = &world.sensor;
    let (columns, of_row) = (sensor.column_wires, 3 * sensor.electrodes_per_row_wire);
    let places: Vec<usize> = row_wires
        .iter()
        .map(|row| world.read_rows.iter().position(|read| read == row).expect("a row that is read"))
        .collect();
    let n = places.len() * of_row;
    let units_ohm = Synthesis::new(world).noise_unit_ohm();
    let mut slopes = DMatrix::zeros(places.len() * columns, n);
    let mut precisions = Vec::with_capacity(places.len() * columns);
    for (block, (&row, place)) in row_wires.iter().zip(&places).enumerate() {
        let mean: Vec<Vector3> = prior.mean_mm[place * of_row..(place + 1) * of_row]
            .chunks_exact(3)
            .map(|delta| [delta[0], delta[1], delta[2]])
            .collect();
        for (k, reading) in sensor.linearise(row, &mean).iter().enumerate() {
            for (i, slope) in reading.log_slopes_per_mm.iter().enumerate() {
                slopes[(block * columns + k, block * of_row + i)] = *slope;
            }
            // Standard deviation of ln R.
            let unit_ohm = units_ohm.get(place * columns + k);
            let unit = unit_ohm.map_or(1.0, |unit_ohm| unit_ohm / reading.resistance_ohm);
            let deviation = world.noise.total_level() * unit;
            precisions.push(1.0 / deviation);
        }
    }
    let chosen: Vec<usize> =
        places.iter().flat_map(|place| place * of_row..(place + 1) * of_row).collect();
    let covariance = DMatrix::from_fn(n, n, |i, j| prior.covariance_mm2[(chosen[i], chosen[j])]);
    let factor = factor(&covariance);
    let mut weighted = &slopes * &factor;
    for (mut line, precision) in weighted.row_iter_mut().zip(&precisions) {
        line *= *precision;
    }
    let information = DMatrix::identity(n, n) + weighted.transpose() * &weighted;
    let inverse = Cholesky::new(information).map_or_else(|| DMatrix::zeros(n, n), |c| c.inverse());
    let posterior = (&factor * inverse * factor.transpose()).diagonal();
    let prior_variance = covariance.diagonal();
    let known = |of: &dyn Fn(usize) -> bool| {
        let members = || (0..n).filter(|i| of(*i));
        let [before, after] = [&prior_variance, &posterior]
            .map(|v| members().map(|i| v[i]).sum::<f64>() / members().count() as f64);
        (before, after, if before > 0.0 { (1.0 - after / before).max(0.0) } else { 0.0 })
    };
    let axes = AXES.map(|axis| {
        let (before, after, known) = known(&|i| i % 3 == axis.index());
        AxisKnowledge { axis, prior_rmse_mm: before.sqrt(), rmse_mm: after.max(0.0).sqrt(), known }
    });
    let positions = row_wires.iter().flat_map(|row| sensor.row_electrodes_mm(*row));
    let electrodes = positions.enumerate().map(|(electrode, at)| ElectrodeKnowledge {
        position_mm: [at[0], at[1]],
        known: [0, 1, 2].map(|axis| known(&|i| i == 3 * electrode + axis).2),
    });
    let signal_to_noise = descending(&weighted);
    Ok(Observability {
        row_wires: row_wires.iter().map(|row| row + 1).collect(),
        readings: slopes.nrows(),
        unknowns: n,
        observable: signal_to_noise.iter().filter(|ratio| **ratio > 1.0).count(),
        singular_values_per_mm: descending(&slopes),
        signal_to_noise,
        axes: axes.to_vec(),
        electrodes: electrodes.collect(),
    })
}

fn descending(matrix: &DMatrix<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = matrix.singular_values().iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

/// Matrix L with L·Lᵀ = `covariance`, from its eigenvectors: some may have no variance.
fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = covariance.clone().symmetric_eigen();
    let mut factor = eigen.eigenvectors;
    for (mut column, value) in factor.column_iter_mut().zip(eigen.eigenvalues.iter()) {
        column *= value.max(0.0).sqrt();
    }
    factor
}
