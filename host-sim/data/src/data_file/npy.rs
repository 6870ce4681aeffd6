//! Arrays that numpy saved: `.npy` holds one, `.npz` several by name.

use std::collections::HashSet;
use std::io::Cursor;
use std::path::Path;

use zip::ZipArchive;

use super::{DataFile, numbered};
use crate::error::{Error, Problem, Result, in_words, quoted};
use crate::input::MOST_VALUES;

mod array;

use array::{Array, MOST_COLUMNS};

/// Most numbers that an archive may hold, however small it is: 160 MB.
const FEW_VALUES: usize = 20_000_000;
/// Most numbers of a larger archive for each of its bytes. Readings have noise, of which a number takes a bit or more;
/// what packs into less is no measurement, but could fill the memory from a small file.
const MOST_VALUES_A_BYTE: usize = 16;
/// Longest name of an array in bytes: every column repeats it.
const MOST_NAME_BYTES: usize = 200;

/// Parses one array, `lines × columns` or `lines`, whose columns are called `c1`, `c2`, …
pub(super) fn parse_array(path: &Path, bytes: &[u8]) -> Result<DataFile> {
    let array = Array::open(bytes).map_err(|cause| unusable(path, cause))?;
    let (count, columns) = (array.count(), array.columns);
    if count > bytes.len() {
        let cause =
            format!("it cannot be read to its end: {count} numbers take more than the file has");
        return Err(unusable(path, cause));
    }
    let mut values = vec![0.0; count];
    let rounded =
        array.read_into(&mut values, columns, 0).map_err(|cause| unusable(path, cause))?;
    Ok(DataFile { rounded, ..data_file(path, numbered(columns), false, values)? })
}

/// Parses arrays of equally many lines, set side by side. The columns of `NAME` are called `NAME1`, `NAME2`, …; an
/// array of one dimension is the column `NAME`.
///
/// All headers are read before any number, so that too many of these are refused before they are unpacked.
pub(super) fn parse_archive(path: &Path, bytes: &[u8]) -> Result<DataFile> {
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|cause| unusable(path, format!("not a .npz file: {cause}")))?;
    let outline = Outline::new(path, &mut archive, bytes.len())?;
    let width = outline.header.len();
    let mut values = vec![0.0; outline.lines * width];
    let (mut first, mut rounded) = (0, vec![]);
    for (index, name) in outline.arrays.iter().enumerate() {
        let of_array = |cause| unusable(path, format!("array {}: {cause}", quoted(name)));
        let mut entry =
            archive.by_index(index).map_err(|cause| unusable(path, cause.to_string()))?;
        let array = Array::open(&mut entry).map_err(of_array)?;
        let columns = array.columns;
        rounded.extend(array.read_into(&mut values, width, first).map_err(of_array)?);
        first += columns;
    }
    Ok(DataFile { rounded, ..data_file(path, outline.header, true, values)? })
}

/// What an archive holds, as its arrays' headers tell.
struct Outline {
    arrays: Vec<String>,
    lines: usize,
    header: Vec<String>,
}

impl Outline {
    /// Reads the headers of an archive of so many `bytes`.
    fn new(path: &Path, archive: &mut ZipArchive<Cursor<&[u8]>>, bytes: usize) -> Result<Self> {
        let most = bytes.saturating_mul(MOST_VALUES_A_BYTE).clamp(FEW_VALUES, MOST_VALUES);
        let (mut outline, mut count) = (Self { arrays: vec![], lines: 0, header: vec![] }, 0);
        let mut known = HashSet::new();
        for index in 0..archive.len() {
            let entry =
                archive.by_index(index).map_err(|cause| unusable(path, cause.to_string()))?;
            let name = entry.name();
            let name = name.strip_suffix(".npy").unwrap_or(name).to_owned();
            if !(1..=MOST_NAME_BYTES).contains(&name.len()) || name.contains(char::is_control) {
                let rule = format!("give a name of 1 to {MOST_NAME_BYTES} plain characters");
                return Err(unusable(path, format!("array {}: {rule}", quoted(&name))));
            }
            let array = Array::open(entry)
                .map_err(|cause| unusable(path, format!("array {}: {cause}", quoted(&name))))?;
            count += array.count();
            if count > most {
                let size = in_words(bytes as u64);
                let cause = format!(
                    "its arrays have {count} numbers together, and a packed file of {size} may have {most}: check \
                     them, or unpack the file"
                );
                return Err(unusable(path, cause));
            }
            if index > 0 && outline.lines != array.lines {
                let (lines, other, name) = (array.lines, outline.lines, quoted(&name));
                let cause = format!("array {name} has {lines} lines, and the first array {other}");
                return Err(unusable(path, cause));
            }
            outline.lines = array.lines;
            let columns = outline.header.len() + array.columns;
            if columns > MOST_COLUMNS {
                let cause =
                    format!("its arrays have {columns} columns and not at most {MOST_COLUMNS}");
                return Err(unusable(path, cause));
            }
            let names = match array.dimensions {
                1 => vec![name.clone()],
                _ => (1..=array.columns).map(|column| format!("{name}{column}")).collect(),
            };
            if let Some(name) = names.iter().find(|name| !known.insert((*name).clone())) {
                return Err(Error::file(path, Problem::RepeatedName { name: name.clone() }));
            }
            outline.header.extend(names);
            outline.arrays.push(name);
        }
        Ok(outline)
    }
}

fn unusable(path: &Path, cause: String) -> Error {
    Error::file(path, Problem::Array { cause })
}

/// A table of these `values`, line after line.
pub(super) fn data_file(
    path: &Path,
    header: Vec<String>,
    names_columns: bool,
    values: Vec<f64>,
) -> Result<DataFile> {
    if values.is_empty() {
        return Err(unusable(path, "it holds no number".into()));
    }
    if let Some(place) = values.iter().position(|value| value.is_infinite()) {
        let (line, column) = (place / header.len(), place % header.len());
        let problem = Problem::Infinite { line: line as u64 + 1, column: header[column].clone() };
        return Err(Error::file(path, problem));
    }
    let kept = 0..values.len() / header.len();
    let (path, line_numbers) = (path.into(), (1..=kept.len() as u64).collect());
    Ok(DataFile { path, header, names_columns, kept, values, line_numbers, ..DataFile::default() })
}

#[cfg(test)]
mod tests;
