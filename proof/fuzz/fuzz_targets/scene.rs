//! Scenes of any text. One is refused, or its resistances are positive, its outputs finite and its columns those that it
//! names.
#![no_main]

use libfuzzer_sys::fuzz_target;
use taxel_data::Stream;
use taxel_evaluate::experiment::Experiment;
use taxel_simulate::Synthesis;

/// Most pairs of an upper and a lower electrode of a scene that is synthesised here.
const MOST_NODES: usize = 20_000;

fuzz_target!(|text: &str| {
    let Ok(experiment) = Experiment::parse("fuzz", text) else { return };
    let world = &experiment.world;
    let sensor = &world.sensor;
    let (upper, lower) = (sensor.upper_electrodes_mm.len(), sensor.lower_electrodes_mm.len());
    assert!(upper <= 255_000 && lower <= 10_000_000, "{upper} and {lower} electrodes");
    if upper * lower > MOST_NODES {
        return;
    }
    let frames = Synthesis::new(world).ideal().frames(Stream::Training, 2);
    assert_eq!(frames.inputs.names, world.reading_names());
    assert_eq!(frames.outputs.names, world.output_names());
    assert_eq!(frames.outputs.names.len(), world.full_scales().len());
    let positive = |reading: &f64| reading.is_finite() && *reading > 0.0;
    assert!(frames.inputs.values.iter().all(positive), "readings {:?}", frames.inputs.values);
    // A contact that is not there has no place.
    assert!(!frames.outputs.values.iter().any(|value| value.is_infinite()), "outputs");
});
