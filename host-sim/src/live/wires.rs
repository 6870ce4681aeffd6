//! Wires that are not good, told from the newest frames.

use std::collections::VecDeque;

use taxel_core::health::Limits;
use taxel_data::Table;
use taxel_learn::faults::{Found, Kind, Place, WINDOW, diagnose};
use taxel_recording::{Column, Health, Layout};
use taxel_view::message as page;

use super::sheet;

/// The newest frames, and what is wrong with their wires.
pub struct Wires {
    frames: VecDeque<Vec<f32>>,
    names: Vec<String>,
    /// Limits, if all readings are in Ω.
    limits: Option<Limits>,
    faults: Vec<Found>,
}

impl Wires {
    /// Wires of readings in these columns, which have these `limits` if they are in Ω.
    pub fn new(readings: &[Column], limits: Limits) -> Self {
        let names: Vec<String> = sheet::names(readings).map(String::from).collect();
        let limits = sheet::limits(sheet::names(readings), limits);
        Self { frames: VecDeque::new(), names, limits, faults: vec![] }
    }

    /// Keeps the readings of a frame.
    pub fn push(&mut self, readings: &[f32]) {
        if self.frames.len() == WINDOW {
            self.frames.pop_front();
        }
        self.frames.push_back(readings.to_vec());
    }

    /// Judges the frames that are kept, by a reading model too if there is one.
    pub fn judge(&mut self, model: Option<taxel_core::reading_model::ReadingModel<'_>>) {
        let Some(limits) = self.limits else { return };
        let values = self.frames.iter().flatten().map(|reading| f64::from(*reading)).collect();
        self.faults = diagnose(&Table { names: self.names.clone(), values }, limits, model);
    }

    /// Faults for the page.
    pub fn for_page(&self) -> Vec<page::Wire> {
        let wire = |found: &Found| {
            let text = found.fault.to_string();
            page::Wire {
                wire: name(found.fault.place),
                health: match health(found.fault.kind) {
                    Health::Open => page::Health::Open,
                    Health::Noisy => page::Health::Noisy,
                    Health::Missing => page::Health::Missing,
                    Health::Shorted | Health::Sound => page::Health::Shorted,
                },
                words: format!("{text}{}", advice(found.fault.kind)),
            }
        };
        self.faults.iter().map(wire).collect()
    }

    /// Health of row-wires and of column-wires, for a recording.
    pub fn for_recording(&self, layout: &Layout) -> [Vec<Health>; 2] {
        let mut health_of = [vec![Health::Sound; layout.rows], vec![Health::Sound; layout.columns]];
        for found in &self.faults {
            let health = health(found.fault.kind);
            let mut mark = |of: usize, wire: usize| {
                if let Some(its) = wire.checked_sub(1).and_then(|wire| health_of[of].get_mut(wire))
                {
                    *its = health;
                }
            };
            match found.fault.place {
                Place::All => (1..=layout.rows).for_each(|row| mark(0, row)),
                Place::Row(row) => mark(0, row),
                Place::Rows(a, b) => [a, b].into_iter().for_each(|row| mark(0, row)),
                Place::Column(column) => mark(1, column),
                Place::Columns(a, b) => [a, b].into_iter().for_each(|column| mark(1, column)),
                Place::Reading(..) => {}
            }
        }
        health_of
    }
}

/// A wire as the page names it.
fn name(place: Place) -> String {
    match place {
        Place::All => "all".into(),
        Place::Row(wire) => format!("row {wire}"),
        Place::Rows(a, b) => format!("rows {a}, {b}"),
        Place::Column(wire) => format!("column {wire}"),
        Place::Columns(a, b) => format!("columns {a}, {b}"),
        Place::Reading(row, column) => format!("row {row}, column {column}"),
    }
}

fn health(kind: Kind) -> Health {
    match kind {
        Kind::Missing | Kind::BesideShort | Kind::IntermittentlyMissing => Health::Missing,
        Kind::Open | Kind::IntermittentlyOpen => Health::Open,
        Kind::Shorted | Kind::AtGround | Kind::Touching | Kind::IntermittentlyShorted => {
            Health::Shorted
        }
        Kind::Noisy => Health::Noisy,
    }
}

/// What helps.
fn advice(kind: Kind) -> &'static str {
    match health(kind) {
        _ if kind == Kind::BesideShort => "",
        Health::Open => ": look for a broken wire or a loose plug",
        Health::Shorted => ": look for wires that touch",
        Health::Noisy => ": look for a loose contact",
        Health::Missing => ": its converter does not answer",
        Health::Sound => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Health::{Missing, Open, Shorted, Sound};

    #[test]
    fn a_broken_row_is_no_column_for_page_and_recording() {
        let names = ["r1c1_ohm", "r1c2_ohm", "r1c3_ohm", "r2c1_ohm", "r2c2_ohm", "r2c3_ohm"];
        let layout = sheet::layout("", sheet::columns(names, []), vec![], None);
        let judged = |broken: &[usize], ohm: f32| {
            let mut wires = Wires::new(&layout.readings, Limits::USUAL);
            for frame in 0..20_u8 {
                let mut readings = vec![100.0 + f32::from(frame % 3); 6];
                broken.iter().for_each(|place| readings[*place] = ohm);
                wires.push(&readings);
            }
            wires.judge(None);
            let page = wires.for_page();
            let words: Vec<&str> = page.iter().map(|it| it.wire.as_str()).collect();
            (words.join(";"), wires.for_recording(&layout))
        };
        let [rows, columns] = [vec![Sound; 2], vec![Sound; 3]];
        assert_eq!(
            judged(&[1, 4], 1e6),
            ("column 2".into(), [rows.clone(), vec![Sound, Open, Sound]])
        );
        assert_eq!(
            judged(&[3, 4, 5], 0.1),
            ("row 2".into(), [vec![Sound, Shorted], columns.clone()])
        );
        assert_eq!(judged(&[2, 5], f32::NAN).1, [rows.clone(), vec![Sound, Sound, Missing]]);
        assert_eq!(judged(&[], 0.0), (String::new(), [rows, columns]));
    }
}
