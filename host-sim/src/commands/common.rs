//! What every command is given: options, and the call that it serves.

use std::fmt::Display;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use taxel_data::DataFile;

use crate::{Error, Result};

/// Options of every command, and who called it.
#[derive(clap::Args, Default)]
pub struct Common {
    /// Seed of every random draw, instead of the scene's or 1; it has no effect where nothing is drawn.
    #[arg(long, global = true)]
    pub seed: Option<u64>,
    /// Print the results as JSON.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print only errors on stderr: no notes, no progress.
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Print how long each stage takes, and the progress of long stages.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Name of the command, and when it began.
    #[clap(skip)]
    pub begun: Option<(String, Instant)>,
    /// Caller in this process, if there is one.
    #[clap(skip)]
    pub caller: Option<Caller>,
}

/// Caller of a command in this process, who gives it tables and is told its remarks.
pub struct Caller {
    /// Tables that are read under their paths, in place of files.
    pub tables: Vec<DataFile>,
    /// Flag that ends long work when it is set.
    pub stop: Arc<AtomicBool>,
    /// Remarks so far.
    pub remarks: Mutex<Vec<String>>,
}

impl Caller {
    /// What the caller was told.
    pub fn into_remarks(self) -> Vec<String> {
        self.remarks.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Common {
    /// Tells `text` to the caller; without one it is a line on stderr, unless that is to be quiet.
    pub fn remark(&self, text: impl Display) {
        match &self.caller {
            Some(caller) => {
                let remarks = caller.remarks.lock();
                remarks.unwrap_or_else(PoisonError::into_inner).push(text.to_string());
            }
            None if !self.quiet => eprintln!("{text}"),
            None => {}
        }
    }

    /// Table that the caller gives under this path.
    pub fn table(&self, path: &Path) -> Option<DataFile> {
        self.caller.as_ref()?.tables.iter().find(|table| table.path == path).cloned()
    }

    /// Seed as a scene's field, if one is given.
    pub fn seed_in_scene(&self) -> Result<Option<toml::Value>> {
        let Some(seed) = self.seed else { return Ok(None) };
        let most = i64::MAX;
        let refused =
            || Error::Usage(format!("--seed {seed}: give at most {most}, the most of a scene"));
        Ok(Some(i64::try_from(seed).map_err(|_| refused())?.into()))
    }
}
