//! What a scene must satisfy. Every message names the field, its value and the fix.

use firmware::readout::ScanSettings;

use super::{Deformation, Scene, Sensor, Table1, Training};
use crate::spread::check_spread;

type Check = Result<(), String>;

pub(super) fn validate(scene: &Scene) -> Check {
    let name_ok = !scene.name.is_empty()
        && scene.name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    require(name_ok, || {
        format!("name = {:?}: it names a folder; use letters, digits, - and _", scene.name)
    })?;
    sensor(&scene.sensor)?;
    deformation(scene)?;
    noise_level("noise.level", scene.noise.level)?;
    readout(scene)?;
    outputs(scene)?;
    training(&scene.training)?;
    scene.table1.as_ref().map_or(Ok(()), table1)?;
    let t = &scene.training;
    let mut counts = vec![("training.frames", t.frames), ("training.test_frames", t.test_frames)];
    if let Some(t) = &scene.table1 {
        counts.extend([("table1.frames", t.frames), ("table1.test_frames", t.test_frames)]);
    }
    counts.into_iter().try_for_each(|(field, frames)| size(scene, field, frames))
}

/// Most numbers that one data set may hold: 4 GB.
const MOST_VALUES: usize = 500_000_000;

/// Checks that `frames` of `scene` fit in memory.
pub(super) fn size(scene: &Scene, field: &str, frames: usize) -> Check {
    let of_a_frame = scene.read_rows.len()
        * (scene.sensor.column_wires
            + scene.sensor.electrodes_per_row_wire * scene.outputs.axes.len());
    let most = MOST_VALUES / of_a_frame;
    require((1..=most).contains(&frames), || {
        format!(
            "{field} = {frames}: give from 1 to {most} frames; a frame has {of_a_frame} numbers, \
             and a data set of more than {MOST_VALUES} does not fit in memory"
        )
    })
}

fn require(holds: bool, message: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err(message()) }
}

fn positive(field: &str, value: f64) -> Check {
    require(value.is_finite() && value > 0.0, || {
        format!("{field} = {value:?}: it must be a positive number")
    })
}

fn count(field: &str, value: usize, most: usize) -> Check {
    require((1..=most).contains(&value), || {
        format!("{field} = {value}: it must be from 1 to {most}")
    })
}

fn sensor(sensor: &Sensor) -> Check {
    count("sensor.row_wires", sensor.row_wires, 255)?;
    count("sensor.electrodes_per_row_wire", sensor.electrodes_per_row_wire, 1000)?;
    count("sensor.column_wires", sensor.column_wires, 10_000)?;
    count("sensor.electrodes_per_column_wire", sensor.electrodes_per_column_wire, 1000)?;
    for (axis, value) in ["x", "y", "z"].iter().zip(sensor.size_mm) {
        positive(&format!("sensor.size_mm ({axis})"), value)?;
    }
    for (axis, value) in ["x", "y", "z"].iter().zip(sensor.stiffness_n_per_mm) {
        positive(&format!("sensor.stiffness_n_per_mm ({axis})"), value)?;
    }
    positive("sensor.resistance_ohm_per_mm", sensor.resistance_ohm_per_mm)?;
    for (field, list, expected, of) in [
        (
            "sensor.upper_electrodes_mm",
            &sensor.upper_electrodes_mm,
            sensor.row_wires * sensor.electrodes_per_row_wire,
            "row_wires × electrodes_per_row_wire",
        ),
        (
            "sensor.lower_electrodes_mm",
            &sensor.lower_electrodes_mm,
            sensor.column_wires * sensor.electrodes_per_column_wire,
            "column_wires × electrodes_per_column_wire",
        ),
    ] {
        require(list.len() == expected, || {
            format!("{field} lists {} positions: {of} asks for {expected}", list.len())
        })?;
        require(list.as_flattened().iter().all(|v| v.is_finite()), || {
            format!("{field} holds a number that is not finite: give every position in mm")
        })?;
    }
    Ok(())
}

fn deformation(scene: &Scene) -> Check {
    let ranges = match scene.deformation {
        Deformation::Independent { dx_mm, dy_mm, dz_mm } => {
            vec![("dx_mm", dx_mm), ("dy_mm", dy_mm), ("dz_mm", dz_mm)]
        }
        Deformation::Press { dent_radius_mm, dent_depth_mm, shear_ratio } => {
            positive("deformation.dent_radius_mm (low)", dent_radius_mm[0])?;
            require(dent_depth_mm[0] >= 0.0, || {
                format!("deformation.dent_depth_mm = {dent_depth_mm:?}: a depth is not negative")
            })?;
            require(shear_ratio[0] >= 0.0, || {
                format!("deformation.shear_ratio = {shear_ratio:?}: a ratio is not negative")
            })?;
            vec![
                ("dent_radius_mm", dent_radius_mm),
                ("dent_depth_mm", dent_depth_mm),
                ("shear_ratio", shear_ratio),
            ]
        }
    };
    for (field, [low, high]) in ranges {
        require(low.is_finite() && high.is_finite() && low <= high, || {
            format!("deformation.{field} = [{low}, {high}]: give [low, high] with low ≤ high")
        })?;
    }
    let moves = scene.deformation_range_mm();
    require(moves.as_flattened().iter().any(|v| *v != 0.0), || {
        "deformation: nothing can move; widen a range".to_owned()
    })?;
    let most = scene.sensor.largest_deformation_mm();
    for (axis, range) in ["x", "y", "z"].iter().zip(moves) {
        let largest = range[0].abs().max(range[1].abs());
        require(scene.sensor.holds_for(largest), || {
            format!(
                "deformation reaches {largest} mm along {axis}: the sensor model holds up to 20 % \
                 of the thickness, {most} mm; narrow the range"
            )
        })?;
    }
    let lowest_upper = lowest(scene.sensor.upper_electrodes_mm.iter().map(|p| p[2])) - moves[2][1];
    let highest_lower = -lowest(scene.sensor.lower_electrodes_mm.iter().map(|p| -p[2]));
    require(lowest_upper > highest_lower, || {
        format!(
            "upper electrodes come down to z = {lowest_upper} mm and lower ones reach \
             {highest_lower} mm: they would touch; raise sensor.upper_electrodes_mm"
        )
    })
}

