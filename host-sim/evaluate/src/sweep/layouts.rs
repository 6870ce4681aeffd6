//! Scenes with lists where a value is expected: each is as many layouts.

use toml::{Table, Value};

use super::fields::{self, with_nearest};
use super::plan::Base;
use crate::error::{Error, Result};
use crate::experiment::Experiment;

/// Most lists of a scene.
const MOST_LISTS: usize = 4;
/// Most layouts of a scene.
const MOST_LAYOUTS: usize = 1000;

/// Layouts of a scene, a built-in one or a file: one, or all combinations of the values in its lists.
///
/// # Errors
/// [`Error`] for a scene that cannot be read, and for one that is none with any value of its lists.
pub fn of_scene(name_or_path: &str) -> Result<Vec<Base>> {
    of_base(Base::of_scene(name_or_path, name_or_path)?)
}

fn of_base(base: Base) -> Result<Vec<Base>> {
    let Err(message) = check(&base.document) else { return Ok(vec![base]) };
    let (label, document) = (base.label.as_str(), &base.document);
    let leaves = fields::leaves(document, &|_| false).into_iter();
    let lists: Vec<(String, Vec<Value>)> =
        leaves.filter_map(|(path, value)| plain_list(path, value)).collect();
    // The lists that are too many are those without which it is a scene, and no fewer do.
    let all = (1..=MOST_LISTS.min(lists.len())).flat_map(|count| combinations(lists.len(), count));
    let (mut chosen, mut wrong) = (None, message);
    for combination in all {
        let first = combination.iter().map(|list| (&lists[*list].0, &lists[*list].1[0]));
        let Some(changed) = with(document, first) else { continue };
        match check(&changed) {
            Ok(()) => {
                chosen = Some(combination);
                break;
            }
            // What is wrong besides the lists.
            Err(message) if !is_of_list(&message) && is_of_list(&wrong) => wrong = message,
            Err(_) => {}
        }
    }
    let Some(chosen) = chosen else { return Err(Error::of_scene(label, with_nearest(&wrong))) };
    let mut layouts = vec![base.clone()];
    for list in chosen {
        let (path, values) = &lists[list];
        let short = path.rsplit('.').next().unwrap_or(path);
        let each = |base: &Base| -> Vec<Base> {
            let changed = |value: &Value| {
                let document = with(&base.document, [(path, value)].into_iter())?;
                let label = format!("{} {short}={value}", base.label);
                Some(Base { label, document, digest: base.digest })
            };
            values.iter().filter_map(changed).collect()
        };
        layouts = layouts.iter().flat_map(each).collect();
        if layouts.len() > MOST_LAYOUTS {
            let message =
                format!("its lists make more than {MOST_LAYOUTS} layouts; give fewer values");
            return Err(Error::of_scene(label, message));
        }
    }
    Ok(layouts)
}

fn check(document: &Table) -> std::result::Result<(), String> {
    Experiment::check_fields(&toml::to_string(document).map_err(|cause| cause.to_string())?)
}

/// Whether a list stands where a value is expected, or the other way round.
fn is_of_list(message: &str) -> bool {
    message.contains("sequence") || message.contains("array of length")
}

/// List of plain values, which may be an axis.
fn plain_list(path: String, value: Value) -> Option<(String, Vec<Value>)> {
    let Value::Array(values) = value else { return None };
    let is_plain = |value: &Value| !matches!(value, Value::Array(_) | Value::Table(_));
    (!values.is_empty() && values.iter().all(is_plain)).then_some((path, values))
}

fn with<'v>(
    document: &Table,
    values: impl Iterator<Item = (&'v String, &'v Value)>,
) -> Option<Table> {
    let mut document = document.clone();
    for (path, value) in values {
        fields::set(&mut document, path, value.clone()).ok()?;
    }
    Some(document)
}

/// All choices of `count` of so many `things`.
fn combinations(things: usize, count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![vec![]];
    }
    let last = |first: &Vec<usize>| first.last().map_or(0, |last| last + 1);
    let before = combinations(things, count - 1).into_iter();
    before
        .flat_map(|first| {
            (last(&first)..things).map(move |next| [first.clone(), vec![next]].concat())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layouts(change: impl Fn(&str) -> String) -> Result<Vec<String>> {
        let document: Table = toml::from_str(&change(crate::scenes::ALL[1].1)).unwrap();
        let layouts = of_base(Base { label: "mat".into(), document, digest: 0 })?;
        for layout in &layouts {
            check(&layout.document).unwrap();
        }
        Ok(layouts.into_iter().map(|layout| layout.label).collect())
    }

    #[test]
    fn a_scene_with_lists_is_all_combinations_of_their_values() {
        assert_eq!(layouts(str::to_owned).unwrap(), ["mat"]);
        let one = |text: &str| text.replace("row_wires = 8", "row_wires = 8\npitch_mm = [1, 2.5]");
        assert_eq!(layouts(one).unwrap(), ["mat pitch_mm=1", "mat pitch_mm=2.5"]);
        let staggers = |text: &str| text.replace("[sensor]", "[sensor]\nlower_stagger = [1, 2]");
        assert_eq!(layouts(staggers).unwrap(), ["mat lower_stagger=1", "mat lower_stagger=2"]);
        let two = |text: &str| one(text).replace("level = 0.005", "level = [0.01, 0.02]");
        let labels = layouts(two).unwrap();
        assert_eq!(labels.len(), 4);
        assert!(
            labels.iter().all(|label| label.contains("level=") && label.contains("pitch_mm=")),
            "{labels:?}"
        );
    }

    #[test]
    fn the_layouts_of_the_project_are_scenes() {
        let layouts =
            of_scene(concat!(env!("CARGO_MANIFEST_DIR"), "/../../cluster/plans/pitches.toml"));
        let layouts = layouts.unwrap();
        assert_eq!(layouts.len(), 10);
        layouts.iter().for_each(|layout| check(&layout.document).unwrap());
    }
}
