//! Column names of data files: their units, row-wires and groups.

use crate::error::cut;

/// Endings of column names that state a unit, each with the unit as it is written.
const UNITS: [(&str, &str); 7] = [
    ("_ohm", "Ω"),
    ("_mm", "mm"),
    ("_n", "N"),
    ("_pa", "Pa"),
    ("_s", "s"),
    ("_hz", "Hz"),
    ("_v", "V"),
];

/// Unit that a column's name states (`Ω` for `r4c17_ohm`), or "".
pub fn unit_of(name: &str) -> &'static str {
    UNITS.iter().find(|(suffix, _)| name.ends_with(suffix)).map_or("", |(_, unit)| unit)
}

/// Row-wire (from 1) that a name like `r4c17_ohm` or `r4e2_dz_mm` begins with.
pub fn row_of(name: &str) -> Option<usize> {
    let rest = name.strip_prefix('r')?;
    let digits = rest.find(|c: char| !c.is_ascii_digit())?;
    let (row, rest) = rest.split_at(digits);
    let place = rest.strip_prefix(['c', 'e'])?;
    place.starts_with(|c: char| c.is_ascii_digit()).then(|| row.parse().ok())?
}

/// Row-wire and column-wire (from 1) of a reading whose name begins with `r{m}c{k}_`, and the rest of the name: `ohm` for
/// `r4c17_ohm`, the file's own name for a cell of a [mat](crate::mat).
pub fn cell_of(name: &str) -> Option<([usize; 2], &str)> {
    let (row, rest) = name.strip_prefix('r')?.split_once('c')?;
    let (column, own) = rest.split_once('_')?;
    let wires = [row.parse().ok()?, column.parse().ok()?];
    wires.iter().all(|wire| *wire > 0).then_some((wires, own))
}

/// Group of readings where they are outputs, of models that predict them.
pub const READINGS: &str = "reading_ohm";

/// Group under which errors of an output are reported: the axis of an electrode's deformation or force
/// (`dz_mm` for `r4e2_dz_mm`), or [`READINGS`]. Any other column is a group of its own.
pub fn group_of(name: &str) -> &str {
    match (row_of(name), name.split_once('_')) {
        (Some(_), Some((_, "ohm"))) => READINGS,
        (Some(_), Some((_, component))) => component,
        _ => name,
    }
}

/// Groups of `names` in the order in which they first appear, each with the indices of its columns.
pub fn groups(names: &[String]) -> Vec<(&str, Vec<usize>)> {
    let mut groups: Vec<(&str, Vec<usize>)> = Vec::new();
    for (column, name) in names.iter().enumerate() {
        let group = group_of(name);
        match groups.iter_mut().find(|(known, _)| *known == group) {
            Some((_, members)) => members.push(column),
            None => groups.push((group, vec![column])),
        }
    }
    groups
}

/// Quantity that an output measures: outputs of one quantity are compared as they are, those of different ones by
/// their spread. It is the unit, but that the contact's place, depth and shear are three quantities in mm. "" for a
/// name that states none.
pub fn quantity_of(name: &str) -> &str {
    match name {
        "contact_x_mm" | "contact_y_mm" => "contact_centre",
        "contact_depth_mm" => "contact_depth",
        "contact_shear_x_mm" | "contact_shear_y_mm" => "contact_shear",
        _ => unit_of(name),
    }
}

/// Whether `group` is compression in mm, the only one with a positional error.
pub fn is_compression(group: &str) -> bool {
    group == "dz_mm"
}

/// Indices of the columns of `header` that match `pattern`, in the header's order. A pattern is a
/// comma-separated list of names in which `*` stands for any characters and `?` for one, and of ranges: `c2..c16`
/// stands for all columns from `c2` to `c16`.
pub fn select(header: &[String], pattern: &str) -> Vec<usize> {
    let mut selected: Vec<usize> =
        pattern.split(',').flat_map(|part| part_of(header, part)).collect();
    selected.sort_unstable();
    selected.dedup();
    selected
}

