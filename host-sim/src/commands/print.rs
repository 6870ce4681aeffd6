//! Printing of results on stdout: aligned tables for people, JSON for programs.

use std::fmt::{Display, Write as _};
use std::io::{self, ErrorKind, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::report::Sections;
use crate::{Error, Result};
use serde::Serialize;
use taxel_data::error::printable;
use taxel_data::output;

use super::{Common, captured, stdout};

/// Page of text for people, printed as a whole.
#[derive(Default)]
pub struct Page(String);

impl Page {
    /// Adds a line.
    pub fn line(&mut self, line: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "{line}");
    }

    /// Page of one line.
    pub fn of(line: impl Display) -> Self {
        let mut page = Self::default();
        page.line(line);
        page
    }

    /// Page of a result.
    pub fn of_sections(sections: &Sections) -> Self {
        Self(sections.text())
    }

    /// Prints the page.
    pub fn print(self) -> Result<()> {
        show(&printable(&self.0))
    }
}

/// Whether stdout is taken by an output, so that results go to stderr.
static STDOUT_IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// Checks before long work that an output can be written to `path`, and would replace none of the `inputs`. If it is
/// stdout, results go to stderr from now on.
pub fn check_output(path: &Path, inputs: &[&Path]) -> Result<()> {
    if output::is_stdout(path) {
        if stdout::was_closed() {
            return Err(taxel_data::Error::write(path, io::Error::other("stdout is closed")).into());
        }
        STDOUT_IS_TAKEN.store(true, Ordering::Relaxed);
    }
    Ok(output::check_writable(path, inputs)?)
}

/// Shows a result; a reader who has seen enough (`| head`) is no failure.
pub fn show(text: &str) -> Result<()> {
    if captured::keep_result(text) {
        return Ok(());
    }
    let (place, written) = if STDOUT_IS_TAKEN.load(Ordering::Relaxed) {
        ("stderr", io::stderr().write_all(text.as_bytes()))
    } else {
        ("stdout", io::stdout().write_all(text.as_bytes()))
    };
    match written {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            Err(Error::failed(format!("cannot write to {place}: {cause}")))
        }
        _ => Ok(()),
    }
}

/// Command that was begun last, and when.
static BEGUN: Mutex<(String, Option<Instant>)> = Mutex::new((String::new(), None));

/// Notes that `command` begins, for what [`json`] says of it.
pub fn begin(command: &str) {
    *BEGUN.lock().unwrap_or_else(PoisonError::into_inner) = (command.into(), Some(Instant::now()));
}

/// Result as JSON for a file, which is the same whenever it is written.
pub fn json_text(result: &impl Serialize) -> Result<String> {
    Ok(document(&object(result)?, false))
}

/// Result as JSON for a file, which is the same whenever it is written.
pub fn file_of(sections: &Sections) -> String {
    document(&sections.json(), false)
}

fn object(result: &impl Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(result);
    text.map_err(|cause| Error::failed(format!("cannot write JSON: {cause}")))
}

/// Object of a result with what all commands say (docs/json.md): the time since the command began only if it is `timed`.
fn document(object: &str, timed: bool) -> String {
    let (command, begun) = BEGUN.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let version = env!("CARGO_PKG_VERSION");
    let seconds = begun.filter(|_| timed).map(|begun| begun.elapsed().as_secs_f64());
    let seconds = seconds.map_or(String::new(), |it| format!("\n  \"seconds\": {it},"));
    let head = format!("{{\n  \"version\": \"{version}\",\n  \"command\": \"{command}\",{seconds}");
    object.replacen('{', &head, 1) + "\n"
}

/// Prints the result of the command as JSON.
pub fn json(result: &impl Serialize) -> Result<()> {
    show(&document(&object(result)?, true))
}

/// Prints the result of the command: as JSON if that was asked for, else as text.
pub fn sections(common: &Common, sections: &Sections) -> Result<()> {
    sections_above(common, sections, &[])
}

/// Prints the result of the command: as JSON if that was asked for, else as text above `more` lines.
pub fn sections_above(common: &Common, sections: &Sections, more: &[String]) -> Result<()> {
    if common.json {
        return show(&document(&sections.json(), true));
    }
    let mut page = Page::of_sections(sections);
    more.iter().for_each(|line| page.line(line));
    page.print()
}

/// Prints the result of the command: as JSON if that was asked for, else as a page.
pub fn result(common: &Common, result: &impl Serialize, page: impl FnOnce() -> Page) -> Result<()> {
    if common.json { json(result) } else { page().print() }
}
