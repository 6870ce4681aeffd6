use taxel_data::Stream;

use super::*;
use crate::motion::{Edge, Ellipse, Kind, Mix, Pair, Part, Punch, Tail};

/// Contacts of each kind, 0.5 mm deep and sheared by up to 0.4, with forms that a test fixes.
fn kinds() -> [(&'static str, Kind); 6] {
    let (dent_depth_mm, shear_ratio) = ([0.5; 2], [0.0, 0.4]);
    [
        ("press", Press { dent_radius_mm: [3.0; 2], dent_depth_mm, shear_ratio }.into()),
        ("punch", punch(2.0, 0.5).into()),
        ("edge", edge(9.0, 1.5, 30.0).into()),
        ("ellipse", ellipse(2.5, 3.0, 120.0).into()),
        ("tail", Tail { cover_mm: [4.0; 2], dent_depth_mm, shear_ratio }.into()),
        ("pair", pair(2.0, 7.0, 50.0).into()),
    ]
}

fn punch(radius_mm: f64, decay_mm: f64) -> Punch {
    let [punch_radius_mm, decay_mm] = [radius_mm, decay_mm].map(|mm| [mm; 2]);
    Punch { punch_radius_mm, decay_mm, dent_depth_mm: [0.5; 2], shear_ratio: [0.0, 0.4] }
}

fn edge(length_mm: f64, width_mm: f64, degrees: f64) -> Edge {
    let [edge_length_mm, edge_width_mm] = [length_mm, width_mm].map(|mm| [mm; 2]);
    let (direction_deg, dent_depth_mm, shear_ratio) = (Some([degrees; 2]), [0.5; 2], [0.0, 0.4]);
    Edge { edge_length_mm, edge_width_mm, direction_deg, dent_depth_mm, shear_ratio }
}

fn ellipse(radius_mm: f64, ratio: f64, degrees: f64) -> Ellipse {
    let (dent_radius_mm, aspect_ratio) = ([radius_mm; 2], [ratio; 2]);
    let (direction_deg, dent_depth_mm, shear_ratio) = (Some([degrees; 2]), [0.5; 2], [0.0, 0.4]);
    Ellipse { dent_radius_mm, aspect_ratio, direction_deg, dent_depth_mm, shear_ratio }
}

fn pair(radius_mm: f64, distance_mm: f64, degrees: f64) -> Pair {
    Pair {
        dent_radius_mm: [radius_mm; 2],
        distance_mm: [distance_mm; 2],
        direction_deg: Some([degrees; 2]),
        second_depth_ratio: [0.6; 2],
        dent_depth_mm: [0.5; 2],
        shear_ratio: [0.0, 0.4],
    }
}

/// Contact of a kind at a place on the paper's face, the same in all lanes.
fn at(kind: &Kind, centre_mm: [f64; 2]) -> Contact {
    let sensor = Sensor::paper();
    let mut latents = vec![[0.0; LANES]; kind.latents(48)];
    for (latent, (at, size)) in latents.iter_mut().zip(centre_mm.iter().zip(sensor.size_mm)) {
        // The latent whose share below is at/size, by bisection.
        let (mut low, mut high) = (-7.0, 7.0);
        for _ in 0..100 {
            let middle = f64::midpoint(low, high);
            *(if normal_share_below(middle) < at / size { &mut low } else { &mut high }) = middle;
        }
        *latent = [high; LANES];
    }
    let mut contact = kind.place_contact(&sensor, &latents).unwrap();
    contact.centre_mm = centre_mm.map(|along| [along; LANES]);
    contact
}

/// Compression in mm of a contact at these places on the face.
fn compression_mm(contact: &Contact, places_mm: &[[f64; 2]]) -> Vec<f64> {
    let electrodes: Vec<Vector3> = places_mm.iter().map(|[x, y]| [*x, *y, 5.0]).collect();
    let mut delta = vec![[[0.0; LANES]; 3]; electrodes.len()];
    contact.deform(&electrodes, &mut delta);
    delta.iter().map(|delta| delta[2][LANES - 1]).collect()
}

fn close(found: &[f64], expected: &[f64], within: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < within, "{found} for {expected}");
    }
    assert_eq!(found.len(), expected.len());
}

