//! Forward model for many frames at once, one frame a lane.
//!
//! Resistances are those of the paper's equations; only 1/√ is computed in another way. Square
//! roots and divisions would take three times as long as all the rest. Instead, an estimate in f32 (a
//! shift of the exponent, then a polynomial) is made exact to 1e-13 by one Newton step in f64. It holds for distances from
//! 1e-15 to 1e15 mm, which those of a checked world are.
//!
//! It consists of shifts, additions and multiplications alone, which every machine rounds alike. Squares
//! of coordinates that electrodes share are computed once.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are indexed alike")]

use std::collections::HashMap;

use taxel_data::{LANES, Lanes};

use super::Sensor;

/// Precision of computed readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Double precision: within 2e-13 of the sensor's equations.
    F64,
    /// Single precision: within 1e-6, a third faster; enough to weigh samples of the limit.
    F32,
}

/// Sensor prepared for computing the readings of many frames.
#[derive(Debug)]
pub struct LaneModel<'s> {
    sensor: &'s Sensor,
    /// Distinct coordinates of lower electrodes: x, and y with z.
    x_mm: Vec<f64>,
    yz_mm: Vec<[f64; 2]>,
    /// Indices of each lower electrode's coordinates in these lists.
    places: Vec<[usize; 2]>,
}

/// Working memory of [`LaneModel::row_column_resistance_ohm`], used again for the next frames.
#[derive(Debug, Clone)]
pub struct Scratch {
    /// Squared distances along x, and along y and z, by coordinate of lower electrodes.
    x_mm2: Vec<Squares>,
    yz_mm2: Vec<Squares>,
    estimates: [Lanes<f32>; 3],
}

impl Default for Scratch {
    fn default() -> Self {
        Self { x_mm2: Vec::new(), yz_mm2: Vec::new(), estimates: [[0.0; LANES]; 3] }
    }
}

/// Squared distances of all lanes, in both precisions.
#[derive(Debug, Clone)]
struct Squares {
    double: Lanes,
    single: Lanes<f32>,
}

impl<'s> LaneModel<'s> {
    /// Prepares `sensor`.
    pub fn new(sensor: &'s Sensor) -> Self {
        let (mut x, mut yz, mut places) = (Distinct::default(), Distinct::default(), Vec::new());
        for electrode in &sensor.lower_electrodes_mm {
            let [at_x, y, z] = *electrode;
            places.push([x.place_of([at_x]), yz.place_of([y, z])]);
        }
        let x_mm = x.values.into_iter().flatten().collect();
        Self { sensor, x_mm, yz_mm: yz.values, places }
    }

    /// Computes the resistances in Ω between row-wire `row` and every column-wire.
    ///
    /// `deformation_mm` has the deformations of that row's electrodes, by electrode and axis;
    /// `resistance_ohm` receives one entry a column-wire. NaN makes its frame's readings NaN.
    ///
    /// # Panics
    /// If `deformation_mm` has not one entry an electrode, or `resistance_ohm` not one a column-wire.
    #[inline(always)]
    pub fn row_column_resistance_ohm(
        &self,
        row: usize,
        precision: Precision,
        deformation_mm: &[[Lanes; 3]],
        scratch: &mut Scratch,
        resistance_ohm: &mut [Lanes],
    ) {
        let sensor = self.sensor;
        let upper = sensor.row_electrodes_mm(row);
        assert_eq!(upper.len(), deformation_mm.len(), "one deformation an electrode");
        assert_eq!(resistance_ohm.len(), sensor.column_wires, "one reading a column-wire");
        let Scratch { x_mm2, yz_mm2, estimates } = scratch;
        x_mm2.resize(self.x_mm.len(), Squares::ZERO);
        yz_mm2.resize(self.yz_mm.len(), Squares::ZERO);
        resistance_ohm.fill([0.0; LANES]);
        for (upper, delta) in upper.iter().zip(deformation_mm) {
            for (squares, x) in x_mm2.iter_mut().zip(&self.x_mm) {
                squares.set(|frame| {
                    let distance = upper[0] - delta[0][frame] - x;
                    distance * distance
                });
            }
            for (squares, [y, z]) in yz_mm2.iter_mut().zip(&self.yz_mm) {
                squares.set(|frame| {
                    let y = upper[1] - delta[1][frame] - y;
                    let z = upper[2] - delta[2][frame] - z;
                    y * y + z * z
                });
            }
            let columns = self.places.chunks_exact(sensor.electrodes_per_column_wire);
            for (places, sum) in columns.zip(&mut *resistance_ohm) {
                let node = |place: usize| {
                    let [x, yz] = places[place];
                    (&x_mm2[x], &yz_mm2[yz])
                };
                let threes = places.len() / 3 * 3;
                for first in (0..threes).step_by(3) {
                    let three = [node(first), node(first + 1), node(first + 2)];
                    add_nodes(precision, three, estimates, sum);
                }
                for place in threes..places.len() {
                    add_nodes(precision, [node(place)], estimates, sum);
                }
            }
        }
        let summed = if precision == Precision::F64 { 2.0 } else { 1.0 }; // as `add_nodes` returns
        let unit = summed * sensor.resistance_ohm_per_mm;
        for sum in resistance_ohm {
            for sum in sum {
                *sum = unit / *sum;
            }
        }
    }
}

