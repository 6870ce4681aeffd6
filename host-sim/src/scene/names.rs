//! Names of the columns that a scene reads and gives out.

use super::{Quantity, Scene};

impl Scene {
    /// Names of the readings that the scene asks for, row after row.
    #[must_use]
    pub fn reading_names(&self) -> Vec<String> {
        let columns = 1..=self.sensor.column_wires;
        let rows = self.read_rows.iter().map(|row| row + 1);
        rows.flat_map(|m| columns.clone().map(move |k| format!("r{m}c{k}_ohm"))).collect()
    }

    /// Names of the outputs that the scene asks for, row after row.
    #[must_use]
    pub fn output_names(&self) -> Vec<String> {
        let (symbol, unit) = match self.outputs.quantity {
            Quantity::Deformation => ('d', "mm"),
            Quantity::Force => ('f', "n"),
        };
        let mut names = Vec::new();
        for row in &self.read_rows {
            for electrode in 1..=self.sensor.electrodes_per_row_wire {
                for axis in &self.outputs.axes {
                    let axis = axis.letter();
                    names.push(format!("r{}e{electrode}_{symbol}{axis}_{unit}", row + 1));
                }
            }
        }
        names
    }
}

/// Names of the full deformation of one row (from 0), electrode after electrode.
#[must_use]
pub fn deformation_names(row: usize, electrodes: usize) -> Vec<String> {
    let electrodes = 1..=electrodes;
    electrodes
        .flat_map(|i| ['x', 'y', 'z'].map(|axis| format!("r{}e{i}_d{axis}_mm", row + 1)))
        .collect()
}