#[test]
fn dents_have_the_depths_computed_by_hand() {
    let centre = [10.0, 9.0];
    let depths = |kind: Kind, places: &[[f64; 2]]| compression_mm(&at(&kind, centre), places);
    // Flat to 2 mm; 0.5·e⁻¹ half a millimetre farther, and 0.5·e⁻² one millimetre.
    let places = [[10.0, 9.0], [11.2, 7.4], [12.5, 9.0], [10.0, 12.0]];
    close(&depths(punch(2.0, 0.5).into(), &places), &[0.5, 0.5, 0.183_939_7, 0.067_667_6], 1e-7);
    // Along x, of a length of 3 deviations to each side: the end has (Φ(6) − ½)/(2Φ(3) − 1) of the depth.
    let places = [[10.0, 9.0], [13.0, 9.0], [10.0, 10.0]];
    let expected = [0.5, 0.250_676_7, 0.303_265_3];
    close(&depths(edge(6.0, 1.0, 0.0).into(), &places), &expected, 1e-6);
    // Turned by 90°, the line is along y.
    let turned = [[10.0, 9.0], [10.0, 12.0], [11.0, 9.0]];
    close(&depths(edge(6.0, 1.0, 90.0).into(), &turned), &expected, 1e-6);
    // Radii of 4 and 1 mm: one deviation away along either, 0.5·e^(−½) is left.
    let places = [[10.0, 9.0], [14.0, 9.0], [10.0, 10.0]];
    let expected = [0.5, 0.303_265_3, 0.303_265_3];
    close(&depths(ellipse(2.0, 4.0, 0.0).into(), &places), &expected, 1e-7);
    // 45°: √8 along each axis are 4 mm, and √½ to one side are 1 mm.
    let (far, near) = (8.0_f64.sqrt(), 0.5_f64.sqrt());
    let places = [[10.0, 9.0], [10.0 + far, 9.0 + far], [10.0 - near, 9.0 + near]];
    close(&depths(ellipse(2.0, 4.0, 45.0).into(), &places), &expected, 1e-7);
    // At ρ = s: 2^(−5/2) of the depth; at 2s: 5^(−5/2).
    let tail = Tail { cover_mm: [2.0; 2], dent_depth_mm: [0.5; 2], shear_ratio: [0.0; 2] };
    let places = [[10.0, 9.0], [8.0, 9.0], [10.0, 13.0]];
    close(&depths(tail.into(), &places), &[0.5, 0.088_388_3, 0.008_944_3], 1e-7);
    // Two dents 4 radii apart: each has e⁻⁸ of the other's depth, and their middle e⁻² of both.
    let places = [[10.0, 9.0], [14.0, 9.0], [12.0, 9.0]];
    let expected = [0.500_100_6, 0.300_167_7, 0.108_268_2];
    close(&depths(pair(1.0, 4.0, 0.0).into(), &places), &expected, 1e-6);
    // Where the second would leave the face, it lies on the other side.
    let contact = at(&pair(1.0, 4.0, 0.0).into(), [17.0, 9.0]);
    close(
        &compression_mm(&contact, &[[13.0, 9.0], [20.0, 9.0]]),
        &[0.300_167_7, 0.005_554_5],
        1e-6,
    );
}

#[test]
fn a_tail_is_as_wide_as_the_gaussian_dent_that_stands_for_it() {
    let half = (2.0_f64.powf(0.4) - 1.0).sqrt() / (2.0 * std::f64::consts::LN_2).sqrt();
    assert!((half - super::super::tail::GAUSSIAN_RADIUS).abs() < 1e-4, "{half}");
    let radius_mm = punch(2.0, 0.5).as_press().unwrap().dent_radius_mm[0];
    let places = [[10.0 + radius_mm * (2.0 * std::f64::consts::LN_2).sqrt(), 9.0]];
    close(&compression_mm(&at(&punch(2.0, 0.5).into(), [10.0, 9.0]), &places), &[0.25], 1e-12);
}

