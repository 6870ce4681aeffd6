//! Scenes and data that the benchmarks share.

use taxel_data::csv_file;
use taxel_data::dataset::Dataset;
use taxel_data::random::Stream;
use taxel_simulate::{World, synthesise};

/// World of a built-in scene (`paper`, `press`).
///
/// # Panics
/// If there is no scene of that name.
pub fn world(name: &str) -> World {
    match name {
        "paper" => World::paper(),
        "press" => World::press(),
        _ => panic!("no built-in scene {name:?}"),
    }
}

/// Synthesises `frames` noisy training frames of a built-in scene, in Ω and mm.
pub fn frames_of(scene_name: &str, frames: usize) -> Dataset {
    synthesise(&world(scene_name), Stream::Training, frames)
}

/// Content of the CSV file that `synth` writes for `frames` of a built-in scene.
///
/// # Panics
/// If the folder for temporary files cannot be written to.
pub fn csv_of(scene_name: &str, frames: usize) -> Vec<u8> {
    let path = std::env::temp_dir().join(format!("taxel-bench-{}.csv", std::process::id()));
    let dataset = frames_of(scene_name, frames);
    let names = dataset.inputs.names.iter().chain(&dataset.outputs.names).map(String::as_str);
    let lines = dataset.inputs.lines().zip(dataset.outputs.lines());
    let lines = lines.map(|(readings, outputs)| readings.iter().chain(outputs).copied());
    csv_file::write(&path, names, lines).expect("a writable folder for temporary files");
    let content = std::fs::read(&path).expect("what was just written");
    let _ = std::fs::remove_file(&path); // a file left behind does no harm
    content
}
