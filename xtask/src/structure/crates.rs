//! The rule for crates: each depends only on crates that stand before it.

use super::house::Side;
use super::workspace::{Kind, Package};

/// Breaches of the `declared` order, which goes from the ground up. Dependencies of tests are free, except that a
/// crate for the device is not tested with crates for the host. It may be tested with mocks, and is never built of them.
pub fn broken(packages: &[Package], declared: &[(&str, Side)]) -> Vec<String> {
    let place = |name: &str| declared.iter().position(|(declared, _)| *declared == name);
    let mut broken = Vec::new();
    for package in packages {
        let name = &package.name;
        let Some(own) = place(name) else {
            broken.push(format!("{name}: not declared in xtask/src/structure/house.rs"));
            continue;
        };
        for dependency in &package.dependencies {
            // An undeclared dependency is reported as a package, or is not part of the workspace.
            let Some(other) = place(&dependency.name) else { continue };
            let climbs = declared[own].1 == Side::Device
                && match declared[other].1 {
                    Side::Device => false,
                    Side::Mock => dependency.kind != Kind::Dev,
                    Side::Host => true,
                };
            if climbs || (dependency.kind != Kind::Dev && other >= own) {
                broken.push(format!(
                    "{}/Cargo.toml: {name} depends on {}, which stands above it",
                    package.directory.display(),
                    dependency.name
                ));
            }
        }
    }
    broken
}

/// Crates that are declared, but not in the workspace.
pub fn absent<'d>(packages: &[Package], declared: &[(&'d str, Side)]) -> Vec<&'d str> {
    let is_there = |name: &str| packages.iter().any(|package| package.name == name);
    declared.iter().map(|(name, _)| *name).filter(|name| !is_there(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::workspace::Dependency;
    use super::*;

    const DECLARED: &[(&str, Side)] =
        &[("ground", Side::Device), ("board", Side::Device), ("desk", Side::Host)];

    fn package(name: &str, dependencies: &[(&str, Kind)]) -> Package {
        let dependencies = dependencies
            .iter()
            .map(|&(name, kind)| Dependency { name: name.into(), kind })
            .collect();
        Package { name: name.into(), directory: name.into(), dependencies, roots: Vec::new() }
    }

    #[test]
    fn a_crate_depends_on_what_stands_before_it() {
        let packages = [
            package("ground", &[("serde", Kind::Normal), ("board", Kind::Dev)]),
            package("board", &[("ground", Kind::Normal), ("ground", Kind::Build)]),
            package("desk", &[("board", Kind::Normal), ("ground", Kind::Normal)]),
        ];
        assert!(broken(&packages, DECLARED).is_empty());
    }

    #[test]
    fn a_crate_that_depends_on_what_stands_above_it_is_refused() {
        for kind in [Kind::Normal, Kind::Build] {
            assert_eq!(
                broken(&[package("ground", &[("board", kind)])], DECLARED),
                ["ground/Cargo.toml: ground depends on board, which stands above it"]
            );
        }
    }

    #[test]
    fn what_runs_on_a_device_has_nothing_of_the_host_not_even_in_tests() {
        assert_eq!(
            broken(&[package("board", &[("desk", Kind::Dev)])], DECLARED),
            ["board/Cargo.toml: board depends on desk, which stands above it"]
        );
    }

    #[test]
    fn a_device_is_tested_with_mocks_and_not_built_of_them() {
        let declared = &[("mock", Side::Mock), ("board", Side::Device)];
        let board = |kind| [package("board", &[("mock", kind)]), package("mock", &[])];
        assert!(broken(&board(Kind::Dev), declared).is_empty());
        assert_eq!(
            broken(&board(Kind::Normal), declared),
            ["board/Cargo.toml: board depends on mock, which stands above it"]
        );
    }

    #[test]
    fn a_crate_that_is_declared_and_not_there_is_named() {
        assert_eq!(absent(&[package("ground", &[])], DECLARED), ["board", "desk"]);
    }

    #[test]
    fn a_crate_that_nobody_declared_is_refused() {
        assert_eq!(
            broken(&[package("new", &[])], DECLARED),
            ["new: not declared in xtask/src/structure/house.rs"]
        );
    }
}
