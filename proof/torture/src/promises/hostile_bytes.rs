//! Any bytes, by any way in: the fuzz targets, on mutants of their corpora.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use hostile::mutate::mutate;
use hostile::{TARGETS, Target, target};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const HOSTILE_BYTES: Promise = Promise {
    name: "hostile-bytes",
    text: "any bytes: refused or right, never a panic",
    share: 3,
    check: all_ways_in,
};

pub const RESIGNED_BLOBS: Promise = Promise {
    name: "re-signed-blobs",
    text: "a blob with any body: no panic, no NaN, host = device",
    share: 3,
    check: blobs,
};

/// Longest mutant in bytes.
const MOST_BYTES: usize = 16_384;

/// A target's corpus.
fn corpus(target: Target) -> Result<Vec<Vec<u8>>, String> {
    files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(target.name))
}

/// Files of a folder, at least one, in the order of their names.
fn files(folder: &Path) -> Result<Vec<Vec<u8>>, String> {
    let told = |cause| format!("{}: {cause}", folder.display());
    let entries = fs::read_dir(folder).map_err(told)?;
    let paths: Result<Vec<PathBuf>, _> = entries.map(|entry| entry.map(|it| it.path())).collect();
    let mut paths = paths.map_err(told)?;
    if paths.is_empty() {
        return Err(format!("{}: no file is there to make mutants of", folder.display()));
    }
    paths.sort();
    paths.iter().map(|path| fs::read(path).map_err(told)).collect()
}

/// Checks the mutant of `corpus` that `seed` stands for, or at first the corpus itself; returns whether it was taken
/// for sound.
fn check(target: Target, corpus: &[Vec<u8>], seed: u64, is_planted: bool) -> bool {
    let count = corpus.len() as u64;
    let bytes = &corpus[(seed % count) as usize];
    if seed < count {
        return (target.check)(bytes, is_planted);
    }
    let other = &corpus[(seed / count % count) as usize];
    (target.check)(&mutate(bytes, other, seed, MOST_BYTES), is_planted)
}

/// Says how many cases the subject took for sound.
fn with_accepted(found: Found, accepted: &AtomicU64) -> Found {
    let share = 100.0 * accepted.load(Ordering::Relaxed) as f64 / found.cases.max(1) as f64;
    let note =
        if found.note.is_empty() { format!("{share:.0} % taken for sound") } else { found.note };
    Found { note, ..found }
}

fn all_ways_in(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let corpora: Vec<Vec<Vec<u8>>> =
        TARGETS.iter().map(|target| corpus(*target)).collect::<Result<_, _>>()?;
    let (ways, accepted) = (TARGETS.len() as u64, AtomicU64::new(0));
    let found = effort.worst((ways * 3000, ways * 2_000_000), (0.0, "broken"), |seed| {
        let way = (seed % ways) as usize;
        let is_sound = check(TARGETS[way], &corpora[way], seed / ways, effort.is_planted());
        accepted.fetch_add(u64::from(is_sound), Ordering::Relaxed);
        Ok(0.0)
    });
    Ok(with_accepted(found, &accepted))
}

fn blobs(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let (blob, accepted) = (target("blob"), AtomicU64::new(0));
    let corpus = corpus(blob)?;
    let found = effort.worst((40_000, 10_000_000), (0.0, "broken"), |seed| {
        let is_sound = check(blob, &corpus, seed, effort.is_planted());
        accepted.fetch_add(u64::from(is_sound), Ordering::Relaxed);
        Ok(0.0)
    });
    Ok(with_accepted(found, &accepted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Folder;

    #[test]
    fn a_folder_without_files_is_an_error_that_names_it() {
        let folder = Folder::new().unwrap();
        let cause = files(folder.path()).unwrap_err();
        assert!(cause.contains(&folder.path().display().to_string()), "{cause}");
        fs::write(folder.path().join("seed"), "x").unwrap();
        assert_eq!(files(folder.path()), Ok(vec![b"x".to_vec()]));
    }
}
