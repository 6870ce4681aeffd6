//! Copies of the workspace in which variants are built: with planted faults, or with room for a larger sensor.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::process::{Outcome, capture, root};

/// Brings the copy in `folder` up to date with the files that git tracks, and those that it would. `change` may give a
/// file another content. Files that are the same stay untouched, so that little is built again.
pub fn update(folder: &Path, mut change: impl FnMut(&str, Vec<u8>) -> Outcome<Vec<u8>>) -> Outcome {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]);
    let listed = capture(git.current_dir(root()));
    listed.outcome.map_err(|cause| listed.err + &cause)?;
    let mut files: BTreeSet<&str> =
        listed.out.split('\0').filter(|file| !file.is_empty()).collect();
    // A file that is deleted may still be tracked.
    files.retain(|file| root().join(file).is_file());
    remove_others(folder, folder, &files)?;
    for file in files {
        let content = fs::read(root().join(file)).map_err(|cause| format!("{file}: {cause}"))?;
        write_if_new(&folder.join(file), &change(file, content)?)?;
    }
    Ok(())
}

/// Removes all other files of a copy: cargo would find one that is gone from the workspace, such as a test's.
fn remove_others(folder: &Path, copy: &Path, files: &BTreeSet<&str>) -> Outcome {
    for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
        let name = path.strip_prefix(copy).unwrap_or(&path).to_string_lossy();
        if path.is_dir() {
            remove_others(&path, copy, files)?;
        } else if !files.contains(&*name) && name != "Cargo.lock" {
            fs::remove_file(&path).map_err(|cause| format!("{}: {cause}", path.display()))?;
        }
    }
    Ok(())
}

/// Writes `bytes` unless the file holds them already.
pub fn write_if_new(file: &Path, bytes: &[u8]) -> Outcome {
    if fs::read(file).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    let made = file.parent().map_or(Ok(()), fs::create_dir_all);
    let written = made.and_then(|()| fs::write(file, bytes));
    written.map_err(|cause| format!("{}: {cause}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_has_what_the_workspace_has_with_its_changes_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("taxel-copy-{}", std::process::id()));
        fs::create_dir_all(folder.join("xtask/tests")).unwrap();
        fs::write(folder.join("xtask/tests/gone.rs"), "old").unwrap();
        let change = |file: &str, content: Vec<u8>| {
            Ok(if file == "rustfmt.toml" { b"changed".to_vec() } else { content })
        };
        update(&folder, change).unwrap();
        assert!(!folder.join("xtask/tests/gone.rs").exists());
        assert_eq!(fs::read(folder.join("rustfmt.toml")).unwrap(), b"changed");
        let same = |file: &str| {
            fs::read(folder.join(file)).unwrap() == fs::read(root().join(file)).unwrap()
        };
        assert!(same("Cargo.toml") && same("xtask/src/main.rs"));
        fs::remove_dir_all(folder).unwrap();
    }
}
