//! What every frame of a recording has, and what goes with it.

use std::collections::BTreeMap;

use crate::error::{Error, Result, at_most};

/// Version of the format.
pub const FORMAT: &str = "1";
/// Largest number of readings, of outputs and of electrodes.
pub const MOST_COLUMNS: usize = 32_768;
/// Largest size of all names and units, some of which stand in each message.
const MOST_NAME_BYTES: usize = 512 << 10;
/// Largest size of the settings.
const MOST_SETTINGS_BYTES: usize = 4 << 20;
/// Largest size of the layout's text, and of the settings with the lengths of their names and values.
pub const MOST_TEXT_BYTES: usize = 8 << 20;
/// Largest size of a weight blob.
pub const MOST_BLOB_BYTES: usize = 16 << 20;
/// Largest size of a scene.
pub const MOST_SCENE_BYTES: usize = 4 << 20;

/// Reading or output of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name, as in a CSV file.
    pub name: String,
    /// Unit; "" if there is none, or it is not known.
    pub unit: String,
}

/// Point of the sensor that moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Electrode {
    /// Name.
    pub name: String,
    /// Place at rest: x, y, z in mm.
    pub place_mm: [f64; 3],
    /// Which of the layout's outputs are its deformation along x, y and z, counted from 0. Their unit is mm, and a
    /// deformation moves the electrode from its place to place − deformation.
    pub outputs: [Option<usize>; 3],
}

/// What every frame of a recording has.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Title, for people.
    pub title: String,
    /// Number of rows of readings.
    pub rows: usize,
    /// Number of columns of readings.
    pub columns: usize,
    /// Readings, row by row: rows × columns.
    pub readings: Vec<Column>,
    /// Outputs of the model, or of the simulation.
    pub outputs: Vec<Column>,
    /// Electrodes that outputs belong to.
    pub electrodes: Vec<Electrode>,
}

/// What goes with a recording's frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extras {
    /// Weight blob that decoded the frames.
    pub blob: Option<Vec<u8>>,
    /// Text of the scene.
    pub scene: Option<String>,
    /// Further settings by name.
    pub settings: BTreeMap<String, String>,
    /// Frame of ROS that the sensor's frame, `taxel`, stands in.
    pub parent_frame: String,
}

impl Default for Extras {
    fn default() -> Self {
        let (blob, scene, settings) = (None, None, BTreeMap::new());
        Self { blob, scene, settings, parent_frame: "world".into() }
    }
}

impl Extras {
    /// Refuses what is too large, or is no name of a frame.
    pub(crate) fn check(&self) -> Result<()> {
        let length = |bytes: Option<usize>| bytes.unwrap_or(0) as u64;
        let blob = length(self.blob.as_ref().map(Vec::len));
        at_most(MOST_BLOB_BYTES as u64, blob, "bytes of the model")?;
        let scene = length(self.scene.as_ref().map(String::len));
        at_most(MOST_SCENE_BYTES as u64, scene, "bytes of the scene")?;
        at_most(MOST_COLUMNS as u64, self.settings.len() as u64, "settings")?;
        let bytes =
            self.settings.iter().map(|(name, value)| name.len() + value.len()).sum::<usize>();
        at_most(MOST_SETTINGS_BYTES as u64, bytes as u64, "bytes of settings")?;
        check_text("the parent frame", &self.parent_frame)?;
        if self.parent_frame.is_empty() || self.parent_frame == "taxel" {
            return Err(Error::layout(format!("{:?} is not a parent frame", self.parent_frame)));
        }
        Ok(())
    }
}

impl Layout {
    /// Refuses a layout that cannot be recorded.
    ///
    /// # Errors
    /// [`Error::Layout`] or [`Error::TooMany`].
    pub fn check(&self) -> Result<()> {
        let Self { rows, columns, readings, outputs, electrodes, .. } = self;
        for (count, what) in [
            (readings.len(), "readings"),
            (outputs.len(), "outputs"),
            (electrodes.len(), "electrodes"),
        ] {
            at_most(MOST_COLUMNS as u64, count as u64, what)?;
        }
        if readings.is_empty() || rows.checked_mul(*columns) != Some(readings.len()) {
            let count = readings.len();
            return Err(Error::layout(format!(
                "{rows} × {columns} wires cannot have {count} readings"
            )));
        }
        check_text("the title", &self.title)?;
        for column in readings.iter().chain(outputs) {
            check_text("a name", &column.name)?;
            check_text("a unit", &column.unit)?;
        }
        let columns = readings.iter().chain(outputs);
        let names: usize = columns.map(|column| column.name.len() + column.unit.len()).sum();
        let names = names + electrodes.iter().map(|electrode| electrode.name.len()).sum::<usize>();
        at_most(MOST_NAME_BYTES as u64, names as u64, "bytes of names")?;
        let mut is_taken = vec![false; outputs.len()];
        for Electrode { name, place_mm, outputs: axes } in electrodes {
            check_text("an electrode's name", name)?;
            if !place_mm.iter().all(|place| place.is_finite()) {
                return Err(Error::layout(format!("electrode {name} has no place")));
            }
            for &output in axes.iter().flatten() {
                let unit = outputs.get(output).map(|column| column.unit.as_str());
                if unit != Some("mm") {
                    let rule =
                        format!("electrode {name}: output {} is not a column in mm", output + 1);
                    return Err(Error::layout(rule));
                }
                if std::mem::replace(&mut is_taken[output], true) {
                    let rule = format!("output {} belongs to two electrodes", output + 1);
                    return Err(Error::layout(rule));
                }
            }
        }
        Ok(())
    }

