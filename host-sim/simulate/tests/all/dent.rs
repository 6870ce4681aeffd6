//! Contacts: their depths, forces and motions.

use std::f64::consts::TAU;

use taxel_data::{LANES, Stream};
use taxel_simulate::contact::Contact;
use taxel_simulate::motion::{Dent, Draws, Kind, Mix, Motion, Part};
use taxel_simulate::profile::Profile;
use taxel_simulate::sensor::{Sensor, Vector3};

/// Contact 0.5 mm deep, sheared by up to 0.4, with these values of its quantities.
fn dent(profile: Profile, values: &[f64]) -> Dent {
    let ranges: Vec<[f64; 2]> = values.iter().map(|value| [*value; 2]).collect();
    Dent::new(profile, &ranges, [[0.5; 2], [0.0, 0.4]])
}

/// Contact of each profile.
fn dents() -> [Dent; 6] {
    [
        dent(Profile::Press, &[3.0]),
        dent(Profile::Punch, &[2.0, 0.5]),
        dent(Profile::Edge, &[9.0, 1.5, 30.0]),
        dent(Profile::Ellipse, &[2.5, 3.0, 120.0]),
        dent(Profile::Tail, &[4.0]),
        dent(Profile::Pair, &[2.0, 7.0, 50.0, 0.6]),
    ]
}

/// The contact at a place on the paper's face, the same in all lanes.
fn at(dent: Dent, centre_mm: [f64; 2]) -> Contact {
    let sensor = Sensor::paper();
    let [x, y] = [0, 1].map(|axis| centre_mm[axis] / sensor.size_mm[axis]);
    let mut units = vec![[0.5; LANES]; 3 + dent.profile.quantities().len()];
    units[..2].copy_from_slice(&[[x; LANES], [y; LANES]]);
    dent.of_units(units, &[[0.3; LANES], [0.1; LANES]], &sensor)
}

/// Compression in mm of a contact at these places on the face.
fn compression_mm(contact: &Contact, places_mm: &[[f64; 2]]) -> Vec<f64> {
    let electrodes: Vec<Vector3> = places_mm.iter().map(|[x, y]| [*x, *y, 5.0]).collect();
    let mut delta = vec![[[0.0; LANES]; 3]; electrodes.len()];
    contact.deform(&electrodes, &mut delta);
    delta.iter().map(|delta| delta[2][LANES - 1]).collect()
}

