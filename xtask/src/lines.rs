//! Lines of Rust that git tracks, crate by crate.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::process::{Outcome, capture, root};

/// Folders of what runs for a user; those of `NOT_PRODUCT` excepted.
const PRODUCT: [&str; 4] = ["model-core", "firmware", "host-sim", "python"];
const NOT_PRODUCT: [&str; 4] =
    ["firmware/qemu", "firmware/link-check", "firmware/mock-board", "host-sim/virtual-board"];

/// All lines; of these the lines of code (no comment, not blank) in the source, and in tests, benches and examples.
type Lines = [usize; 3];

/// Prints the table.
pub fn run() -> Outcome {
    let mut git = Command::new("git");
    let listed = capture(git.args(["ls-files", "*.rs", "*Cargo.toml"]).current_dir(root()));
    listed.outcome.map_err(|cause| listed.err + &cause)?;
    let (manifests, sources): (Vec<&str>, _) =
        listed.out.lines().partition(|file| file.ends_with("Cargo.toml"));
    let folders: Vec<&str> =
        manifests.iter().filter_map(|it| it.strip_suffix("/Cargo.toml")).collect();
    let (mut crates, mut sums) = (BTreeMap::new(), [("in all", [0; 3]), ("product", [0; 3])]);
    for file in sources {
        let text = fs::read_to_string(root().join(file)).map_err(|it| format!("{file}: {it}"))?;
        let around = folders.iter().filter(|folder| Path::new(file).starts_with(folder));
        let owner = *around.max_by_key(|folder| folder.len()).unwrap_or(&"(no crate)");
        let is_product = PRODUCT.iter().any(|folder| Path::new(owner).starts_with(folder));
        let counted = count(file, &text);
        add(crates.entry(owner).or_default(), counted);
        add(&mut sums[0].1, counted);
        if is_product && !NOT_PRODUCT.contains(&owner) {
            add(&mut sums[1].1, counted);
        }
    }
    println!("{:26} {:>7} {:>7} {:>7}", "lines of Rust", "all", "source", "tests");
    for (name, [all, source, tests]) in crates.into_iter().chain(sums) {
        println!("{name:26} {all:7} {source:7} {tests:7}");
    }
    Ok(())
}

fn add(sum: &mut Lines, counted: Lines) {
    sum.iter_mut().zip(counted).for_each(|(sum, lines)| *sum += lines);
}

fn count(file: &str, text: &str) -> Lines {
    let of_tests = ["tests", "tests.rs", "examples", "benches"];
    let is_test = file.split('/').any(|part| of_tests.contains(&part) || part.starts_with("test_"));
    let mut lines = [0; 3];
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
        lines[0] += 1;
        lines[kind] += usize::from(is_code);
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
        assert_eq!(count("a/src/lib.rs", text), [12, 3, 6]);
        assert_eq!(count("a/tests/all.rs", text), [12, 0, 9]);
        assert_eq!(count("a/src/b.rs", "#[cfg(test)]\nmod tests;\nmod a;\n"), [3, 1, 2]);
    }
}
