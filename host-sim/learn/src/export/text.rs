//! What all languages say of a model.

use taxel_core::blob::{Columns, Model};

/// Lines of a comment on columns with their units, each behind `start`; columns that are alike and follow each other
/// share one. Names are passed through `shown`.
pub fn columns(
    names: Columns<'_>,
    units: Columns<'_>,
    start: &str,
    shown: impl Fn(&str) -> String,
) -> String {
    let pairs: Vec<(&str, &str)> = names.iter().zip(units.iter()).collect();
    let line = |alike: &[(&str, &str)]| {
        let (name, unit) = alike[0];
        let unit = if unit.is_empty() { String::new() } else { format!(", {}", shown(unit)) };
        let times =
            if alike.len() > 1 { format!(" ({} times)", alike.len()) } else { String::new() };
        format!("{start}{}{unit}{times}\n", shown(name))
    };
    pairs.chunk_by(|a, b| a == b).map(line).collect()
}

/// Rows, from 1, that the network of this `index` decodes.
pub fn rows_of(model: &Model<'_>, index: usize) -> impl Iterator<Item = usize> {
    (0..model.shape().rows)
        .filter(move |row| model.network_of_row(*row) == Some(index))
        .map(|row| row + 1)
}
