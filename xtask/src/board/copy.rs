//! A copy of the workspace in which variants of the board's image are built: with a fault in one place, or with room for
//! a larger sensor.
//!
//! Both are built in one folder, so that the libraries of others are built once. So the copy's packages have another
//! version: cargo would take packages of one name and version for the same, wherever they lie.

use std::path::PathBuf;
use std::process::Command;

use super::ONCHIP;
use super::mutants::Mutant;
use crate::copy::{update, write_if_new};
use crate::images::SEAL;
use crate::process::{Outcome, read, run, target_dir, watch};
use crate::toolchain::{Toolchain, elf};

/// The version of the project's packages, and that of the copy's.
const VERSION: &str = concat!("version = \"", env!("CARGO_PKG_VERSION"), "\"");
const OTHER_VERSION: &str = "version = \"0.0.0\"";

/// Manifests of the copy that differ: file, text in it, and what replaces it. The images have other names too, so that they
/// do not replace the project's own.
const MANIFESTS: [(&str, &str, &str); 4] = [
    ("Cargo.toml", VERSION, OTHER_VERSION),
    ("firmware/Cargo.toml", VERSION, OTHER_VERSION),
    (
        "firmware/nucleo-f446re/Cargo.toml",
        "[[bin]]\nname = \"nucleo-f446re\"",
        "[[bin]]\nname = \"nucleo-variant\"",
    ),
    (
        "firmware/nucleo-f446re/Cargo.toml",
        "[[bin]]\nname = \"nucleo-f446re-onchip\"",
        "[[bin]]\nname = \"nucleo-variant-onchip\"",
    ),
];

/// Room in the wide image: more columns than three converters sample, and more rows than one register drives.
const WIDE: &str = "16x32x18";

const PACKAGE: &str = "nucleo-f446re";
const IMAGE: &str = "nucleo-variant";
const ONCHIP_IMAGE: &str = "nucleo-variant-onchip";

/// The copy.
pub struct Copy {
    folder: PathBuf,
}

impl Copy {
    /// Makes the copy, or brings it up to date. Files that are the same stay untouched, so that little is built again.
    pub fn make() -> Outcome<Self> {
        let folder = target_dir().join("board").join("workspace");
        update(&folder, |file, content| {
            let of_file = MANIFESTS.iter().filter(|(name, ..)| *name == file);
            Ok(of_file.fold(content, |content, (_, text, other)| {
                String::from_utf8_lossy(&content).replace(text, other).into_bytes()
            }))
        })?;
        Ok(Self { folder })
    }

    /// Builds the image of `mutant`, with the features that its scenario needs, and returns its path.
    pub fn build_mutant(&self, toolchain: &Toolchain, mutant: &Mutant) -> Outcome<PathBuf> {
        let file = self.folder.join(&mutant.file);
        let sound = read(&file)?;
        write_if_new(&file, mutant.apply(&sound)?.as_bytes())?;
        let name = if mutant.scenario == ONCHIP { ONCHIP_IMAGE } else { IMAGE };
        let mut command = self.command(toolchain, name);
        if mutant.scenario == SEAL {
            command.args(["--features", SEAL]);
        }
        let built = watch(&mut command, false);
        write_if_new(&file, sound.as_bytes())?;
        let built = built?;
        if built.success {
            Ok(elf(name))
        } else {
            Err(format!("mutant {} does not build:\n{}", mutant.name, built.messages))
        }
    }

    /// Builds the image with room for [`WIDE`], as [`image`].
    pub fn build_wide(&self, toolchain: &Toolchain) -> Outcome {
        run(self.command(toolchain, IMAGE).env("TAXEL_CAPACITY", WIDE))
    }

    fn command(&self, toolchain: &Toolchain, image: &str) -> Command {
        let mut command = toolchain.build();
        command.arg("--manifest-path").arg(self.folder.join("Cargo.toml"));
        command.args(["--profile", "firmware", "--package", PACKAGE, "--bin", image]);
        command
    }
}

/// Path of the image with more room.
pub fn image() -> PathBuf {
    elf(IMAGE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_stands_in_its_manifest_and_names_of_images_once() {
        for (file, text, _) in MANIFESTS {
            let count = read(file).unwrap().matches(text).count();
            assert!(if text == VERSION { count >= 1 } else { count == 1 }, "{file}: {count}");
        }
    }
}
