//! Results of commands as they are printed: aligned tables for people, JSON for programs.

use std::fmt::{Display, Write as _};
use std::io::{self, ErrorKind, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::report::Sections;
use crate::{Error, Result};
use taxel_data::error::printable;
use taxel_data::output;

use super::{Common, stdout};

/// Page of text for people, printed as a whole.
#[derive(Default)]
pub struct Page(String);

impl Page {
    /// Adds a line.
    pub fn line(&mut self, line: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "{line}");
    }

    /// Page of a result.
    pub fn of_sections(sections: &Sections) -> Self {
        Self(sections.text())
    }

    /// The page as what a command found.
    pub fn outcome(self) -> Outcome {
        Outcome::of(printable(&self.0).into())
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

/// What a command found, as it is to be printed.
#[derive(Default)]
pub struct Outcome {
    pub text: String,
    /// Reason why the command failed, though it found something.
    pub failure: Option<Error>,
}

impl Outcome {
    /// Outcome with this text.
    pub fn of(text: String) -> Self {
        Self { text, failure: None }
    }

    /// This outcome of a command that failed, if `outcome` is an error.
    #[must_use]
    pub fn and(self, outcome: Result<()>) -> Self {
        Self { failure: outcome.err(), ..self }
    }

    /// Prints it; a reader who has seen enough (`| head`) is no failure.
    ///
    /// # Errors
    /// The failure of the command, and an error of the write.
    pub fn print(self) -> Result<()> {
        let text = self.text.as_bytes();
        let (place, written) = if STDOUT_IS_TAKEN.load(Ordering::Relaxed) {
            ("stderr", io::stderr().write_all(text))
        } else {
            ("stdout", io::stdout().write_all(text))
        };
        match written {
            Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
                Err(Error::failed(format!("cannot write to {place}: {cause}")))
            }
            _ => self.failure.map_or(Ok(()), Err),
        }
    }
}

/// Result as JSON for a file, which is the same whenever it is written.
pub fn file_of(common: &Common, sections: &Sections) -> String {
    document(common, &sections.json(), false)
}

/// Object of a result with what all commands say (docs/json.md): the time since the command began only if it is `timed`.
fn document(common: &Common, object: &str, timed: bool) -> String {
    let begun = common.begun.as_ref();
    let command = begun.map_or("", |(command, _)| command);
    let version = env!("CARGO_PKG_VERSION");
    let seconds = begun.filter(|_| timed).map(|(_, begun)| begun.elapsed().as_secs_f64());
    let seconds = seconds.map_or(String::new(), |it| format!("\n  \"seconds\": {it},"));
    let head = format!("{{\n  \"version\": \"{version}\",\n  \"command\": \"{command}\",{seconds}");
    object.replacen('{', &head, 1) + "\n"
}

/// Result of the command: as JSON if that was asked for, else as text.
pub fn sections(common: &Common, sections: &Sections) -> Outcome {
    sections_above(common, sections, &[])
}

/// Result of the command: as JSON if that was asked for, else as text above `more` lines.
pub fn sections_above(common: &Common, sections: &Sections, more: &[String]) -> Outcome {
    if common.json {
        return Outcome::of(document(common, &sections.json(), true));
    }
    let mut page = Page::of_sections(sections);
    more.iter().for_each(|line| page.line(line));
    page.outcome()
}
