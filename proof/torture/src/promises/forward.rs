//! The forward model where electrodes come close, touch, or would pass through each other.

use taxel_data::random::{Purpose, Random, Stream};
use taxel_simulate::motion::Independent;
use taxel_simulate::{Synthesis, World};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const TOUCHING: Promise = Promise {
    name: "forward-touching",
    text: "readings fall in z, or electrodes may touch",
    share: 1,
    check: touching,
};

/// Steps of compression at which readings are compared.
const STEPS: u32 = 20;

fn touching(effort: &Effort, _: &Tools) -> Result<Found, String> {
    Ok(effort.worst_of_accepted((2000, 1_000_000), (1e-12, "rise"), |seed| {
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let world = world(&mut random);
        if let Err(refusal) = world.check() {
            let is_named = refusal.field == "deformation" || refusal.field.starts_with("sensor.");
            let unnamed = || Err(format!("refused without the field: {refusal}"));
            return if is_named { Ok(None) } else { unnamed() };
        }
        let frames = Synthesis::new(&world).ideal().frames(Stream::Test, 8);
        let stray = frames.inputs.values.iter().find(|r| !(r.is_finite() && **r > 0.0));
        if let Some(reading) = stray {
            return Err(format!("a reading is {reading:e} Ω"));
        }
        rise(&world).map(Some)
    }))
}

/// Sensor of few electrodes whose layers are anything from far apart to beyond each other.
fn world(random: &mut Random) -> World {
    let most_mm = 10_f64.powf(random.between([-3.0, 0.0]));
    let range = [0.0, most_mm];
    let mut world = World::of_motion(Independent { dx_mm: range, dy_mm: range, dz_mm: range });
    let sensor = &mut world.sensor;
    let size_mm = [4.0, 4.0, 5.0];
    (sensor.row_wires, sensor.electrodes_per_row_wire) = (1, 2);
    (sensor.column_wires, sensor.electrodes_per_column_wire) = (2, 1);
    sensor.size_mm = size_mm;
    // The gap that compression leaves: none, tiny, negative or wide.
    let gap_mm = match random.below(4) {
        0 => 0.0,
        1 => 10_f64.powf(random.between([-15.0, -3.0])),
        2 => -random.between([0.0, 1.0]),
        _ => random.between([0.0, 5.0]),
    };
    let upper = |x_mm: f64| [x_mm, 2.0, most_mm + gap_mm];
    sensor.upper_electrodes_mm = vec![upper(1.0), upper(3.0)];
    sensor.lower_electrodes_mm = vec![[1.0, 2.0, 0.0], [3.0, 2.0, 0.0]];
    world.read_rows = vec![0];
    world
}

/// Largest relative rise of a reading while the layers are pressed together.
fn rise(world: &World) -> Result<f64, String> {
    let sensor = &world.sensor;
    let most_mm = world.motion.range_mm()[2][1];
    let (mut before, mut worst) = (vec![f64::INFINITY; 2], 0.0_f64);
    for step in 0..=STEPS {
        let pressed = [0.0, 0.0, most_mm * f64::from(step) / f64::from(STEPS)];
        let linearised = sensor.linearise(0, &[pressed; 2]).into_iter();
        let readings: Vec<f64> = linearised.map(|reading| reading.resistance_ohm).collect();
        if let Some(reading) = readings.iter().find(|r| !(r.is_finite() && **r > 0.0)) {
            return Err(format!("a reading is {reading:e} Ω at {} mm", pressed[2]));
        }
        for (now, before) in readings.iter().zip(&before) {
            worst = worst.max(now / before - 1.0);
        }
        before = readings;
    }
    Ok(worst)
}
