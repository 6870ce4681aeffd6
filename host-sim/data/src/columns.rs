//! Columns of data files: names, units, and what the project's own names mean.

/// Units that a column's name may end in, and how they are written.
const UNITS: [(&str, &str); 7] = [
    ("_ohm", "Ω"),
    ("_mm", "mm"),
    ("_n", "N"),
    ("_pa", "Pa"),
    ("_s", "s"),
    ("_hz", "Hz"),
    ("_v", "V"),
];

/// The unit that a column's name states, or "".
#[must_use]
pub fn unit_of(name: &str) -> &'static str {
    UNITS.iter().find(|(suffix, _)| name.ends_with(suffix)).map_or("", |(_, unit)| unit)
}

/// The row-wire (from 1) that a name like `r4c17_ohm` or `r4e2_dz_mm` begins with.
#[must_use]
pub fn row_of(name: &str) -> Option<usize> {
    let rest = name.strip_prefix('r')?;
    let digits = rest.find(|c: char| !c.is_ascii_digit())?;
    let (row, rest) = rest.split_at(digits);
    let place = rest.strip_prefix(['c', 'e'])?;
    place.starts_with(|c: char| c.is_ascii_digit()).then(|| row.parse().ok())?
}

/// What errors of an output are reported under: the axis of an electrode's deformation or force
/// (`dz_mm` for `r4e2_dz_mm`), or the column itself for any other name.
#[must_use]
pub fn group_of(name: &str) -> &str {
    match (row_of(name), name.split_once('_')) {
        (Some(_), Some((_, component))) => component,
        _ => name,
    }
}

/// The groups of `names` in the order in which they first appear, each with its columns' places.
#[must_use]
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

/// Whether `group` is compression in mm, for which the positional error is defined.
#[must_use]
pub fn is_compression(group: &str) -> bool {
    group == "dz_mm"
}

/// Columns of `header` that match `pattern`, in the header's order: comma-separated names in which
/// `*` stands for any characters and `?` for one.
#[must_use]
pub fn select(header: &[String], pattern: &str) -> Vec<usize> {
    let globs: Vec<&str> = pattern.split(',').map(str::trim).collect();
    (0..header.len()).filter(|i| globs.iter().any(|g| matches(g, &header[*i]))).collect()
}

/// The first part of a comma-separated `pattern` that no column of `header` matches.
#[must_use]
pub fn unmatched<'p>(header: &[String], pattern: &'p str) -> Option<&'p str> {
    pattern.split(',').map(str::trim).find(|glob| !header.iter().any(|name| matches(glob, name)))
}

/// The first names of a header, for messages.
#[must_use]
pub fn some_names(header: &[String]) -> String {
    const SHOWN: usize = 8;
    let shown = header.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
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
        assert_eq!(unit_of("r12c3_ohm"), "Ω");
        assert_eq!(unit_of("fx_n"), "N");
        assert_eq!(unit_of("ch1"), "");
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
}
