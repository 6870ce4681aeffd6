//! What a device says of itself.

use taxel_core::Wires;
use taxel_core::blob::{Columns, Model, ModelShape};
use taxel_core::checksum::CRC_32;
use taxel_firmware::capacity::Capacity;
use taxel_firmware::link::message::{Identity, Memory, ModelIdentity};

/// Identity that a device reports.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceIdentity {
    pub board: String,
    /// Version of its firmware.
    pub firmware: String,
    /// Largest number of row-wires.
    pub rows: usize,
    /// Largest number of readings in a row.
    pub columns: usize,
    /// Largest number of outputs of a row.
    pub outputs: usize,
    /// Active model, if there is one.
    pub model: Option<ModelIdentity>,
    /// Name of its scene or data set, cut after 40 bytes.
    pub model_name: String,
    /// Largest blob that a slot holds, in bytes.
    pub slot_bytes: usize,
    /// Largest chunk of an upload, in bytes.
    pub chunk_bytes: usize,
    /// Use of its flash and RAM.
    pub memory: Memory,
    /// Number that no other board of its kind has.
    pub unique_id: [u8; 12],
    /// CRC-32 of the wires of its readings.
    pub wires_crc_32: u32,
}

impl DeviceIdentity {
    /// The device's number, as hexadecimal digits.
    pub fn unique_id_text(&self) -> String {
        self.unique_id.map(|byte| format!("{byte:02x}")).concat()
    }

    /// Sensor and model that the device has room for.
    pub fn capacity(&self) -> Capacity {
        Capacity { rows: self.rows, columns: self.columns, outputs: self.outputs }
    }

    /// Shape of the active model; without one, all wires.
    fn shape(&self) -> ModelShape {
        self.model.map_or(self.capacity().wires_as_shape(), |model| ModelShape {
            rows: model.rows.into(),
            inputs: model.inputs.into(),
            outputs: model.outputs.into(),
        })
    }

    /// Number of readings in a frame.
    pub fn readings(&self) -> usize {
        self.shape().rows * self.shape().inputs
    }

    /// Wires that the device scans: those of its model, or all without one. `None` if its model takes other readings than
    /// all between the first wires, row after row.
    pub fn wires(&self) -> Option<Wires> {
        let columns = self.capacity().line(self.shape()).max(1);
        let wires = Wires { rows: self.readings() / columns, columns };
        let cells = (0..self.readings()).map(|i| [(i / columns) as u8, (i % columns) as u8]);
        let cells: Vec<u8> = cells.flatten().collect();
        (CRC_32.checksum(&cells) == self.wires_crc_32).then_some(wires)
    }

    /// Whether the active model has the columns of `model` and was trained on the same: it is that model, or one that a
    /// recalibration made of it.
    pub fn is_made_of(&self, model: &Model<'_>) -> bool {
        let metadata = model.metadata();
        let crc = |names: Columns<'_>, units: Columns<'_>| {
            let mut digest = CRC_32.digest();
            [names, units].iter().for_each(|columns| digest.update(columns.0.as_bytes()));
            digest.finalize()
        };
        self.model.is_some_and(|found| {
            found.scene_digest == metadata.scene_digest
                && found.inputs_crc_32 == crc(metadata.input_names, metadata.input_units)
                && found.outputs_crc_32 == crc(metadata.output_names, metadata.output_units)
        })
    }

    /// Whether the model with that CRC-32 is active.
    pub fn has_in_force(&self, crc_32: u32) -> bool {
        self.model.is_some_and(|found| found.crc_32 == crc_32)
    }
}

impl From<&Identity<'_>> for DeviceIdentity {
    fn from(identity: &Identity<'_>) -> Self {
        Self {
            board: identity.board.into(),
            firmware: identity.firmware.into(),
            rows: identity.rows.into(),
            columns: identity.columns.into(),
            outputs: identity.outputs.into(),
            model: identity.model,
            model_name: identity.model_name.into(),
            slot_bytes: identity.slot_bytes as usize,
            chunk_bytes: identity.chunk_bytes.into(),
            memory: identity.memory,
            unique_id: identity.unique_id,
            wires_crc_32: identity.wires_crc_32,
        }
    }
}
