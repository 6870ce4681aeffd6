//! The forward model where electrodes come close, touch, or would pass through each other: readings fall while layers are
//! pressed together, or the scene is refused because electrodes may touch.

use taxel_data::LANES;
use taxel_data::random::{Purpose, Random, Stream};

use taxel_simulate::World;
use taxel_simulate::motion::Independent;
use taxel_simulate::sensor::{LaneModel, Precision, Scratch};

use crate::table;

/// Steps of compression at which readings are compared.
const STEPS: u32 = 20;

#[test]
fn readings_fall_while_layers_are_pressed_together() {
    table::hold("touching", 1.0, 2000, |seed| {
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let world = world(&mut random);
        if let Err(refusal) = world.check() {
            let is_named = refusal.field == "deformation" || refusal.field.starts_with("sensor.");
            assert!(is_named, "refused without the field: {refusal}");
            return None;
        }
        Some(rise(&world) / 1e-12)
    });
}

/// Sensor of few electrodes whose layers are anything from far apart to beyond each other.
fn world(random: &mut Random) -> World {
    let most_mm = 10_f64.powf(random.between([-3.0, 0.0]));
    let range = [0.0, most_mm];
    let mut world = World::of_motion(Independent { dx_mm: range, dy_mm: range, dz_mm: range });
    let sensor = &mut world.sensor;
    (sensor.row_wires, sensor.electrodes_per_row_wire) = (1, 2);
    (sensor.column_wires, sensor.electrodes_per_column_wire) = (2, 1);
    sensor.size_mm = [4.0, 4.0, 5.0];
    // The gap that compression leaves: none, tiny, negative or wide.
    let gap_mm = match random.below(4) {
        0 => 0.0,
        1 => 10_f64.powf(random.between([-15.0, -3.0])),
        2 => -random.between([0.0, 1.0]),
        _ => random.between([0.0, 5.0]),
    };
    sensor.upper_electrodes_mm = [1.0, 3.0].map(|x_mm| [x_mm, 2.0, most_mm + gap_mm]).to_vec();
    sensor.lower_electrodes_mm = [1.0, 3.0].map(|x_mm| [x_mm, 2.0, 0.0]).to_vec();
    world.read_rows = vec![0];
    world
}

/// Largest relative rise of a reading while the layers are pressed together.
fn rise(world: &World) -> f64 {
    let most_mm = world.motion.range_mm()[2][1];
    let model = LaneModel::new(&world.sensor);
    let (mut scratch, mut readings) = (Scratch::default(), [[0.0; LANES]; 2]);
    let (mut before, mut worst) = ([f64::INFINITY; 2], 0.0_f64);
    for step in 0..=STEPS {
        let pressed = [0.0, 0.0, most_mm * f64::from(step) / f64::from(STEPS)];
        let pressed = [pressed.map(|along| [along; LANES]); 2];
        let precision = Precision::F64;
        model.row_column_resistance_ohm(0, precision, &pressed, &mut scratch, &mut readings);
        for ([now, ..], before) in readings.iter().zip(&mut before) {
            assert!(now.is_finite() && *now > 0.0, "a reading is {now:e} Ω");
            worst = worst.max(now / *before - 1.0);
            *before = *now;
        }
    }
    worst
}