#[test]
fn dents_have_the_depths_computed_by_hand() {
    let check = |profile, values: &[f64], centre_mm, expected: &[([f64; 2], f64)]| {
        let contact = at(dent(profile, values), centre_mm);
        for (place, expected) in expected {
            let found = compression_mm(&contact, &[*place])[0];
            assert!((found - expected).abs() < 1e-6, "{profile:?} {place:?}: {found}");
        }
    };
    let middle = [10.0, 9.0];
    // Flat to 2 mm; 0.5·e⁻¹ half a millimetre farther, and 0.5·e⁻² one millimetre.
    let expected = [([11.2, 7.4], 0.5), ([12.5, 9.0], 0.183_939_7), ([10.0, 12.0], 0.067_667_6)];
    check(Profile::Punch, &[2.0, 0.5], middle, &expected);
    // Along x, of a length of 3 deviations to each side: the end has (Φ(6) − ½)/(2Φ(3) − 1) of the depth.
    let expected = [(middle, 0.5), ([13.0, 9.0], 0.250_676_7), ([10.0, 10.0], 0.303_265_3)];
    check(Profile::Edge, &[6.0, 1.0, 0.0], middle, &expected);
    // Turned by 90°, the line is along y.
    let expected = [(middle, 0.5), ([10.0, 12.0], 0.250_676_7), ([11.0, 9.0], 0.303_265_3)];
    check(Profile::Edge, &[6.0, 1.0, 90.0], middle, &expected);
    // Radii of 4 and 1 mm: one deviation away along either, 0.5·e^(−½) is left.
    let expected = [(middle, 0.5), ([14.0, 9.0], 0.303_265_3), ([10.0, 10.0], 0.303_265_3)];
    check(Profile::Ellipse, &[2.0, 4.0, 0.0], middle, &expected);
    // 45°: √8 along each axis are 4 mm, and √½ to one side are 1 mm.
    let (far, near) = (8.0_f64.sqrt(), 0.5_f64.sqrt());
    let [along, across] = [[10.0 + far, 9.0 + far], [10.0 - near, 9.0 + near]];
    let expected = [(along, 0.303_265_3), (across, 0.303_265_3)];
    check(Profile::Ellipse, &[2.0, 4.0, 45.0], middle, &expected);
    // At ρ = s: 2^(−5/2) of the depth; at 2s: 5^(−5/2).
    let expected = [(middle, 0.5), ([8.0, 9.0], 0.088_388_3), ([10.0, 13.0], 0.008_944_3)];
    check(Profile::Tail, &[2.0], middle, &expected);
    // Two dents 4 radii apart: each has e⁻⁸ of the other's depth, and their middle e⁻² of both.
    let expected = [(middle, 0.500_100_6), ([14.0, 9.0], 0.300_167_7), ([12.0, 9.0], 0.108_268_2)];
    check(Profile::Pair, &[1.0, 4.0, 0.0, 0.6], middle, &expected);
    // Where the second would leave the face, it lies on the other side.
    let expected = [([13.0, 9.0], 0.300_167_7), ([20.0, 9.0], 0.005_554_5)];
    check(Profile::Pair, &[1.0, 4.0, 0.0, 0.6], [17.0, 9.0], &expected);
}

#[test]
fn dents_are_as_wide_as_the_gaussian_ones_that_stand_for_them() {
    for dent in dents() {
        let radius_mm = dent.as_press().unwrap().quantities[0][0];
        // An edge along x is as wide across; an ellipse has the volume of the round dent, and a pair its radius.
        let dent = match dent.profile {
            Profile::Ellipse | Profile::Pair => continue,
            Profile::Edge => Dent { quantities: [[9.0; 2], [1.5; 2], [0.0; 2], [0.0; 2]], ..dent },
            _ => dent,
        };
        let places = [[10.0, 9.0 + radius_mm * (2.0 * std::f64::consts::LN_2).sqrt()]];
        let found = compression_mm(&at(dent, [10.0, 9.0]), &places)[0];
        assert!((found - 0.25).abs() < 1e-4, "{dent:?}: {found}");
    }
}

#[test]
fn the_force_is_the_integral_of_the_pressure_over_the_face() {
    let sensor = Sensor::paper();
    // 2 N/mm an electrode, 48 of them on 20 mm × 18 mm.
    let stiffness = sensor.foundation_n_per_mm3();
    assert!((stiffness - 2.0 * 48.0 / 360.0).abs() < 1e-15);
    // A round dent has the volume 2π·s²·d; on a face of 10 deviations to each side all of it, at a corner a quarter.
    let small = dent(Profile::Press, &[0.9]);
    for (centre_mm, share) in [([10.0, 9.0], 1.0), ([0.0, 18.0], 0.25)] {
        let expected = share * TAU * 0.81 * 0.5 * stiffness;
        let found = at(small, centre_mm).force_n(&sensor)[0];
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} N for {expected} N");
    }
    // Sum over cells of 0.05 mm × 0.05 mm.
    let cell = 0.05;
    let middle = |i: u32| (f64::from(i) + 0.5) * cell;
    let cells: Vec<[f64; 2]> =
        (0..400).flat_map(|i| (0..360).map(move |j| [middle(i), middle(j)])).collect();
    for dent in dents() {
        for centre_mm in [[10.0, 9.0], [0.0, 18.0], [17.5, 4.0], [0.01, 9.0]] {
            let contact = at(dent, centre_mm);
            // A cell a lane: moving the contact is moving the place.
            let (mut moved, mut sum) = (contact.clone(), 0.0);
            for cells in cells.chunks_exact(LANES) {
                moved.centre_mm =
                    [0, 1].map(|axis| std::array::from_fn(|it| centre_mm[axis] - cells[it][axis]));
                let mut delta = [[[0.0; LANES]; 3]];
                moved.deform(&[[0.0; 3]], &mut delta);
                sum += delta[0][2].iter().sum::<f64>();
            }
            let (found, expected) =
                (contact.force_n(&sensor)[LANES - 1], sum * stiffness * cell * cell);
            let within = if dent.profile == Profile::Punch { 5e-3 } else { 1e-4 };
            assert!(
                (found / expected - 1.0).abs() < within,
                "{dent:?} {centre_mm:?}: {found} N, {expected} N"
            );
        }
    }
}

