//! Check of the workspace's structure: which crate may depend on which, that it uses what it depends on, that all tests run,
//! and that names are short. Here a new crate is declared.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::process::{Outcome, capture, cargo, root};

/// The workspace's crates from the ground up, floor by floor: none depends on one above it.
const DEVICE: &[&str] =
    &["taxel-core", "taxel-firmware", "board-common", "qemu-image", "nucleo-f446re"];
const DESK: &[&str] = &[
    "taxel-data",
    "taxel-recording",
    "taxel-simulate",
    "taxel-learn",
    "taxel-limit",
    "taxel-rig",
    "taxel-view",
    "taxel-evaluate",
    "host-sim",
    "taxel-python",
    "device-log",
    "xtask",
];
/// Crates that prove the product, and are no part of it.
const PROOF: &[&str] = &["taxel-fuzz", "benchmarks"];

/// Number of crates of the product, which depends on none that proves it.
const PRODUCT: usize = DEVICE.len() + DESK.len();

/// Most letters of the name of a function or a test.
const LONGEST_NAME: usize = 60;

/// Fails if a crate depends on one above it, or on one that it does not use, or is not declared, or has tests that never run;
/// or if a name is too long.
pub fn run() -> Outcome {
    let metadata = metadata()?;
    let mut broken = broken(&metadata);
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let manifest = Path::new(package["manifest_path"].as_str().unwrap_or_default());
        let folder = manifest.parent().unwrap_or(manifest);
        let code = sources(folder);
        broken.extend(unused(package, &code));
        broken.extend(never_run(package, &sources(&folder.join("src"))));
        broken.extend(long_names(&code).map(|name| {
            format!("{name} has {} letters: give it at most {LONGEST_NAME}", name.len())
        }));
    }
    if broken.is_empty() { Ok(()) } else { Err(broken.join("\n")) }
}

/// What cargo knows of the workspace's crates.
pub fn metadata() -> Outcome<Value> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let said = capture(cargo(&arguments).current_dir(root()));
    said.outcome.map_err(|cause| said.err + &cause)?;
    serde_json::from_str(&said.out).map_err(|cause| cause.to_string())
}

/// Dependencies of a package that its `code` does not use. (cargo-machete does the same, and takes longer to install than
/// everything here to build.)
fn unused(package: &Value, code: &str) -> Vec<String> {
    let ignored = package["metadata"]["cargo-machete"]["ignored"].as_array();
    let dependencies = package["dependencies"].as_array().into_iter().flatten();
    let named = dependencies.filter_map(|it| it["rename"].as_str().or(it["name"].as_str()));
    named
        .filter(|name| ignored.is_none_or(|ignored| !ignored.iter().any(|it| it == name)))
        .filter(|name| !uses(code, &name.replace('-', "_")))
        .map(|name| format!("{} does not use {name:?}", package["name"]))
        .collect()
}

/// Whether code without comments uses the crate `name`: at the beginning of a path. A module of that name hides it.
fn uses(code: &str, name: &str) -> bool {
    let is_hidden = [";", " {"].iter().any(|end| code.contains(&format!("mod {name}{end}")));
    code.match_indices(name).any(|(place, _)| {
        let (before, after) = (&code[..place], &code[place + name.len()..]);
        let begins = match before.strip_suffix("::") {
            Some(before) => !before.ends_with(|it: char| it.is_alphanumeric() || "_>".contains(it)),
            None => !is_hidden && !before.ends_with(|it: char| it.is_alphanumeric() || it == '_'),
        };
        let is_import =
            before.ends_with("use ") && [";", " as "].iter().any(|it| after.starts_with(it));
        begins && (after.starts_with("::") || is_import)
    })
}

/// What is wrong with a package whose code in `src`, without comments, has tests that `cargo test` never runs.
fn never_run(package: &Value, code: &str) -> Option<String> {
    let own = ["lib", "cdylib", "bin"].map(Value::from);
    let mut targets = package["targets"].as_array().into_iter().flatten();
    let runs = targets.any(|it| own.contains(&it["kind"][0]) && it["test"] == true);
    let has_tests = ["#[cfg(test)]", "#[test]"].iter().any(|it| code.contains(it));
    let why =
        "has tests in src, which never run by its Cargo.toml (test = false): move them to tests/";
    (has_tests && !runs).then(|| format!("{} {why}", package["name"]))
}

/// Names of functions, in Rust and in Python, that are too long.
fn long_names(code: &str) -> impl Iterator<Item = &str> {
    let functions = ["fn ", "def "].into_iter().flat_map(|word| code.split(word).skip(1));
    let names =
        functions.filter_map(|it| it.split(|it: char| !it.is_alphanumeric() && it != '_').next());
    names.filter(|name| name.len() > LONGEST_NAME)
}

