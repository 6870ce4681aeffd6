//! Lines of Rust that git tracks, crate by crate.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::process::{Outcome, capture, root};

/// Folders of what runs for a user; those of `NOT_PRODUCT` excepted.
const PRODUCT: [&str; 3] = ["model-core", "firmware", "host-sim"];
const NOT_PRODUCT: [&str; 4] =
    ["firmware/qemu", "firmware/link-check", "firmware/mock-board", "firmware/remote-readout"];

/// All lines; of these the lines of code (no comment, not blank) in the source, and in tests, benches and examples.
#[derive(Default, Clone, Copy)]
struct Lines([usize; 3]);

/// Prints the table.
pub fn run() -> Outcome {
    let listed =
        capture(Command::new("git").args(["ls-files", "*.rs", "*Cargo.toml"]).current_dir(root()));
    listed.outcome.map_err(|cause| listed.err + &cause)?;
    let folders: Vec<&str> =
        listed.out.lines().filter_map(|file| file.strip_suffix("/Cargo.toml")).collect();
    let is_rust = |file: &str| Path::new(file).extension().is_some_and(|end| end == "rs");
    let mut crates: BTreeMap<&str, Lines> = BTreeMap::new();
    for file in listed.out.lines().filter(|file| is_rust(file)) {
        let text =
            fs::read_to_string(root().join(file)).map_err(|cause| format!("{file}: {cause}"))?;
        let around = folders.iter().filter(|folder| Path::new(file).starts_with(folder));
        let owner = around.max_by_key(|folder| folder.len()).unwrap_or(&"(no crate)");
        let sum = crates.entry(owner).or_default();
        *sum = plus(*sum, &count(file, &text));
    }
    let is_product = |name: &str| {
        PRODUCT.iter().any(|folder| Path::new(name).starts_with(folder))
            && !NOT_PRODUCT.contains(&name)
    };
    println!("{:26} {:>7} {:>7} {:>7}", "lines of Rust", "all", "source", "tests");
    let mut sums = [("in all", Lines::default()), ("the product", Lines::default())];
    for (name, lines) in &crates {
        show(name, lines);
        sums[0].1 = plus(sums[0].1, lines);
        if is_product(name) {
            sums[1].1 = plus(sums[1].1, lines);
        }
    }
    sums.iter().for_each(|(name, lines)| show(name, lines));
    Ok(())
}

fn show(name: &str, Lines([all, source, tests]): &Lines) {
    println!("{name:26} {all:7} {source:7} {tests:7}");
}

fn plus(one: Lines, other: &Lines) -> Lines {
    Lines([0, 1, 2].map(|at| one.0[at] + other.0[at]))
}

fn count(file: &str, text: &str) -> Lines {
    let of_tests = ["tests", "tests.rs", "examples", "benches"];
    let is_test = file.split('/').any(|part| of_tests.contains(&part) || part.starts_with("test_"));
    let mut lines = Lines::default();
    let mut rest = text.lines();
    // Last line of the item for tests that this line is in.
    let mut item_end: Option<String> = None;
    while let Some(line) = rest.next() {
        let code = line.trim_start();
        if item_end.is_none() && code.starts_with("#[cfg(test)]") {
            let item = rest.clone().find(|next| !next.trim_start().starts_with("#["));
            let is_block = item.is_some_and(|item| item.ends_with('{'));
            item_end =
                if is_block { Some(line.replace(code, "}")) } else { item.map(str::to_owned) };
        }
        let is_code = !code.is_empty() && !code.starts_with("//");
        let kind = if is_test || item_end.is_some() { 2 } else { 1 };
        lines.0[0] += 1;
        lines.0[kind] += usize::from(is_code);
        if item_end.as_deref().is_some_and(|end| line == end || line.trim_end_matches(';') == end) {
            item_end = None;
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_blank_lines_are_no_code_and_a_module_of_tests_is_none_of_the_source() {
        let text = "//! A.\n\nfn f() {\n}\n#[cfg(test)]\n#[cfg(unix)]\nmod tests {\n    // b\n    fn g() {\n    }\n}\nfn h() {}\n";
        assert_eq!(count("a/src/lib.rs", text).0, [12, 3, 6]);
        assert_eq!(count("a/tests/all.rs", text).0, [12, 0, 9]);
        assert_eq!(count("a/src/b.rs", "#[cfg(test)]\nmod tests;\nmod a;\n").0, [3, 1, 2]);
    }
}
