//! What must hold for any bytes that reach Taxel, whoever sends them: one target a way in.
//!
//! A target takes bytes, gives them to the subject as an attacker would, and panics where the subject breaks a
//! promise. libFuzzer runs targets on bytes that it finds by coverage (`proof/fuzz/README.md`), and `cargo xtask torture` on
//! the committed corpus and on [mutants](mutate::mutate) of it.

#![allow(missing_docs, clippy::missing_errors_doc)] // a name that says all needs no more

// From the ground up: a module imports only what is declared before it.
mod draws;
pub mod mutate;
pub mod seal;
mod blob;
mod packet;
mod settings;
mod link;
mod csv_file;
mod gzip;
mod pattern;
mod time_stamp;
mod scene;
mod recording;

/// A way in for hostile bytes.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Name, which is that of its corpus.
    pub name: &'static str,
    /// Gives bytes to the subject; returns whether the subject took them for sound. Panics where a promise is broken.
    pub check: fn(bytes: &[u8]) -> bool,
}

/// All targets.
pub const TARGETS: &[Target] = &[
    Target { name: "blob", check: blob::check },
    Target { name: "packet", check: packet::check },
    Target { name: "settings", check: settings::check },
    Target { name: "link", check: link::check },
    Target { name: "csv", check: csv_file::check },
    Target { name: "gzip", check: gzip::check },
    Target { name: "pattern", check: pattern::check },
    Target { name: "time", check: time_stamp::check },
    Target { name: "scene", check: scene::check },
    Target { name: "recording", check: recording::check },
];

/// The target called `name`.
///
/// # Panics
/// There is none.
pub fn target(name: &str) -> Target {
    *TARGETS.iter().find(|target| target.name == name).expect("the name of a target")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn every_target_holds_on_its_corpus_and_takes_some_of_it() {
        let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus");
        for target in TARGETS {
            let seeds: Vec<Vec<u8>> = std::fs::read_dir(corpora.join(target.name))
                .unwrap()
                .map(|entry| std::fs::read(entry.unwrap().path()).unwrap())
                .collect();
            let sound = seeds.iter().filter(|seed| (target.check)(seed)).count();
            assert!(sound > 0, "{}: no seed is sound", target.name);
        }
    }
}
