//! Fields of a document by their paths, such as `sensor.row_wires` or `sensor.size_mm.2`.

use taxel_data::{BadValue, require};
use toml::{Table, Value};

/// Sets the field at `path`, in tables that are made where they are missing; in lists, places are counted from 0.
///
/// # Errors
/// [`BadValue`] for a path through a value that is neither table nor list, or to a place that a list does not have.
pub fn set(document: &mut Table, path: &str, value: Value) -> Result<(), BadValue> {
    let (first, rest) = first_of(path);
    let Some(rest) = rest else {
        document.insert(first.into(), value);
        return Ok(());
    };
    let inner = document.entry(first).or_insert_with(|| Table::new().into());
    set_in(inner, rest, value).map_err(|bad| bad.named(path))
}

/// First part of a path, and the rest of it, if there is any.
fn first_of(path: &str) -> (&str, Option<&str>) {
    path.split_once('.').map_or((path, None), |(first, rest)| (first, Some(rest)))
}

fn set_in(outer: &mut Value, path: &str, value: Value) -> Result<(), BadValue> {
    match outer {
        Value::Table(table) => set(table, path, value),
        Value::Array(list) => {
            let (first, rest) = first_of(path);
            let length = list.len();
            let place = first.parse().ok().filter(|place| *place < length);
            let place: usize = place.ok_or_else(|| {
                BadValue::new(
                    path,
                    first,
                    format!("give an index of the list, 0 to {}", length - 1),
                )
            })?;
            match rest {
                None => list[place] = value,
                Some(rest) => set_in(&mut list[place], rest, value)?,
            }
            Ok(())
        }
        other => Err(BadValue::new(path, other, "it is a value, which has no fields")),
    }
}

/// Paths and values of the fields in `table`, in tables of tables as well; those that `is_value` are values.
pub fn leaves(table: &Table, is_value: &dyn Fn(&Value) -> bool) -> Vec<(String, Value)> {
    let mut leaves = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(inner) if !is_value(value) => {
                let inner = self::leaves(inner, is_value).into_iter();
                leaves.extend(inner.map(|(path, value)| (format!("{key}.{path}"), value)));
            }
            _ => leaves.push((key.clone(), value.clone())),
        }
    }
    leaves
}

/// Message of serde with only the nearest of the names that it lists for an unknown one.
pub fn with_nearest(message: &str) -> String {
    let Some((start, list)) = message.split_once(", expected ") else {
        return message.trim().into();
    };
    let Some(given) = start.rsplit('`').nth(1).filter(|_| start.contains("unknown ")) else {
        return message.trim().into();
    };
    let known: Vec<&str> = list.split('`').skip(1).step_by(2).collect();
    format!("{start}; {}", nearest(given, &known))
}

/// Advice that names those of the `known` names that are nearest to the `given` one.
pub fn nearest(given: &str, known: &[&str]) -> String {
    const SHOWN: usize = 3;
    let mut by_distance: Vec<(usize, &str)> =
        known.iter().map(|name| (strsim::damerau_levenshtein(given, name), *name)).collect();
    by_distance.sort_unstable();
    let names = by_distance.iter().take(SHOWN).map(|(_, name)| format!("`{name}`"));
    format!("the nearest are {}", names.collect::<Vec<_>>().join(", "))
}

/// Checks that `name` is one of the `known` names.
pub fn require_known(field: &str, name: &str, known: &[&str]) -> Result<(), BadValue> {
    require(known.contains(&name), field, name, || {
        format!("it is unknown; {}", nearest(name, known))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Table {
        toml::from_str("seed = 1\n[sensor]\nsize_mm = [1.0, 2.0, 3.0]\n[noise]\nlevel = 0.1")
            .unwrap()
    }

    #[test]
    fn fields_are_set_by_their_paths() {
        let mut changed = document();
        let values =
            [("seed", Value::from(7)), ("sensor.size_mm.2", 4.5.into()), ("a.b.c", true.into())];
        values.into_iter().for_each(|(path, value)| set(&mut changed, path, value).unwrap());
        let expected =
            "seed = 7\n[sensor]\nsize_mm = [1.0, 2.0, 4.5]\n[noise]\nlevel = 0.1\n[a.b]\nc = true";
        assert_eq!(changed, toml::from_str(expected).unwrap());
    }

    #[test]
    fn paths_that_lead_nowhere_are_refused_by_name() {
        for (path, said) in [
            ("seed.x", "has no fields"),
            ("sensor.size_mm.3", "0 to 2"),
            ("sensor.size_mm.z", "0 to 2"),
            ("noise.level.0", "has no fields"),
        ] {
            let message = set(&mut document(), path, 1.into()).unwrap_err().to_string();
            assert!(message.contains(path) && message.contains(said), "{message}");
        }
    }

    #[test]
    fn an_unknown_name_is_told_from_its_nearest() {
        let short = with_nearest("unknown field `row_wire`, expected one of `noise`, `row_wires`");
        assert!(short.starts_with("unknown field `row_wire`; the nearest are `row_wires`"));
    }
}
