//! Note on readings that a model is trained on, and that a device would take for missing.

use super::{Common, health};
use crate::subject::Subject;
use taxel_core::health::Limits;
use taxel_data::{Stream, Table};
use taxel_learn::faults::{Place, diagnose};
use taxel_learn::health::{fault, judge};
use taxel_simulate::Synthesis;

/// Frames of a scene that are looked at.
const FRAMES_OF_SCENE: usize = 200;

/// Notes on stderr which readings of a scene a device would take for missing, by its usual limits. Those of measurements
/// are noted when their files are read.
pub fn note_scene(subject: &Subject, common: &Common) {
    if let Some(scene) = subject.scene() {
        let frames = scene.frames.min(FRAMES_OF_SCENE);
        let readings = Synthesis::new(&scene.world).frames(Stream::Training, frames).inputs;
        note(&readings, &format!("scene {}", scene.name), common);
    }
}

/// Notes on stderr which `readings` of a `source` a device would take for missing, by its usual limits.
pub fn note(readings: &Table, source: &str, common: &Common) {
    notes(readings, source).iter().for_each(|it| common.remark(it));
}

fn notes(readings: &Table, source: &str) -> Vec<String> {
    let limits = Limits::USUAL;
    let is_faulty =
        |(name, reading): (&String, &f64)| fault(name, *reading, Some(limits)).is_some();
    if !readings.lines().any(|line| readings.names.iter().zip(line).any(is_faulty)) {
        return vec![]; // without a copy of all readings
    }
    let mut columns = judge(&mut readings.clone(), Some(limits));
    columns.iter_mut().for_each(|column| column.missing = 0); // lines without a value are told of elsewhere
    columns.retain(|column| column.faulty() > 0);
    if columns.is_empty() {
        return vec![];
    }
    let mut faults = diagnose(readings, limits, None);
    faults.retain(|found| !matches!(found.fault.place, Place::Reading(..))); // columns have a share of their own
    let first = format!(
        "note: readings of {source} lie outside of {} to {} Ω: a device, `decode` and `eval` treat them as missing:",
        limits.shorted_below_ohm, limits.open_above_ohm
    );
    let last = [
        "  if they are correct, give the device other limits (link configure --shorted-below-ohm, --open-above-ohm), and \
         --limits",
        "  to `decode` and `eval`; otherwise correct the readings, or choose others",
    ];
    let named = health::notes(&columns, &faults, readings.len());
    [first].into_iter().chain(named).chain(last.map(String::from)).collect()
}
