//! Check of the workspace's structure: which crate may depend on which. Here a new crate is declared.

use serde_json::Value;

use crate::process::{Outcome, capture, cargo};

/// The workspace's crates from the ground up, floor by floor: none depends on one above it.
const DEVICE: &[&str] =
    &["model-core", "firmware", "board-common", "link-check", "qemu-image", "nucleo-f446re"];
/// Crates that stand in for a device in its tests, and in proofs.
const MOCKS: &[&str] = &["mock-board"];
const DESK: &[&str] = &[
    "taxel-data",
    "taxel-simulate",
    "taxel-learn",
    "taxel-limit",
    "taxel-rig",
    "taxel-evaluate",
    "host-sim",
    "xtask",
];

/// Fails if a crate depends on one above it, or is not declared.
pub fn run() -> Outcome {
    let metadata = capture(&mut cargo(&["metadata", "--no-deps", "--format-version", "1"]));
    metadata.outcome.map_err(|cause| metadata.err + &cause)?;
    let metadata: Value = serde_json::from_str(&metadata.out).map_err(|cause| cause.to_string())?;
    let broken = broken(&metadata);
    if broken.is_empty() { Ok(()) } else { Err(broken.join("\n")) }
}

/// Breaches of the order. Crates of the desk may be tested with any others, crates of the device with mocks besides
/// their own kind.
fn broken(metadata: &Value) -> Vec<String> {
    let place = |name: &Value| {
        let mut all = DEVICE.iter().chain(MOCKS).chain(DESK);
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
                Some("dev") if own < DEVICE.len() => DEVICE.len() + MOCKS.len(),
                Some("dev") => usize::MAX,
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
    fn a_crate_depends_on_what_stands_below_it() {
        let broken = |name: &str, on: &str, kind: Option<&str>| {
            let dependencies = json!([{"name": on, "kind": kind}, {"name": "serde", "kind": null}]);
            !broken(&json!({"packages": [{"name": name, "dependencies": dependencies}]})).is_empty()
        };
        for (name, on, kind) in [
            ("model-core", "firmware", None),
            ("model-core", "taxel-data", Some("dev")),
            ("firmware", "mock-board", None),
            ("firmware", "taxel-learn", Some("build")),
            ("taxel-data", "taxel-simulate", None),
            ("unknown", "serde", None),
        ] {
            assert!(broken(name, on, kind), "{name} on {on}");
        }
        for (name, on, kind) in [
            ("firmware", "model-core", None),
            ("firmware", "mock-board", Some("dev")),
            ("taxel-data", "host-sim", Some("dev")),
            ("taxel-simulate", "firmware", None),
        ] {
            assert!(!broken(name, on, kind), "{name} on {on}");
        }
    }
}
