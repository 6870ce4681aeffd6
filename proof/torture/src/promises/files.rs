//! Outputs while calls to the system fail: at the n-th call, for every n.

mod disk;
mod traced;

use std::fs;
use std::path::{Path, PathBuf};

use taxel_data::Error;
use taxel_data::output::{Disk, FileSet, write_whole_on};

use self::disk::{FaultyDisk, Kind};
use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::scratch::{Files, Folder, files_of};
use crate::tools::Tools;

pub const FAULTS: Promise = Promise {
    name: "file-faults",
    text: "a call that fails leaves old files whole, or new ones",
    share: 4,
    check: faults,
};

const SET: FileSet = FileSet { name: "run", files: &["model", "metrics", "table", "page"] };

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Output {
    File,
    Set,
}

/// A fault, and the call at which it strikes.
#[derive(Debug, Clone, Copy)]
struct Case {
    output: Output,
    kind: Kind,
    call: usize,
}

fn faults(effort: &Effort, tools: &Tools) -> Result<Found, String> {
    let is_planted = effort.is_planted();
    let mut cases = Vec::new();
    for output in [Output::File, Output::Set] {
        for kind in Kind::ALL {
            let folder = Folder::new()?;
            let disk = FaultyDisk::counting(kind);
            write(&disk, folder.path(), output, &contents(0, true), is_planted)
                .map_err(|cause| format!("without a fault: {cause}"))?;
            cases.extend((1..=disk.calls()).map(|call| Case { output, kind, call }));
        }
    }
    let number = cases.len() as u64;
    let mut found = effort.worst((number, 6 * number), (0.0, "broken"), |seed| {
        let case = cases[(seed % number) as usize];
        let broken = tested(case, seed / number, is_planted);
        broken.map(|()| 0.0).map_err(|cause| format!("{case:?}: {cause}"))
    });
    if !effort.is_over() {
        traced::test(effort, tools, &mut found)?;
    }
    Ok(found)
}

/// Lets the fault of a case strike while files are replaced whose contents depend on `seed`.
fn tested(case: Case, seed: u64, is_planted: bool) -> Result<(), String> {
    let folder = Folder::new()?;
    let path = folder.path();
    let [old, new] = [
        contents(2 * seed, seed.is_multiple_of(2)),
        contents(2 * seed + 1, seed.is_multiple_of(3)),
    ];
    let [old, new] = [expected(&old, case.output), expected(&new, case.output)];
    // Fewer files take fewer calls.
    let healthy = FaultyDisk::counting(case.kind);
    write(&healthy, path, case.output, &old, false)?;
    let before = healthy.calls();
    write(&healthy, path, case.output, &new, is_planted)?;
    let calls = healthy.calls() - before;
    write(&healthy, path, case.output, &old, false)?;
    let call = (case.call - 1) % calls + 1;
    let disk = FaultyDisk::failing(case.kind, call);
    let outcome = write(&disk, path, case.output, &new, is_planted);
    if disk.calls() < call {
        return Err(format!("only {} calls", disk.calls()));
    }
    let (hidden, seen): (Files, Files) =
        files_of(path)?.into_iter().partition(|(name, _)| name.starts_with('.'));
    if matches!(case.kind, Kind::Killed | Kind::Stuck) {
        let is_of = |run: &Files| seen.iter().all(|(name, bytes)| run.get(name) == Some(bytes));
        if !(seen == old || seen == new || (!hidden.is_empty() && (is_of(&old) || is_of(&new)))) {
            return Err("files of both runs, or half of one".into());
        }
        // Who comes next completes what was begun, or removes it.
        write(&healthy, path, case.output, &new, is_planted)?;
        let whole = files_of(path)? == new;
        return if whole { Ok(()) } else { Err("the next run leaves other files".into()) };
    }
    if case.kind.is_harmless() && outcome.is_err() {
        return Err("refused because of a write that only had to be repeated".into());
    }
    let wanted = if outcome.is_ok() { new } else { old };
    match outcome {
        _ if seen != wanted => Err("other files than the outcome says".into()),
        _ if !hidden.is_empty() => Err("a temporary stays".into()),
        Err(cause) if !cause.contains(path.to_string_lossy().as_ref()) => {
            Err(format!("the message names no path: {cause}"))
        }
        _ => Ok(()),
    }
}

/// Writes `files` to a folder; in a self-test as a program does that replaces file after file in its place.
fn write(
    disk: &FaultyDisk,
    folder: &Path,
    output: Output,
    files: &Files,
    is_planted: bool,
) -> Result<(), String> {
    let files: Vec<(&str, &[u8])> =
        files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    let written = match output {
        _ if is_planted => in_place(disk, folder, &files),
        Output::Set => SET.write_on(disk, folder, &files),
        Output::File => {
            let path = folder.join(SET.files[0]);
            let bytes = files.iter().find(|(name, _)| *name == SET.files[0]);
            write_whole_on(disk, &path, |file| {
                let bytes = bytes.map_or(&[][..], |(_, bytes)| bytes);
                file.write_all(bytes).map_err(|cause| Error::write(&path, cause))
            })
        }
    };
    written.map_err(|cause| cause.to_string())
}

fn in_place(disk: &FaultyDisk, folder: &Path, files: &[(&str, &[u8])]) -> taxel_data::Result<()> {
    for (name, bytes) in files {
        let path: PathBuf = folder.join(name);
        let _ = fs::remove_file(&path);
        let written = disk.create(&path).and_then(|file| disk.write(&file, bytes));
        written.map_err(|cause| Error::write(&path, cause))?;
    }
    Ok(())
}

/// Files of one run: some larger than what is written at once, `with_table` or without.
fn contents(seed: u64, with_table: bool) -> Files {
    let sizes = [9_000, 40_000, 3, 20_000].map(|size| size + (seed % 1000) as usize);
    let files = SET.files.iter().zip(sizes).filter(|(name, _)| with_table || **name != "table");
    let content = |name: &str, size| {
        let byte = |place: usize| (seed as usize ^ place ^ name.len()) as u8;
        (0..size).map(byte).collect()
    };
    files.map(|(name, size)| ((*name).to_owned(), content(name, size))).collect()
}

/// What must be in the folder after all of `files` were written.
fn expected(files: &Files, output: Output) -> Files {
    let is_written = |name: &str| output == Output::Set || name == SET.files[0];
    files.iter().filter(|(name, _)| is_written(name)).map(|(n, b)| (n.clone(), b.clone())).collect()
}
