//! Commands that are killed, interrupted, or find the disk full, at moments drawn by the seed.

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rand_core::{Rng as _, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::scratch::{Files, Folder, files_of};
use crate::tools::Tools;

pub const JOBS: Promise = Promise {
    name: "file-jobs",
    text: "an ended job leaves whole files, old or new",
    share: 8,
    check: jobs,
};

const SCENE: &str = include_str!("interruptions/scene.toml");
const TABLE1: &str = include_str!("interruptions/table1.toml");

/// The longest time of a job that does not hang.
const PATIENCE: Duration = Duration::from_mins(1);

/// Exit status of a Rust program that panics.
const PANICKED: i32 = 101;

/// Folder of all outputs: `run` names it after the scene.
const DATA: &str = "data";

/// Arguments of an earlier run, and of the one that is ended.
const COMMANDS: [[&[&str]; 2]; 2] = [
    [
        &["synth", "scene.toml", "-n", "300", "-o", "data/y.csv"],
        &["synth", "scene.toml", "-n", "9000", "--seed", "2", "-o", "data/y.csv"],
    ],
    [&["run", "table1.toml", "-o", "."], &["run", "scene.toml", "--seed", "2", "-o", "."]],
];

/// A command, the files that an earlier run of it has left, and those that it writes.
struct Job<'p> {
    program: &'p Path,
    arguments: &'static [&'static str],
    old: Files,
    new: Files,
    took_us: u64,
}

fn jobs(effort: &Effort, tools: &Tools) -> Result<Found, String> {
    let program = tools.program()?;
    let jobs = COMMANDS.map(|[before, arguments]| {
        let empty = Files::new();
        let mut job =
            Job { program, arguments: before, old: empty.clone(), new: empty, took_us: 0 };
        job.old = job.whole()?;
        job.arguments = arguments;
        let start = Instant::now();
        job.new = job.whole()?;
        job.took_us = start.elapsed().as_micros() as u64;
        Ok(job)
    });
    let jobs = jobs.into_iter().collect::<Result<Vec<Job<'_>>, String>>()?;
    let least = if effort.is_planted() { 8 } else { 32 };
    let ended_early = AtomicU64::new(0);
    let mut found = effort.worst((least, 2000), (0.0, "broken"), |seed| {
        let job = &jobs[(seed % 2) as usize];
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut below = |bound: u64| random.next_u64() % bound.max(1);
        let largest = job.new.values().map(Vec::len).max().unwrap_or(0) as u64;
        let (limit, signal) = match seed / 2 % 4 {
            0 => (below(largest / 512 + 1).to_string(), None),
            kind => ("unlimited".into(), Some(["-KILL", "-INT", "-TERM"][kind as usize - 1])),
        };
        // In a self-test the job makes room for its outputs before it begins.
        let first = if effort.is_planted() { "rm -f data/*; " } else { "" };
        let moment = Duration::from_micros(below(job.took_us));
        let waits = below(2) == 0;
        let folder = job.folder()?;
        let status = job.run(&folder, &format!("ulimit -f {limit}; {first}"), |job| {
            thread::sleep(moment);
            // Half of all moments are soon after it begins to write.
            while waits && !has_temporary(folder.path()) && is_running(job)? {
                thread::yield_now();
            }
            // While it has not been waited for, its number belongs to nobody else.
            if let Some(signal) = signal {
                let mut kill = Command::new("kill");
                kill.args([signal, &job.id().to_string()]).stderr(Stdio::null());
                kill.status().map_err(|cause| format!("kill: {cause}"))?;
            }
            Ok(())
        })?;
        ended_early.fetch_add(u64::from(!status.success()), Ordering::Relaxed);
        let judged = job.judge(&folder, status);
        judged.map(|()| 0.0).map_err(|cause| format!("{}, {signal:?}: {cause}", job.arguments[0]))
    });
    if found.note.is_empty() {
        found.note = format!("{} jobs were ended before they were done", ended_early.into_inner());
    }
    Ok(found)
}

