//! What a sensor's frames hold: readings, outputs, and the electrodes that outputs belong to.

use std::collections::BTreeMap;

use taxel_core::blob::{Columns, Metadata};
use taxel_core::checksum::CRC_32;
use taxel_core::health::Limits;
use taxel_data::columns;
use taxel_recording::{Column, Electrode, Layout};
use taxel_rig::device::DeviceIdentity;
use taxel_simulate::sensor::{Sensor, default_upper_electrodes_mm};

/// Columns called `names`; their units are what the names say, where `units` do not.
pub fn columns<'n>(
    names: impl IntoIterator<Item = &'n str>,
    units: impl IntoIterator<Item = &'n str>,
) -> Vec<Column> {
    let mut units = units.into_iter();
    let column = |name: &str| {
        let unit = units.next().filter(|unit| !unit.is_empty());
        Column { name: name.into(), unit: unit.unwrap_or(columns::unit_of(name)).into() }
    };
    names.into_iter().map(column).collect()
}

/// Layout of frames with these `readings` and `outputs`. Electrodes of outputs such as `r1e1_dz_mm` stand where `sensor` has
/// them, or evenly on a face of the paper's size.
pub fn layout(
    title: &str,
    readings: Vec<Column>,
    outputs: Vec<Column>,
    sensor: Option<&Sensor>,
) -> Layout {
    let (rows, columns) = grid(&readings);
    let electrodes = electrodes(&outputs, sensor);
    Layout { title: title.into(), rows, columns, readings, outputs, electrodes }
}

/// Layout of the frames of a model.
pub fn of_model(metadata: &Metadata<'_>, sensor: Option<&Sensor>) -> Layout {
    let readings = columns(metadata.input_names.iter(), metadata.input_units.iter());
    let outputs = columns(metadata.output_names.iter(), metadata.output_units.iter());
    layout(metadata.name, readings, outputs, sensor)
}

/// Layout of the frames of a device whose model nobody has named. The device tells no names, but a checksum of them, by which
/// the usual names are recognised.
pub fn of_device(identity: &DeviceIdentity) -> Layout {
    let count = identity.readings();
    let usual = identity.wires().map(|wires| {
        let row = |m: usize| (1..=wires.columns).map(move |k| format!("r{m}c{k}_ohm"));
        (1..=wires.rows).flat_map(row).collect::<Vec<_>>()
    });
    let readings =
        usual.unwrap_or_else(|| (1..=count).map(|number| format!("reading_{number}")).collect());
    let outputs = identity.model.map_or(vec![], |model| {
        let (rows, outputs) = (usize::from(model.rows), usize::from(model.outputs));
        let deformations = |axes: &str| -> Vec<String> {
            let electrodes = outputs / axes.len();
            let electrode = |m: usize, e: usize| {
                axes.chars().map(move |axis| format!("r{m}e{e}_d{axis}_mm")).collect::<Vec<_>>()
            };
            let row = |m: usize| (1..=electrodes).flat_map(move |e| electrode(m, e));
            (1..=rows).flat_map(row).collect()
        };
        let is_it = |names: &Vec<String>| {
            let units = vec!["mm"; names.len()].join("\n");
            let mut digest = CRC_32.digest();
            digest.update(names.join("\n").as_bytes());
            digest.update(units.as_bytes());
            digest.finalize() == model.outputs_crc_32
        };
        let known = ["xyz", "z"].into_iter().map(deformations).find(is_it);
        known.unwrap_or_else(|| (1..=rows * outputs).map(|it| format!("output_{it}")).collect())
    });
    let name = if identity.model.is_some() { &identity.model_name } else { &identity.board };
    let [readings, outputs] =
        [readings, outputs].map(|names| columns(names.iter().map(String::as_str), []));
    layout(name, readings, outputs, None)
}

/// Number of rows and columns of readings called `r1c1_…`, if they are all of a grid, row after row; else one row.
fn grid(readings: &[Column]) -> (usize, usize) {
    let cells: Option<Vec<[usize; 2]>> =
        readings.iter().map(|column| Some(columns::cell_of(&column.name)?.0)).collect();
    let cells = cells.unwrap_or_default();
    let width = cells.iter().take_while(|[row, _]| *row == cells[0][0]).count();
    let is_like_first = |row: &[[usize; 2]]| {
        row.len() == width
            && row
                .iter()
                .zip(&cells)
                .all(|(cell, first)| cell[1] == first[1] && cell[0] == row[0][0])
    };
    if width > 0 && cells.chunks(width).all(is_like_first) {
        (cells.len() / width, width)
    } else {
        (1, readings.len())
    }
}