#[test]
fn the_force_is_the_integral_of_the_pressure_over_the_face() {
    let sensor = Sensor::paper();
    // 2 N/mm an electrode, 48 of them on 20 mm × 18 mm.
    let stiffness = sensor.foundation_n_per_mm3();
    assert!((stiffness - 2.0 * 48.0 / 360.0).abs() < 1e-15);
    // Sum over cells of 0.05 mm × 0.05 mm.
    let cell = 0.05;
    let middle = |i: u32| (f64::from(i) + 0.5) * cell;
    let cells: Vec<[f64; 2]> =
        (0..400).flat_map(|i| (0..360).map(move |j| [middle(i), middle(j)])).collect();
    for (name, kind) in kinds() {
        for centre_mm in [[10.0, 9.0], [0.0, 18.0], [17.5, 4.0], [0.01, 9.0]] {
            let contact = at(&kind, centre_mm);
            let mut sum = 0.0;
            for cells in cells.chunks(LANES) {
                let mut offset_mm = [[0.0; LANES]; 2];
                for (lane, place) in cells.iter().enumerate() {
                    for axis in 0..2 {
                        offset_mm[axis][lane] = place[axis] - centre_mm[axis];
                    }
                }
                let mut shares = [0.0; LANES];
                contact.profiles[0].shares(&contact.form, &offset_mm, &mut shares);
                sum += shares[..cells.len()].iter().sum::<f64>() * 0.5 * stiffness * cell * cell;
            }
            let found = contact.force_n(&sensor)[LANES - 1];
            assert!((found / sum - 1.0).abs() < 1e-4, "{name} {centre_mm:?}: {found} N, {sum} N");
        }
    }
}

#[test]
fn shear_and_depth_are_those_of_an_electrode_at_the_centre() {
    for (name, kind) in kinds() {
        let contact =
            kind.draw_contact(&Sensor::paper(), &mut Draws::new(1, Stream::Test, 0)).unwrap();
        let [x, y] = contact.centre_mm.map(|along| along[5]);
        let mut delta = [[[0.0; LANES]; 3]];
        contact.deform(&[[x, y, 5.0]], &mut delta);
        let [dx, dy, dz] = delta[0].map(|lanes| lanes[5]);
        // The dent of a pair that is not the first adds to it.
        let least = contact.dent_depth_mm[5] * (1.0 - 1e-9);
        assert!(dz >= least && (name == "pair" || dz <= 0.5), "{name}: {dz} mm");
        let [sheared_x, sheared_y] = contact.shear_mm().map(|lanes| lanes[5] / 0.5 * dz);
        close(&[dx, dy], &[sheared_x, sheared_y], 1e-12);
        assert!(dx.hypot(dy) <= 0.4 * dz && dx.hypot(dy) > 0.0, "{name}: {dx} {dy} mm");
    }
}

#[test]
fn a_contact_of_any_kind_goes_where_a_path_moves_it() {
    let sensor = Sensor::paper();
    let mixed = Kind::from(mix([1.0, 1.0]));
    for kind in kinds().into_iter().map(|(_, kind)| kind).chain([mixed]) {
        let mut draws = Draws::new(1, Stream::Test, 0);
        let mut moved = kind.start(&sensor, &mut draws);
        let form = moved.contact().unwrap().form;
        moved.move_to([[8.0; LANES], [7.5; LANES]], [0.3; LANES]);
        let contact = moved.contact().unwrap();
        assert_eq!((contact.form, contact.dent_depth_mm), (form, [0.3; LANES]));
        let at_centre = compression_mm(contact, &[[8.0, 7.5]])[0];
        assert!((0.3 - 1e-12..0.35).contains(&at_centre), "{kind:?}: {at_centre} mm");
        moved.move_to([[8.0; LANES], [7.5; LANES]], [0.0; LANES]);
        assert_eq!(compression_mm(moved.contact().unwrap(), &[[8.0, 7.5]]), [0.0]);
    }
}

#[test]
fn no_dent_leaves_the_range_that_a_motion_states() {
    // Two dents of 3 mm, 4 mm apart, are deepest between their centres.
    let mut pair = pair(3.0, 4.0, 0.0);
    pair.second_depth_ratio = [1.0; 2];
    let contact = at(&pair.into(), [8.0, 9.0]);
    let along: Vec<[f64; 2]> = (0..400).map(|i| [0.05 * f64::from(i), 9.0]).collect();
    let deepest = compression_mm(&contact, &along).into_iter().fold(0.0, f64::max);
    let stated = Kind::from(pair).range_mm();
    assert!(
        deepest > 0.79 && deepest <= stated[2][1] && stated[2][1] < 0.91,
        "{deepest} {stated:?}"
    );
    assert!((stated[0][1] - 0.4 * stated[2][1]).abs() < 1e-12);
    assert_eq!(Kind::from(pair).deepest_mm(), 0.5);
}

