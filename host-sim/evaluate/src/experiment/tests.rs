use taxel_data::{Purpose, Random, Stream};
use taxel_simulate::Synthesis;
use taxel_simulate::sensor::Sensor;

use super::*;

#[test]
fn built_in_scenes_are_valid_and_equal_the_worlds_in_code() {
    for (name, _) in crate::scenes::ALL {
        let scene = Experiment::load(name).unwrap();
        assert_eq!(scene.name, name);
        assert_eq!(scene.world.read_rows.len(), scene.world.sensor.row_wires);
        assert_eq!(scene.world.sensor == Sensor::paper(), name != "shear", "{name}");
    }
    let worlds = [World::paper(), World::press(), World::contact()];
    for (name, world) in ["paper", "press", "contact"].into_iter().zip(worlds) {
        assert_eq!(Experiment::load(name).unwrap().world, world);
    }
}

#[test]
fn listed_positions_replace_the_cells_and_must_not_touch() {
    let with_upper = |z: &str| {
        let upper = (0..48).map(|i| format!("[{i}.5, 1.0, {z}]")).collect::<Vec<_>>().join(", ");
        let listed = format!(
            "resistance_ohm_per_mm = 250.0\nstiffness_n_per_mm = [0.5, 0.6, 3.0]\n\
             upper_electrodes_mm = [{upper}]"
        );
        crate::scenes::ALL[1].1.replace("resistance_ohm_per_mm = 100.0", &listed)
    };
    let refused = Experiment::parse("test", &with_upper("0.5")).unwrap_err().to_string();
    assert!(refused.contains("they would touch"), "{refused}");
    let text = with_upper("6.0");
    let scene = Experiment::parse("test", &text).unwrap().world;
    assert_eq!(scene.sensor.upper_electrodes_mm[47], [47.5, 1.0, 6.0]);
    assert_eq!(scene.sensor.stiffness_n_per_mm, [0.5, 0.6, 3.0]);
    let default = Experiment::load("press").unwrap().world;
    assert_eq!(scene.sensor.lower_electrodes_mm, default.sensor.lower_electrodes_mm);
    let digest = |text: &str| Experiment::parse("test", text).unwrap().digest;
    assert_ne!(digest(&text), digest(crate::scenes::ALL[1].1));
}

#[test]
fn staggered_electrodes_are_those_that_a_list_gives() {
    let of_columns = "column_wires = 18\nelectrodes_per_column_wire = 3";
    let sensor = |fields: &str| {
        let fields = format!("column_wires = 12\nelectrodes_per_column_wire = 1\n{fields}");
        let text = crate::scenes::ALL[1].1.replace(of_columns, &fields);
        Experiment::parse("test", &text).unwrap().world.sensor
    };
    let x_mm = |column: usize| (column as f64 + 0.5) * 20.0 / 12.0;
    for (stagger, places_mm) in
        [(1, &[9.0][..]), (2, &[4.5, 13.5]), (4, &[2.25, 6.75, 11.25, 15.75])]
    {
        let listed = (0..12).map(|k| format!("[{:?}, {}, 0.0]", x_mm(k), places_mm[k % stagger]));
        let listed = listed.collect::<Vec<_>>().join(", ");
        let expected = sensor(&format!("lower_electrodes_mm = [{listed}]"));
        assert_eq!(sensor(&format!("lower_stagger = {stagger}")), expected);
    }
    // Places in units of half a cell, of which a row-wire has six along 20 mm.
    let upper = sensor("upper_stagger = 2").upper_electrodes_mm;
    let first_mm = |row: usize| upper[6 * row][0] * 12.0 / 20.0;
    for row in 0..8 {
        assert!((first_mm(row) - [0.5, 1.5][row % 2]).abs() < 1e-12, "row {row}");
        assert_eq!(upper[6 * row][1], Sensor::paper().upper_electrodes_mm[6 * row][1]);
    }
}

#[test]
fn each_axis_may_have_a_pitch_of_its_own() {
    let size_mm = |fields: &str| {
        let text = crate::scenes::ALL[1].1.replace("size_mm = [20.0, 18.0, 5.0]", fields);
        Experiment::parse("test", &text).unwrap().world.sensor.size_mm
    };
    let both = "pitch_x_mm = 1.5\npitch_y_mm = 2.5\nthickness_mm = 5";
    assert_eq!(size_mm(both), [27.0, 20.0, 5.0]);
    let one = "pitch_mm = 1.0\npitch_y_mm = 2.5\nthickness_mm = 5";
    assert_eq!(size_mm(one), [18.0, 20.0, 5.0]);
}

#[test]
fn forces_have_their_own_full_scale_and_values() {
    let text = crate::scenes::ALL[0]
        .1
        .replace("quantity = \"deformation\"", "quantity = \"force\"")
        .replace("axes = [\"x\", \"y\", \"z\"]", "axes = [\"x\", \"z\"]");
    let scene = Experiment::parse("test", &text).unwrap().world;
    assert_eq!(scene.full_scales()[..3], [1.0, 2.0, 1.0]);
    let Outputs::Electrodes(outputs) = &scene.outputs else { panic!("outputs of electrodes") };
    let per_mm = outputs.axes.iter().map(|axis| outputs.per_mm(&scene.sensor, *axis));
    assert_eq!(per_mm.collect::<Vec<_>>(), [1.0, 2.0]);
    assert_eq!(scene.output_names()[1], "r1e1_fz_n");
}

