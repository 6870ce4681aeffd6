//! One frame, and what is known of it.

use crate::error::{Error, Result};
use crate::layout::Layout;

/// One scan, and what was decoded of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Time of the scan by the device's clock, in µs.
    pub time_us: u64,
    /// Number of the frame, by the device.
    pub number: u32,
    /// Readings, row by row, in the units of their columns; NaN where one is missing.
    pub readings: Vec<f32>,
    /// Outputs of the model, in the units of their columns; NaN where there is none.
    pub outputs: Option<Vec<f32>>,
    /// Standard deviation of each output, in its unit.
    pub deviations: Option<Vec<f32>>,
    /// True outputs, where they are known.
    pub truth: Option<Vec<f32>>,
    /// Place of the contact in mm: x, y and depth, while something touches. A depth that is not known is NaN; one of 0 is
    /// read as not known.
    pub contact_mm: Option<[f32; 3]>,
    /// Force on the sensor along x, y and z in N, if it is known; 0 when a contact ends.
    pub force_n: Option<[f32; 3]>,
    /// Events of touch that were told since the frame before, in words.
    pub events: Vec<String>,
    /// State of the wires and of the model. A frame that is written with `None` leaves it as it was: when it is read it
    /// has the last one before it.
    pub status: Option<Status>,
}

/// State of the wires and of the model.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Status {
    /// Health of each row-wire; none if it is not known.
    pub row_wires: Vec<Health>,
    /// Health of each column-wire; none if it is not known.
    pub column_wires: Vec<Health>,
    /// Number of frames that were lost since the start.
    pub lost_frames: u64,
    /// Whether readings are unlike those that the model was trained on.
    pub is_novel: bool,
    /// Whether readings lie outside the model's range, and were clamped to it.
    pub is_clamped: bool,
}

/// Health of a wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Health {
    /// Its readings can be believed.
    Sound,
    /// It is broken, or not connected.
    Open,
    /// It touches another.
    Shorted,
    /// Its readings change by themselves.
    Noisy,
    /// Its readings were not taken.
    Missing,
}

impl Health {
    pub(crate) const ALL: [Self; 5] =
        [Self::Sound, Self::Open, Self::Shorted, Self::Noisy, Self::Missing];

    /// Word for people.
    pub fn word(self) -> &'static str {
        match self {
            Self::Sound => "sound",
            Self::Open => "open",
            Self::Shorted => "shorted",
            Self::Noisy => "noisy",
            Self::Missing => "missing",
        }
    }
}

impl Status {
    /// Whether it is about the wires of `layout`, or about none.
    pub(crate) fn fits(&self, layout: &Layout) -> bool {
        [(&self.row_wires, layout.rows), (&self.column_wires, layout.columns)]
            .iter()
            .all(|(wires, count)| wires.is_empty() || wires.len() == *count)
    }
}

impl Frame {
    /// Refuses a frame that does not fit `layout`.
    pub(crate) fn check(&self, layout: &Layout) -> Result<()> {
        let number = self.number;
        let refuse = |field, rule: String| Err(Error::Frame { number, field, rule });
        let outputs = layout.outputs.len();
        let lengths = [
            ("readings", Some(&self.readings), layout.readings.len()),
            ("outputs", self.outputs.as_ref(), outputs),
            ("deviations", self.deviations.as_ref(), outputs),
            ("truth", self.truth.as_ref(), outputs),
        ];
        for (field, values, expected) in lengths {
            if let Some(found) = values.map(Vec::len).filter(|found| *found != expected) {
                return refuse(field, format!("have {found} values, and the layout {expected}"));
            }
        }
        if self.deviations.is_some() && self.outputs.is_none() {
            return refuse("deviations", "need outputs".into());
        }
        if self.status.as_ref().is_some_and(|status| !status.fits(layout)) {
            return refuse("status", "has another number of wires than the layout".into());
        }
        Ok(())
    }
}
