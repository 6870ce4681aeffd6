//! Results on disk: one file a point, which is whole or not there.
//!
//! A file begins with the CRC-64 of all that follows, so that one that was cut off or changed is noticed. No other process
//! can do harm: what is written is renamed into place, and has the same bytes whoever computed it.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use taxel_data::digest::digest;
use taxel_data::output;

use super::judge::Outcome;
use super::plan::{Plan, Point};
use super::point::Results;
use crate::error::{Error, Result};
use crate::evaluate::paper_networks::Cell;
use crate::metrics::Blocks;

/// Result of a point, as its file has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Digest of all that decides the result.
    pub id: String,
    /// Program that computed it.
    pub build: String,
    /// Results by their names.
    pub results: BTreeMap<String, f64>,
    /// Parts of blocks of frames in errors.
    pub blocks: Blocks,
    /// Remarks on them.
    pub notes: Vec<String>,
    /// Errors of a cell of Table 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell: Option<Cell>,
    /// Sum of the squared errors of each output on a fold that is held out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub squares: Vec<f64>,
    /// Reason why there are none.
    pub failed: Option<String>,
}

/// State of a point's file.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    Missing,
    Whole(Box<Record>),
    /// File that is no result of this point, and why.
    Unusable(String),
}

/// Folder of results.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
}

impl Record {
    /// Record of what became of a point.
    pub fn new(plan: &Plan, point: &Point, outcome: Outcome) -> Self {
        let (outcome, failed) = match outcome {
            Ok(results) => (results, None),
            Err(why) => (Results::default(), Some(why)),
        };
        Self {
            id: point.id.clone(),
            build: plan.build.clone(),
            results: outcome.values,
            blocks: outcome.blocks,
            notes: outcome.notes,
            cell: outcome.cell,
            squares: outcome.squares,
            failed,
        }
    }

    fn text(&self) -> Result<String> {
        let json = serde_json::to_string(self).map_err(|cause| Error::failed(cause.to_string()))?;
        let rest = format!("{}\n", &json[1..]);
        Ok(format!("{START}{:016x}\",{rest}", digest(rest.as_bytes())))
    }

    /// Record in a file's text.
    fn parse(text: &str) -> std::result::Result<Self, String> {
        let foreign = || "it is not a result of a sweep".to_owned();
        let after = text.strip_prefix(START).ok_or_else(foreign)?;
        let (crc, rest) = after.split_once("\",").ok_or_else(foreign)?;
        if u64::from_str_radix(crc, 16) != Ok(digest(rest.as_bytes())) {
            return Err("it is damaged: its CRC does not match its content".into());
        }
        serde_json::from_str(&format!("{{{rest}"))
            .map_err(|cause| format!("it is not a result: {cause}"))
    }
}

/// Start of every file.
const START: &str = "{\"crc64\":\"";

impl Store {
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.into() }
    }

    /// File of the point with this id.
    pub fn path(&self, id: &str) -> PathBuf {
        self.folder.join(format!("{id}.json"))
    }

    /// Reads the file of a point.
    ///
    /// # Errors
    /// [`Error`] for a file that is there and cannot be read.
    pub fn find(&self, plan: &Plan, point: &Point) -> Result<Found> {
        let path = self.path(&point.id);
        let text = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(cause) if cause.kind() == ErrorKind::NotFound => return Ok(Found::Missing),
            Err(cause) => return Err(taxel_data::Error::read(&path, cause).into()),
        };
        let Ok(text) = String::from_utf8(text) else {
            return Ok(Found::Unusable("it is not text".into()));
        };
        Ok(match Record::parse(&text) {
            Err(why) => Found::Unusable(why),
            Ok(record) if record.id != point.id => {
                Found::Unusable(format!("it is the result of another point, {}", record.id))
            }
            Ok(record) if record.build != plan.build => {
                Found::Unusable(format!("it was computed by another program, {}", record.build))
            }
            Ok(record) => Found::Whole(Box::new(record)),
        })
    }

    /// Writes the file of a point.
    ///
    /// # Errors
    /// [`Error`] if it cannot be written; the file is then as it was.
    pub fn write(&self, record: &Record) -> Result<()> {
        fs::create_dir_all(&self.folder)
            .map_err(|cause| taxel_data::Error::write(&self.folder, cause))?;
        Ok(output::write_bytes(&self.path(&record.id), record.text()?.as_bytes())?)
    }

    /// Names of the other files in the folder that look like results: of another plan, or another program.
    pub fn others(&self, points: &[Point]) -> Vec<String> {
        let ids: std::collections::HashSet<&str> =
            points.iter().map(|point| point.id.as_str()).collect();
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
        let mut others: Vec<String> = names
            .filter(|name| {
                let id = name.strip_suffix(".json");
                let is_id =
                    |id: &&str| id.len() == 16 && id.bytes().all(|byte| byte.is_ascii_hexdigit());
                id.filter(is_id).is_some_and(|id| !ids.contains(id))
            })
            .collect();
        others.sort_unstable();
        others
    }
}
