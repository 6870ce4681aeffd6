//! What the benchmarks share: scenes and data to work on.

use host_sim::data_file;
use host_sim::dataset::Dataset;
use host_sim::random::Stream;
use host_sim::scene::Scene;
use host_sim::synth::synthesise;

/// A built-in scene (`paper`, `press`).
///
/// # Panics
/// If there is none of that name.
#[must_use]
pub fn scene(name: &str) -> Scene {
    Scene::load(name).expect("a built-in scene")
}

/// `frames` noisy training frames of a built-in scene, in Ω and mm.
#[must_use]
pub fn frames_of(scene_name: &str, frames: usize) -> Dataset {
    synthesise(&scene(scene_name), Stream::Training, frames)
}

/// The content of the CSV file that `synth` writes for `frames` of a built-in scene.
///
/// # Panics
/// If the folder for temporary files cannot be written to.
#[must_use]
pub fn csv_of(scene_name: &str, frames: usize) -> Vec<u8> {
    let path = std::env::temp_dir().join(format!("taxel-bench-{}.csv", std::process::id()));
    let dataset = frames_of(scene_name, frames);
    let names = dataset.inputs.names.iter().chain(&dataset.outputs.names).map(String::as_str);
    let lines = dataset.inputs.lines().zip(dataset.outputs.lines());
    let lines = lines.map(|(readings, outputs)| readings.iter().chain(outputs).copied());
    data_file::write(&path, names, lines).expect("a writable folder for temporary files");
    let content = std::fs::read(&path).expect("what was just written");
    let _ = std::fs::remove_file(&path); // a file left behind does no harm
    content
}