#[test]
fn a_contact_follows_its_path_and_keeps_its_shear_and_form() {
    let sensor = Sensor::paper();
    let motions = dents().map(Kind::from).into_iter().chain([mix([1.0, 1.0]).into()]);
    for motion in motions {
        let mut draws = Draws::new(1, Stream::Test, 0);
        let mut moved = motion.start(&sensor, &mut draws);
        let form = moved.contact().unwrap().form;
        moved.move_to([[8.0; LANES], [7.5; LANES]], [0.3; LANES]);
        let contact = moved.contact().unwrap();
        assert_eq!((contact.form, contact.dent_depth_mm), (form, [0.3; LANES]));
        let mut delta = [[[0.0; LANES]; 3]];
        contact.deform(&[[8.0, 7.5, 5.0]], &mut delta);
        let [dx, dy, dz] = delta[0].map(|lanes| lanes[5]);
        // The second dent of a pair adds to the first.
        assert!((0.3 - 1e-12..0.35).contains(&dz), "{motion:?}: {dz} mm");
        for (found, sheared) in [dx, dy].into_iter().zip(contact.shear_mm()) {
            assert!((found - sheared[5] / 0.3 * dz).abs() < 1e-12);
        }
        assert!(dx.hypot(dy) <= 0.4 * dz && dx.hypot(dy) > 0.0, "{motion:?}: {dx} {dy} mm");
        moved.move_to([[8.0; LANES], [7.5; LANES]], [0.0; LANES]);
        assert_eq!(compression_mm(moved.contact().unwrap(), &[[8.0, 7.5]]), [0.0]);
    }
}

#[test]
fn no_dent_leaves_the_range_that_a_motion_states() {
    // Two dents of 3 mm, 4 mm apart, are deepest between their centres.
    let pair = dent(Profile::Pair, &[3.0, 4.0, 0.0, 1.0]);
    let along: Vec<[f64; 2]> = (0..400).map(|i| [0.05 * f64::from(i), 9.0]).collect();
    let contact = at(pair, [8.0, 9.0]);
    let deepest = compression_mm(&contact, &along).into_iter().fold(0.0, f64::max);
    let [[_, sheared], _, [_, stated]] = pair.range_mm();
    assert!(deepest > 0.79 && deepest <= stated && stated < 0.91, "{deepest} {stated}");
    assert!((sheared - 0.4 * stated).abs() < 1e-12);
    assert_eq!(pair.deepest_mm(), 0.5);
}

