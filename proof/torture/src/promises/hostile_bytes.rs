//! Any bytes, by any way in: the fuzz targets, on mutants of their corpora.

use std::fs;
use std::path::{Path, PathBuf};

use hostile::mutate::mutate;
use hostile::{TARGETS, Target, target};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;

pub const HOSTILE_BYTES: Promise = Promise {
    name: "hostile-bytes",
    text: "any bytes: refused or right, never a panic",
    share: 3,
    check: |effort, _| mutants(effort, TARGETS, (3000, 2_000_000)),
};

pub const RESIGNED_BLOBS: Promise = Promise {
    name: "re-signed-blobs",
    text: "a blob with any body: no panic, no NaN",
    share: 3,
    check: |effort, _| mutants(effort, &[target("blob")], (40_000, 10_000_000)),
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
fn check(target: Target, corpus: &[Vec<u8>], seed: u64) -> bool {
    let count = corpus.len() as u64;
    let bytes = &corpus[(seed % count) as usize];
    if seed < count {
        return (target.check)(bytes);
    }
    let other = &corpus[(seed / count % count) as usize];
    (target.check)(&mutate(bytes, other, seed, MOST_BYTES))
}

/// Gives mutants of their corpora to `targets`, which take turns: so many cases of each. One that is refused is right.
fn mutants(
    effort: &Effort,
    targets: &[Target],
    (least, most): (u64, u64),
) -> Result<Found, String> {
    let corpora: Vec<Vec<Vec<u8>>> =
        targets.iter().map(|target| corpus(*target)).collect::<Result<_, _>>()?;
    let ways = targets.len() as u64;
    Ok(effort.worst_of_accepted((ways * least, ways * most), (0.0, "broken"), |seed| {
        let way = (seed % ways) as usize;
        Ok(check(targets[way], &corpora[way], seed / ways).then_some(0.0))
    }))
}
