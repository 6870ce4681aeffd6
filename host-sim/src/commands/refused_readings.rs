//! Note on readings that a model is trained on, and that a device would take for missing.

use super::stderr;
use crate::subject::Subject;
use taxel_core::health::{Fault, Limits};
use taxel_data::error::cut;
use taxel_data::{Stream, Table, columns};
use taxel_learn::faults::{Grid, Place, diagnose};
use taxel_simulate::Synthesis;

/// Most wires, and most columns, that are named.
const MOST_NAMED: usize = 5;
/// Frames of a scene that are looked at.
const FRAMES_OF_SCENE: usize = 200;

/// Notes on stderr which readings of a scene a device would take for missing, by its usual limits. Those of measurements
/// are noted when their files are read.
pub fn note_scene(subject: &Subject) {
    if let Some(scene) = subject.scene() {
        let frames = scene.training.frames.min(FRAMES_OF_SCENE);
        let readings = Synthesis::new(&scene.world).frames(Stream::Training, frames).inputs;
        note(&readings, &format!("scene {}", scene.name));
    }
}

/// Notes on stderr which `readings` of a `source` a device would take for missing, by its usual limits.
pub fn note(readings: &Table, source: &str) {
    notes(readings, source).iter().for_each(stderr::remark);
}

/// Column with readings outside of the limits, and in how many frames.
struct Refused<'n> {
    name: &'n str,
    shorted: usize,
    open: usize,
}

fn notes(readings: &Table, source: &str) -> Vec<String> {
    let limits = Limits::USUAL;
    let mut worst = refused(readings, limits);
    if worst.is_empty() {
        return vec![];
    }
    let frames = readings.len();
    let mut notes = vec![format!(
        "note: readings of {source} lie outside of {} to {} Ω: a device, `decode` and `eval` take them for missing:",
        limits.shorted_below_ohm, limits.open_above_ohm
    )];
    let mut faults = diagnose(readings, limits, None);
    faults.retain(|found| !matches!(found.fault.place, Place::Reading(..))); // columns have a share of their own
    faults.sort_by_key(|found| std::cmp::Reverse(found.frames)); // stable
    worst.retain(|column| {
        let holds = |(row, wire)| faults.iter().any(|found| found.fault.place.holds(row, wire));
        !Grid::wires_of_name(column.name).is_some_and(holds)
    });
    worst.sort_by_key(|column| std::cmp::Reverse(column.shorted + column.open)); // stable
    let of_wires =
        faults.iter().map(|found| format!("{} in {}", found.fault, share(found.frames, frames)));
    let of_columns = worst.iter().map(|column| {
        let kinds = [(column.shorted, "shorted"), (column.open, "open")];
        let kinds = kinds.iter().filter(|(count, _)| *count > 0);
        let kinds = kinds.map(|(count, kind)| format!("{kind} in {}", share(*count, frames)));
        format!("{} {}", cut(column.name), kinds.collect::<Vec<_>>().join(", "))
    });
    let named = of_wires.take(MOST_NAMED).chain(of_columns.take(MOST_NAMED));
    notes.extend(named.map(|named| format!("  {named}")));
    let more = [faults.len(), worst.len()].map(|count| count.saturating_sub(MOST_NAMED));
    if more.iter().sum::<usize>() > 0 {
        notes.push(format!("  and {} more wires or columns", more.iter().sum::<usize>()));
    }
    notes.push(
        "  if they are sound, give the device other limits (link configure --shorted-below-ohm, --open-above-ohm), and \
         --limits"
            .into(),
    );
    notes.push("  to `decode` and `eval`; otherwise mend the readings, or choose others".into());
    notes
}

/// Columns of `readings` in Ω with values outside of the `limits`.
fn refused(readings: &Table, limits: Limits) -> Vec<Refused<'_>> {
    let names = readings.names.iter().enumerate();
    let in_ohm = names.filter(|(_, name)| columns::is_judged_in_ohm(name));
    let mut refused: Vec<(usize, Refused<'_>)> =
        in_ohm.map(|(place, name)| (place, Refused { name, shorted: 0, open: 0 })).collect();
    for line in readings.lines() {
        for (place, column) in &mut refused {
            match limits.fault(line[*place] as f32) {
                Some(Fault::Shorted) => column.shorted += 1,
                Some(Fault::Open) => column.open += 1,
                Some(Fault::Missing) | None => {} // frames without a value are told of elsewhere
            }
        }
    }
    refused.into_iter().map(|(_, column)| column).filter(|it| it.shorted + it.open > 0).collect()
}

/// So many of all `frames`; never 0 % of some, or 100 % of fewer than all.
fn share(count: usize, frames: usize) -> String {
    let percent = 100.0 * count as f64 / frames as f64;
    match percent {
        ..0.1 => format!("{count} of {frames} frames"),
        99.9..100.0 => format!("{percent:.2} % of frames"),
        _ => format!("{} % of frames", (percent * 10.0).round() / 10.0),
    }
}
