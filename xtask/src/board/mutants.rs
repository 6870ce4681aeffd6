//! Mutants of the firmware: each has one fault, and the emulated board must show it.

use std::fs;

use serde::Deserialize;

use crate::process::{Outcome, root};

/// The list.
const FILE: &str = "proof/board-emulator/mutants.toml";

/// A fault, and how it shows.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mutant {
    pub name: String,
    pub file: String,
    /// Text that stands once in the file, and what replaces it.
    find: String,
    replace: String,
    /// Scenario that must fail.
    pub scenario: String,
    /// Text that the scenario must print.
    pub shown_by: String,
}

#[derive(Deserialize)]
struct List {
    mutant: Vec<Mutant>,
}

/// The mutants of these names; all if no name is given.
///
/// # Errors
/// The list is wrong.
pub fn load(names: &[String]) -> Outcome<Vec<Mutant>> {
    let failed = |cause: &dyn ToString| format!("{FILE}: {}", cause.to_string());
    let text = fs::read_to_string(root().join(FILE)).map_err(|cause| failed(&cause))?;
    let List { mut mutant } = toml::from_str(&text).map_err(|cause| failed(&cause))?;
    mutant.retain(|it| names.is_empty() || names.contains(&it.name));
    Ok(mutant)
}

impl Mutant {
    /// `text` of the file with the fault.
    pub fn apply(&self, text: &str) -> Outcome<String> {
        let Self { name, file, find, replace, .. } = self;
        match text.matches(find).count() {
            1 => Ok(text.replacen(find, replace, 1)),
            count => {
                Err(format!("mutant {name}: {find:?} stands {count} times in {file}, not once"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn read(file: &str) -> String {
        fs::read_to_string(root().join(file)).unwrap_or_else(|cause| panic!("{file}: {cause}"))
    }

    #[test]
    fn every_mutant_finds_its_text_once_and_has_a_scenario_and_a_name_of_its_own() {
        let mutants = load(&[]).unwrap();
        for mutant in &mutants {
            let text = read(&mutant.file);
            let faulty = mutant.apply(&text).unwrap_or_else(|cause| panic!("{cause}"));
            assert_ne!(faulty, text, "{}", mutant.name);
        }
        let scenarios = read("proof/board-emulator/scenarios.py");
        for Mutant { name, scenario, .. } in &mutants {
            let function = format!("def {}(make, files)", scenario.replace('-', "_"));
            assert!(scenarios.contains(&function), "{name}: there is no scenario {scenario}");
        }
        let names: BTreeSet<_> = mutants.iter().map(|mutant| &mutant.name).collect();
        assert_eq!(names.len(), mutants.len());
        assert_eq!(load(&["sck-slow".to_owned()]).unwrap().len(), 1);
    }

    #[test]
    fn every_rule_has_a_mutant_that_breaks_it() {
        let rules = read("proof/board-emulator/rules.txt");
        let rules = rules.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
        let rules: BTreeSet<_> =
            rules.map(|line| line.split('|').next().unwrap().trim().to_owned()).collect();
        let shown = load(&[]).unwrap().into_iter().map(|mutant| mutant.shown_by);
        let broken = shown.filter_map(|text| Some(text.strip_prefix("BREACH ")?.to_owned()));
        assert_eq!(broken.collect::<BTreeSet<_>>(), rules);
    }
}
