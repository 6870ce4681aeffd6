//! The forward model against values that were computed otherwise.

use taxel_simulate::sensor::{Sensor, Vector3};

fn readings(sensor: &Sensor, row: usize, deformation_mm: &[Vector3]) -> Vec<f64> {
    let readings = sensor.linearise(row, deformation_mm).into_iter();
    readings.map(|reading| reading.resistance_ohm).collect()
}

#[test]
fn two_electrodes_give_the_resistance_of_their_distance() {
    let sensor = Sensor {
        row_wires: 1,
        electrodes_per_row_wire: 1,
        column_wires: 1,
        electrodes_per_column_wire: 1,
        upper_electrodes_mm: vec![[3.0, 4.0, 12.0]],
        lower_electrodes_mm: vec![[0.0; 3]],
        ..Sensor::paper()
    };
    assert!((readings(&sensor, 0, &[[0.0; 3]])[0] - 1300.0).abs() < 1e-9);
    // Deformation is subtracted: positive Δz brings the layers together.
    assert!((readings(&sensor, 0, &[[3.0, 4.0, 2.0]])[0] - 1000.0).abs() < 1e-9);
}

#[test]
fn a_deformation_at_the_bound_is_not_refused_for_rounding() {
    let sensor = Sensor::paper();
    assert!(sensor.holds_for(sensor.largest_deformation_mm().next_up()));
    assert!(!sensor.holds_for(1.001 * sensor.largest_deformation_mm()));
}

#[test]
fn readings_agree_with_values_computed_to_forty_digits() {
    // Expected values come from 40-digit decimal arithmetic on the equations (row, deformation rule,
    // column, Ω).
    let sensor = Sensor::paper();
    let rule = |i: usize| {
        let i = i as f64;
        [0.1 * i - 0.25, 0.3 - 0.125 * i, 0.0625 * (i + 1.0)]
    };
    let deformation_mm: Vec<_> = (0..6).map(rule).collect();
    let rest = [[0.0; 3]; 6];
    for (row, moved, column, expected) in CASES {
        let set = if moved { &deformation_mm[..] } else { &rest[..] };
        let found = readings(&sensor, row, set)[column];
        assert!((found / expected - 1.0).abs() <= 1e-14, "r{row} c{column}: {found}");
    }
}

/// Cases of the forward model: row, deformed by the rule or at rest, column, and Ω rounded to f64.
const CASES: [(usize, bool, usize, f64); 6] = [
    (0, false, 0, 69.732_600_274_078_82),
    (3, false, 8, 46.737_473_715_473_56),
    (7, false, 17, 69.732_600_274_078_82),
    (0, true, 0, 69.828_092_558_371_75),
    (4, true, 9, 45.423_202_802_756_414),
    (7, true, 16, 65.631_196_488_568_1),
];

#[test]
fn derivatives_are_those_of_the_readings() {
    let sensor = Sensor::paper();
    let deformation_mm: Vec<Vector3> =
        (0..6).map(|i| [0.1 * f64::from(i), -0.3, 0.15 * f64::from(i)]).collect();
    let linearised = sensor.linearise(2, &deformation_mm);
    for i in 0..18 {
        let moved = |by: f64| {
            let mut moved = deformation_mm.clone();
            moved[i / 3][i % 3] += by;
            readings(&sensor, 2, &moved)
        };
        for (k, (up, down)) in moved(1e-4).iter().zip(moved(-1e-4)).enumerate() {
            let slope = (up / down).ln() / 2e-4;
            let found = linearised[k].log_slopes_per_mm[i];
            assert!((found - slope).abs() < 1e-8, "column {k}, unknown {i}: {found} {slope}");
        }
    }
}
