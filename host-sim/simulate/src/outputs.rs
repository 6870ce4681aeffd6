//! Outputs that a model should predict, and the names of their columns.

use serde::Deserialize;
use taxel_data::{LANES, Lanes};

use crate::contact::Contact;
use crate::sensor::{Axis, Sensor};

/// Outputs that a model should predict: of electrodes, or of the one contact.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "OutputsTable")]
pub enum Outputs {
    /// Outputs of every electrode of the rows that are read.
    Electrodes(ElectrodeOutputs),
    /// Quantities of the contact, each once, in the order of [`ContactOutput::ALL`]. They belong to the whole array
    /// and to no row-wire.
    Contact(Vec<ContactOutput>),
}

/// Outputs of a model, for every electrode of the rows that are read.
#[derive(Debug, Clone, PartialEq)]
pub struct ElectrodeOutputs {
    /// Quantity: deformation in mm or force in N.
    pub quantity: Quantity,
    /// Axes of the components, each once, in the order x, y, z.
    pub axes: Vec<Axis>,
}

/// Quantity that outputs of electrodes measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Deformation Δ, in mm.
    Deformation,
    /// Force F = diag(kx, ky, kz)·Δ, in N.
    Force,
}

/// Quantity of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ContactOutput {
    /// Place of the contact's centre on the face, x and y in mm; missing where nothing touches.
    Centre,
    /// Depth of the dent in mm: compression at its centre.
    Depth,
    /// Shear at the centre, Δx and Δy in mm.
    Shear,
    /// Normal force on the whole face, in N: see [`Contact::force_n`].
    Force,
}

/// Outputs as they stand in a scene's file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputsTable {
    quantity: Option<Quantity>,
    axes: Option<Vec<Axis>>,
    contact: Option<Vec<ContactOutput>>,
}

impl TryFrom<OutputsTable> for Outputs {
    type Error = &'static str;

    fn try_from(table: OutputsTable) -> Result<Self, Self::Error> {
        match (table.quantity, table.axes, table.contact) {
            (None, None, Some(contact)) => Ok(Self::Contact(contact)),
            (Some(quantity), Some(axes), None) => {
                Ok(Self::Electrodes(ElectrodeOutputs { quantity, axes }))
            }
            (_, _, Some(_)) => Err(
                "`contact` cannot be combined with others: leave out `quantity` and `axes`, which \
                                    are for outputs of electrodes, or leave out `contact`",
            ),
            (None, _, None) => {
                Err("missing field `quantity` (outputs of electrodes), or `contact` \
                                    (outputs of the contact)")
            }
            (Some(_), None, None) => Err("missing field `axes`"),
        }
    }
}

impl From<ElectrodeOutputs> for Outputs {
    fn from(outputs: ElectrodeOutputs) -> Self {
        Self::Electrodes(outputs)
    }
}

impl Outputs {
    /// Deformation in mm along all three axes.
    pub fn all_deformations() -> Self {
        let axes = vec![Axis::X, Axis::Y, Axis::Z];
        ElectrodeOutputs { quantity: Quantity::Deformation, axes }.into()
    }

    /// Number of outputs of a frame of so many `rows` of `sensor`.
    pub fn count(&self, sensor: &Sensor, rows: usize) -> usize {
        match self {
            Self::Electrodes(outputs) => rows * sensor.electrodes_per_row_wire * outputs.axes.len(),
            Self::Contact(wanted) => wanted.iter().map(|quantity| quantity.names().len()).sum(),
        }
    }

    /// Number of row tables in a data set of so many `rows`: outputs of electrodes belong to their row-wires, those
    /// of the contact to the array.
    pub fn row_tables(&self, rows: usize) -> usize {
        match self {
            Self::Electrodes(_) => rows,
            Self::Contact(_) => 1,
        }
    }

    /// Names of the outputs: of `rows` (from 0) of `sensor`, row after row, or of the contact.
    pub fn names(&self, sensor: &Sensor, rows: &[usize]) -> Vec<String> {
        match self {
            Self::Electrodes(outputs) => outputs.names(sensor, rows),
            Self::Contact(wanted) => {
                let names = wanted.iter().flat_map(|quantity| quantity.names());
                names.map(|name| (*name).to_owned()).collect()
            }
        }
    }
}

impl ElectrodeOutputs {
    /// Output of an electrode of `sensor` for a deformation of 1 mm along `axis`, in mm or N.
    pub fn per_mm(&self, sensor: &Sensor, axis: Axis) -> f64 {
        match self.quantity {
            Quantity::Deformation => 1.0,
            Quantity::Force => sensor.stiffness_n_per_mm[axis.index()],
        }
    }

    /// Names of the outputs of `rows` (from 0) of `sensor`, row after row.
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

impl ContactOutput {
    /// All quantities, in the order of their columns.
    pub const ALL: [Self; 4] = [Self::Centre, Self::Depth, Self::Shear, Self::Force];

    /// Names of the quantity's columns.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::Centre => &["contact_x_mm", "contact_y_mm"],
            Self::Depth => &["contact_depth_mm"],
            Self::Shear => &["contact_shear_x_mm", "contact_shear_y_mm"],
            Self::Force => &["contact_force_n"],
        }
    }

    /// Values of the quantity's columns for `contact`, pressed into `sensor`; without a contact, where there is
    /// nothing to measure, the centre is NaN and everything else 0.
    pub fn of(self, contact: Option<&Contact>, sensor: &Sensor) -> Vec<Lanes> {
        let Some(contact) = contact else {
            let nothing = if self == Self::Centre { f64::NAN } else { 0.0 };
            return vec![[nothing; LANES]; self.names().len()];
        };
        match self {
            // A contact that is lifted is nowhere.
            Self::Centre => contact
                .centre_mm
                .map(|mut along| {
                    for (place, depth_mm) in along.iter_mut().zip(&contact.dent_depth_mm) {
                        *place = if *depth_mm == 0.0 { f64::NAN } else { *place };
                    }
                    along
                })
                .to_vec(),
            Self::Depth => vec![contact.dent_depth_mm],
            Self::Shear => contact.shear_mm().to_vec(),
            Self::Force => vec![contact.force_n(sensor)],
        }
    }

    /// Full scale of the quantity's columns: the extent of the face for the centre, else what the `largest` contact
    /// has.
    pub fn full_scales(self, largest: &Contact, sensor: &Sensor) -> Vec<f64> {
        if self == Self::Centre {
            return sensor.size_mm[..2].to_vec();
        }
        let columns = self.of(Some(largest), sensor);
        columns.iter().map(|lanes| lanes.iter().copied().fold(lanes[0], f64::max)).collect()
    }
}
