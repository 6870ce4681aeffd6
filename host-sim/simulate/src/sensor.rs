//! Ideal sensor: geometry and the forward model, in f64.
//!
//! The model is the paper's equations 1–7. An upper electrode moved from U to U − Δ has the node
//! resistance r = g·‖U − Δ − L‖ to the lower electrode L. The resistance between row-wire m and
//! column-wire k is that of all nodes of the two wires in parallel. Force follows the generalised Hooke
//! law F = diag(kx, ky, kz)·Δ.

use serde::{Deserialize, Serialize};

mod lanes;

pub use lanes::{LaneModel, Precision, Scratch};

/// Axis of the sensor's right-handed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Axis x, along the row-wires.
    X,
    /// Axis y, across the row-wires.
    Y,
    /// Axis z, along the outward normal.
    Z,
}

impl Axis {
    /// Index of the axis in a [`Vector3`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// Letter of the axis in column names.
    pub fn letter(self) -> char {
        ['x', 'y', 'z'][self.index()]
    }
}

/// Position or deformation in mm: x along the row-wires, y across them, z along the outward normal.
pub type Vector3 = [f64; 3];

/// Geometry and material of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Number of row-wires, in the upper layer.
    pub row_wires: usize,
    /// Number of electrodes on each row-wire.
    pub electrodes_per_row_wire: usize,
    /// Number of column-wires, in the lower layer: those that are read.
    pub column_wires: usize,
    /// Numbers of the column-wires that are read, from 0, if there are others.
    pub read_columns: Option<Vec<usize>>,
    /// Number of electrodes on each column-wire.
    pub electrodes_per_column_wire: usize,
    /// Upper electrodes at rest, row-wire after row-wire: `row_wires × electrodes_per_row_wire`.
    pub upper_electrodes_mm: Vec<Vector3>,
    /// Lower electrodes, column-wire after column-wire: `column_wires × electrodes_per_column_wire`.
    pub lower_electrodes_mm: Vec<Vector3>,
    /// Extent in x, y and z; z is the thickness H.
    pub size_mm: Vector3,
    /// Resistance g per length of rubber.
    pub resistance_ohm_per_mm: f64,
    /// Diagonal of the stiffness matrix: force per deformation along x, y and z.
    pub stiffness_n_per_mm: Vector3,
}

/// Reading of one row-wire and one column-wire, and how it changes with the deformation.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// Resistance R.
    pub resistance_ohm: f64,
    /// Derivatives of ln R, by electrode of the row and axis.
    pub log_slopes_per_mm: Vec<f64>,
}

/// Stiffness typical of a soft silicone; only forces depend on it.
pub const TYPICAL_STIFFNESS_N_PER_MM: Vector3 = [1.0, 1.0, 2.0];

/// Default upper electrodes: centres of equal cells on the top face, row-wires along x.
///
/// Each cell is cut into `stagger` equal parts along x, which the electrodes of neighbouring row-wires take in turn. With one
/// part they stand in line.
pub fn default_upper_electrodes_mm(
    rows: usize,
    per_row: usize,
    stagger: usize,
    size_mm: Vector3,
) -> Vec<Vector3> {
    let [x_mm, y_mm, z_mm] = size_mm;
    let along = move |m: usize, i: usize| cell(i * stagger + m % stagger, per_row * stagger, x_mm);
    (0..rows)
        .flat_map(|m| (0..per_row).map(move |i| [along(m, i), cell(m, rows, y_mm), z_mm]))
        .collect()
}

/// Default lower electrodes: centres of equal cells on the bottom face, column-wires along y.
///
/// Each cell is cut into `stagger` equal parts along y, which the electrodes of neighbouring column-wires take in turn. With
/// one part they stand in line.
pub fn default_lower_electrodes_mm(
    columns: usize,
    per_column: usize,
    stagger: usize,
    size_mm: Vector3,
) -> Vec<Vector3> {
    let [x_mm, y_mm, _] = size_mm;
    let along =
        move |k: usize, j: usize| cell(j * stagger + k % stagger, per_column * stagger, y_mm);
    (0..columns)
        .flat_map(|k| (0..per_column).map(move |j| [cell(k, columns, x_mm), along(k, j), 0.0]))
        .collect()
}

fn cell(index: usize, count: usize, extent_mm: f64) -> f64 {
    (index as f64 + 0.5) * extent_mm / count as f64
}

/// Vector d from an electrode of the lower layer to one of the upper that was `moved`, and the conductance 1/‖d‖ between them.
pub fn node(upper: &Vector3, moved: &Vector3, lower: &Vector3) -> (Vector3, f64) {
    let d = [0, 1, 2].map(|axis| upper[axis] - moved[axis] - lower[axis]);
    (d, 1.0 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt())
}

