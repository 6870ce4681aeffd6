//! The module of Python: its wheel, and its tests, in a virtual environment of their own.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::process::{Outcome, root, run, target_dir};

/// What the tests take, besides the module itself.
const PACKAGES: [&str; 6] =
    ["maturin>=1.9,<2", "mypy", "numpy", "pandas", "pytest", "scikit-learn>=1.6"];

/// Builds the wheel, installs it, and runs its tests.
pub fn test() -> Outcome {
    let (python, folder) = (environment(&PACKAGES)?, root().join("python"));
    let wheels = target_dir().join("test-wheels");
    let mut build = maturin(&python, "build", &wheels);
    // PyO3's macros want other features of syn than serde does, so that nearly everything is built anew: less optimised,
    // that takes two thirds of the time, and the tests take no longer.
    build.args(["--profile", "dev"]).env("CARGO_PROFILE_DEV_OPT_LEVEL", "1");
    run(build.arg("--interpreter").arg(&python))?;
    let mut install = pip(&python);
    install.args(["install", "--force-reinstall", "--no-deps", "--no-index", "--find-links"]);
    run(install.arg(&wheels).arg("taxel"))?;
    // From elsewhere, so that what is installed is tested.
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "-q", "--rootdir"]).arg(&folder).arg(folder.join("tests"));
    run(tests.current_dir(target_dir()))
}

/// The environment's interpreter, with these `packages`; made if there is none.
pub fn environment(packages: &[&str]) -> Outcome<PathBuf> {
    let folder = target_dir().join("python");
    let python = folder.join("bin/python");
    if !python.exists() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    }
    run(pip(&python).arg("install").args(packages))?;
    Ok(python)
}

/// A command of maturin, which is in the environment of `python`; what it makes lands in `folder`.
pub fn maturin(python: &Path, command: &str, folder: &Path) -> Command {
    let mut maturin = Command::new(python.with_file_name("maturin"));
    // It looks for zig, if that is wanted, by the first Python in the path.
    let own = python.parent().map(Path::to_path_buf);
    let path = env::var_os("PATH").unwrap_or_default();
    if let Ok(path) = env::join_paths(own.into_iter().chain(env::split_paths(&path))) {
        maturin.env("PATH", path);
    }
    maturin.args([command, "--manifest-path"]).arg(root().join("python/Cargo.toml"));
    maturin.arg("--out").arg(folder);
    maturin
}

fn pip(python: &PathBuf) -> Command {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "--quiet", "--disable-pip-version-check"]);
    pip
}
