//! Jobs of the program host-sim that are ended before they are done, and what they must leave behind.

mod device;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::scratch::{Files, Folder, files_of};
use device::Device;

/// Folder of a place that all outputs are in. `run` and `trade` name it after the scene.
const DATA: &str = "data";

const SCENE: &str = include_str!("jobs/scene.toml");
const TABLE1: &str = include_str!("jobs/table1.toml");

/// The longest time of a job that does not hang.
const PATIENCE: Duration = Duration::from_mins(1);

/// Exit status of a Rust program that panics.
const PANICKED: i32 = 101;

/// Where a job is done.
pub struct Place {
    folder: Folder,
    device: Option<Device>,
}

impl Place {
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Whether there is a temporary among the outputs: the job has begun to write.
    pub fn has_temporary(&self) -> bool {
        let entries = fs::read_dir(self.path().join(DATA)).into_iter().flatten().flatten();
        entries.map(|entry| entry.file_name()).any(|name| name.as_encoded_bytes().starts_with(b"."))
    }
}

/// How a job ended.
#[derive(Debug)]
pub struct Outcome {
    pub status: ExitStatus,
    pub message: String,
    /// Whether a panic is expected: Rust's own library panics if a folder cannot be closed.
    pub may_panic: bool,
}

/// A command, the files that an earlier run of it has left, and those that it writes.
pub struct Job {
    program: PathBuf,
    name: &'static str,
    arguments: &'static [&'static str],
    old: Files,
    new: Files,
    took: Duration,
}