impl Squares {
    const ZERO: Self = Self { double: [0.0; LANES], single: [0.0; LANES] };

    #[inline(always)]
    fn set(&mut self, squared_mm2: impl Fn(usize) -> f64) {
        for frame in 0..LANES {
            self.double[frame] = squared_mm2(frame);
            self.single[frame] = self.double[frame] as f32;
        }
    }
}

/// Adds Σ 1/‖·‖ of `N` nodes to `sum` (f32), or twice that (f64).
#[inline(always)]
fn add_nodes<const N: usize>(
    precision: Precision,
    nodes: [(&Squares, &Squares); N],
    estimates: &mut [Lanes<f32>; 3],
    sum: &mut Lanes,
) {
    // Two loops: the first has eight lanes where the second has four.
    if precision == Precision::F32 {
        let added = &mut estimates[0];
        for frame in 0..LANES {
            let mut total = 0.0;
            for node in estimates_at(&nodes, frame) {
                total += node;
            }
            added[frame] = total;
        }
        for frame in 0..LANES {
            sum[frame] += f64::from(added[frame]);
        }
        return;
    }
    for frame in 0..LANES {
        let found = estimates_at(&nodes, frame);
        for place in 0..N {
            estimates[place][frame] = found[place];
        }
    }
    for frame in 0..LANES {
        let mut added = 0.0;
        for place in 0..N {
            let (x, yz) = nodes[place];
            let squared_mm2 = x.double[frame] + yz.double[frame];
            added += twice_refined(squared_mm2, estimates[place][frame]);
        }
        sum[frame] += added;
    }
}

/// Estimates of 1/‖·‖ of `N` nodes in one frame.
#[inline(always)]
fn estimates_at<const N: usize>(nodes: &[(&Squares, &Squares); N], frame: usize) -> [f32; N] {
    let mut squared_mm2 = [0.0; N];
    for place in 0..N {
        let (x, yz) = nodes[place];
        squared_mm2[place] = x.single[frame] + yz.single[frame];
    }
    estimate(squared_mm2)
}

/// Estimates 1/√x to 3e-7: the exponent is halved by a shift (Blinn, 1997), which is right to 3.5 %, and
/// the best polynomial of degree 4 corrects the rest.
///
/// Each step is done for all `N`, so that a processor need not wait for one estimate before it begins
/// the next.
#[inline(always)]
fn estimate<const N: usize>(x: [f32; N]) -> [f32; N] {
    const SHIFTED: u32 = 0x5f37_0000;
    const P: [f32; 5] = [1.0, 0.499_998_43, 0.374_985_2, 0.313_887_8, 0.278_575_3];
    let (mut y, mut off, mut factor) = ([0.0; N], [0.0; N], [0.0; N]);
    for i in 0..N {
        y[i] = f32::from_bits(SHIFTED.wrapping_sub(x[i].to_bits() >> 1));
    }
    for i in 0..N {
        off[i] = 1.0 - x[i] * y[i] * y[i];
    }
    for i in 0..N {
        let squared = off[i] * off[i];
        factor[i] = (P[0] + off[i] * P[1]) + squared * ((P[2] + off[i] * P[3]) + squared * P[4]);
    }
    for i in 0..N {
        y[i] *= factor[i];
    }
    y
}

/// Refines an `estimate` of 1/√x to 2/√x by one Newton step. The caller halves the sum.
#[inline(always)]
fn twice_refined(x: f64, estimate: f32) -> f64 {
    let y = f64::from(estimate);
    y * (3.0 - x * y * y)
}

/// Distinct coordinates, in the order in which they came.
struct Distinct<const N: usize> {
    values: Vec<[f64; N]>,
    /// Place of each among the values, by its bits.
    places: HashMap<[u64; N], usize>,
}

impl<const N: usize> Default for Distinct<N> {
    fn default() -> Self {
        Self { values: Vec::new(), places: HashMap::new() }
    }
}

impl<const N: usize> Distinct<N> {
    /// Index of `value`, which is added if it is new.
    fn place_of(&mut self, value: [f64; N]) -> usize {
        // Adding 0 makes −0 and 0 the same bits.
        let bits = value.map(|coordinate| (coordinate + 0.0).to_bits());
        *self.places.entry(bits).or_insert_with(|| {
            self.values.push(value);
            self.values.len() - 1
        })
    }
}
