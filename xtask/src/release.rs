//! What is given to those who have no Rust: a static program, a wheel, its sources, and notices of what both hold.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::process::{Outcome, cargo, root, run as run_command, target_dir};
use crate::python;

/// Target whose programs need no library of the system.
const STATIC: &str = "x86_64-unknown-linux-musl";

/// Oldest glibc that the wheel runs with: 2.17, that of CentOS 7 and all since.
const WHEEL: [&str; 3] = ["--zig", "--compatibility", "manylinux2014"];

/// Builds everything into target/release-files, and prints sizes.
pub fn run() -> Outcome {
    let folder = target_dir().join("release-files");
    fs::create_dir_all(&folder).map_err(|cause| format!("{}: {cause}", folder.display()))?;
    notices(&folder.join("THIRD-PARTY.html"))?;
    program(&folder)?;
    let python = python::environment(&["maturin>=1.9,<2", "ziglang"])?;
    run_command(python::maturin(&python, "build", &folder).arg("--release").args(WHEEL))?;
    run_command(&mut python::maturin(&python, "sdist", &folder))?;
    let mut files: Vec<_> = fs::read_dir(&folder).into_iter().flatten().flatten().collect();
    files.sort_by_key(std::fs::DirEntry::file_name);
    for file in files {
        let bytes = file.metadata().map_or(0, |about| about.len());
        println!("{:8.2} MB  {}", bytes as f64 / 1e6, file.path().display());
    }
    Ok(())
}

/// Builds the static program.
fn program(folder: &Path) -> Outcome {
    let stripped = ["--config", "profile.release.strip=true"];
    let build = ["build", "--release", "--package", "host-sim", "--target", STATIC];
    run_command(cargo(&build).args(stripped)).map_err(|cause| {
        format!("{cause}; the target is installed by: rustup target add {STATIC}")
    })?;
    let built = target_dir().join(STATIC).join("release/host-sim");
    let kept = folder.join("host-sim-x86_64-linux");
    fs::copy(&built, &kept).map_err(|cause| format!("{}: {cause}", built.display()))?;
    Ok(())
}

/// Writes the licences of all crates that the program and the wheel hold; the module of Python holds the program's.
fn notices(file: &Path) -> Outcome {
    let settings = root().join("xtask/notices");
    let mut about = Command::new("cargo");
    about.args([
        "about",
        "generate",
        "--locked",
        "--fail",
        "--manifest-path",
        "python/Cargo.toml",
        "--config",
    ]);
    about
        .arg(settings.join("about.toml"))
        .arg(settings.join("about.hbs"))
        .arg("--output-file")
        .arg(file);
    run_command(about.current_dir(root())).map_err(|cause| {
        format!("{cause}; it takes cargo-about: cargo install cargo-about --locked --features cli")
    })
}