/// Name, arguments of the earlier run, and arguments of the job. `PORT` is the port of a device.
type Commands = (&'static str, &'static [&'static str], &'static [&'static str]);

const COMMANDS: [Commands; 5] = [
    (
        "synth",
        &["synth", "scene.toml", "-n", "300", "-o", "data/y.csv"],
        &["synth", "scene.toml", "-n", "3000", "--seed", "2", "-o", "data/y.csv"],
    ),
    ("run", &["run", "table1.toml", "-o", "."], &["run", "scene.toml", "--seed", "2", "-o", "."]),
    (
        "train",
        &["train", "scene.toml", "-o", "data/m.bin"],
        &["train", "scene.toml", "--seed", "2", "-o", "data/m.bin"],
    ),
    (
        "trade",
        &[
            "trade",
            "scene.toml",
            "-o",
            ".",
            "--centres",
            "4",
            "--output-rank",
            "none",
            "--gate",
            "none",
            "--max-flash",
            "100000",
        ],
        &[
            "trade",
            "scene.toml",
            "-o",
            ".",
            "--centres",
            "4",
            "--output-rank",
            "none",
            "--gate",
            "none",
            "--seed",
            "2",
        ],
    ),
    (
        "link record",
        &["link", "PORT", "record", "-n", "9", "-o", "data/r.csv"],
        &["link", "PORT", "record", "-n", "60", "-o", "data/r.csv"],
    ),
];

impl Job {
    /// All jobs.
    ///
    /// # Errors
    /// One that is not ended fails.
    pub fn all(program: &Path) -> Result<Vec<Self>, String> {
        COMMANDS.iter().map(|commands| Self::new(program, *commands)).collect()
    }

    /// `synth` and `run`: a single file, and files that belong together.
    ///
    /// # Errors
    /// One that is not ended fails.
    pub fn of_each_kind(program: &Path) -> Result<[Self; 2], String> {
        Ok([Self::new(program, COMMANDS[0])?, Self::new(program, COMMANDS[1])?])
    }

    fn new(program: &Path, (name, before, arguments): Commands) -> Result<Self, String> {
        let empty = Files::new();
        let (took, program) = (Duration::ZERO, program.to_path_buf());
        let mut job =
            Self { program, name, arguments: before, old: empty.clone(), new: empty, took };
        job.old = job.whole()?.0;
        job.arguments = arguments;
        (job.new, job.took) = job.whole()?;
        if job.old == job.new { Err(format!("{name}: both runs write the same")) } else { Ok(job) }
    }

    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Time that the job takes if it is not ended.
    pub fn took(&self) -> Duration {
        self.took
    }

    /// Bytes of the largest file that it writes.
    pub fn largest(&self) -> usize {
        self.new.values().map(Vec::len).max().unwrap_or(0)
    }

    /// Files and time of the job, if it is not ended.
    fn whole(&self) -> Result<(Files, Duration), String> {
        let place = self.place()?;
        let start = Instant::now();
        self.complete(&place)?;
        Ok((files_of(&place.path().join(DATA))?, start.elapsed()))
    }

    /// Does the whole job.
    fn complete(&self, place: &Place) -> Result<(), String> {
        let output = self.command(place).output();
        let output = output.map_err(|cause| format!("{}: {cause}", self.name))?;
        if output.status.success() {
            return Ok(());
        }
        let message = String::from_utf8_lossy(&output.stderr);
        Err(format!("{} fails though nothing ends it: {}", self.name, message.trim()))
    }

    /// A new place, with the files of the earlier run.
    ///
    /// # Errors
    /// It cannot be made, in words.
    pub fn place(&self) -> Result<Place, String> {
        let folder = Folder::new()?;
        let told = |cause| format!("{}: {cause}", folder.path().display());
        let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes);
        fs::create_dir(folder.path().join(DATA)).map_err(told)?;
        write("scene.toml", SCENE.as_bytes()).map_err(told)?;
        write("table1.toml", format!("{SCENE}{TABLE1}").as_bytes()).map_err(told)?;
        for (name, bytes) in &self.old {
            write(&format!("{DATA}/{name}"), bytes).map_err(told)?;
        }
        let needs_device = self.arguments.contains(&"PORT");
        let device = needs_device.then(Device::start).transpose()?;
        Ok(Place { folder, device })
    }

    /// The job as a command of its own.
    pub fn command(&self, place: &Place) -> Command {
        self.under(Command::new(&self.program), place, false)
    }

    /// The job as the last arguments of another command.
    pub fn under(&self, mut command: Command, place: &Place, with_program: bool) -> Command {
        if with_program {
            command.arg(&self.program);
        }
        let port = place.device.as_ref().map_or("", Device::port);
        let arguments = self.arguments.iter().map(|it| if *it == "PORT" { port } else { *it });
        command.args(arguments).current_dir(place.path()).env("RAYON_NUM_THREADS", "1");
        command.env("RUST_BACKTRACE", "0");
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }

    /// Judges what is left.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn judge(&self, place: &Place, outcome: &Outcome) -> Result<(), String> {
        let data = place.path().join(DATA);
        let (hidden, seen): (Files, Files) =
            files_of(&data)?.into_iter().partition(|(name, _)| name.starts_with('.'));
        let names = || hidden.keys().chain(seen.keys()).cloned().collect::<Vec<_>>().join(" ");
        let Outcome { status, message, may_panic } = outcome;
        if status.code() == Some(PANICKED) && !may_panic {
            let first: Vec<&str> = message.trim().lines().take(2).collect();
            return Err(format!("panic: {}", first.join(" ")));
        }
        if status.success() {
            let whole = seen == self.new && hidden.is_empty();
            return if whole { Ok(()) } else { Err(format!("done, but left {}", names())) };
        }
        // A panic where one is expected is like a kill.
        let is_killed = is_killed(*status) || status.code() == Some(PANICKED);
        let is_of = |run: &Files| seen.iter().all(|(name, bytes)| run.get(name) == Some(bytes));
        let is_one_run = seen == self.old || seen == self.new;
        // The next run completes it.
        let is_moving =
            hidden.keys().any(|name| name.ends_with(".ready/") || name.ends_with(".moving/"))
                && (is_of(&self.old) || is_of(&self.new));
        if !(is_one_run || is_killed && is_moving) {
            return Err(format!("{status}: files of both runs, or half of one: {}", names()));
        }
        if hidden.len() > usize::from(is_killed) {
            return Err(format!("{status}: temporaries stay: {}", names()));
        }
        if !hidden.is_empty() {
            self.complete(place)?;
            let found = files_of(&data)?;
            let names: Vec<&str> = found.keys().map(String::as_str).collect();
            if found != self.new {
                return Err(format!("the next run left {}", names.join(" ")));
            }
        }
        Ok(())
    }
}

/// Waits until a job has ended.
///
/// # Errors
/// It hangs, or cannot be waited for.
pub fn wait(mut child: Child, may_panic: bool) -> Result<Outcome, String> {
    let start = Instant::now();
    while is_running(&mut child)? {
        if start.elapsed() > PATIENCE {
            let _ = child.kill();
            let _ = child.wait();
            return Err("it hangs".into());
        }
        thread::sleep(Duration::from_millis(1));
    }
    let output = child.wait_with_output().map_err(|cause| format!("wait: {cause}"))?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    Ok(Outcome { status: output.status, message, may_panic })
}

/// Whether a job has not ended yet.
///
/// # Errors
/// That cannot be told.
pub fn is_running(child: &mut Child) -> Result<bool, String> {
    child.try_wait().map(|status| status.is_none()).map_err(|cause| format!("wait: {cause}"))
}

fn is_killed(status: ExitStatus) -> bool {
    std::os::unix::process::ExitStatusExt::signal(&status) == Some(9)
}