impl Sensor {
    /// Sensor of Wang et al. (2014): 8 × 18 wires, 20 × 18 × 5 mm, g = 100 Ω/mm.
    ///
    /// The paper gives no coordinates, so electrodes lie at the centres of equal cells. Stiffness is
    /// that of a soft silicone.
    pub fn paper() -> Self {
        let size_mm = [20.0, 18.0, 5.0];
        Self {
            row_wires: 8,
            electrodes_per_row_wire: 6,
            column_wires: 18,
            read_columns: None,
            electrodes_per_column_wire: 3,
            upper_electrodes_mm: default_upper_electrodes_mm(8, 6, 1, size_mm),
            lower_electrodes_mm: default_lower_electrodes_mm(18, 3, 1, size_mm),
            size_mm,
            resistance_ohm_per_mm: 100.0,
            stiffness_n_per_mm: TYPICAL_STIFFNESS_N_PER_MM,
        }
    }

    /// Stiffness along z of the rubber as an elastic foundation, in N/mm³: force per area and compression. Every upper
    /// electrode stands for an equal part of the face.
    pub fn foundation_n_per_mm3(&self) -> f64 {
        let [x_mm, y_mm, _] = self.size_mm;
        self.stiffness_n_per_mm[2] * self.upper_electrodes_mm.len() as f64 / (x_mm * y_mm)
    }

    /// Upper electrodes of row-wire `row` (from 0), at rest, in mm.
    pub fn row_electrodes_mm(&self, row: usize) -> &[Vector3] {
        let n = self.electrodes_per_row_wire;
        &self.upper_electrodes_mm[row * n..(row + 1) * n]
    }

    /// Linearises the readings of row-wire `row` (from 0) with every column-wire around this deformation of its
    /// electrodes, on which alone they depend.
    ///
    /// With conductances 1/‖d‖ of the nodes, d = U − Δ − L, R is g/Σ 1/‖d‖ and ∂ln R/∂Δ is Σ d/‖d‖³ over −Σ 1/‖d‖.
    /// [`LaneModel`] computes many frames at once.
    ///
    /// # Panics
    /// If `deformation_mm` has not one entry an electrode.
    pub fn linearise(&self, row: usize, deformation_mm: &[Vector3]) -> Vec<Linearised> {
        let upper = self.row_electrodes_mm(row);
        assert_eq!(upper.len(), deformation_mm.len(), "one deformation an electrode");
        let of_column = |column: &[Vector3]| {
            let mut conductance_mm = 0.0;
            let mut slopes: Vec<f64> = Vec::with_capacity(3 * upper.len());
            for (u, delta) in upper.iter().zip(deformation_mm) {
                let mut slope = [0.0; 3];
                for l in column {
                    let (d, node) = node(u, delta, l);
                    conductance_mm += node;
                    slope.iter_mut().zip(d).for_each(|(s, d)| *s += d * node.powi(3));
                }
                slopes.extend(slope);
            }
            Linearised {
                resistance_ohm: self.resistance_ohm_per_mm / conductance_mm,
                log_slopes_per_mm: slopes.iter().map(|slope| -slope / conductance_mm).collect(),
            }
        };
        self.lower_electrodes_mm
            .chunks_exact(self.electrodes_per_column_wire)
            .map(of_column)
            .collect()
    }

    /// This sensor, of whose column-wires (from 0) only these are read. A reading depends on its own two wires alone.
    ///
    /// # Panics
    /// If it lacks one of these wires.
    #[must_use]
    pub fn with_columns(&self, columns: &[usize]) -> Self {
        let n = self.electrodes_per_column_wire;
        let electrodes = columns.iter().map(|k| &self.lower_electrodes_mm[k * n..(k + 1) * n]);
        Self {
            column_wires: columns.len(),
            lower_electrodes_mm: electrodes.flatten().copied().collect(),
            read_columns: Some(
                columns.iter().filter_map(|k| self.column_numbers().nth(*k)).collect(),
            ),
            ..self.clone()
        }
    }

    /// Numbers of the column-wires that are read, from 0.
    pub fn column_numbers(&self) -> impl Iterator<Item = usize> + Clone {
        let numbers = self.read_columns.as_deref();
        (0..self.column_wires).map(move |column| numbers.map_or(column, |numbers| numbers[column]))
    }

    /// Names `r{m}c{k}_ohm` of the readings of `rows` (from 0), row after row.
    pub fn reading_names(&self, rows: &[usize]) -> Vec<String> {
        let columns = self.column_numbers().map(|column| column + 1);
        let rows = rows.iter().map(|row| row + 1);
        rows.flat_map(|m| columns.clone().map(move |k| format!("r{m}c{k}_ohm"))).collect()
    }

    /// Names `r{m}e{i}_d{x|y|z}_mm` of the full deformation of one `row` (from 0), electrode after
    /// electrode.
    pub fn deformation_names(&self, row: usize) -> Vec<String> {
        let electrodes = 1..=self.electrodes_per_row_wire;
        electrodes
            .flat_map(|i| ['x', 'y', 'z'].map(|axis| format!("r{}e{i}_d{axis}_mm", row + 1)))
            .collect()
    }

    /// Largest deformation along any axis for which the model holds: 20 % of the thickness.
    pub fn largest_deformation_mm(&self) -> f64 {
        0.2 * self.size_mm[2]
    }

    /// Whether the model holds for a deformation along any axis; rounding errors beyond it are accepted.
    pub fn holds_for(&self, deformation_mm: f64) -> bool {
        deformation_mm.abs() <= self.largest_deformation_mm() * (1.0 + 1e-12)
    }
}