#[test]
fn settings_that_cannot_be_used_are_refused_by_name() {
    let refused = |kind: Kind| kind.check().unwrap_err().to_string();
    let mut bad = punch(2.0, 0.5);
    bad.decay_mm = [0.0, 1.0];
    assert!(
        refused(bad.into()).starts_with("deformation.decay_mm (low) = 0.0: it must be a positive")
    );
    let mut bad = ellipse(2.0, 3.0, 0.0);
    bad.aspect_ratio = [0.5, 2.0];
    assert!(refused(bad.into()).contains("aspect_ratio (low) = 0.5: it must be from 1 to 100"));
    let mut bad = pair(2.0, 7.0, 0.0);
    bad.second_depth_ratio = [0.5, 1.5];
    assert!(refused(bad.into()).contains("second_depth_ratio (high) = 1.5"));
    let mut bad = edge(9.0, 1.0, 0.0);
    bad.direction_deg = Some([90.0, 0.0]);
    assert!(refused(bad.into()).contains("direction_deg = [90, 0]: give [low, high]"));
    let mut bad = edge(9.0, 1.0, 0.0);
    bad.dent_depth_mm = [-0.1, 1.0];
    assert!(refused(bad.into()).contains("dent_depth_mm"));
    for (_, kind) in kinds() {
        kind.check().unwrap();
    }
}

fn mix(weights: [f64; 2]) -> Mix {
    let [press, .., tail, _] = kinds().map(|(_, kind)| kind);
    let parts = weights.into_iter().zip([press, tail]);
    Mix { parts: parts.map(|(weight, deformation)| Part { weight, deformation }).collect() }
}

#[test]
fn a_mix_has_each_part_as_often_as_its_weight_says_and_just_as_alone() {
    let (sensor, mix) = (Sensor::paper(), Kind::from(mix([3.0, 1.0])));
    let alone = kinds();
    let mut counts = [0; 2];
    for first in (0..64_000).step_by(LANES) {
        let mut draws = Draws::new(1, Stream::Test, first);
        let mixed = mix.draw_contact(&sensor, &mut draws).unwrap();
        let places = [[4.0, 3.0, 5.0], [12.0, 10.0, 5.0]];
        let deformation = |contact: &Contact| {
            let mut delta = [[[0.0; LANES]; 3]; 2];
            contact.deform(&places, &mut delta);
            delta
        };
        let found = (deformation(&mixed), mixed.force_n(&sensor));
        let parts = [&alone[0].1, &alone[4].1].map(|kind| {
            let contact = kind.draw_contact(&sensor, &mut draws.clone()).unwrap();
            (deformation(&contact), contact.force_n(&sensor))
        });
        for lane in 0..LANES {
            let part = usize::from(mixed.profile_of[lane]);
            counts[part] += 1;
            assert_eq!(found.1[lane], parts[part].1[lane]);
            for electrode in 0..2 {
                let [found, part] = [&found.0, &parts[part].0].map(|of| of[electrode]);
                assert_eq!(found.map(|lanes| lanes[lane]), part.map(|lanes| lanes[lane]));
            }
        }
    }
    // Three quarters of 64,000, within five standard deviations.
    assert!((counts[0] - 48_000_i32).abs() < 550, "{counts:?}");
}

#[test]
fn a_mix_states_the_ranges_of_all_parts_and_refuses_what_is_no_contact() {
    let mut mixed = mix([1.0, 2.0]);
    mixed.parts[0].deformation =
        Press { dent_radius_mm: [1.0, 2.0], dent_depth_mm: [0.0, 0.9], shear_ratio: [0.0; 2] }
            .into();
    assert_eq!(mixed.range_mm(), [[-0.2, 0.2], [-0.2, 0.2], [0.0, 0.9]]);
    // A path may take every part no deeper than the shallowest goes.
    assert_eq!((mixed.deepest_mm(), mixed.latents(48)), (0.5, 7));
    assert_eq!(mixed.as_press().unwrap().dent_depth_mm, [0.5; 2]);
    let refused = |mix: Mix| mix.check().unwrap_err().to_string();
    assert!(refused(Mix { parts: vec![] }).contains("deformation.parts = 0 parts"));
    assert!(refused(mix([1.0, -1.0])).contains("deformation.parts (2).weight = -1.0"));
    let mut nested = mix([1.0, 1.0]);
    nested.parts[0].deformation = mix([1.0, 1.0]).into();
    assert!(refused(nested).contains("deformation.parts (1).kind = mix: a mix is of contacts"));
    let mut shallow = mix([1.0, 1.0]);
    shallow.parts[1].deformation = punch(2.0, -1.0).into();
    assert!(refused(shallow).contains("deformation.parts (2).decay_mm (low) = -1.0"));
}
