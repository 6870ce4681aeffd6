//! Rigorous bound on the effect of quantisation on an estimate: the difference between estimates from
//! scanned and from ideal readings, for samples off by half a count. `docs/readout.md` derives it.
//!
//! It holds for readings without noise, cross-talk and series resistance, and for the exponentials that
//! are within 2 ulp (the polynomial and libm's).

use firmware::circuit::{Divider, NO_CURRENT_COUNTS, ZeroPotential};
use model_core::blob::Model;
use model_core::rbf::{Network, Shape, direct};
use model_core::scale::scale;
use taxel_data::table::Table;
use taxel_simulate::readout::Circuit;

/// Counts of the converter at its reference voltage.
const COUNTS: f64 = 4096.0;
/// Unit roundoff of f32.
const UNIT: f64 = 0.5 * f32::EPSILON as f64;

/// Bound γ_n on the relative error of a product of `n` operations rounded to f32.
fn gamma(n: usize) -> f64 {
    let n = n as f64 * UNIT;
    n / (1.0 - n)
}

/// Largest |scanned − `ohm`| in Ω for a converter of `bits` behind `circuit` (its typical parts);
/// infinite where the converter's range ends.
pub fn reading_bound_ohm(circuit: Circuit, ohm: f64, bits: u8) -> f64 {
    // Each sample is off by half a step.
    let half = 0.5 * f64::from(1_u32 << (12 - bits));
    let (counts, largest_counts, bound_ohm) = match circuit {
        Circuit::Divider => {
            let reference_ohm = f64::from(Divider::<1, 1>::TYPICAL.reference_ohm[0]);
            let counts = COUNTS * reference_ohm / (reference_ohm + ohm);
            (counts, counts, (reference_ohm + ohm) * half / (counts - half))
        }
        Circuit::ZeroPotential => {
            let typical = ZeroPotential::<1, 1>::TYPICAL;
            let drive = f64::from(typical.drive_v) / f64::from(typical.reference_v) * COUNTS;
            let counts = drive * f64::from(typical.feedback_ohm[0]) / ohm;
            // The sample and the idle sample are both off.
            (counts, drive + counts, ohm * 2.0 * half / (counts - 2.0 * half))
        }
    };
    // So small a current counts as none.
    let is_open = counts - 2.0 * half < f64::from(NO_CURRENT_COUNTS);
    if bound_ohm < 0.0 || is_open || largest_counts + half > COUNTS - 2.0 * half {
        return f64::INFINITY;
    }
    bound_ohm + gamma(8) * (ohm + bound_ohm)
}

/// Largest difference of every output of `model` between scanned and ideal `readings`, whose columns
/// are the model's inputs.
///
/// # Panics
/// If `readings` has other columns than the model's inputs, or the model is not of the format f32-direct, or
/// stands behind a projection: the bound is derived for neither.
pub fn output_bounds(model: &Model<'_>, circuit: Circuit, bits: u8, readings: &Table) -> Table {
    assert!(model.projection().is_none(), "a model behind a projection");
    let all: Vec<Network<'_>> = model.networks().collect();
    let networks: Vec<&Network<'_>> =
        (0..model.shape().rows).map(|row| &all[model.network_of_row(row).unwrap()]).collect();
    let names = model.metadata().output_names.iter().map(String::from).collect();
    let mut values = Vec::new();
    for line in readings.lines() {
        let rows = line.chunks_exact(model.shape().inputs);
        for (network, ohm) in networks.iter().zip(rows) {
            let bound_ohm = ohm.iter().map(|ohm| reading_bound_ohm(circuit, *ohm, bits));
            let Network::F32Direct(network) = network else { panic!("a model of another format") };
            values.extend(of_network(network, ohm, &bound_ohm.collect::<Vec<_>>()));
        }
    }
    Table { names, values }
}