#[test]
fn full_scales_are_the_face_and_the_largest_contact() {
    let scene = Experiment::load("contact").unwrap();
    let [x, y, depth, force] = scene.world.full_scales()[..] else { panic!("four outputs") };
    assert_eq!((x, y, depth), (20.0, 18.0, 1.0));
    // The largest dent, 1 mm deep and 5 mm in radius, in the middle of the face: 0.2667 N/mm³ × 157 mm³, less what
    // lies beyond the face, 4.55 % along x and 7.19 % along y.
    let whole = 2.0 * 48.0 / 360.0 * std::f64::consts::TAU * 25.0;
    assert!((force / whole - (1.0 - 0.0455) * (1.0 - 0.0719)).abs() < 1e-4, "{force}");
}

#[test]
fn counts_are_checked_before_memory_is_taken_for_them() {
    let (row, column) = ("electrodes_per_row_wire = 6", "electrodes_per_column_wire = 3");
    for (field, count, huge) in [
        ("sensor.row_wires", "\nrow_wires = 8", "1000000000"),
        ("sensor.electrodes_per_row_wire", row, "6666666666666666662"),
        ("sensor.electrodes_per_row_wire", row, "100000000000"),
        ("sensor.column_wires", "\ncolumn_wires = 18", "10001"),
        ("sensor.electrodes_per_column_wire", column, "1001"),
    ] {
        let name = count.split(" = ").next().unwrap();
        let text = crate::scenes::ALL[1].1.replace(count, &format!("{name} = {huge}"));
        let refused = Experiment::parse("test", &text).unwrap_err().to_string();
        assert!(refused.contains(&format!("{field} = {huge}: it must be from 1 to")), "{refused}");
    }
}

#[test]
fn scenes_that_take_hours_to_compute_are_refused() {
    let of_columns = "\ncolumn_wires = 18\nelectrodes_per_column_wire = 3";
    let wires = |electrodes: u32| {
        format!("\ncolumn_wires = 10000\nelectrodes_per_column_wire = {electrodes}")
    };
    let huge = crate::scenes::ALL[1].1.replace(of_columns, &wires(1000));
    let refused = Experiment::parse("test", &huge).unwrap_err().to_string();
    assert!(refused.contains("48 × 10000000 electrodes"), "{refused}");
    // A row of 1000 electrodes has as many pairs with fewer lower electrodes, which are laid out sooner.
    let one = huge.replace("\nrow_wires = 8", "\nrow_wires = 1");
    let long = "\nelectrodes_per_row_wire = 1000";
    let long = one.replace("\nelectrodes_per_row_wire = 6", long).replace(&wires(1000), &wires(6));
    let refused = Experiment::parse("test", &long).unwrap_err().to_string();
    assert!(refused.contains("training.frames") && refused.contains("take hours"), "{refused}");
    let large = one.replace(&wires(1000), &wires(20));
    let scene = Experiment::parse("test", &large).unwrap();
    // Laid out in linear time: a second where a look at all pairs takes many.
    let frames = Synthesis::new(&scene.world).frames(Stream::Test, 1);
    assert!(frames.inputs.values.iter().all(|reading| *reading > 0.0));
}

#[test]
fn deep_nesting_is_refused_and_quoted_in_part_only() {
    let refused = Experiment::parse("test", &format!("name = {}", "[".repeat(200_000)));
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("recurs") && refused.len() < 1000, "{} bytes", refused.len());
}

/// Scenes with a character or a digit changed, cut short, or with a line of another place.
#[test]
fn a_damaged_scene_is_refused_or_gives_positive_readings() {
    let mut random = Random::new(1, Stream::Test, Purpose::Damage, 0, 0);
    let mut taken = 0;
    for case in 0..600 {
        let (_, text) = crate::scenes::ALL[case % crate::scenes::ALL.len()];
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let [at, from] = [0; 2].map(|_| random.below(lines.len()));
        match random.below(4) {
            0 => lines.truncate(at),
            1 => lines[at] = lines[from].clone(),
            change => {
                let line = &mut lines[at];
                let digits = line.char_indices().filter(|(_, letter)| letter.is_ascii_digit());
                let places: Vec<usize> = digits.map(|(place, _)| place).collect();
                if places.is_empty() || change == 2 {
                    line.pop();
                } else {
                    let place = places[random.below(places.len())];
                    line.replace_range(
                        place..=place,
                        ["-", "9e9", "nan", ".", "0"][random.below(5)],
                    );
                }
            }
        }
        let Ok(experiment) = Experiment::parse("damaged", &lines.join("\n")) else { continue };
        let sensor = &experiment.world.sensor;
        if sensor.upper_electrodes_mm.len() * sensor.lower_electrodes_mm.len() > 20_000 {
            continue;
        }
        taken += 1;
        let frames = Synthesis::new(&experiment.world).ideal().frames(Stream::Training, 2);
        let readings = &frames.inputs.values;
        assert!(readings.iter().all(|ohm| ohm.is_finite() && *ohm > 0.0), "{}", lines.join("\n"));
    }
    assert!((100..600).contains(&taken), "{taken} scenes were taken");
}