    /// Outputs that belong to no electrode.
    pub(crate) fn free_outputs(&self) -> Vec<usize> {
        let taken: Vec<usize> =
            self.electrodes.iter().flat_map(|it| it.outputs).flatten().collect();
        let mut is_free = vec![true; self.outputs.len()];
        taken.iter().for_each(|&output| is_free[output] = false);
        (0..self.outputs.len()).filter(|&output| is_free[output]).collect()
    }

    /// Layout as names and texts: a line a column, with tabs between its fields.
    pub(crate) fn to_texts(&self) -> BTreeMap<String, String> {
        let lines = |columns: &[Column]| {
            columns.iter().flat_map(|it| [&it.name, "\t", &it.unit, "\n"]).collect::<String>()
        };
        let electrode = |Electrode { name, place_mm: [x, y, z], outputs }: &Electrode| {
            let [dx, dy, dz] =
                outputs.map(|output| output.map_or("-".into(), |it| (it + 1).to_string()));
            format!("{name}\t{x:?}\t{y:?}\t{z:?}\t{dx}\t{dy}\t{dz}\n")
        };
        let texts: [(&str, String); 8] = [
            ("format", FORMAT.into()),
            ("title", self.title.clone()),
            ("rows", self.rows.to_string()),
            ("columns", self.columns.to_string()),
            ("readings", lines(&self.readings)),
            ("outputs", lines(&self.outputs)),
            ("electrodes", self.electrodes.iter().map(electrode).collect()),
            (
                "units",
                "Messages are in m, N and N m, but /taxel/readings and /taxel/outputs, which are in the units of their \
                 columns. Places of electrodes in this record are in mm; the last three numbers are the outputs, counted \
                 from 1, that move them along x, y and z."
                    .into(),
            ),
        ];
        texts.map(|(name, text)| (name.to_string(), text)).into()
    }

    /// Height in mm of the electrodes that are highest at rest; 0 without any.
    pub(crate) fn surface_mm(&self) -> f64 {
        let heights = self.electrodes.iter().map(|electrode| electrode.place_mm[2]);
        heights.reduce(f64::max).unwrap_or(0.0)
    }

    /// Layout of names and texts.
    ///
    /// # Errors
    /// [`Error::Foreign`] for a text that is missing or none of a layout; [`Error::OtherFormat`]; errors of
    /// [`check`](Self::check).
    pub(crate) fn from_texts(texts: &BTreeMap<String, String>) -> Result<Self> {
        let text = |name: &str| {
            let text = texts.get(name).map(String::as_str);
            text.ok_or_else(|| Error::Foreign(format!("{name:?} in its metadata record `taxel`")))
        };
        let format = text("format")?;
        if format != FORMAT {
            let found = format.chars().take(20).collect();
            return Err(Error::OtherFormat { found, known: FORMAT });
        }
        let unfit =
            |name: &str| Error::Foreign(format!("a sound {name:?} in its metadata record `taxel`"));
        let count = |name| text(name)?.parse().map_err(|_| unfit(name));
        let columns = |name| -> Result<Vec<Column>> {
            let column = |line: &str| {
                let (name, unit) = line.split_once('\t')?;
                Some(Column { name: name.into(), unit: unit.into() })
            };
            // One more than allowed is refused by `check`.
            let lines = text(name)?.lines().take(MOST_COLUMNS + 1);
            lines.map(column).collect::<Option<_>>().ok_or_else(|| unfit(name))
        };
        let electrodes = text("electrodes")?.lines().take(MOST_COLUMNS + 1).map(electrode);
        let layout = Self {
            title: text("title")?.into(),
            rows: count("rows")?,
            columns: count("columns")?,
            readings: columns("readings")?,
            outputs: columns("outputs")?,
            electrodes: electrodes.collect::<Option<_>>().ok_or_else(|| unfit("electrodes"))?,
        };
        layout.check()?;
        Ok(layout)
    }
}

/// Electrode of a line.
fn electrode(line: &str) -> Option<Electrode> {
    let mut fields = line.split('\t');
    let name = fields.next()?.into();
    let mut place_mm = [0.0; 3];
    for place in &mut place_mm {
        *place = fields.next()?.parse().ok()?;
    }
    let mut outputs = [None; 3];
    for output in &mut outputs {
        *output = match fields.next()? {
            "-" => None,
            number => Some(number.parse::<usize>().ok()?.checked_sub(1)?),
        };
    }
    fields.next().is_none().then_some(Electrode { name, place_mm, outputs })
}

/// Refuses a text that does not fit a line.
fn check_text(what: &str, text: &str) -> Result<()> {
    if text.chars().any(char::is_control) {
        return Err(Error::layout(format!("{what} holds a tab or a line end: {text:?}")));
    }
    at_most(1000, text.len() as u64, "bytes of a name")
}