/// Electrodes of outputs called `r1e1_dx_mm`, in the order of their rows.
fn electrodes(outputs: &[Column], sensor: Option<&Sensor>) -> Vec<Electrode> {
    let mut found: BTreeMap<[usize; 2], [Option<usize>; 3]> = BTreeMap::new();
    for (index, output) in outputs.iter().enumerate() {
        if let Some((place, axis)) = deformation_of(&output.name) {
            found.entry(place).or_default()[axis].get_or_insert(index);
        }
    }
    let most = |axis: usize| found.keys().map(|place| place[axis]).max().unwrap_or(0);
    let (rows, per_row) = (most(0), most(1));
    let size_mm = sensor.map_or(Sensor::paper().size_mm, |sensor| sensor.size_mm);
    let holds = |it: &&Sensor| it.row_wires >= rows && it.electrodes_per_row_wire >= per_row;
    let places: Vec<Vec<[f64; 3]>> = match sensor.filter(holds) {
        Some(sensor) => (0..rows).map(|row| sensor.row_electrodes_mm(row).to_vec()).collect(),
        None if rows == 0 => vec![],
        None => default_upper_electrodes_mm(rows, per_row, 1, size_mm)
            .chunks(per_row)
            .map(<[_]>::to_vec)
            .collect(),
    };
    let electrode = |([row, place], outputs): ([usize; 2], [Option<usize>; 3])| Electrode {
        name: format!("r{row}e{place}"),
        place_mm: places[row - 1][place - 1],
        outputs,
    };
    found.into_iter().map(electrode).collect()
}

/// Row and place of an electrode, from 1, and the axis, from 0, of a deformation in mm called `r1e2_dz_mm`.
fn deformation_of(name: &str) -> Option<([usize; 2], usize)> {
    let (row, rest) = name.strip_prefix('r')?.split_once('e')?;
    let (place, axis) = rest.split_once("_d")?;
    let axis = ["x_mm", "y_mm", "z_mm"].iter().position(|it| *it == axis)?;
    let place = [row.parse().ok()?, place.parse().ok()?];
    // Wires of larger numbers have no device.
    place.iter().all(|it| (1..=255).contains(it)).then_some((place, axis))
}

/// Names of columns, in their order.
pub fn names(columns: &[Column]) -> impl Iterator<Item = &str> {
    columns.iter().map(|column| column.name.as_str())
}

/// These `limits` of readings that are believed, if all of them are in Ω.
pub fn limits<'n>(mut names: impl Iterator<Item = &'n str>, limits: Limits) -> Option<Limits> {
    names.all(columns::is_judged_in_ohm).then_some(limits)
}

/// Whether the model of this `metadata` takes the readings of `layout`, by their names.
pub fn takes(metadata: &Metadata<'_>, layout: &Layout) -> bool {
    let inputs: Columns<'_> = metadata.input_names;
    names(&layout.readings).eq(inputs.iter())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Vec<Column> {
        columns(names.iter().copied(), [])
    }

    #[test]
    fn readings_of_all_wires_are_a_grid_and_others_one_row() {
        assert_eq!(grid(&of(&["r1c1_ohm", "r1c2_ohm", "r2c1_ohm", "r2c2_ohm"])), (2, 2));
        assert_eq!(grid(&of(&["r4c3_ohm", "r4c9_ohm"])), (1, 2));
        assert_eq!(grid(&of(&["r1c1_ohm", "r1c2_ohm", "r2c1_ohm"])), (1, 3));
        assert_eq!(grid(&of(&["r1c1_ohm", "r2c2_ohm"])), (1, 2));
        assert_eq!(grid(&of(&["force", "r1c1_ohm"])), (1, 2));
        assert_eq!(grid(&[]), (1, 0));
    }

    #[test]
    fn electrodes_have_their_outputs_and_the_places_of_the_sensor() {
        let outputs = of(&["fz_n", "r2e1_dz_mm", "r1e2_dx_mm", "r1e2_dz_mm", "r0e1_dz_mm"]);
        let found = electrodes(&outputs, None);
        let names: Vec<&str> = found.iter().map(|it| it.name.as_str()).collect();
        assert_eq!(names, ["r1e2", "r2e1"]);
        assert_eq!(found[0].outputs, [Some(2), None, Some(3)]);
        assert!(found[0].place_mm[0] > found[1].place_mm[0]);
        let sensor = Sensor::paper();
        let of_paper = electrodes(&outputs, Some(&sensor));
        assert_eq!(of_paper[1].place_mm, sensor.row_electrodes_mm(1)[0]);
        assert!(electrodes(&of(&["fz_n"]), None).is_empty());
        assert_eq!(outputs[0].unit, "N");
    }
}
