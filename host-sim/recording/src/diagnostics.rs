//! State of the wires and of the model, as the diagnostics of ROS.

use crate::bytes::{Bytes, Message};
use crate::frame::{Health, Status};
use crate::message::{header, skip_header};

/// Name of the status, by which it is found among others.
const NAME: &str = "taxel";
const LOST: &str = "lost frames";
const NOVEL: &str = "novel";
const CLAMPED: &str = "clamped";
const WARN: u8 = 1;

/// Names of wires, from which numbers follow, counted from 1.
const ROW: &str = "row-wire ";
const COLUMN: &str = "column-wire ";

/// Wires with their names.
fn wires(status: &Status) -> impl Iterator<Item = (String, Health)> {
    let named = |name: &'static str, wires: &[Health]| {
        let wires = wires.to_vec();
        (1..)
            .zip(wires)
            .map(move |(number, health): (usize, _)| (format!("{name}{number}"), health))
    };
    named(ROW, &status.row_wires).chain(named(COLUMN, &status.column_wires))
}

/// Message for `status` of the sensor called `title`.
pub fn diagnostics(ns: u64, title: &str, status: &Status) -> Vec<u8> {
    let faulty = wires(status).filter(|(_, health)| *health != Health::Sound);
    let mut faults: Vec<String> =
        faulty.map(|(name, health)| format!("{name} {}", health.word())).collect();
    if status.is_novel {
        faults.push("unlike what the model was trained on".into());
    }
    if status.is_clamped {
        faults.push("outside the model's range".into());
    }
    let yes = |is: bool| if is { "yes" } else { "no" }.to_string();
    let mut values: Vec<(String, String)> =
        wires(status).map(|(name, health)| (name, health.word().into())).collect();
    values.push((LOST.into(), status.lost_frames.to_string()));
    values.push((NOVEL.into(), yes(status.is_novel)));
    values.push((CLAMPED.into(), yes(status.is_clamped)));

    let mut message = Message::new();
    header(&mut message, ns, "");
    message.length(1);
    message.u8(if faults.is_empty() { 0 } else { WARN });
    message.text(NAME);
    message.text(&if faults.is_empty() { "no fault".into() } else { faults.join(", ") });
    message.text(title);
    message.length(values.len());
    for (name, value) in values {
        message.text(&name);
        message.text(&value);
    }
    message.into_bytes()
}

/// Takes the sensor's status from a message, if it is not about others; `None` if it is no message of this type.
pub fn read_diagnostics(bytes: &[u8], found: &mut Option<Status>) -> Option<()> {
    let mut bytes = Bytes::message(bytes)?;
    skip_header(&mut bytes)?;
    for _ in 0..bytes.u32()? {
        bytes.u8()?;
        let name = bytes.text()?;
        bytes.text()?;
        bytes.text()?;
        let mut status = Status::default();
        for _ in 0..bytes.u32()? {
            let (key, value) = (bytes.text()?, bytes.text()?);
            let health = || Health::ALL.into_iter().find(|health| health.word() == value);
            match key {
                _ if name != NAME => {}
                LOST => status.lost_frames = value.parse().ok()?,
                NOVEL => status.is_novel = value == "yes",
                CLAMPED => status.is_clamped = value == "yes",
                wire if wire.starts_with(ROW) => status.row_wires.push(health()?),
                wire if wire.starts_with(COLUMN) => status.column_wires.push(health()?),
                _ => {}
            }
        }
        if name == NAME {
            *found = Some(status);
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Health::{Open, Shorted, Sound};

    #[test]
    fn faults_are_a_warning_with_their_wires_in_words() {
        let said = |status: &Status| {
            let bytes = diagnostics(0, "a sensor", status);
            let mut read = Bytes::message(&bytes).unwrap();
            skip_header(&mut read).unwrap();
            let (count, level, _) = (read.u32(), read.u8(), read.text());
            assert_eq!(count, Some(1));
            (level.unwrap(), read.text().unwrap().to_owned())
        };
        let sound = Status { row_wires: vec![Sound; 2], lost_frames: 3, ..Status::default() };
        assert_eq!(said(&sound), (0, "no fault".into()));
        let column_wires = vec![Shorted, Sound];
        let faulty = Status { row_wires: vec![Sound, Open], column_wires, ..sound.clone() };
        assert_eq!(said(&faulty), (1, "row-wire 2 open, column-wire 1 shorted".into()));
        let novel = Status { is_novel: true, ..sound.clone() };
        assert_eq!(said(&novel), (1, "unlike what the model was trained on".into()));
        let clamped = Status { is_clamped: true, ..sound };
        assert_eq!(said(&clamped), (1, "outside the model's range".into()));
    }
}
