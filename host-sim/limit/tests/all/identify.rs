//! What the readings of a linearised sensor show, against the limit and by counting.

use taxel_data::Silent;
use taxel_limit::Reference;
use taxel_limit::identify::{Observability, Prior, observability};
use taxel_simulate::World;

fn of_rows(world: &World, rows: &[usize]) -> Observability {
    observability(world, &Prior::new(world), rows).unwrap()
}

#[test]
fn six_directions_of_a_row_are_observable_at_half_a_percent() {
    let world = World::paper();
    for row in 0..8 {
        let found = of_rows(&world, &[row]);
        assert_eq!(found.observable, 6, "row {row}");
        let ratios = &found.signal_to_noise;
        assert!(ratios[3] > 3.0 && ratios[5] < 1.5 && ratios[7] < 0.5, "{ratios:?}");
        let values = &found.singular_values_per_mm;
        assert!((0.1..0.25).contains(&values[0]) && values[17] < 1e-6, "{values:?}");
        let places = world.sensor.row_electrodes_mm(row).iter().map(|at| [at[0], at[1]]);
        assert!(found.electrodes.iter().map(|it| it.position_mm).eq(places), "row {row}");
    }
    // Rows are independent: two show together what each shows.
    let both = of_rows(&world, &[2, 5]);
    assert_eq!((both.observable, both.unknowns, both.readings), (12, 36, 36));
}

#[test]
fn the_prediction_is_the_limit_for_a_nearly_linear_sensor() {
    let mut world = World { read_rows: vec![3], ..World::paper() };
    world.noise.level = 0.02;
    let limits = Reference::new(&world, 40, &Silent).unwrap().limits();
    for (limit, predicted) in limits.iter().zip(of_rows(&world, &[3]).axes) {
        let ratio = predicted.rmse_mm / limit.limit;
        assert!((0.9..1.1).contains(&ratio), "{limit:?} {predicted:?}");
    }
}

#[test]
fn correlated_noise_hides_as_much_as_white_noise_of_its_level() {
    let mut world = World { read_rows: vec![3], ..World::paper() };
    world.noise.time_constant_ms = 5.0;
    let mut ratio = |white: f64, correlated: f64| {
        (world.noise.level, world.noise.correlated_level) = (white, correlated);
        of_rows(&world, &[3]).signal_to_noise[0]
    };
    assert!((ratio(0.003, 0.004) / ratio(0.005, 0.0) - 1.0).abs() < 1e-9);
}
