//! Running other programs.

use std::env;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use rayon::prelude::*;

/// Result of a step: its value, or the reason why it failed.
pub type Outcome<T = ()> = Result<T, String>;

/// Root folder of the workspace.
pub fn root() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here)
}

/// Folder for cargo's builds for the host.
pub fn target_dir() -> PathBuf {
    root().join(env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

/// Text of a file, by its path from the root or an absolute one.
pub fn read(path: impl AsRef<Path>) -> Outcome<String> {
    let path = path.as_ref();
    fs::read_to_string(root().join(path)).map_err(|cause| format!("{}: {cause}", path.display()))
}

/// Command with the cargo that runs this program.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(root());
    command
}

/// Results of `work` on all `pieces`, in their order. Two are done at a time: a program in QEMU takes one core, and small
/// computers have two.
pub fn two_at_a_time<T: Sync, R: Send>(
    pieces: &[T],
    work: impl Fn(&T) -> R + Sync,
) -> Outcome<Vec<R>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
    let pool = pool.map_err(|cause| cause.to_string())?;
    Ok(pool.install(|| pieces.par_iter().with_max_len(1).map(&work).collect()))
}

/// Prints and runs `command`; its output is passed through.
pub fn run(command: &mut Command) -> Outcome {
    let status = status(command)?;
    ended_well(command, status)
}

/// Prints and runs `command`, and returns how it ended; its output is passed through.
pub fn status(command: &mut Command) -> Outcome<ExitStatus> {
    show(command);
    command.status().map_err(|cause| not_started(command, &cause))
}

/// Output and outcome of a piece of work that is done.
pub struct Said {
    pub out: String,
    pub err: String,
    pub outcome: Outcome,
}

/// Runs `command`, and returns its output.
pub fn capture(command: &mut Command) -> Said {
    let shown = shown(command);
    match command.output() {
        Ok(output) => Said {
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: shown + "\n" + &String::from_utf8_lossy(&output.stderr),
            outcome: ended_well(command, output.status),
        },
        Err(cause) => Said {
            out: String::new(),
            err: shown + "\n",
            outcome: Err(not_started(command, &cause)),
        },
    }
}

/// Result of a command whose messages are examined.
pub struct Watched {
    pub success: bool,
    /// Everything that the command wrote to stderr.
    pub messages: String,
}

/// Prints and runs `command`, and returns its stderr; with `echo`, also passes it through.
pub fn watch(command: &mut Command, echo: bool) -> Outcome<Watched> {
    show(command);
    let mut child =
        command.stderr(Stdio::piped()).spawn().map_err(|cause| not_started(command, &cause))?;
    let mut messages = String::new();
    if let Some(stderr) = child.stderr.take() {
        for line in BufReader::new(stderr).split(b'\n') {
            let line =
                line.map_err(|cause| format!("cannot read from {}: {cause}", name(command)))?;
            let line = String::from_utf8_lossy(&line);
            if echo {
                eprintln!("{line}");
            }
            messages.push_str(&line);
            messages.push('\n');
        }
    }
    let status = child.wait().map_err(|cause| format!("{}: {cause}", name(command)))?;
    Ok(Watched { success: status.success(), messages })
}

/// The first line that `program` prints, if it can be run.
pub fn first_line(program: impl AsRef<Path>, arguments: &[&str]) -> Option<String> {
    let output =
        Command::new(program.as_ref()).args(arguments).current_dir(root()).output().ok()?;
    if !output.status.success() {
        return None;
    }
    Some(String::from_utf8(output.stdout).ok()?.lines().next()?.to_owned())
}

fn name(command: &Command) -> String {
    let program = Path::new(command.get_program());
    program.file_name().unwrap_or(program.as_os_str()).to_string_lossy().into_owned()
}

fn show(command: &Command) {
    eprintln!("{}", shown(command));
}

fn shown(command: &Command) -> String {
    let arguments: Vec<_> = command.get_args().map(|a| a.to_string_lossy()).collect();
    format!("$ {} {}", name(command), arguments.join(" "))
}

fn ended_well(command: &Command, status: ExitStatus) -> Outcome {
    if status.success() { Ok(()) } else { Err(format!("{} ended with {status}", name(command))) }
}

fn not_started(command: &Command, cause: &std::io::Error) -> String {
    format!("cannot start {}: {cause}", command.get_program().display())
}
