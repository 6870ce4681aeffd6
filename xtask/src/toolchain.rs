//! A toolchain that can build for the device.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use crate::process::{Outcome, cargo, first_line, root, target_dir};

/// The target of the images.
pub const TARGET: &str = "thumbv7em-none-eabihf";

const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_CLIPPY: &str = "/usr/bin/cargo-clippy";
const DEBIAN_CLIPPY_PACKAGE: &str = "rust-web-clippy";

/// Environment variables that control cargo and rustc. Another toolchain must not inherit them from the one that
/// runs this program.
const OF_THE_HOST_TOOLCHAIN: [&str; 7] = [
    "CARGO",
    "LD_LIBRARY_PATH",
    "RUSTC",
    "RUSTC_WORKSPACE_WRAPPER",
    "RUSTC_WRAPPER",
    "RUSTDOC",
    "RUSTUP_TOOLCHAIN",
];

/// Toolchain for a target.
pub struct Toolchain {
    target: &'static str,
    source: Source,
}

/// Source of the target's `core`.
enum Source {
    /// The active toolchain has the target.
    Active,
    /// Debian's toolchain has the library's source instead, but no linker for the target.
    Debian { linker: PathBuf },
}

impl fmt::Display for Toolchain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.source {
            Source::Active => write!(f, "the active one, which has {}", self.target),
            Source::Debian { linker } => {
                write!(f, "{DEBIAN_CARGO} with core built from source, and {}", linker.display())
            }
        }
    }
}

impl Toolchain {
    /// Finds a toolchain for the images' target.
    pub fn find() -> Outcome<Self> {
        Self::new(TARGET)
    }

    /// Finds the active toolchain if it has `target`, else Debian's.
    pub fn new(target: &'static str) -> Outcome<Self> {
        let library = first_line("rustc", &["--print", "target-libdir", "--target", target]);
        if library.is_some_and(|path| Path::new(&path).is_dir()) {
            return Ok(Self { target, source: Source::Active });
        }
        let source = debian().map_err(|cause| {
            format!(
                "no toolchain for {target}: the active one lacks it, and {cause}. Either\n  \
                 rustup target add {target}\nor, on Debian,\n  \
                 apt-get install rustc-web cargo-web rust-web-src rust-web-clippy"
            )
        })?;
        Ok(Self { target, source })
    }

    /// Version of the compiler, as it prints it.
    pub fn compiler(&self) -> Outcome<String> {
        let rustc = match self.source {
            Source::Active => "rustc",
            Source::Debian { .. } => DEBIAN_RUSTC,
        };
        first_line(rustc, &["--version"]).ok_or(format!("{rustc} does not print its version"))
    }

    /// Command `cargo build` for the target, with a separate target directory.
    pub fn build(&self) -> Command {
        self.command(DEBIAN_CARGO, "build")
    }

    /// Command `cargo check` for the target, with a separate target directory.
    pub fn check(&self) -> Command {
        self.command(DEBIAN_CARGO, "check")
    }

    /// Command `cargo clippy` for the target, with a separate target directory.
    pub fn clippy(&self) -> Outcome<Command> {
        if matches!(self.source, Source::Debian { .. }) && !Path::new(DEBIAN_CLIPPY).is_file() {
            return Err(format!(
                "{DEBIAN_CLIPPY} is not there; either\n  apt-get install {DEBIAN_CLIPPY_PACKAGE}\n\
                 or\n  rustup target add {}",
                self.target
            ));
        }
        Ok(self.command(DEBIAN_CLIPPY, "clippy"))
    }

    /// Command for cargo's `subcommand`; with Debian's toolchain, `debian_program` runs it.
    fn command(&self, debian_program: &str, subcommand: &str) -> Command {
        let mut command = match &self.source {
            Source::Active => cargo(&[subcommand]),
            Source::Debian { linker } => {
                let mut command = Command::new(debian_program);
                for variable in OF_THE_HOST_TOOLCHAIN {
                    command.env_remove(variable);
                }
                // Building core is an unstable feature; this variable enables it in a stable compiler.
                command.env("RUSTC", DEBIAN_RUSTC).env("RUSTC_BOOTSTRAP", "1");
                // Clippy's front end would start the first cargo in the path.
                command.env("CARGO", DEBIAN_CARGO);
                command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker);
                command.current_dir(root()).args([subcommand, "-Zbuild-std=core"]);
                command
            }
        };
        // Flags given for the host, such as target-cpu=native, would break the target's build.
        command.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        command.args(["--target", self.target, "--target-dir"]).arg(thumb_dir());
        command
    }
}

/// Folder for cargo's builds for the target.
fn thumb_dir() -> PathBuf {
    target_dir().join("thumb")
}

/// Path of a program for the target that was built with the profile `firmware`.
pub fn elf(program: &str) -> PathBuf {
    thumb_dir().join(TARGET).join("firmware").join(program)
}

fn debian() -> Outcome<Source> {
    let version = first_line(DEBIAN_RUSTC, &["--version"])
        .filter(|_| Path::new(DEBIAN_CARGO).is_file())
        .ok_or(format!("{DEBIAN_RUSTC} and {DEBIAN_CARGO} are not there"))?;
    let needed = env!("CARGO_PKG_RUST_VERSION");
    if release(&version) < release(needed) {
        return Err(format!("{DEBIAN_RUSTC} is {version}, older than {needed}"));
    }
    let sysroot = sysroot(DEBIAN_RUSTC).ok_or(format!("{DEBIAN_RUSTC} names no sysroot"))?;
    if !sysroot.join("lib/rustlib/src/rust/library/core").is_dir() {
        return Err(format!("{DEBIAN_RUSTC} comes without its library's source"));
    }
    let linker = linker(&sysroot).ok_or("there is no linker for it (rust-lld or ld.lld)")?;
    Ok(Source::Debian { linker })
}

fn sysroot(rustc: &str) -> Option<PathBuf> {
    first_line(rustc, &["--print", "sysroot"]).map(PathBuf::from)
}

/// Path of rustup's `rust-lld`, which Debian's compiler comes without.
fn linker(debian_sysroot: &Path) -> Option<PathBuf> {
    let of_rust = [sysroot("rustc"), Some(debian_sysroot.to_owned())]
        .into_iter()
        .flatten()
        .filter_map(|sysroot| fs::read_dir(sysroot.join("lib/rustlib")).ok())
        .flat_map(|targets| targets.flatten().map(|target| target.path().join("bin/rust-lld")));
    let path = env::var_os("PATH").unwrap_or_default();
    let of_system = env::split_paths(&path).map(|directory| directory.join("ld.lld"));
    of_rust.chain(of_system).find(|linker| linker.is_file())
}

/// Major and minor number of the first version in `text`.
fn release(text: &str) -> Option<(u32, u32)> {
    text.split_whitespace().find_map(|word| {
        let mut numbers = word.split('.').map(|number| number.parse().ok());
        Some((numbers.next()??, numbers.next()??))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_release_is_found_in_what_rustc_prints() {
        assert_eq!(
            release("rustc 1.96.0 (ac68faa20 2026-05-25) (built from source)"),
            Some((1, 96))
        );
        assert_eq!(release("1.95"), Some((1, 95)));
        assert!(release("rustc 1.63.0") < release("1.95"));
        assert!(release("unknown") < release("1.95"));
    }
}
