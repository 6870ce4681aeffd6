//! Places in a linked image that could panic: constants with a file's name, line and column, which the linker keeps only
//! for panics that the optimiser could not remove.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use object::{Object, ObjectSection};

use crate::process::{Outcome, read};

/// Where the files are listed that may panic, since that cannot be reached: others' files alone.
const LIST: &str = "firmware/README.md";
const HEADING: &str = "## Panics that cannot be reached";

/// Fails if `image` has a place of a panic that is not listed, or none at one that is.
pub fn check(image: &Path) -> Outcome {
    let failed = |cause: String| format!("{}: {cause}", image.display());
    let bytes = fs::read(image).map_err(|cause| failed(cause.to_string()))?;
    let file = object::File::parse(&*bytes).map_err(|cause| failed(cause.to_string()))?;
    let section = file.section_by_name(".rodata").ok_or(failed("there is no .rodata".into()))?;
    let constants = section.data().map_err(|cause| failed(cause.to_string()))?;
    let page = read(LIST)?;
    let found = places(constants, section.address());
    let faults = compare(&found, &listed(&page));
    if !faults.is_empty() {
        return Err(format!("{}: {}", image.display(), faults.join("; ")));
    }
    let lines: usize = found.values().map(Vec::len).sum();
    println!("{lines} places of panics in the board's image, in {} files: {LIST}", found.len());
    Ok(())
}

/// What is found and not listed, and what is listed and not found.
fn compare(found: &BTreeMap<String, Vec<u32>>, listed: &[String]) -> Vec<String> {
    let unlisted = found.iter().filter(|(file, _)| !listed.contains(file));
    let unlisted = unlisted.map(|(file, lines)| format!("{file} can panic, in lines {lines:?}"));
    let gone = listed.iter().filter(|file| !found.contains_key(*file));
    let gone = gone.map(|file| format!("{LIST} lists {file}, which cannot panic"));
    unlisted.chain(gone).collect()
}

/// Lines by file, as in `stm32f4xx-hal/src/spi.rs`, of the places among `constants`, which begin at `start`.
fn places(constants: &[u8], start: u64) -> BTreeMap<String, Vec<u32>> {
    let mut places: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for words in (0..constants.len()).step_by(4).filter_map(|at| constants.get(at..at + 16)) {
        let [name, length, line, column] =
            [0, 4, 8, 12].map(|at| u32::from_le_bytes(words[at..at + 4].try_into().unwrap()));
        let place =
            u64::from(name).checked_sub(start).and_then(|place| usize::try_from(place).ok());
        let text =
            place.and_then(|place| constants.get(place..place.checked_add(length as usize)?));
        let text = text.and_then(|text| str::from_utf8(text).ok()).unwrap_or_default();
        let is_source = Path::new(text).extension().is_some_and(|ending| ending == "rs");
        if is_source && (1..1 << 16).contains(&line) && (1..1 << 10).contains(&column) {
            places.entry(short(text)).or_default().push(line);
        }
    }
    places
}

/// A file of another crate without the registry's folder and the crate's version; any other as it is.
fn short(file: &str) -> String {
    let Some((_, inside)) = file.split_once("/registry/src/") else { return file.to_owned() };
    let (folder, path) =
        inside.split_once('/').and_then(|(_, rest)| rest.split_once('/')).unwrap_or_default();
    let name = folder.rsplit_once('-').map_or(folder, |(name, _)| name);
    format!("{name}/{path}")
}

/// The files that the page lists.
fn listed(page: &str) -> Vec<String> {
    let section = page.split_once(HEADING).map_or("", |(_, rest)| rest);
    let section = section.split_once("\n#").map_or(section, |(section, _)| section);
    let files = section.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
    files.map(|(file, _)| file.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: u64 = 0x0800_0000;

    /// A section that holds `text` and a place there.
    fn section(text: &str, line: u32) -> Vec<u8> {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(text.len().next_multiple_of(4), 0);
        let words = [START as u32, text.len() as u32, line, 9];
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_panic_of_ours_is_found_by_its_line() {
        let found = places(&section("firmware/src/link.rs", 12), START);
        assert_eq!(found["firmware/src/link.rs"], [12]);
        assert_eq!(
            compare(&found, &["firmware/src/gone.rs".to_owned()]),
            [
                "firmware/src/link.rs can panic, in lines [12]",
                "firmware/README.md lists firmware/src/gone.rs, which cannot panic"
            ]
        );
    }

    #[test]
    fn a_file_of_others_is_named_without_folder_and_version() {
        let file = "/home/x/.cargo/registry/src/index.crates.io-1/some-hal-0.2.0/src/a/b.rs";
        assert_eq!(places(&section(file, 7), START)["some-hal/src/a/b.rs"], [7]);
        let page = format!(
            "{HEADING}\n\n| file | why |\n|---|---|\n| `some-hal/src/a/b.rs` | so |\n\n## Next\n| `x` |"
        );
        assert_eq!(listed(&page), ["some-hal/src/a/b.rs"]);
    }

    #[test]
    fn what_is_no_place_is_none() {
        assert!(places(&section("firmware/src/link.rs", 0), START).is_empty());
        assert!(places(&section("no file", 12), START).is_empty());
    }
}
