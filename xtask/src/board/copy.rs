//! A copy of the workspace in which variants of the board's image are built: with a fault in one place, or with room for
//! a larger sensor.
//!
//! Both are built in one folder, so that the libraries of others are built once. So the copy's packages have another
//! version: cargo would take packages of one name and version for the same, wherever they lie.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{fs, io};

use super::mutants::Mutant;
use crate::process::{Outcome, root, run, target_dir, watch};
use crate::toolchain::{Toolchain, elf};

/// Folders and files that are not copied, besides hidden ones: what is built or written.
const LEFT_OUT: [&str; 2] = ["target", "out"];

/// Manifests of the copy that differ: file, text that stands once in it, and what replaces it. The image has another
/// name too, so that it does not replace the project's own.
const MANIFESTS: [(&str, &str, &str); 2] = [
    ("Cargo.toml", concat!("version = \"", env!("CARGO_PKG_VERSION"), "\""), "version = \"0.0.0\""),
    (
        "firmware/nucleo-f446re/Cargo.toml",
        "[[bin]]\nname = \"nucleo-f446re\"",
        "[[bin]]\nname = \"nucleo-variant\"",
    ),
];

/// Room in the wide image: more columns than three converters sample, and more rows than one register drives.
const WIDE: &str = "16x32x18";

const PACKAGE: &str = "nucleo-f446re";
const IMAGE: &str = "nucleo-variant";

/// The copy.
pub struct Copy {
    folder: PathBuf,
}

impl Copy {
    /// Makes the copy, or brings it up to date. Files that are the same stay untouched, so that little is built again.
    pub fn make() -> Outcome<Self> {
        let folder = target_dir().join("board").join("workspace");
        copy_folder(root(), &folder)?;
        for (file, text, other) in MANIFESTS {
            let changed = read(&root().join(file))?.replacen(text, other, 1);
            write_if_new(&folder.join(file), changed.as_bytes())?;
        }
        Ok(Self { folder })
    }

    /// Builds the image of `mutant`, and returns its path.
    pub fn build_mutant(&self, toolchain: &Toolchain, mutant: &Mutant) -> Outcome<PathBuf> {
        let file = self.folder.join(&mutant.file);
        let sound = read(&file)?;
        write_if_new(&file, mutant.apply(&sound)?.as_bytes())?;
        let built = watch(&mut self.command(toolchain), false);
        write_if_new(&file, sound.as_bytes())?;
        let built = built?;
        if built.success {
            Ok(image())
        } else {
            Err(format!("mutant {} does not build:\n{}", mutant.name, built.messages))
        }
    }

    /// Builds the image with room for [`WIDE`], as [`image`].
    pub fn build_wide(&self, toolchain: &Toolchain) -> Outcome {
        run(self.command(toolchain).env("TAXEL_CAPACITY", WIDE))
    }

    fn command(&self, toolchain: &Toolchain) -> Command {
        let mut command = toolchain.build();
        command.arg("--manifest-path").arg(self.folder.join("Cargo.toml"));
        command.args(["--profile", "firmware", "--package", PACKAGE, "--bin", IMAGE]);
        command
    }
}

/// Path of the variant that was built last.
pub fn image() -> PathBuf {
    elf(IMAGE)
}

fn copy_folder(from: &Path, to: &Path) -> Outcome {
    let failed = |cause| format!("{}: {cause}", from.display());
    fs::create_dir_all(to).map_err(|cause| format!("{}: {cause}", to.display()))?;
    remove_what_is_gone(from, to).map_err(|cause| format!("{}: {cause}", to.display()))?;
    for entry in fs::read_dir(from).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name();
        let shown = name.to_string_lossy();
        if shown.starts_with('.') || LEFT_OUT.contains(&&*shown) {
            continue;
        }
        if entry.file_type().map_err(failed)?.is_dir() {
            copy_folder(&entry.path(), &to.join(name))?;
        } else if !MANIFESTS.iter().any(|(file, ..)| entry.path() == root().join(file)) {
            let bytes = fs::read(entry.path()).map_err(failed)?;
            write_if_new(&to.join(name), &bytes)?;
        }
    }
    Ok(())
}

/// Removes from the copy `to` what is not in `from` any more: cargo would find it, such as a test's file.
fn remove_what_is_gone(from: &Path, to: &Path) -> io::Result<()> {
    for entry in fs::read_dir(to)? {
        let entry = entry?;
        if from.join(entry.file_name()).exists() {
            continue;
        }
        if entry.file_type()?.is_dir() {
            fs::remove_dir_all(entry.path())?;
        } else {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

fn read(file: &Path) -> Outcome<String> {
    fs::read_to_string(file).map_err(|cause| format!("{}: {cause}", file.display()))
}

/// Writes `bytes` unless the file holds them already.
fn write_if_new(file: &Path, bytes: &[u8]) -> Outcome {
    if fs::read(file).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    fs::write(file, bytes).map_err(|cause| format!("{}: {cause}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_gone_is_removed_from_the_copy() {
        let folder = std::env::temp_dir().join(format!("taxel-copy-{}", std::process::id()));
        let (from, to) = (folder.join("from"), folder.join("to"));
        fs::create_dir_all(from.join("app")).unwrap();
        fs::write(from.join("app/main.rs"), "new").unwrap();
        fs::create_dir_all(to.join("gone")).unwrap();
        for file in ["app.rs", "gone/file.rs"] {
            fs::write(to.join(file), "old").unwrap();
        }
        copy_folder(&from, &to).unwrap();
        let left: Vec<_> = fs::read_dir(&to).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(left, [to.join("app")]);
        assert_eq!(read(&to.join("app/main.rs")).unwrap(), "new");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_differs_stands_once_in_its_manifest() {
        for (file, text, _) in MANIFESTS {
            assert_eq!(read(&root().join(file)).unwrap().matches(text).count(), 1, "{file}");
        }
    }
}
