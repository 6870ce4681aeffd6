//! Outputs while the program is killed, power is lost, or a call to the system fails: before each step, for all steps.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use taxel_data::Error;
use taxel_data::output::{FileSet, Step, watched, write_whole};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::scratch::{Files, Folder, files_of};
use crate::tools::Tools;

pub const FAULTS: Promise = Promise {
    name: "file-faults",
    text: "a fault, a kill or a loss of power leaves whole files",
    share: 2,
    check: faults,
};

const SET: FileSet = FileSet { files: &["model", "metrics", "table", "page"] };

fn faults(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let forgets_always = effort.is_planted();
    Ok(effort.worst((8, 400), (0.0, "broken"), |seed| {
        // A single file, or a set, of which each run may lack one.
        let single = seed.is_multiple_of(4);
        let [old, new] = [(seed, 3), (seed + 1, 2)].map(|(seed, divisor)| {
            let mut files = contents(seed);
            files.retain(|name, _| name == "model" || !single);
            files.retain(|name, _| name != "table" || seed.is_multiple_of(divisor));
            files
        });
        let mut failing = 1;
        while failing <= fails_at(failing, &old, &new, forgets_always)? {
            failing += 1;
        }
        Ok(0.0)
    }))
}

/// Replaces `old` files by `new` ones while step number `failing` fails. Returns the number of steps.
fn fails_at(
    failing: usize,
    old: &Files,
    new: &Files,
    forgets_always: bool,
) -> Result<usize, String> {
    let folder = Folder::new()?;
    let path = folder.path().to_path_buf();
    write(&path, old).map_err(|cause| format!("without a fault: {cause}"))?;
    let disk = Disk { forgets_always, ..Disk::default() };
    let disk = Rc::new(RefCell::new(disk));
    let (seen_disk, runs) = (disk.clone(), [old.clone(), new.clone()]);
    let watcher = move |step: Step<'_>| {
        let mut disk = seen_disk.borrow_mut();
        disk.take(step);
        // What a kill would leave, and what a loss of power would leave.
        for forgets in [false, true] {
            if let Err(cause) = disk.judge(&path, &runs, forgets) {
                disk.broken.get_or_insert(format!("before {step:?}: {cause}"));
            }
        }
        if disk.steps == failing { Err(ErrorKind::StorageFull.into()) } else { Ok(()) }
    };
    let outcome = watched(watcher, || write(folder.path(), new));
    let disk = disk.take();
    if let Some(broken) = disk.broken {
        return Err(broken);
    }
    let found = files_of(folder.path())?;
    let told = |cause: &str| Err(format!("step {failing} fails: {cause}: {outcome:?}"));
    match &outcome {
        _ if found.keys().any(|name| name.starts_with('.')) => told("a temporary stays"),
        Ok(()) if found != *new => told("done, but other files"),
        Err(_) if found != *old && !disk.renames => told("failed, but other files"),
        Err(cause) if !cause.to_string().contains(&*folder.path().to_string_lossy()) => {
            told("the message names no path")
        }
        _ => Ok(disk.steps),
    }
}

/// Disk that forgets what was not made safe.
#[derive(Default)]
struct Disk {
    /// Forgets even that: a self-test.
    forgets_always: bool,
    steps: usize,
    renames: bool,
    /// Files with bytes that are not safe.
    unsafe_files: BTreeSet<PathBuf>,
    /// What was found broken first.
    broken: Option<String>,
}

impl Disk {
    fn take(&mut self, step: Step<'_>) {
        self.steps += 1;
        match step {
            Step::Write(file) => {
                self.unsafe_files.insert(file.into());
            }
            Step::Sync(file) if !self.forgets_always => {
                self.unsafe_files.remove(file);
            }
            Step::Rename(from, to) => {
                self.renames = true;
                if self.unsafe_files.remove(from) {
                    self.unsafe_files.insert(to.into());
                }
            }
            Step::Create(_) | Step::Sync(_) | Step::Remove(_) => {}
        }
    }

    /// Whether every file in the folder is whole, of one of two `runs`, and none is missing that both have.
    fn judge(&self, folder: &Path, runs: &[Files; 2], forgets: bool) -> Result<(), String> {
        let mut found = files_of(folder)?;
        found.retain(|name, _| !name.starts_with('.'));
        let forgotten = |name: &String| forgets && self.unsafe_files.contains(&folder.join(name));
        let is_whole = |(name, bytes): (&String, &Vec<u8>)| {
            !forgotten(name) && runs.iter().any(|run| run.get(name) == Some(bytes))
        };
        if let Some((name, _)) = found.iter().find(|file| !is_whole(*file)) {
            return Err(format!("{name} is not whole"));
        }
        let missing = |name: &&String| runs[1].contains_key(*name) && !found.contains_key(*name);
        runs[0].keys().find(missing).map_or(Ok(()), |name| Err(format!("{name} is missing")))
    }
}

/// Writes `files`: a single one piece by piece, or a set.
fn write(folder: &Path, files: &Files) -> taxel_data::Result<()> {
    if files.len() > 1 {
        let files: Vec<(&str, &[u8])> =
            files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
        return SET.write(folder, &files);
    }
    for (name, bytes) in files {
        let path = folder.join(name);
        write_whole(&path, |file| {
            let mut pieces = bytes.chunks(9000);
            pieces.try_for_each(|piece| file.write_all(piece)).map_err(|it| Error::write(&path, it))
        })?;
    }
    Ok(())
}

/// Files of one run: some larger than what is written at once.
fn contents(seed: u64) -> Files {
    let sizes = [9_000, 40_000, 3, 20_000].map(|size| size + (seed % 1000) as usize);
    let content = |name: &str, size| {
        let byte = |place: usize| (seed as usize ^ place ^ name.len()) as u8;
        (0..size).map(byte).collect()
    };
    let files = SET.files.iter().zip(sizes);
    files.map(|(name, size)| ((*name).to_owned(), content(name, size))).collect()
}
