//! Where a contact is and with which force, by the outputs of a frame.

use taxel_recording::{Column, Layout};

/// Share of the greatest depth from which on an electrode counts for the place.
const SHARE: f32 = 0.3;

/// Place of what touches in mm, x, y and depth: outputs such as `contact_x_mm` or `x_mm`, or else the depth-weighted mean
/// place of the electrodes that are pressed in most.
pub fn place_mm(layout: &Layout, outputs: &[f32]) -> Option<[f32; 3]> {
    let named = |name: &str| value(layout, outputs, name);
    if let (Some(x), Some(y)) = (named("x_mm"), named("y_mm")) {
        return Some([x, y, named("depth_mm").unwrap_or(f32::NAN)]);
    }
    let pressed = layout.electrodes.iter().filter_map(|electrode| {
        Some((electrode.place_mm, outputs[electrode.outputs[2]?])).filter(|it| it.1 > 0.0)
    });
    let deepest = pressed.clone().map(|it| it.1).reduce(f32::max)?;
    let (mut sums, mut weights) = ([0.0_f64; 2], 0.0);
    for (place, depth) in pressed.filter(|it| it.1 > SHARE * deepest) {
        let weight = f64::from(depth - SHARE * deepest);
        weights += weight;
        sums.iter_mut().zip(place).for_each(|(sum, place)| *sum += weight * place);
    }
    let [x, y] = sums.map(|sum| (sum / weights) as f32);
    Some([x, y, deepest])
}

/// Force along x, y and z in N: an output such as `contact_force_n` or `force_N`, or else sums over electrodes of outputs such
/// as `r1e1_fz_n` or `fz_n`. `None` without any along z.
pub fn force_n(layout: &Layout, outputs: &[f32]) -> Option<[f32; 3]> {
    if let Some(force) = value(layout, outputs, "force_n") {
        return Some([0.0, 0.0, force]);
    }
    let sum = |axis: char| {
        let is_it = |name: &str| {
            let name = name.rsplit_once('_').filter(|(_, unit)| *unit == "n").map(|(name, _)| name);
            name.is_some_and(|name| name.rsplit('_').next() == Some(&format!("f{axis}")))
        };
        let columns = layout.outputs.iter().zip(outputs).filter(|(column, _)| is_it(&column.name));
        let values: Vec<f32> = columns.map(|(_, value)| *value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f32>()).filter(|it| it.is_finite())
    };
    let z = sum('z')?;
    Some([sum('x').unwrap_or(0.0), sum('y').unwrap_or(0.0), z])
}

/// Value of the output of this `name`, with or without `contact_` before it.
fn value(layout: &Layout, outputs: &[f32], name: &str) -> Option<f32> {
    let is_it = |column: &Column| {
        let found = column.name.to_lowercase();
        found.strip_prefix("contact_").unwrap_or(&found) == name
    };
    layout.outputs.iter().position(is_it).map(|it| outputs[it]).filter(|it| it.is_finite())
}

#[cfg(test)]
mod tests {
    use super::super::sheet;
    use super::*;

    fn layout(names: &[&str]) -> Layout {
        sheet::layout("", vec![], sheet::columns(names.iter().copied(), []), None)
    }

    #[test]
    fn the_place_is_between_the_electrodes_that_are_pressed_most() {
        let names =
            ["r1e1", "r1e2", "r1e3", "r2e1", "r2e2", "r2e3"].map(|it| format!("{it}_dz_mm"));
        let sheet = layout(&names.each_ref().map(String::as_str));
        let place = |index: usize| sheet.electrodes[index].place_mm.map(|it| it as f32);
        let [x, y, depth] = place_mm(&sheet, &[0.0, 0.5, 0.5, 0.0, 0.02, f32::NAN]).unwrap();
        assert!((x - f32::midpoint(place(1)[0], place(2)[0])).abs() < 1e-4, "{x}");
        assert!((y - place(1)[1]).abs() < 1e-4 && depth == 0.5);
        assert_eq!(place_mm(&sheet, &[f32::NAN, -0.1, 0.0, -0.2, f32::NAN, -0.1]), None);
        assert_eq!(force_n(&sheet, &[0.5; 6]), None);
    }

    #[test]
    fn outputs_of_a_contact_and_of_forces_are_taken_as_they_are() {
        let names = ["contact_x_mm", "contact_y_mm", "contact_depth_mm", "contact_force_n"];
        let outputs = [3.0, 4.0, 0.6, 1.5];
        assert_eq!(place_mm(&layout(&names), &outputs), Some([3.0, 4.0, 0.6]));
        assert_eq!(force_n(&layout(&names), &outputs), Some([0.0, 0.0, 1.5]));
        let mat = layout(&["x_mm", "y_mm", "force_N"]);
        assert_eq!(place_mm(&mat, &[3.0, 4.0, 1.5]).unwrap()[..2], [3.0, 4.0]);
        assert_eq!(force_n(&mat, &[3.0, 4.0, 1.5]), Some([0.0, 0.0, 1.5]));
        let forces = layout(&["r1e1_fz_n", "r1e2_fz_n", "gain"]);
        assert_eq!(force_n(&forces, &[0.5, 0.25, 9.0]), Some([0.0, 0.0, 0.75]));
    }
}
