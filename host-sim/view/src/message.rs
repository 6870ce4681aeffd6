//! What a view shows, in the words of its page: each struct is the JSON of one event.
//!
//! A number that is missing is NaN here and `null` there.

use serde::Serialize;

/// What does not change from frame to frame: event `layout`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Layout {
    /// Title of the page, such as the name of the sensor or scene.
    pub title: String,
    /// Kind of the source.
    pub kind: Kind,
    /// Source in words, such as `/dev/ttyACM0, taxel-f446 0.1.0`.
    pub source: String,
    /// Number of row-wires; 0 if readings are not those of a matrix.
    pub rows: usize,
    /// Number of column-wires; 0 if readings are not those of a matrix.
    pub columns: usize,
    /// Readings of a frame, row by row.
    pub readings: Vec<Channel>,
    /// Outputs of a frame.
    pub outputs: Vec<Channel>,
    /// Electrodes of the sheet; empty if outputs are shown as values with traces.
    pub electrodes: Vec<Electrode>,
    /// Δz in mm at the end of the colour scale.
    pub scale_mm: f32,
    /// What the source can do.
    pub can: Can,
    /// Length of a recording in seconds.
    pub duration_s: Option<f64>,
}

/// Kind of a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A device, real or emulated.
    #[default]
    Device,
    /// A simulation, which knows the truth.
    Simulation,
    /// A recording.
    Recording,
}

/// Name and unit of a reading or an output.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Channel {
    /// Name, such as `r1c1`.
    pub name: String,
    /// Unit, such as `Ω`; empty if it has none.
    pub unit: String,
}

/// Contact on a wire of the upper layer whose deformation is decoded.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Electrode {
    /// Name, such as `r1e1`.
    pub name: String,
    /// Place x, y, z in mm in the unloaded sheet.
    pub place_mm: [f32; 3],
    /// Indices of the outputs Δx, Δy and Δz in mm; `None` if an axis is not decoded.
    pub outputs: [Option<usize>; 3],
}

/// What a source can do: buttons for the rest are not shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Can {
    /// Whether it can take a new baseline.
    pub zero: bool,
    /// Whether it can be recorded.
    pub record: bool,
    /// Whether it can be moved in time, slowed down and stepped.
    pub seek: bool,
}

/// One frame: event `frame`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Frame {
    /// Number, counted by the source.
    pub number: u64,
    /// Time in µs on the source's clock.
    pub time_us: u64,
    /// Age in ms when it is handed over; the page receives the age at sending.
    pub age_ms: f32,
    /// Readings in the order and the units of the layout; NaN for those that are missing.
    pub readings: Vec<f32>,
    /// Outputs in the order and the units of the layout.
    pub outputs: Vec<f32>,
    /// Standard deviations of the outputs, if the model knows them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviations: Option<Vec<f32>>,
    /// True outputs, if the source knows them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<Vec<f32>>,
    /// What is to be said of each row-wire, if the model decodes row by row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_status: Option<Vec<Option<Flag>>>,
    /// Novelty in nats, if the model knows it: above 0, the frame is unlike those of training.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub novelty: Option<f32>,
    /// What is to be said of the frame.
    pub flags: Vec<Flag>,
    /// Contact, while something touches.
    pub contact: Option<Contact>,
    /// Force in N along z, if it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f32>,
}

/// What is to be said of a frame or of a row of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Flag {
    /// It is unlike what the model was trained on.
    #[serde(rename = "novel")]
    Novel,
    /// Readings out of the model's range were moved to its end.
    #[serde(rename = "clamped")]
    Clamped,
    /// Readings are missing.
    #[serde(rename = "missing")]
    Missing,
}

/// A contact on the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Contact {
    /// Place x in mm.
    pub x_mm: f32,
    /// Place y in mm.
    pub y_mm: f32,
    /// Largest Δz in mm.
    pub depth_mm: f32,
}

/// How the source is: event `status`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Status {
    /// State of the source.
    pub state: State,
    /// State in words; if something is wrong, with what to do.
    pub message: String,
    /// Frames a second that are taken.
    pub scan_rate: Option<f32>,
    /// Frames a second that are decoded.
    pub decode_rate: Option<f32>,
    /// What is taken for the sensor at rest, in words; empty if the source tells it.
    pub rest: String,
    /// Number of frames that were lost on their way.
    pub lost: u64,
    /// Wires that are not good.
    pub wires: Vec<Wire>,
    /// Recording that is being written.
    pub recording: Option<Recording>,
    /// RMSE in mm of the outputs against the truth, over a stretch of time that the source chooses.
    pub rmse_mm: Option<f32>,
    /// RMSE as a multiple of the limit.
    pub times_limit: Option<f32>,
    /// Place in a recording in seconds.
    pub position_s: Option<f64>,
    /// Speed of a recording, 1 for that of the clock.
    pub speed: Option<f64>,
    /// Newest event of touch and its age, in words.
    pub event: Option<String>,
}

/// State of a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum State {
    /// Frames come.
    #[default]
    #[serde(rename = "live")]
    Live,
    /// It was told to wait.
    #[serde(rename = "paused")]
    Paused,
    /// Frames should come, and none does.
    #[serde(rename = "no data")]
    NoData,
    /// It has come to its end.
    #[serde(rename = "ended")]
    Ended,
}

/// A wire that is not good.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Wire {
    /// Wire: `row 3` or `column 5`, counted from 1.
    pub wire: String,
    /// What ails it.
    pub health: Health,
    /// The same in words, with what to do.
    pub words: String,
}

/// What ails a wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Health {
    /// It is interrupted.
    Open,
    /// It touches another conductor.
    Shorted,
    /// Its readings scatter more than they should.
    Noisy,
    /// Its readings do not come.
    Missing,
}

/// A recording that is being written.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Recording {
    /// File.
    pub file: String,
    /// Size in bytes.
    pub bytes: u64,
    /// Length in seconds.
    pub seconds: f64,
}
