//! The rule for sizes: no crate holds more than a part of all lines of Rust.

use std::path::Path;

use super::workspace::Package;

/// A crate's part of all lines of Rust.
#[derive(Debug, PartialEq)]
pub struct Share {
    pub name: String,
    pub lines: usize,
    pub percent: f64,
}

/// The crates' shares, the largest first, from the number of lines of each file. A file belongs to the crate whose
/// folder is the innermost around it.
pub fn of(packages: &[Package], files: &[(&Path, usize)]) -> Vec<Share> {
    let owner = |file: &Path| {
        let around = packages.iter().filter(|package| file.starts_with(&package.directory));
        around.max_by_key(|package| package.directory.components().count())
    };
    let all: usize = files.iter().map(|(_, lines)| lines).sum();
    let mut shares: Vec<Share> = packages
        .iter()
        .map(|package| {
            let own = files.iter().filter(|(file, _)| owner(file) == Some(package));
            let lines = own.map(|(_, lines)| lines).sum();
            let percent = 100.0 * lines as f64 / all.max(1) as f64;
            Share { name: package.name.clone(), lines, percent }
        })
        .collect();
    shares.sort_by(|a, b| b.lines.cmp(&a.lines).then_with(|| a.name.cmp(&b.name)));
    shares
}

/// The shares as lines with aligned columns.
pub fn table(shares: &[Share]) -> String {
    let line = |share: &Share| {
        format!("{:16} {:6} lines of Rust {:5.1} %\n", share.name, share.lines, share.percent)
    };
    shares.iter().map(line).collect()
}

/// Descriptions of crates that hold more than `largest_percent`.
pub fn too_large(shares: &[Share], largest_percent: f64) -> Vec<String> {
    let message = |share: &Share| {
        format!(
            "{} holds {:.1} % of all lines of Rust, at most {largest_percent} % may stand in one crate: cut it",
            share.name, share.percent
        )
    };
    shares.iter().filter(|share| share.percent > largest_percent).map(message).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, directory: &str) -> Package {
        let directory = directory.into();
        Package { name: name.into(), directory, dependencies: Vec::new(), roots: Vec::new() }
    }

    #[test]
    fn a_file_counts_for_the_innermost_crate_around_it() {
        let packages = [package("outer", "a"), package("inner", "a/b"), package("other", "ab")];
        let files =
            [("a/src/lib.rs", 20), ("a/b/src/lib.rs", 30), ("ab/lib.rs", 40), ("x/y.rs", 10)];
        let files = files.map(|(file, lines)| (Path::new(file), lines));
        let shares = of(&packages, &files);
        let found: Vec<_> =
            shares.iter().map(|share| (share.name.as_str(), share.lines, share.percent)).collect();
        assert_eq!(found, [("other", 40, 40.0), ("inner", 30, 30.0), ("outer", 20, 20.0)]);
        assert!(table(&shares).contains("other                40 lines of Rust  40.0 %\n"));
    }

    #[test]
    fn a_crate_may_reach_its_share_but_not_exceed_it() {
        let share = |percent| [Share { name: "a".into(), lines: 1, percent }];
        assert!(too_large(&share(27.0), 27.0).is_empty());
        assert_eq!(
            too_large(&share(27.25), 27.0),
            ["a holds 27.2 % of all lines of Rust, at most 27 % may stand in one crate: cut it"]
        );
    }
}
