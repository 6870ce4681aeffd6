//! Bounds of promises that are measured: twice the worst that ten runs found.

use std::fmt::Write;
use std::path::Path;

/// Number of runs whose worst is accepted.
pub const RUNS: u64 = 10;

const FILE: &str = include_str!("../bounds.csv");

/// The largest value that is accepted of the promise `name`: twice the worst in `bounds.csv`, if it is there, and at most
/// what is `promised`.
pub fn bound(name: &str, promised: f64) -> f64 {
    worst(name).map_or(promised, |worst| promised.min(2.0 * worst))
}

/// Whether the promise `name` is measured.
pub fn is_measured(name: &str) -> bool {
    worst(name).is_some()
}

fn worst(name: &str) -> Option<f64> {
    FILE.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(',')?.parse().ok())
}

/// Writes these worst values into `bounds.csv`.
pub fn accept(worst: &[(&str, f64)]) -> std::io::Result<()> {
    let mut text = String::new();
    for line in FILE.lines() {
        let name = line.split(',').next().unwrap_or_default();
        // Writing to a String cannot fail.
        let _ = match worst.iter().find(|(accepted, _)| *accepted == name) {
            Some((_, worst)) => writeln!(text, "{name},{worst:.3e}"),
            None => writeln!(text, "{line}"),
        };
    }
    std::fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("bounds.csv"), text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::promises::PROMISES;

    #[test]
    fn every_bound_is_of_a_promise_positive_and_at_most_what_is_promised() {
        for line in FILE.lines().filter(|line| !line.starts_with('#')).skip(1) {
            let name = line.split(',').next().unwrap();
            assert!(PROMISES.iter().any(|promise| promise.name == name), "{line}");
            assert!(worst(name).unwrap() > 0.0 && bound(name, 1e-300) == 1e-300, "{line}");
            assert_eq!(bound(name, f64::INFINITY), 2.0 * worst(name).unwrap());
        }
    }
}
