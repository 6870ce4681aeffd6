//! Column names of data files: their units, row-wires and groups.

use crate::error::cut;

/// Units, each with the ways in which names and units lines spell it. Upper and lower case differ where a prefix does.
pub const UNITS: [(&str, &[&str]); 39] = [
    ("Ω", &["ohm", "Ohm", "Ω"]),
    ("kΩ", &["kohm", "kOhm", "kΩ"]),
    ("MΩ", &["Mohm", "MOhm", "MΩ"]),
    ("N", &["n", "N"]),
    ("mN", &["mN"]),
    ("kN", &["kN"]),
    ("N·m", &["Nm", "N·m", "N*m"]),
    ("N·mm", &["Nmm", "N·mm", "N*mm"]),
    ("mN·m", &["mNm", "mN·m", "mN*m"]),
    ("g", &["g"]),
    ("kg", &["kg"]),
    ("mg", &["mg"]),
    ("m", &["m"]),
    ("cm", &["cm"]),
    ("mm", &["mm"]),
    ("µm", &["um", "µm", "μm"]),
    ("Pa", &["pa", "Pa"]),
    ("hPa", &["hPa"]),
    ("kPa", &["kpa", "kPa"]),
    ("MPa", &["MPa"]),
    ("s", &["s", "sec"]),
    ("ms", &["ms"]),
    ("µs", &["us", "µs", "μs"]),
    ("ns", &["ns"]),
    ("Hz", &["hz", "Hz"]),
    ("kHz", &["khz", "kHz"]),
    ("V", &["v", "V"]),
    ("mV", &["mV"]),
    ("µV", &["uV", "µV", "μV"]),
    ("mA", &["mA"]),
    ("µA", &["uA", "µA", "μA"]),
    ("mT", &["mT"]),
    ("µT", &["uT", "µT", "μT"]),
    ("pF", &["pF"]),
    ("nF", &["nF"]),
    ("°", &["deg", "°"]),
    ("rad", &["rad"]),
    ("°C", &["degC", "°C"]),
    ("%", &["percent", "%"]),
];
/// Units that brackets and units lines state, but no ending: `ch_A` and `x_bar` are names.
const BRACKETED: [&str; 8] = ["A", "T", "K", "F", "bar", "mbar", "psi", "min"];

/// The unit that `text` spells, if it is known.
pub fn unit(text: &str) -> Option<&'static str> {
    of_ending(text).or_else(|| BRACKETED.iter().find(|unit| **unit == text).copied())
}

fn of_ending(text: &str) -> Option<&'static str> {
    UNITS.iter().find(|(_, spelled)| spelled.contains(&text)).map(|(unit, _)| *unit)
}

/// Unit that a column's name states (`Ω` for `r4c17_ohm`, `N` for `fz (N)`), or "".
pub fn unit_of(name: &str) -> &'static str {
    match bracketed(name) {
        Some((_, unit)) => unit,
        None => name.rsplit_once('_').and_then(|(_, ending)| of_ending(ending)).unwrap_or(""),
    }
}

/// `name` without the unit that it states in brackets or by its ending.
pub fn without_unit(name: &str) -> &str {
    match bracketed(name) {
        Some((name, _)) => name,
        None if unit_of(name).is_empty() => name,
        None => name.rsplit_once('_').map_or(name, |(name, _)| name),
    }
}

/// Name and unit of a column called `fz (N)` or `fz [N]`.
fn bracketed(name: &str) -> Option<(&str, &'static str)> {
    let (rest, open) = match name.strip_suffix(')') {
        Some(rest) => (rest, '('),
        None => (name.strip_suffix(']')?, '['),
    };
    let (name, text) = rest.rsplit_once(open)?;
    Some((name.trim_end(), unit(text.trim())?)).filter(|(name, _)| !name.is_empty())
}

