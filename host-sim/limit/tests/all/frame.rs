//! The likelihood of a frame against the density of normal noise.

use taxel_data::{LANES, Lanes};
use taxel_limit::frame::Rows;
use taxel_simulate::World;
use taxel_simulate::sensor::LaneModel;

#[test]
fn likelihoods_are_those_of_normal_noise() {
    let world = World { read_rows: vec![3], ..World::press() };
    let rows = |deviation_ohm| Rows {
        world: &world,
        motion: &*world.motion,
        model: LaneModel::new(&world.sensor),
        wires: &[3],
        deviation_ohm,
    };
    let readings: Vec<f64> = (0..18).map(|k| 90.0 + f64::from(k)).collect();
    let ideal: Vec<Lanes> = (0..18).map(|k| [95.0 + 0.3 * f64::from(k); LANES]).collect();
    let log = |deviation: f64, reading: f64, ideal: f64| {
        -deviation.ln() - 0.5 * ((reading - ideal) / deviation).powi(2)
    };
    let sum = |of: &dyn Fn(usize) -> f64| (0..18).map(of).sum::<f64>();
    let relative = sum(&|k| log(0.005 * ideal[k][0], readings[k], ideal[k][0]));
    let constant = sum(&|k| -(0.005 * readings[k]).ln());
    let found = rows(&[]).log_likelihood(&readings, &ideal)[5];
    assert!((found - (relative - constant)).abs() < 1e-9, "{found}");
    let found = rows(&[0.4; 18]).log_likelihood(&readings, &ideal)[5];
    let absolute = sum(&|k| log(0.4, readings[k], ideal[k][0]) - log(0.4, 0.0, 0.0));
    assert!((found - absolute).abs() < 1e-9, "{found}");
}