/// Indices of the columns of `header` that one part of a pattern stands for.
fn part_of(header: &[String], part: &str) -> Vec<usize> {
    let glob = part.trim();
    let matching: Vec<usize> = (0..header.len()).filter(|i| matches(glob, &header[*i])).collect();
    if let Some((first, last)) = glob.split_once("..")
        && matching.is_empty()
    {
        let place = |name: &str| header.iter().position(|known| known == name.trim());
        return match (place(first), place(last)) {
            (Some(first), Some(last)) => (first..=last).collect(),
            _ => vec![],
        };
    }
    matching
}

/// First part of a comma-separated `pattern` that no column of `header` matches.
pub fn unmatched<'p>(header: &[String], pattern: &'p str) -> Option<&'p str> {
    pattern.split(',').map(str::trim).find(|part| part_of(header, part).is_empty())
}

/// First names of a header, as a list for messages.
pub fn some_names(header: &[String]) -> String {
    const SHOWN: usize = 8;
    let shown = header.iter().take(SHOWN).map(|name| cut(name)).collect::<Vec<_>>().join(", ");
    if header.len() > SHOWN { format!("{shown}, … ({} columns)", header.len()) } else { shown }
}

fn matches(glob: &str, name: &str) -> bool {
    match glob.chars().next() {
        None => name.is_empty(),
        Some('*') => {
            let rest = &glob[1..];
            let mut ends = name.char_indices().map(|(i, _)| i).chain([name.len()]);
            ends.any(|i| matches(rest, &name[i..]))
        }
        Some(wanted) => name.chars().next().is_some_and(|c| {
            (wanted == '?' || wanted == c)
                && matches(&glob[wanted.len_utf8()..], &name[c.len_utf8()..])
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_row_group_and_unit() {
        assert_eq!(row_of("r12c3_ohm"), Some(12));
        assert_eq!(row_of("r4e2_dz_mm"), Some(4));
        for other in ["fx_n", "r_x", "row1", "r3", "r3x1", "rc1", ""] {
            assert_eq!(row_of(other), None, "{other}");
        }
        assert_eq!(group_of("r4e2_dz_mm"), "dz_mm");
        assert_eq!(group_of("fx_n"), "fx_n");
        assert_eq!((group_of("r4c17_ohm"), unit_of(READINGS)), (READINGS, "Ω"));
        assert_eq!(unit_of("r12c3_ohm"), "Ω");
        assert_eq!(unit_of("fx_n"), "N");
        assert_eq!(unit_of("ch1"), "");
        assert_eq!(quantity_of("contact_x_mm"), quantity_of("contact_y_mm"));
        assert_ne!(quantity_of("contact_x_mm"), quantity_of("contact_depth_mm"));
        assert_eq!(quantity_of("r4e2_dz_mm"), quantity_of("x_mm"));
    }

    #[test]
    fn globs_select_columns_in_file_order() {
        let header = ["ch1", "fx_n", "ch12", "x_mm", "fz_n"].map(String::from);
        assert_eq!(select(&header, "ch*"), [0, 2]);
        assert_eq!(select(&header, "x_mm, f?_n"), [1, 3, 4]);
        assert_eq!(select(&header, "ch?"), [0]);
        assert_eq!(unmatched(&header, "ch*,fy_n"), Some("fy_n"));
        assert_eq!(unmatched(&header, "ch*"), None);
    }

    #[test]
    fn ranges_select_columns_from_one_to_another() {
        let header = ["c1", "c2", "c3", "b.c1", "b.c2", "a..b"].map(String::from);
        assert_eq!(select(&header, "c2..c3"), [1, 2]);
        assert_eq!(select(&header, "b.c2, c3..b.c1,c3"), [2, 3, 4]);
        assert_eq!(select(&header, "c1..c1"), [0]);
        assert_eq!(select(&header, "a..b"), [5]);
        for nothing in ["c2..c9", "c3..c2", "..", "c2.."] {
            assert_eq!(unmatched(&header, nothing), Some(nothing));
        }
    }
}