/// Largest change of every output when each reading is off by at most `bound_ohm` from `ohm`.
fn of_network(network: &direct::Network<'_>, ohm: &[f64], bound_ohm: &[f64]) -> Vec<f64> {
    let (p, shape) = (network.parameters(), network.shape());
    // x: the ideal readings exactly as inference scales them; h: the largest deviation of scanned ones.
    let (mut x, mut h) = (Vec::new(), Vec::new());
    for (k, (ohm, bound_ohm)) in ohm.iter().zip(bound_ohm).enumerate() {
        let (minimum, per_span) = (p.input_minimum[k], p.input_per_span[k]);
        x.push(f64::from(scale(*ohm as f32, minimum, per_span)));
        let (minimum, per_span) = (f64::from(minimum), f64::from(per_span));
        // The ideal reading is rounded to f32; then both are scaled by two rounded operations.
        let apart = (bound_ohm + UNIT * ohm) * per_span;
        let largest = (ohm - minimum).abs() * per_span + apart;
        h.push(apart + 2.0 * gamma(2) * largest);
    }
    let h_norm = norm(&h);

    // A Taylor polynomial of second order about x is maximised with the signs of its coefficients and
    // the box's half-sides. The largest third derivative in the box, and rounding, are added as sums of
    // magnitudes.
    let mut taylor = Taylor::new(p.affine, shape);
    let mut magnitude: Vec<f64> = p.bias.iter().map(|b| f64::from(*b).abs()).collect();
    for ((x, h), row) in x.iter().zip(&h).zip(p.affine.chunks_exact(shape.outputs)) {
        add(&mut magnitude, x.abs() + h, row.iter().map(|a| f64::from(*a).abs()));
    }
    let mut rest = vec![0.0; shape.outputs];
    let centres = p.centres.chunks_exact(shape.inputs);
    let weights = p.output_weights.chunks_exact(shape.outputs);
    for (c, (centre, weights)) in centres.zip(weights).enumerate() {
        let decay = f64::from(*p.decay.get(c).unwrap_or(&p.decay[0]));
        let from_centre: Vec<f64> = x.iter().zip(centre).map(|(x, c)| x - f64::from(*c)).collect();
        taylor.add_centre(decay, &from_centre, weights);

        let distance = norm(&from_centre);
        let (nearest, farthest) = ((distance - h_norm).max(0.0), distance + h_norm);
        let largest = (-decay * nearest * nearest).exp();
        let third = largest * third_derivative(decay, farthest) * h_norm.powi(3) / 6.0;
        // Rounding of φ: that of d·‖x − c‖², and 2 ulp of the exponential, in two inferences.
        // Operations: difference, square, a sum in four lanes, these together, times decay.
        let operations = 2 + shape.inputs.div_ceil(4) + 2 + 1;
        let exponent = 1.01 * decay * farthest * farthest * gamma(operations);
        let rounding = 2.0 * (largest * (exponent + 4.1 * UNIT) + 1e-37);
        let magnitudes = || weights.iter().map(|w| f64::from(*w).abs());
        add(&mut rest, third + rounding, magnitudes());
        add(&mut magnitude, largest, magnitudes());
    }
    // Each inference is a sum of so many rounded products.
    add(&mut rest, 2.0 * gamma(shape.inputs + shape.centres + 3), magnitude.iter().copied());
    let bounds =
        taylor.largest_change(&h).into_iter().zip(rest).map(|(change, rest)| change + rest);
    // Rounding of this computation itself, in f64.
    bounds.map(|bound| bound * (1.0 + 1e-9)).collect()
}

/// Adds `factor` times `values` to `sums`.
fn add(sums: &mut [f64], factor: f64, values: impl Iterator<Item = f64>) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
}

/// Largest |third derivative of exp(−d·ρ²)|/exp(−d·ρ²) in any direction, up to `farthest` from the
/// centre: (2d)^(3/2)·|3τ − τ³| with |τ| ≤ √(2d)·ρ.
fn third_derivative(decay: f64, farthest: f64) -> f64 {
    let root = (2.0 * decay).sqrt();
    let t = root * farthest;
    let largest = if t <= 1.0 { 3.0 * t - t.powi(3) } else { (t.powi(3) - 3.0 * t).max(2.0) };
    root.powi(3) * largest
}

/// First and second derivatives of a network's outputs.
struct Taylor {
    outputs: usize,
    /// Gradient, `[input × output]`.
    gradient: Vec<f64>,
    /// Second derivatives, `[pair of inputs × output]`, for pairs (0, 0), (0, 1), …, (1, 1), …
    hessian: Vec<f64>,
}

impl Taylor {
    /// Derivatives of the affine tail alone.
    fn new(affine: &[f32], shape: Shape) -> Self {
        let Shape { inputs, outputs, .. } = shape;
        let mut gradient: Vec<f64> = affine.iter().map(|a| f64::from(*a)).collect();
        gradient.resize(inputs * outputs, 0.0);
        Self { outputs, gradient, hessian: vec![0.0; inputs * (inputs + 1) / 2 * outputs] }
    }

    /// Adds the derivatives of a centre: ∂φ = −2d·u·φ, ∂²φ = (4d²·u·uᵀ − 2d·1)·φ with u = x − c.
    fn add_centre(&mut self, decay: f64, u: &[f64], weights: &[f32]) {
        let activation = (-decay * u.iter().map(|u| u * u).sum::<f64>()).exp();
        let weights: Vec<f64> = weights.iter().map(|w| f64::from(*w) * activation).collect();
        for (u, row) in u.iter().zip(self.gradient.chunks_exact_mut(self.outputs)) {
            add(row, -2.0 * decay * u, weights.iter().copied());
        }
        let mut rows = self.hessian.chunks_exact_mut(self.outputs);
        for (k, u_k) in u.iter().enumerate() {
            for (l, u_l) in u.iter().enumerate().skip(k) {
                let diagonal = if k == l { 2.0 * decay } else { 0.0 };
                let Some(row) = rows.next() else { return };
                add(row, 4.0 * decay * decay * u_k * u_l - diagonal, weights.iter().copied());
            }
        }
    }

    /// Largest change of every output for steps of at most `h`.
    fn largest_change(&self, h: &[f64]) -> Vec<f64> {
        let mut change = vec![0.0; self.outputs];
        for (h, row) in h.iter().zip(self.gradient.chunks_exact(self.outputs)) {
            add(&mut change, *h, row.iter().map(|slope| slope.abs()));
        }
        let mut rows = self.hessian.chunks_exact(self.outputs);
        for (k, h_k) in h.iter().enumerate() {
            for (l, h_l) in h.iter().enumerate().skip(k) {
                let share = if k == l { 0.5 } else { 1.0 };
                let Some(row) = rows.next() else { return change };
                add(&mut change, share * h_k * h_l, row.iter().map(|second| second.abs()));
            }
        }
        change
    }
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

#[test]
fn bounds_of_a_reading_are_those_of_its_circuit() {
    let bounds = Circuit::ALL.map(|circuit| reading_bound_ohm(circuit, 55.0, 12));
    assert!(bounds[0] > 0.071 && bounds[0] < 0.072); // the divider
    assert!(bounds[1] > 0.021 && bounds[1] < 0.022); // zero potential
}