#[test]
fn settings_that_cannot_be_used_are_refused_by_name() {
    for dent in dents() {
        dent.check().unwrap();
    }
    let with = |at: usize, range: [f64; 2], mut dent: Dent| {
        dent.quantities[at] = range;
        dent
    };
    let [press, punch, edge, ellipse, _, pair] = dents();
    for (dent, expected) in [
        (with(1, [0.0, 1.0], punch), "deformation.decay_mm (low) = 0.0: it must be a positive"),
        (with(1, [0.5, 2.0], ellipse), "aspect_ratio (low) = 0.5: it must be from 1 to 100"),
        (with(3, [0.5, 1.5], pair), "second_depth_ratio (high) = 1.5"),
        (with(2, [90.0, 0.0], edge), "direction_deg = [90, 0]: give [low, high]"),
        (Dent { dent_depth_mm: [-0.1, 1.0], ..press }, "dent_depth_mm"),
        (Dent { shear_ratio: [f64::NAN; 2], ..press }, "shear_ratio"),
    ] {
        let refused = dent.check().unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}

fn mix(weights: [f64; 2]) -> Mix {
    let [press, .., tail, _] = dents();
    let parts = weights.into_iter().zip([press.into(), tail.into()]);
    Mix { parts: parts.map(|(weight, deformation)| Part { weight, deformation }).collect() }
}

#[test]
fn a_mix_draws_each_part_by_its_weight_and_the_same_as_alone() {
    let (sensor, mix, [press, .., tail, _]) = (Sensor::paper(), mix([3.0, 1.0]), dents());
    let mut presses = 0_i32;
    let seen = |contact: &Contact| {
        let mut delta = [[[0.0; LANES]; 3]; 2];
        contact.deform(&[[4.0, 3.0, 5.0], [12.0, 10.0, 5.0]], &mut delta);
        (delta, contact.force_n(&sensor))
    };
    for first in (0..64_000).step_by(LANES) {
        let mut draws = Draws::new(1, Stream::Test, first);
        let mixed = mix.draw_contact(&sensor, &mut draws).unwrap();
        presses += mixed.profile.iter().map(|it| i32::from(*it == Profile::Press)).sum::<i32>();
        if first > 2000 {
            continue;
        }
        let alone = [press, tail].map(|it| seen(&it.draw_contact(&sensor, &mut draws).unwrap()));
        let (deltas, forces) = seen(&mixed);
        for lane in 0..LANES {
            let (expected, force) = &alone[usize::from(mixed.profile[lane] == Profile::Tail)];
            assert_eq!(forces[lane], force[lane]);
            for (found, expected) in deltas.as_flattened().iter().zip(expected.as_flattened()) {
                assert_eq!(found[lane], expected[lane]);
            }
        }
    }
    // Three quarters of 64,000, within five standard deviations.
    assert!((presses - 48_000).abs() < 550, "{presses}");
}

#[test]
fn a_mix_has_the_ranges_of_all_parts_and_refuses_other_motions() {
    let mut mixed = mix([1.0, 2.0]);
    let shallow = [[0.0, 0.9], [0.0; 2]];
    mixed.parts[0].deformation = Dent::new(Profile::Press, &[[1.0, 2.0]], shallow).into();
    assert_eq!(mixed.range_mm(), [[-0.2, 0.2], [-0.2, 0.2], [0.0, 0.9]]);
    // A path may take every part no deeper than the shallowest goes.
    assert_eq!(mixed.deepest_mm(), 0.5);
    assert_eq!(mixed.as_press().unwrap().dent_depth_mm, [0.5; 2]);
    let refused = |mix: Mix| mix.check().unwrap_err().to_string();
    assert!(refused(Mix { parts: vec![] }).contains("deformation.parts = 0 parts"));
    assert!(refused(mix([1.0, -1.0])).contains("deformation.parts (2).weight = -1.0"));
    let mut nested = mix([1.0, 1.0]);
    nested.parts[0].deformation = mix([1.0, 1.0]).into();
    assert!(
        refused(nested).contains("deformation.parts (1).kind = mix: a mix consists of contacts")
    );
    let mut bad = mix([1.0, 1.0]);
    bad.parts[1].deformation = dent(Profile::Punch, &[2.0, -1.0]).into();
    assert!(refused(bad).contains("deformation.parts (2).decay_mm (low) = -1.0"));
}
