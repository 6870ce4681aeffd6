//! The module of Python: its wheel, and its tests, in a virtual environment of their own.

use std::path::PathBuf;
use std::process::Command;

use crate::process::{Outcome, root, run, target_dir};

/// What the tests take, besides the module itself.
const PACKAGES: [&str; 5] = ["maturin>=1.9,<2", "numpy", "pandas", "pytest", "scikit-learn>=1.6"];

#[derive(clap::Args)]
pub struct Options {
    /// Build the wheel that is given to others, into target/wheels: optimised as `cargo build --release` is.
    #[arg(long)]
    release: bool,
}

/// Builds the wheel, installs it, and runs its tests.
pub fn test(options: &Options) -> Outcome {
    let (python, folder) = (environment()?, root().join("python"));
    let wheels = target_dir().join(if options.release { "wheels" } else { "test-wheels" });
    let mut build = Command::new(python.with_file_name("maturin"));
    build.args(["build", "--manifest-path"]).arg(folder.join("Cargo.toml"));
    build.arg("--out").arg(&wheels).arg("--interpreter").arg(&python);
    if options.release {
        build.arg("--release");
    } else {
        // PyO3's macros want other features of syn than serde does, so that nearly everything is built anew: less optimised,
        // that takes two thirds of the time, and the tests take no longer.
        build.args(["--profile", "dev"]).env("CARGO_PROFILE_DEV_OPT_LEVEL", "1");
    }
    run(&mut build)?;
    let mut install = pip(&python);
    install.args(["install", "--force-reinstall", "--no-deps", "--no-index", "--find-links"]);
    run(install.arg(&wheels).arg("taxel"))?;
    // From elsewhere, so that what is installed is tested.
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "-q", "--rootdir"]).arg(&folder).arg(folder.join("tests"));
    run(tests.current_dir(target_dir()))
}

/// The environment's interpreter; made if there is none.
fn environment() -> Outcome<PathBuf> {
    let folder = target_dir().join("python");
    let python = folder.join("bin/python");
    if !python.exists() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    }
    run(pip(&python).arg("install").args(PACKAGES))?;
    Ok(python)
}

fn pip(python: &PathBuf) -> Command {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "--quiet", "--disable-pip-version-check"]);
    pip
}
