//! A scene of any text. One that is taken for sound must be synthesised to numbers, and its resistances are positive.

use taxel_data::random::Stream;
use taxel_evaluate::experiment::Experiment;
use taxel_simulate::Synthesis;

/// Most pairs of an upper and a lower electrode of a scene that is synthesised here.
const MOST_NODES: usize = 20_000;

/// Text of a scene.
pub fn check(bytes: &[u8]) -> bool {
    let Ok(text) = str::from_utf8(bytes) else { return false };
    let Ok(experiment) = Experiment::parse("fuzz", text) else { return false };
    let world = &experiment.world;
    let sensor = &world.sensor;
    let (upper, lower) = (sensor.upper_electrodes_mm.len(), sensor.lower_electrodes_mm.len());
    assert!(upper <= 255_000 && lower <= 10_000_000, "{upper} and {lower} electrodes");
    if upper * lower > MOST_NODES {
        return true;
    }
    let frames = Synthesis::new(world).ideal().frames(Stream::Training, 2);
    assert_eq!(frames.inputs.names, world.reading_names());
    assert_eq!(frames.outputs.names, world.output_names());
    assert_eq!(frames.outputs.names.len(), world.full_scales().len());
    let positive = |reading: &f64| reading.is_finite() && *reading > 0.0;
    assert!(frames.inputs.values.iter().all(positive), "readings {:?}", frames.inputs.values);
    // A contact that is not there has no place.
    assert!(!frames.outputs.values.iter().any(|value| value.is_infinite()), "outputs");
    true
}
