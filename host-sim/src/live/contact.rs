//! The contact that a frame's outputs tell of.

use taxel_recording::{Contact, Layout};

/// Least depth in mm that counts as a contact, and least multiple of an output's standard deviation where that is known. A
/// contact ends at half of these: it does not flicker.
const LEAST_DEPTH_MM: f32 = 0.1;
const LEAST_DEVIATIONS: f32 = 4.0;
/// Least force in N that counts as a contact, where no depth is known.
const LEAST_FORCE_N: f32 = 0.1;
/// Share of the greatest depth from which on an electrode counts for the place.
const SHARE: f32 = 0.3;

/// The contact that `outputs` tell of, if something touches: the outputs called `contact_…`, or else the depth-weighted mean
/// place of the electrodes that are pressed in most. Forces are sums over electrodes. `was_touched` says whether there was one in
/// the frame before.
pub fn contact(
    layout: &Layout,
    outputs: &[f32],
    deviations: Option<&[f32]>,
    was_touched: bool,
) -> Option<Contact> {
    let share = if was_touched { 0.5 } else { 1.0 };
    let named = |name: &str| {
        let column = layout.outputs.iter().position(|column| column.name == name)?;
        Some(outputs[column]).filter(|value| value.is_finite())
    };
    let is_touched = |depth_mm: f32, output: usize| {
        let deviation = deviations.map_or(0.0, |it| it[output]);
        depth_mm > share * LEAST_DEPTH_MM && depth_mm > share * LEAST_DEVIATIONS * deviation
    };
    let force_n = force_n(layout, outputs);
    if let (Some(x), Some(y)) = (named("contact_x_mm"), named("contact_y_mm")) {
        let depth = named("contact_depth_mm").unwrap_or(f32::NAN);
        let force_n = named("contact_force_n").map(|force| [0.0, 0.0, force]).or(force_n);
        let of_depth = layout.outputs.iter().position(|it| it.name == "contact_depth_mm");
        let touches = match of_depth.filter(|_| depth.is_finite()) {
            Some(output) => is_touched(depth, output),
            None => force_n.is_some_and(|it| it[2] > share * LEAST_FORCE_N),
        };
        return touches.then_some(Contact { place_mm: [x, y, depth], force_n });
    }
    let pressed = layout.electrodes.iter().filter_map(|electrode| {
        let output = electrode.outputs[2]?;
        Some((electrode.place_mm, outputs[output], output)).filter(|it| it.1.is_finite())
    });
    let deepest = pressed.clone().max_by(|a, b| a.1.total_cmp(&b.1))?;
    if !is_touched(deepest.1, deepest.2) {
        return None;
    }
    let (mut sums, mut weights) = ([0.0_f64; 2], 0.0);
    for (place, depth, _) in pressed.filter(|it| it.1 > SHARE * deepest.1) {
        let weight = f64::from(depth - SHARE * deepest.1);
        weights += weight;
        sums.iter_mut().zip(place).for_each(|(sum, place)| *sum += weight * place);
    }
    let [x, y] = sums.map(|sum| (sum / weights) as f32);
    Some(Contact { place_mm: [x, y, deepest.1], force_n })
}

/// Sum of the forces along x, y and z in N, of outputs called `r1e1_fz_n` or `fz_n`; `None` without any along z.
fn force_n(layout: &Layout, outputs: &[f32]) -> Option<[f32; 3]> {
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

#[cfg(test)]
mod tests {
    use super::super::sheet;
    use super::*;

    fn layout(names: &[&str]) -> Layout {
        sheet::layout("", vec![], sheet::columns(names.iter().copied(), []), None)
    }

    #[test]
    fn the_place_is_between_the_electrodes_that_are_pressed_most() {
        let sheet = layout(&[
            "r1e1_dz_mm",
            "r1e2_dz_mm",
            "r1e3_dz_mm",
            "r2e1_dz_mm",
            "r2e2_dz_mm",
            "r2e3_dz_mm",
        ]);
        let place = |index: usize| sheet.electrodes[index].place_mm.map(|it| it as f32);
        let found = contact(&sheet, &[0.0, 0.5, 0.5, 0.0, 0.02, f32::NAN], None, false).unwrap();
        assert!(
            (found.place_mm[0] - f32::midpoint(place(1)[0], place(2)[0])).abs() < 1e-4,
            "{found:?}"
        );
        assert!((found.place_mm[1] - place(1)[1]).abs() < 1e-4 && found.place_mm[2] == 0.5);
        assert_eq!(found.force_n, None);
        assert!(contact(&sheet, &[0.0, 0.09, 0.0, 0.0, 0.0, 0.0], None, false).is_none());
        // A contact ends later than it begins.
        assert!(contact(&sheet, &[0.0, 0.09, 0.0, 0.0, 0.0, 0.0], None, true).is_some());
        let unsure = [0.2; 6];
        assert!(contact(&sheet, &[0.0, 0.5, 0.5, 0.0, 0.0, 0.0], Some(&unsure), false).is_none());
        assert!(contact(&sheet, &[f32::NAN; 6], None, false).is_none());
    }

    #[test]
    fn outputs_of_a_contact_and_of_forces_are_taken_as_they_are() {
        let names = ["contact_x_mm", "contact_y_mm", "contact_depth_mm", "contact_force_n"];
        let found = contact(&layout(&names), &[3.0, 4.0, 0.6, 1.5], None, false).unwrap();
        assert_eq!(found, Contact { place_mm: [3.0, 4.0, 0.6], force_n: Some([0.0, 0.0, 1.5]) });
        assert!(contact(&layout(&names), &[3.0, 4.0, 0.01, 0.0], None, false).is_none());
        assert_eq!(
            force_n(&layout(&["r1e1_fz_n", "r1e2_fz_n", "gain"]), &[0.5, 0.25, 9.0]),
            Some([0.0, 0.0, 0.75])
        );
    }
}
