//! The copy of the tracked files that has all faults behind one switch, and its programs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::{fs, hash::DefaultHasher, hash::Hasher};

use serde_json::Value;

use super::list::{FOLDER, Fault, splice};
use crate::copy::{update, write_if_new};
use crate::process::{Outcome, PROOF_TESTED, cargo, root, target_dir};

/// What the copy's build made.
pub struct Copy {
    /// Test programs: the folder of the crate, and the path.
    pub programs: Vec<(String, PathBuf)>,
    /// Whether these are all unit tests: those of the default crates.
    pub has_all_units: bool,
    /// Whether lines of torture can be run.
    pub has_torture: bool,
    pub torture: PathBuf,
    pub host_sim: PathBuf,
    /// Stands for all files but the faults.
    pub digest: u64,
}

/// Package of the lines of torture.
pub const TORTURE: &str = "torture";

/// Folder of everything that this command writes.
pub fn folder() -> PathBuf {
    target_dir().join("mutants")
}

fn source() -> PathBuf {
    folder().join("source")
}

/// Makes the copy, or brings it up to date, and builds it; of tests those of these `crates` alone, if there
/// are any, and lines of torture only if they are wanted.
///
/// # Errors
/// A fault does not compile.
pub fn build(faults: &[Fault], crates: &[String], has_torture: bool) -> Outcome<Copy> {
    let (digest, has_all_units) = (make(faults)?, crates.is_empty());
    let has_torture = has_torture && has_all_units || crates.iter().any(|name| name == TORTURE);
    let mut programs = Vec::new();
    let packages = crates.iter().filter(|name| *name != TORTURE);
    let packages: Vec<&str> = packages.flat_map(|name| ["--package", name]).collect();
    let built = if has_all_units || !packages.is_empty() {
        messages(&[&["test", "--no-run"], &packages[..]].concat())?
    } else {
        Vec::new()
    };
    let of_proof = if has_all_units {
        messages(&[&["test", "--no-run"][..], &PROOF_TESTED].concat())?
    } else {
        Vec::new()
    };
    for line in built.into_iter().chain(of_proof) {
        let crate_folder = Path::new(line["manifest_path"].as_str().unwrap_or_default()).parent();
        let crate_folder = crate_folder.and_then(|folder| folder.strip_prefix(source()).ok());
        let program = line["executable"].as_str().filter(|_| line["profile"]["test"] == true);
        if let (Some(folder), Some(program)) = (crate_folder, program) {
            programs.push((folder.to_string_lossy().into_owned(), PathBuf::from(program)));
        }
    }
    if has_torture {
        messages(&["build", "--package", "host-sim"])?;
        messages(&["build", "--package", TORTURE])?;
    }
    let built = folder().join("build/debug");
    Ok(Copy {
        programs,
        has_all_units,
        has_torture,
        torture: built.join("torture"),
        host_sim: built.join("host-sim"),
        digest,
    })
}

/// Writes the copy, and returns the digest of all tracked files but pages, and those of this command.
fn make(faults: &[Fault]) -> Outcome<u64> {
    let spliced = splice(faults)?;
    let crates: BTreeSet<&str> = faults.iter().map(|fault| fault.crate_folder.as_str()).collect();
    let switch = folder().join("fault-switch");
    let mut digest = DefaultHasher::new();
    update(&source(), |file, content| {
        if !file.starts_with(FOLDER)
            && !file.starts_with("xtask")
            && Path::new(file).extension().is_none_or(|it| it != "md")
        {
            digest.write(file.as_bytes());
            digest.write(&content);
        }
        if let Some(switched) = spliced.get(file) {
            return Ok(switched.clone().into_bytes());
        }
        if !file.strip_suffix("/Cargo.toml").is_some_and(|folder| crates.contains(folder)) {
            return Ok(content);
        }
        let dependency =
            format!("[dependencies]\nfault-switch = {{ path = '{}' }}", switch.display());
        let text = String::from_utf8_lossy(&content).replacen("[dependencies]", &dependency, 1);
        Ok(text.into_bytes())
    })?;
    let manifest = "[package]\nname = \"fault-switch\"\nedition = \"2024\"\n\n[workspace]\n";
    write_if_new(&switch.join("Cargo.toml"), manifest.as_bytes())?;
    let code = root().join(FOLDER).join("fault_switch.rs");
    let code = fs::read(&code).map_err(|cause| format!("{}: {cause}", code.display()))?;
    write_if_new(&switch.join("src/lib.rs"), &code)?;
    Ok(digest.finish())
}

/// Runs cargo in the copy, and returns what it says of each artefact.
fn messages(arguments: &[&str]) -> Outcome<Vec<Value>> {
    eprintln!("$ cargo {} (in {})", arguments.join(" "), source().display());
    let output = cargo(arguments)
        .current_dir(source())
        .arg("--message-format=json-render-diagnostics")
        .env("CARGO_TARGET_DIR", folder().join("build"))
        .env("CARGO_INCREMENTAL", "0")
        .stderr(Stdio::inherit())
        .output()
        .map_err(|cause| format!("cargo: {cause}"))?;
    if !output.status.success() {
        return Err(format!("the copy does not build: {}", output.status));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
}