fn lowest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

pub(super) fn noise_level(field: &str, level: f64) -> Check {
    require((0.0..=1.0).contains(&level), || {
        format!("{field} = {level}: it is a fraction from 0 to 1 (0.005 is 0.5 %)")
    })
}

fn readout(scene: &Scene) -> Check {
    let (rows, most) = (&scene.read_rows, scene.sensor.row_wires);
    let ascending = rows.windows(2).all(|pair| pair[0] < pair[1]);
    let listed = || rows.iter().map(|row| row.wrapping_add(1)).collect::<Vec<_>>();
    require(!rows.is_empty() && ascending && rows.iter().all(|row| *row < most), || {
        format!("readout.row_wires = {:?}: list rows from 1 to {most}, ascending", listed())
    })?;
    let r = &scene.readout;
    let whole = |field: &str, value: Option<u32>, [low, high]: [u32; 2]| {
        require(value.is_none_or(|value| (low..=high).contains(&value)), || {
            let value = value.unwrap_or_default();
            format!("readout.{field} = {value}: it must be from {low} to {high}")
        })
    };
    let most_oversampling = ScanSettings::MOST_OVERSAMPLING.into();
    whole("adc_bits", r.adc_bits.map(u32::from), [4, 12])?;
    whole("oversampling", r.oversampling.map(u32::from), [1, most_oversampling])?;
    whole("settling_us", r.settling_us, [0, ScanSettings::MOST_SETTLING_US])?;
    for (field, value, most) in [
        ("row_switch_ohm", r.row_switch_ohm, 1e3),
        ("line_ohm", r.line_ohm, 1e3),
        ("op_amp_offset_v", r.op_amp_offset_v, 0.1),
        ("adc_noise_counts", r.adc_noise_counts, 100.0),
        ("time_constant_us", r.time_constant_us, 1e3),
    ] {
        require(value.is_none_or(|value| (0.0..=most).contains(&value)), || {
            let value = value.unwrap_or_default();
            format!("readout.{field} = {value}: it must be from 0 to {most}")
        })?;
    }
    for (field, value) in [("row_switch_ohm", r.row_switch_ohm), ("line_ohm", r.line_ohm)] {
        let shared = value.unwrap_or_default();
        require(shared == 0.0 || r.cross_talk == Some(true), || {
            format!(
                "readout.{field} = {shared}: what the readings of a wire share couples them; set \
                 readout.cross_talk = true, or leave {field} out"
            )
        })?;
    }
    Ok(())
}

fn outputs(scene: &Scene) -> Check {
    let axes = &scene.outputs.axes;
    let ascending = axes.windows(2).all(|pair| pair[0].index() < pair[1].index());
    require(!axes.is_empty() && ascending, || {
        let letters: Vec<char> = axes.iter().map(|axis| axis.letter()).collect();
        format!(
            "outputs.axes = {letters:?}: list at least one of \"x\", \"y\", \"z\", each once, always in \
             the order x, y, z"
        )
    })
}

fn training(t: &Training) -> Check {
    frames("training", t.frames, t.test_frames, t.centres)?;
    check_spread("training.spread", t.spread)
}

fn table1(t: &Table1) -> Check {
    frames("table1", t.frames, t.test_frames, t.centres)?;
    require(!t.spreads.is_empty(), || "table1.spreads is empty: list at least one".to_owned())?;
    require(!t.noise_levels.is_empty(), || {
        "table1.noise_levels is empty: list at least one".to_owned()
    })?;
    for spread in &t.spreads {
        check_spread("table1.spreads", *spread)?;
    }
    for level in &t.noise_levels {
        noise_level("table1.noise_levels", *level)?;
    }
    require((2..=2000).contains(&t.standard_frames) && t.standard_frames <= t.frames, || {
        format!(
            "table1.standard_frames = {}: it must be from 2 to 2000 (work grows with its cube) and \
             at most table1.frames = {}",
            t.standard_frames, t.frames
        )
    })
}

fn frames(section: &str, frames: usize, test_frames: usize, centres: usize) -> Check {
    count(&format!("{section}.centres"), centres, 65_535)?;
    require(frames >= 2, || format!("{section}.frames = {frames}: it must be at least 2"))?;
    require(test_frames > 0, || format!("{section}.test_frames = 0: it must be at least 1"))?;
    require(centres < frames, || {
        format!(
            "{section}.centres = {centres}: there must be fewer centres than training frames \
             ({frames}); lower it or raise {section}.frames"
        )
    })
}
