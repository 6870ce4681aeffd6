//! What commands say of a device: its identity for programs, and its memory for people.

use crate::report::Sections;
use serde_json::json;
use taxel_firmware::link::message::Memory;
use taxel_rig::device::DeviceIdentity;

/// Adds the identity of a device, which programs read. Checksums are text: programs read large numbers as floats, which
/// round them.
pub fn value(result: &mut Sections, device: &DeviceIdentity) {
    let model = device.model.map(|model| {
        json!({
            "model_crc": format!("{:08x}", model.crc_32),
            "slot": model.slot,
            "generation": model.generation,
            "rows": model.rows,
            "inputs": model.inputs,
            "outputs": model.outputs,
            "in_ram": model.in_ram,
            "scene_digest": format!("{:016x}", model.scene_digest),
            "inputs_crc": format!("{:08x}", model.inputs_crc_32),
            "outputs_crc": format!("{:08x}", model.outputs_crc_32),
            "on_trial": model.on_trial,
        })
    });
    let identity = json!({
        "board": device.board,
        "firmware": device.firmware,
        "rows": device.rows,
        "columns": device.columns,
        "outputs": device.outputs,
        "model": model,
        "model_name": device.model_name,
        "slot_bytes": device.slot_bytes,
        "chunk_bytes": device.chunk_bytes,
        "memory": device.memory,
        "unique_id": device.unique_id_text(),
    });
    result.value("device", &identity);
}

/// Adds lines about the use of a device's memory.
pub fn memory(result: &mut Sections, m: &Memory) {
    result.line(
        "flash",
        format!(
            "{} bytes without the model: vector table {}, code {}, constants {}, start values {}",
            m.flash_bytes(),
            m.vector_table,
            m.text,
            m.rodata,
            m.data
        ),
    );
    result.line(
        "RAM",
        format!(
            "{} bytes: variables {}, stack {} at its deepest (of {} reserved)",
            m.ram_bytes(),
            m.ram_bytes() - m.stack_high_water,
            m.stack_high_water,
            m.stack_reserved
        ),
    );
}
