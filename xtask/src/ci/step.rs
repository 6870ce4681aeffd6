//! One step of CI: a command whose output is kept until it ends, because others run at the same time.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::process::Outcome;

/// Start of the line in which cargo, or a program of this project, says why it failed.
const CAUSE: &str = "error: ";

/// A step to be run.
pub struct Step {
    pub name: &'static str,
    pub command: Command,
}

/// A step that has ended, with its outcome.
#[derive(Debug, PartialEq, Eq)]
pub struct Ended {
    pub name: &'static str,
    pub time: Duration,
    pub outcome: Outcome,
    /// Everything that the step printed.
    pub output: String,
}

impl Step {
    /// Runs the step to its end. Its output goes to a file in `directory` meanwhile.
    pub fn run(mut self, directory: &Path) -> Ended {
        let start = Instant::now();
        let log = directory.join(format!("{}.log", self.name));
        let outcome = into_file(&mut self.command, &log);
        let output = fs::read(&log).unwrap_or_default();
        let output = String::from_utf8_lossy(&output).into_owned();
        let outcome = outcome.and_then(|success| {
            if success {
                Ok(())
            } else {
                Err(cause(&output).unwrap_or("it does not say why").to_owned())
            }
        });
        Ended { name: self.name, time: start.elapsed(), outcome, output }
    }
}

/// Runs `command` with its output in the file `log`; returns whether it succeeds.
fn into_file(command: &mut Command, log: &Path) -> Outcome<bool> {
    let failed = |cause: std::io::Error| format!("{}: {cause}", log.display());
    let file = File::create(log).map_err(failed)?;
    let errors = file.try_clone().map_err(failed)?;
    command.stdin(Stdio::null()).stdout(file).stderr(errors);
    let program = command.get_program().display().to_string();
    let status = command.status().map_err(|cause| format!("cannot start {program}: {cause}"))?;
    Ok(status.success())
}

/// The output from the last cause of a failure to the end.
fn cause(output: &str) -> Option<&str> {
    let start = output.rfind(&format!("\n{CAUSE}")).map(|at| at + 1);
    let start = start.or(output.starts_with(CAUSE).then_some(0))?;
    Some(output[start..].trim_start_matches(CAUSE).trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_cause_is_told() {
        assert_eq!(cause("error: a\nb\n"), Some("a\nb"));
        assert_eq!(cause("error: a\n\nerror: b\n  c\n"), Some("b\n  c"));
        assert_eq!(cause("no error: here\n"), None);
    }

    #[cfg(unix)]
    #[test]
    fn what_a_step_writes_is_kept_whole_in_its_order() {
        let directory = std::env::temp_dir().join(format!("taxel-step-{}", std::process::id()));
        fs::create_dir_all(&directory).unwrap();
        let run = |name, script: &str| {
            let mut command = Command::new("sh");
            command.args(["-c", script]);
            let ended = Step { name, command }.run(&directory);
            (ended.outcome, ended.output)
        };
        assert_eq!(run("well", "echo a; echo b >&2; echo c"), (Ok(()), "a\nb\nc\n".into()));
        let (outcome, output) = run("badly", "echo error: no; exit 1");
        assert_eq!((outcome, output.as_str()), (Err("no".into()), "error: no\n"));
        assert_eq!(run("silently", "exit 1").0, Err("it does not say why".into()));
        let missing = Step { name: "missing", command: Command::new("/no/such/program") };
        assert!(missing.run(&directory).outcome.unwrap_err().starts_with("cannot start /no/such"));
        fs::remove_dir_all(&directory).unwrap();
    }
}
