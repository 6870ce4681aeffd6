//! The planted faults, as the files in `proof/mutants` list them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::Deserialize;

use crate::process::{Outcome, root};

/// Folder of the lists, of the switch and of the score.
pub const FOLDER: &str = "proof/mutants";

/// Whether a fault replaces a value or statements.
#[derive(Debug, Clone, Copy, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Kind {
    #[default]
    Expression,
    Statement,
}

/// A fault, as a list has it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    pub name: String,
    pub file: String,
    line: Option<String>,
    find: String,
    replace: String,
    #[serde(default)]
    kind: Kind,
    /// What a user would suffer.
    pub why: String,
    /// Reason why nobody can observe it.
    pub equivalent: Option<String>,
    /// Lines of torture that must see it, each by itself.
    #[serde(default)]
    pub torture: Vec<String>,
    /// The list's name.
    #[serde(skip)]
    pub list: String,
    /// Name of the crate's folder.
    #[serde(skip)]
    pub crate_folder: String,
}

#[derive(Deserialize)]
struct List {
    fault: Vec<Fault>,
}

impl Fault {
    /// Where the fault's text begins in the file's `text`.
    fn place(&self, text: &str) -> Outcome<usize> {
        let once = |text: &str, part: &str| {
            let mut places = text.match_indices(part);
            match (places.next(), places.count()) {
                (Some((place, _)), 0) => Ok(place),
                (None, _) => Err(format!("{}: `{part}` is not in {}", self.name, self.file)),
                _ => Err(format!("{}: `{part}` is more than once in {}", self.name, self.file)),
            }
        };
        match &self.line {
            None => once(text, &self.find),
            Some(line) => Ok(once(text, line)? + once(line, &self.find)?),
        }
    }

    /// The fault's text with both ways behind the switch.
    fn switched(&self, number: usize) -> String {
        let Self { find, replace, .. } = self;
        let both = format!("if fault_switch::on({number}) {{ {replace} }} else {{ {find} }}");
        if self.kind == Kind::Expression { format!("({both})") } else { both }
    }

    /// What makes a run of this fault the same as another one.
    pub fn key(&self) -> String {
        format!("{} {:?} {} -> {}", self.file, self.line, self.find, self.replace)
    }
}

/// Name of the list whose author had not read the tests. Some of its faults are in the places of others, so that it is
/// run alone.
pub const SECOND: &str = "second";

/// Reads the second list, or all others. The place of a fault, from 1 on, is its number.
///
/// # Errors
/// A list is wrong: a name stands twice, or a fault's text does not stand once in its file.
pub fn load(is_second: bool) -> Outcome<Vec<Fault>> {
    let folder = root().join(FOLDER);
    let failed = |cause: std::io::Error| format!("{FOLDER}: {cause}");
    let entries: Result<Vec<_>, _> = fs::read_dir(&folder).map_err(failed)?.collect();
    let mut files: Vec<_> = entries.map_err(failed)?.iter().map(fs::DirEntry::path).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.retain(|file| file.file_stem().is_some_and(|name| name == SECOND) == is_second);
    files.sort();
    let mut faults: Vec<Fault> = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).map_err(failed)?;
        let list: List =
            toml::from_str(&text).map_err(|cause| format!("{}: {cause}", file.display()))?;
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        faults.extend(list.fault.into_iter().map(|fault| Fault {
            list: name.clone().into_owned(),
            crate_folder: crate_folder(&fault.file),
            ..fault
        }));
    }
    for (number, fault) in faults.iter().enumerate() {
        if faults[..number].iter().any(|earlier| earlier.name == fault.name) {
            return Err(format!("two faults are called `{}`", fault.name));
        }
    }
    splice(&faults)?;
    Ok(faults)
}

/// The files that hold faults, with all of them behind the switch.
pub fn splice(faults: &[Fault]) -> Outcome<BTreeMap<&str, String>> {
    let mut places: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
    let mut texts = BTreeMap::new();
    for (index, fault) in faults.iter().enumerate() {
        let text = fs::read_to_string(root().join(&fault.file))
            .map_err(|cause| format!("{}: {}: {cause}", fault.name, fault.file))?;
        places.entry(&fault.file).or_default().push((fault.place(&text)?, index));
        texts.insert(fault.file.as_str(), text);
    }
    for (file, mut places) in places {
        places.sort_unstable();
        for pair in places.windows(2) {
            let [(first, one), (second, other)] = [pair[0], pair[1]];
            if first + faults[one].find.len() > second {
                let names = [&faults[one].name, &faults[other].name];
                return Err(format!("the faults {names:?} overlap in {file}"));
            }
        }
        for (place, index) in places.into_iter().rev() {
            let (end, both) = (place + faults[index].find.len(), faults[index].switched(index + 1));
            texts.entry(file).and_modify(|text| text.replace_range(place..end, &both));
        }
    }
    Ok(texts)
}

/// Folder of the crate to which a file belongs.
fn crate_folder(file: &str) -> String {
    let mut folders = Path::new(file).ancestors().skip(1);
    let own = folders.find(|folder| root().join(folder).join("Cargo.toml").exists());
    own.map(|folder| folder.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_stands_behind_the_switch_where_its_line_is() {
        let fault = "name = 'less'\nfile = 'a.rs'\nline = 'if a <= b'\nfind = 'a <= b'\nreplace = 'a < b'\nwhy = 'w'";
        let fault: Fault = toml::from_str(fault).unwrap();
        assert_eq!(fault.place("a <= b; if a <= b {").unwrap(), 11);
        assert_eq!(fault.switched(7), "(if fault_switch::on(7) { a < b } else { a <= b })");
        for text in ["a <= b", "if a <= b; if a <= b"] {
            assert!(fault.place(text).is_err(), "{text}");
        }
    }

    #[test]
    fn every_fault_stands_once_in_its_file_and_names_what_a_user_would_suffer() {
        let (first, second) = (load(false).unwrap(), load(true).unwrap());
        assert!(first.len() >= 100 && second.len() >= 40, "{}, {}", first.len(), second.len());
        for fault in first.into_iter().chain(second) {
            assert!(!fault.why.is_empty() && fault.find != fault.replace, "{}", fault.name);
        }
    }
}
