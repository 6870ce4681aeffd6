//! Outputs that a model should predict, and the names of their columns.

use serde::Deserialize;

use crate::sensor::{Axis, Sensor, Vector3};

/// Outputs of a model, for every electrode of the rows that are read.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outputs {
    /// Quantity: deformation in mm or force in N.
    pub quantity: Quantity,
    /// Axes of the components, each once, in the order x, y, z.
    pub axes: Vec<Axis>,
}

/// Quantity that outputs measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Deformation Δ, in mm.
    Deformation,
    /// Force F = diag(kx, ky, kz)·Δ, in N.
    Force,
}

impl Outputs {
    /// Deformation in mm along all three axes.
    #[must_use]
    pub fn all_deformations() -> Self {
        Self { quantity: Quantity::Deformation, axes: vec![Axis::X, Axis::Y, Axis::Z] }
    }

    /// Output of an electrode of `sensor` for a deformation of 1 mm along `axis`, in mm or N.
    #[must_use]
    pub fn per_mm(&self, sensor: &Sensor, axis: Axis) -> f64 {
        match self.quantity {
            Quantity::Deformation => 1.0,
            Quantity::Force => sensor.stiffness_n_per_mm[axis.index()],
        }
    }

    /// Outputs of one electrode of `sensor` for its deformation in mm, in the order of the axes.
    pub fn of_electrode(
        &self,
        sensor: &Sensor,
        deformation_mm: Vector3,
    ) -> impl Iterator<Item = f64> {
        let vector = match self.quantity {
            Quantity::Deformation => deformation_mm,
            Quantity::Force => sensor.force_n(deformation_mm),
        };
        self.axes.iter().map(move |axis| vector[axis.index()])
    }

    /// Names of the outputs of `rows` (from 0) of `sensor`, row after row.
    #[must_use]
    pub fn names(&self, sensor: &Sensor, rows: &[usize]) -> Vec<String> {
        let (symbol, unit) = match self.quantity {
            Quantity::Deformation => ('d', "mm"),
            Quantity::Force => ('f', "n"),
        };
        let mut names = Vec::new();
        for row in rows {
            for electrode in 1..=sensor.electrodes_per_row_wire {
                for axis in &self.axes {
                    let axis = axis.letter();
                    names.push(format!("r{}e{electrode}_{symbol}{axis}_{unit}", row + 1));
                }
            }
        }
        names
    }
}