impl Job<'_> {
    /// Makes a folder with the files of the earlier run.
    fn folder(&self) -> Result<Folder, String> {
        let folder = Folder::new()?;
        let told = |cause| format!("{}: {cause}", folder.path().display());
        let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes);
        fs::create_dir(folder.path().join(DATA)).map_err(told)?;
        write("scene.toml", SCENE.as_bytes()).map_err(told)?;
        write("table1.toml", format!("{SCENE}{TABLE1}").as_bytes()).map_err(told)?;
        for (name, bytes) in &self.old {
            write(&format!("{DATA}/{name}"), bytes).map_err(told)?;
        }
        Ok(folder)
    }

    /// Runs the job in a shell, after the commands `first`; `end` may end it.
    fn run(
        &self,
        folder: &Folder,
        first: &str,
        end: impl FnOnce(&mut Child) -> Result<(), String>,
    ) -> Result<ExitStatus, String> {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("{first} exec \"$0\" \"$@\"")]).arg(self.program);
        shell.args(self.arguments).current_dir(folder.path()).env("RAYON_NUM_THREADS", "1");
        shell.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = shell.spawn().map_err(|cause| format!("sh: {cause}"))?;
        end(&mut child)?;
        let start = Instant::now();
        while is_running(&mut child)? {
            if start.elapsed() > PATIENCE {
                let _ = child.kill().and_then(|()| child.wait());
                return Err("it hangs".into());
            }
            thread::sleep(Duration::from_millis(1));
        }
        child.wait().map_err(|cause| format!("wait: {cause}"))
    }

    /// Files of the job if nothing ends it.
    fn whole(&self) -> Result<Files, String> {
        let folder = self.folder()?;
        let status = self.run(&folder, "", |_| Ok(()))?;
        if status.success() {
            files_of(&folder.path().join(DATA))
        } else {
            Err(format!("{} fails though nothing ends it: {status}", self.arguments[0]))
        }
    }

    /// Judges what is left.
    fn judge(&self, folder: &Folder, status: ExitStatus) -> Result<(), String> {
        let (hidden, seen): (Files, Files) = files_of(&folder.path().join(DATA))?
            .into_iter()
            .partition(|(name, _)| name.starts_with('.'));
        let is_whole = |(name, bytes): (&String, &Vec<u8>)| {
            [&self.old, &self.new].iter().any(|run| run.get(name) == Some(bytes))
        };
        let is_killed = status.signal() == Some(9);
        let has_all = self
            .old
            .keys()
            .filter(|name| self.new.contains_key(*name))
            .all(|name| seen.contains_key(name));
        match status.code() {
            Some(PANICKED) => Err("it panics".into()),
            Some(0) if seen != self.new => Err("done, but left other files".into()),
            _ if !is_killed && !hidden.is_empty() => Err(format!("{status}: a temporary stays")),
            // Between two renames.
            _ if is_killed && has_all && seen.iter().all(is_whole) => {
                let next = self.run(folder, "", |_| Ok(()))?;
                let mut found = files_of(&folder.path().join(DATA))?;
                found.retain(|name, _| !name.starts_with('.'));
                let is_done = next.success() && found == self.new;
                if is_done { Ok(()) } else { Err(format!("the next run: {next}")) }
            }
            _ if seen == self.old || seen == self.new => Ok(()),
            _ => Err(format!("{status}: files of both runs, or half of one")),
        }
    }
}

fn has_temporary(folder: &Path) -> bool {
    let entries = fs::read_dir(folder.join(DATA)).into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name()).any(|name| name.as_encoded_bytes().starts_with(b"."))
}

fn is_running(child: &mut Child) -> Result<bool, String> {
    child.try_wait().map(|status| status.is_none()).map_err(|cause| format!("wait: {cause}"))
}
