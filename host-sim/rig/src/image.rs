//! Images: which one has room for a model and scans its readings, and how it is built.

use taxel_core::blob::Model;
use taxel_core::health::MOST_COLUMNS;
use taxel_core::scratch_floats;
use taxel_data::columns;
use taxel_firmware::capacity::{Capacity, MOST_OUTPUTS, MOST_ROWS};
use taxel_firmware::timing::{ONCHIP_COLUMNS, ONCHIP_ROWS};

/// RAM in bytes that an image has for its buffers, at most.
const MOST_BUFFER_BYTES: usize = 52 * 1024;

/// Whether an image of this `capacity` decodes `model`, and scans its readings.
pub fn fits(capacity: Capacity, model: &Model<'_>) -> bool {
    let (names, shape) = (model.metadata().input_names, model.shape());
    capacity.has_room_for(shape)
        && scratch_floats(model) <= capacity.scratch_floats()
        && capacity.cells(names, shape).all(|cell| cell.is_ok())
}

/// Capacity of an image that decodes `model` and scans its readings: what the image at hand `has`, if that is enough.
///
/// # Errors
/// Reason why no image does, and what to do.
pub fn capacity_for(model: &Model<'_>, has: Capacity) -> Result<Capacity, String> {
    if fits(has, model) {
        return Ok(has);
    }
    let shape = model.shape();
    let (rows, columns) = wires(model, has)?;
    let scratch_rows = scratch_floats(model).div_ceil(2 * columns);
    let rows = rows.max(scratch_rows);
    let outputs = (shape.rows * shape.outputs).div_ceil(rows);
    let needed = [outputs.max(has.outputs), outputs];
    let needed = needed.map(|outputs| Capacity { rows, columns, outputs });
    let possible = |it: &&Capacity| {
        let within =
            it.rows <= MOST_ROWS && it.columns <= MOST_COLUMNS && it.outputs <= MOST_OUTPUTS;
        within && it.buffer_bytes() <= MOST_BUFFER_BYTES && fits(**it, model)
    };
    needed.iter().find(possible).copied().ok_or_else(|| {
        let most = MOST_BUFFER_BYTES / 1024;
        let remedy = if model.whole_frames() { "give fewer inputs or --features" } else { "give fewer inputs" };
        if columns > MOST_COLUMNS || rows > MOST_ROWS {
            format!(
                "no image scans its {rows} × {columns} wires, but at most {MOST_ROWS} × {MOST_COLUMNS}; choose others with \
                 --inputs"
            )
        } else {
            let bytes = needed[1].buffer_bytes();
            format!("no image has room for it: its buffers take {bytes} bytes of RAM, and there are {most} KiB; {remedy}")
        }
    })
}

/// Row-wires and column-wires that a board needs for the readings of `model`.
fn wires(model: &Model<'_>, has: Capacity) -> Result<(usize, usize), String> {
    let (names, shape) = (model.metadata().input_names, model.shape());
    let cells: Vec<_> = names.iter().map(columns::cell_of).collect();
    if cells.iter().any(Option::is_some) {
        if let Some(name) = names.iter().find(|name| columns::cell_of(name).is_none()) {
            return Err(format!(
                "input {name} cannot be scanned: it names no wires, as others do; name every input after its wires, such as \
                 r4c17_ohm, or train without it (--inputs)"
            ));
        }
        let most =
            |of: usize| cells.iter().flatten().map(|(wires, _)| wires[of]).max().unwrap_or(1);
        return Ok((
            most(0).max(has.rows),
            most(1).max(if shape.rows == 1 { 1 } else { has.columns }),
        ));
    }
    if shape.rows > 1 || shape.inputs <= MOST_COLUMNS {
        return Ok((shape.rows.max(has.rows), shape.inputs.max(has.columns)));
    }
    let divides = |columns: &usize| shape.inputs.is_multiple_of(*columns);
    let columns = (2..=MOST_COLUMNS).rev().filter(divides);
    let columns = columns.min_by_key(|columns| columns.abs_diff(shape.inputs / columns));
    columns.map(|columns| ((shape.inputs / columns).max(has.rows), columns)).ok_or_else(|| {
        format!(
            "{} readings without names of wires cannot be divided into rows of {MOST_COLUMNS} or fewer: train with --grid ROWSxCOLUMNS",
            shape.inputs
        )
    })
}

/// What image `model` needs, if one that `has` this capacity does not do; `None` if it does.
pub fn needed(model: &Model<'_>, has: Capacity) -> Option<String> {
    match capacity_for(model, has) {
        Ok(capacity) if capacity == has => None,
        Ok(Capacity { rows, columns, outputs }) => {
            let room = format!("TAXEL_CAPACITY={rows}x{columns}x{outputs}");
            let of_board = if rows <= ONCHIP_ROWS.into() && columns <= ONCHIP_COLUMNS.into() {
                format!("{room} cargo nucleo builds the board's")
            } else {
                format!("the NUCLEO-F446RE scans {ONCHIP_ROWS} × {ONCHIP_COLUMNS} at most")
            };
            Some(format!(
                "it needs an image with room for {rows} × {columns} wires: {of_board}; \
                 {room} cargo xtask firmware qemu-app builds the emulator's (docs/board.md)"
            ))
        }
        Err(reason) => Some(reason),
    }
}
