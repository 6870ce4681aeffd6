//! The forward model in lanes against the plain formula.

use taxel_data::{LANES, Lanes, Purpose, Random, Stream};
use taxel_simulate::sensor::{LaneModel, Precision, Scratch, Sensor, Vector3};

/// Readings of a row in lanes, computed in one place: the function is compiled wherever it is called.
fn in_lanes(
    (model, row, precision): (&LaneModel<'_>, usize, Precision),
    deformation_mm: &[[Lanes; 3]],
    columns: usize,
) -> Vec<Lanes> {
    let mut readings = vec![[f64::NAN; LANES]; columns];
    let scratch = &mut Scratch::default();
    model.row_column_resistance_ohm(row, precision, deformation_mm, scratch, &mut readings);
    readings
}

/// Readings of drawn deformations by the plain formula, and in lanes.
fn both_ways(sensor: &Sensor, precision: Precision) -> Vec<[f64; 2]> {
    let model = LaneModel::new(sensor);
    let mut random = Random::new(3, Stream::Test, Purpose::Deformation, 0, 0);
    let mut pairs = Vec::new();
    for row in 0..sensor.row_wires {
        let mut deformation_mm = vec![[[0.0; LANES]; 3]; sensor.electrodes_per_row_wire];
        let most = sensor.largest_deformation_mm();
        for lanes in deformation_mm.as_flattened_mut() {
            lanes.fill_with(|| random.between([-most, most]));
        }
        let in_lanes = in_lanes((&model, row, precision), &deformation_mm, sensor.column_wires);
        for frame in 0..LANES {
            let deltas: Vec<Vector3> =
                deformation_mm.iter().map(|delta| delta.map(|lanes| lanes[frame])).collect();
            let plain = sensor.linearise(row, &deltas).into_iter().zip(&in_lanes);
            pairs.extend(plain.map(|(plain, lanes)| [plain.resistance_ohm, lanes[frame]]));
        }
    }
    pairs
}

fn largest_error(pairs: &[[f64; 2]]) -> f64 {
    pairs.iter().map(|[plain, lanes]| (lanes / plain - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn lanes_agree_with_the_plain_formula() {
    let odd = Sensor {
        row_wires: 2,
        column_wires: 5,
        electrodes_per_column_wire: 4,
        lower_electrodes_mm: (0..20)
            .map(f64::from)
            .map(|i| [i * i / 20.0, 18.0 - i / 2.0, -i / 30.0])
            .collect(),
        ..Sensor::paper()
    };
    // As far apart as a checked world may have electrodes.
    let mut far = Sensor::paper();
    far.lower_electrodes_mm[7][0] = 1e9;
    for sensor in [Sensor::paper(), odd, far] {
        let error = largest_error(&both_ways(&sensor, Precision::F64));
        assert!(error < 1e-13, "f64: {error:e}");
        let error = largest_error(&both_ways(&sensor, Precision::F32));
        assert!((1e-9..1e-6).contains(&error), "f32: {error:e}");
    }
}

/// The resistance of a single node is its distance, by the reciprocal root of the square, over three powers of two.
#[test]
fn estimates_of_reciprocal_roots_are_as_good_as_stated() {
    let (row_wires, electrodes_per_row_wire) = (1, 1);
    let (column_wires, electrodes_per_column_wire) = (1, 1);
    let (upper_electrodes_mm, lower_electrodes_mm) = (vec![[0.0; 3]], vec![[0.0; 3]]);
    let sensor = Sensor {
        row_wires,
        electrodes_per_row_wire,
        column_wires,
        electrodes_per_column_wire,
        upper_electrodes_mm,
        lower_electrodes_mm,
        ..Sensor::paper()
    };
    let model = LaneModel::new(&sensor);
    for first in (0..400_000).step_by(LANES) {
        let share = |lane: usize| (first + lane) as f64 / 400_000.0;
        let square = |lane| f64::exp(share(lane) * 2.0_f64.ln() * 3.0 + 3.0);
        let distance_mm: Lanes = std::array::from_fn(|lane| square(lane).sqrt());
        let deformation_mm = [[distance_mm, [0.0; LANES], [0.0; LANES]]];
        for (precision, bound) in [(Precision::F32, 3e-7), (Precision::F64, 1e-13)] {
            let found = &in_lanes((&model, 0, precision), &deformation_mm, 1)[0];
            for (found, distance_mm) in found.iter().zip(distance_mm) {
                let expected = sensor.resistance_ohm_per_mm * distance_mm;
                assert!((found / expected - 1.0).abs() < bound, "{distance_mm} mm: {found}");
            }
        }
    }
}