/// Whether the column called `name` is a resistance in Ω, to be judged by limits: `r4c17_ohm`. A device judges all that it scans.
pub fn is_judged_in_ohm(name: &str) -> bool {
    name.ends_with("_ohm")
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

/// Whether the output called `name` tells where a touch is, and not how much there is of it: `x_mm`, `contact_y_mm`,
/// `pos_x`, and no force, shear or displacement along x.
pub fn is_place(name: &str) -> bool {
    let bare = without_unit(name).to_lowercase();
    let is_axis = ["x", "y"].contains(&bare.rsplit('_').next().unwrap_or_default());
    let is_length = ["", "m", "cm", "mm", "µm"].contains(&unit_of(name));
    let is_amount =
        ["shear", "force", "torque", "moment", "displacement"].iter().any(|it| bare.contains(it));
    is_axis && is_length && row_of(name).is_none() && !is_amount
}

/// Whether `group` is compression in mm, the only one with a positional error.
pub fn is_compression(group: &str) -> bool {
    group == "dz_mm"
}

/// Index of the column called `name`. A unit in brackets may stand on one side alone, if no other column is meant.
pub fn place(header: &[String], name: &str) -> Option<usize> {
    let exact = header.iter().position(|known| known == name);
    exact.or_else(|| {
        let mut named = header.iter().enumerate().filter(|(_, known)| is_named(known, name));
        named.next().filter(|_| named.next().is_none()).map(|(place, _)| place)
    })
}

/// Whether `known` is `name` with a unit in brackets, or without.
fn is_named(known: &str, name: &str) -> bool {
    match [known, name].map(bracketed) {
        [Some((bare, _)), None] => bare == name,
        [None, Some((bare, _))] => bare == known,
        _ => false,
    }
}

/// Indices of the columns of `header` that match `pattern`, in the header's order. A pattern is a
/// comma-separated list of names in which `*` stands for any characters and `?` for one, and of ranges: `c2..c16`
/// stands for all columns from `c2` to `c16`. `!` before a part leaves its columns out, and `fz` finds `fz (N)`, too.
pub fn select(header: &[String], pattern: &str) -> Vec<usize> {
    let parts = || pattern.split(',').map(|part| part_of(header, part));
    let mut selected: Vec<usize> =
        parts().filter(|(is_left_out, _)| !is_left_out).flat_map(|(_, columns)| columns).collect();
    for (_, columns) in parts().filter(|(is_left_out, _)| *is_left_out) {
        selected.retain(|column| !columns.contains(column));
    }
    selected.sort_unstable();
    selected.dedup();
    selected
}

/// Whether one part of a pattern leaves columns out, and the indices of the columns of `header` that it stands for.
fn part_of(header: &[String], part: &str) -> (bool, Vec<usize>) {
    let part = part.trim();
    match part.strip_prefix('!') {
        Some(left_out) if !header.iter().any(|name| name == part) => {
            (true, columns_of(header, left_out.trim()))
        }
        _ => (false, columns_of(header, part)),
    }
}

fn columns_of(header: &[String], glob: &str) -> Vec<usize> {
    let is_meant = |name: &str| {
        matches(glob, name) || bracketed(name).is_some_and(|(bare, _)| matches(glob, bare))
    };
    let matching: Vec<usize> = (0..header.len()).filter(|i| is_meant(&header[*i])).collect();
    if let Some((first, last)) = glob.split_once("..")
        && matching.is_empty()
    {
        return match (place(header, first.trim()), place(header, last.trim())) {
            (Some(first), Some(last)) => (first..=last).collect(),
            _ => vec![],
        };
    }
    matching
}

/// First part of a comma-separated `pattern` that no column of `header` matches.
pub fn unmatched<'p>(header: &[String], pattern: &'p str) -> Option<&'p str> {
    pattern.split(',').map(str::trim).find(|part| part_of(header, part).1.is_empty())
}

/// First and last names of a header, as a list for messages.
pub fn some_names(header: &[String]) -> String {
    const ALL: usize = 8;
    const ENDS: [usize; 2] = [5, 3];
    let listed = |names: &[String]| names.iter().map(|it| cut(it)).collect::<Vec<_>>().join(", ");
    if header.len() <= ALL {
        return listed(header);
    }
    let (first, last) = (&header[..ENDS[0]], &header[header.len() - ENDS[1]..]);
    format!("{}, …, {} ({} columns)", listed(first), listed(last), header.len())
}

/// Names of a header as a list for messages, and the one that is most like the `wanted` name, if any is: the same but for
/// case, unit and signs, or a part of it.
pub fn known_names(header: &[String], wanted: &str) -> String {
    let bare = |name: &str| -> String {
        let bare = without_unit(name).chars().filter(|c| c.is_alphanumeric());
        bare.flat_map(char::to_lowercase).collect()
    };
    let wanted = bare(wanted);
    let is_alike = |name: &&String| {
        let name = bare(name);
        let short = name.len().min(wanted.len());
        short > 1 && (name.contains(&wanted) || wanted.contains(&name))
    };
    let same = header.iter().find(|name| bare(name) == wanted && !wanted.is_empty());
    let known = some_names(header);
    match same.or_else(|| header.iter().find(is_alike)) {
        Some(name) => format!("{known}; did you mean {:?}?", cut(name)),
        None => known,
    }
}

/// Whether `name` is what `glob` stands for. It takes the product of their lengths at most.
fn matches(glob: &str, name: &str) -> bool {
    let (glob, name): (Vec<char>, Vec<char>) = (glob.chars().collect(), name.chars().collect());
    let (mut at, mut star, mut place) = (0, None, 0);
    while place < name.len() {
        match glob.get(at) {
            Some('*') => {
                star = Some((at, place));
                at += 1;
                continue;
            }
            Some(wanted) if *wanted == '?' || *wanted == name[place] => at += 1,
            // The last star takes a character more.
            _ => match star {
                Some((of_star, from)) => {
                    star = Some((of_star, from + 1));
                    (at, place) = (of_star + 1, from);
                }
                None => return false,
            },
        }
        place += 1;
    }
    glob[at..].iter().all(|rest| *rest == '*')
}