/// All code of the crate in a `folder`, without comments and without that of crates within.
fn sources(folder: &Path) -> String {
    let mut text = String::new();
    for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
        if path.is_dir() && !path.join("Cargo.toml").exists() && !path.ends_with("target") {
            text += &sources(&path);
        } else if path.extension().is_some_and(|end| end == "rs" || end == "py") {
            let code = fs::read_to_string(path).unwrap_or_default();
            text.extend(
                code.lines().filter_map(|line| line.split("//").next()).flat_map(|it| [it, "\n"]),
            );
        }
    }
    text
}

/// Breaches of the order. Crates of the desk may be tested with any others, crates of the device with their own kind.
fn broken(metadata: &Value) -> Vec<String> {
    let place = |name: &Value| {
        let mut all = DEVICE.iter().chain(DESK).chain(PROOF);
        all.position(|declared| name == declared)
    };
    let mut broken = Vec::new();
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let name = &package["name"];
        let Some(own) = place(name) else {
            broken.push(format!("{name} is not declared in xtask/src/structure.rs"));
            continue;
        };
        for dependency in package["dependencies"].as_array().into_iter().flatten() {
            let Some(other) = place(&dependency["name"]) else { continue };
            let allowed = match dependency["kind"].as_str() {
                Some("dev") if own < DEVICE.len() => DEVICE.len(),
                Some("dev") if own < PRODUCT => PRODUCT,
                _ => own,
            };
            if other >= allowed {
                broken.push(format!(
                    "{name} depends on {}, which stands above it",
                    dependency["name"]
                ));
            }
        }
    }
    broken
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_dependency_named_only_by_a_module_or_a_comment_is_unused() {
        let folder = std::env::temp_dir().join(format!("taxel-structure-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let unused = |code: &str| {
            fs::write(folder.join("lib.rs"), code).unwrap();
            let package = json!({"name": "a", "dependencies": [{"name": "blue-sky"}]});
            unused(&package, &sources(&folder))
        };
        for code in [
            "use blue_sky::Cloud;",
            "fn f() { blue_sky::rain() }",
            "use blue_sky as _;",
            "mod blue_sky; use ::blue_sky::Cloud;",
        ] {
            assert!(unused(code).is_empty(), "{code}");
        }
        for code in [
            "// as blue_sky::Cloud",
            "//! `blue_sky::rain`",
            "mod blue_sky;\nfn f() { blue_sky::rain() }",
            "use crate::blue_sky::Cloud;",
            "use very_blue_sky::Cloud;",
            "let blue_sky = 1;",
        ] {
            assert_eq!(unused(code), ["\"a\" does not use \"blue-sky\""], "{code}");
        }
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn tests_that_never_run_are_found() {
        let refused = |code: &str, targets: &Value| {
            never_run(&json!({"name": "a", "targets": targets}), code).is_some()
        };
        let lib = |test: bool| json!({"kind": ["lib"], "test": test});
        let integration = json!({"kind": ["test"], "test": true});
        for code in ["#[cfg(test)]\nmod tests;", "    #[test]\n    fn f() {}"] {
            assert!(refused(code, &json!([lib(false), integration])), "{code}");
            assert!(!refused(code, &json!([lib(true), integration])), "{code}");
        }
        assert!(!refused("fn test() {}", &json!([lib(false), integration])));
    }

    #[test]
    fn names_longer_than_60_letters_are_found() {
        let [good, long] = [60, 61].map(|length| "a".repeat(length));
        let code = format!("fn {good}() {{}}\nfn {long}<T>() {{}}\ndef {long}(x):");
        assert_eq!(long_names(&code).collect::<Vec<_>>(), [&long; 2]);
    }

    #[test]
    fn a_crate_depends_on_what_stands_below_it() {
        let broken = |name: &str, on: &str, kind: Option<&str>| {
            let dependencies = json!([{"name": on, "kind": kind}, {"name": "serde", "kind": null}]);
            !broken(&json!({"packages": [{"name": name, "dependencies": dependencies}]})).is_empty()
        };
        for (name, on, kind) in [
            ("taxel-core", "taxel-firmware", None),
            ("taxel-core", "taxel-data", Some("dev")),
            ("taxel-firmware", "taxel-data", Some("dev")),
            ("taxel-firmware", "taxel-learn", Some("build")),
            ("taxel-data", "taxel-simulate", None),
            ("host-sim", "benchmarks", Some("dev")),
            ("unknown", "serde", None),
        ] {
            assert!(broken(name, on, kind), "{name} on {on}");
        }
        for (name, on, kind) in [
            ("taxel-firmware", "taxel-core", None),
            ("taxel-core", "taxel-firmware", Some("dev")),
            ("taxel-data", "host-sim", Some("dev")),
            ("taxel-simulate", "taxel-firmware", None),
            ("taxel-fuzz", "taxel-core", None),
        ] {
            assert!(!broken(name, on, kind), "{name} on {on}");
        }
    }
}
