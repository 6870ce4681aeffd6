//! Arrays that numpy saved: `.npy` holds one, `.npz` several by name.

use std::io::{self, Cursor, Read};
use std::path::Path;

use npyz::{Deserialize, NpyFile, Order};
use zip::ZipArchive;

use super::{DataFile, numbered};
use crate::error::{Error, Problem, Result};

/// Parses one array, `lines × columns` or `lines`, whose columns are called `c1`, `c2`, …
///
/// # Errors
/// [`Error::File`] for bytes that are no such array.
pub(super) fn parse_array(path: &Path, bytes: &[u8]) -> Result<DataFile> {
    let array = Array::parse(bytes).map_err(|cause| unusable(path, cause))?;
    let header = numbered(array.columns);
    data_file(path, bytes, header, false, array.values)
}

/// Parses arrays of equally many lines, set side by side. The columns of `NAME` are called `NAME1`, `NAME2`, …; an
/// array of one dimension is the column `NAME`.
///
/// # Errors
/// [`Error::File`] for bytes that are no such arrays, and for a column name that two arrays lead to.
pub(super) fn parse_archive(path: &Path, bytes: &[u8]) -> Result<DataFile> {
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|cause| unusable(path, format!("not a .npz file: {cause}")))?;
    let mut header: Vec<String> = vec![];
    let mut arrays: Vec<Array> = vec![];
    for index in 0..archive.len() {
        let mut entry =
            archive.by_index(index).map_err(|cause| unusable(path, cause.to_string()))?;
        let name = entry.name().map_err(|cause| unusable(path, cause.to_string()))?.into_owned();
        let name = name.strip_suffix(".npy").unwrap_or(&name).to_owned();
        let mut stored = vec![];
        let array = entry
            .read_to_end(&mut stored)
            .map_err(|cause| format!("it cannot be read to its end: {cause}"))
            .and_then(|_| Array::parse(&stored))
            .map_err(|cause| unusable(path, format!("array {name:?}: {cause}")))?;
        if let Some(first) = arrays.first()
            && first.lines != array.lines
        {
            let (lines, other) = (array.lines, first.lines);
            let cause = format!("array {name:?} has {lines} lines, and the first array {other}");
            return Err(unusable(path, cause));
        }
        let names = match array.dimensions {
            1 => vec![name],
            _ => (1..=array.columns).map(|column| format!("{name}{column}")).collect(),
        };
        if let Some(name) = names.iter().find(|name| header.contains(name)) {
            return Err(Error::file(path, Problem::RepeatedName { name: name.clone() }));
        }
        header.extend(names);
        arrays.push(array);
    }
    let lines = arrays.first().map_or(0, |array| array.lines);
    let of_line = |line| arrays.iter().flat_map(move |array| array.line(line).iter().copied());
    let values = (0..lines).flat_map(of_line).collect();
    data_file(path, bytes, header, true, values)
}

fn unusable(path: &Path, cause: String) -> Error {
    Error::file(path, Problem::Array { cause })
}

fn data_file(
    path: &Path,
    bytes: &[u8],
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
    let line_numbers = (1..).take(values.len() / header.len()).collect();
    let digest = crate::digest::digest(bytes);
    Ok(DataFile { path: path.into(), header, names_columns, digest, values, line_numbers })
}

/// Said of a shape whose number of elements no computer can count.
const TOO_LARGE: &str = "its shape has more elements than any memory";

/// Checks the shape in the header of a `.npy` file, since the parser multiplies its sizes unchecked.
fn check_shape(bytes: &[u8]) -> std::result::Result<(), String> {
    // The dictionary stands on the first line, after the format's version and the line's length.
    let line = String::from_utf8_lossy(bytes.split(|byte| *byte == b'\n').next().unwrap_or(bytes));
    let sizes = line.split_once("shape").and_then(|(_, rest)| rest.split_once('('));
    let sizes = sizes.and_then(|(_, rest)| rest.split_once(')')).map_or("", |(sizes, _)| sizes);
    let sizes = sizes.split(',').map(str::trim).filter(|size| !size.is_empty());
    let sizes: Vec<u64> = sizes.map_while(|size| size.parse().ok()).collect();
    let count = sizes.iter().try_fold(1_u64, |count, size| count.checked_mul((*size).max(1)));
    count.map(|_| ()).ok_or_else(|| TOO_LARGE.into())
}

/// Array of numbers.
struct Array {
    dimensions: usize,
    lines: usize,
    columns: usize,
    /// Elements, `lines × columns`, line after line.
    values: Vec<f64>,
}

impl Array {
    /// Parses an array; the error says what it is instead.
    fn parse(bytes: &[u8]) -> std::result::Result<Self, String> {
        check_shape(bytes)?;
        let file = NpyFile::new(bytes).map_err(|cause| format!("not a .npy file: {cause}"))?;
        let shape: Option<Vec<usize>> =
            file.shape().iter().map(|size| usize::try_from(*size).ok()).collect();
        let dimensions = file.shape().len();
        let (lines, columns) = match shape.as_deref() {
            Some([lines]) => (*lines, 1),
            Some([lines, columns]) => (*lines, *columns),
            _ => return Err(format!("it has {dimensions} dimensions and not 1 or 2")),
        };
        let count = lines.checked_mul(columns).ok_or(TOO_LARGE)?;
        if count == 0 {
            return Err("it holds no number".into());
        }
        let (order, kind) = (file.order(), file.dtype().descr());
        let values = elements::<f64, _>(file, |value| value)
            .or_else(|file| elements::<f32, _>(file, f64::from))
            .or_else(|file| elements::<i64, _>(file, |value| value as f64))
            .or_else(|file| elements::<i32, _>(file, f64::from))
            .or_else(|file| elements::<i16, _>(file, f64::from))
            .or_else(|file| elements::<i8, _>(file, f64::from))
            .or_else(|file| elements::<u64, _>(file, |value| value as f64))
            .or_else(|file| elements::<u32, _>(file, f64::from))
            .or_else(|file| elements::<u16, _>(file, f64::from))
            .or_else(|file| elements::<u8, _>(file, f64::from))
            .or_else(|file| elements::<bool, _>(file, f64::from))
            .map_err(|_| {
                format!(
                    "its elements are {kind}; those that are read are float32 and float64, integers of 8 to 64 bits, \
                     and bool"
                )
            })?
            .map_err(|cause| format!("it cannot be read to its end: {cause}"))?;
        if values.len() != count {
            return Err(format!("it holds {} numbers, and its shape {count}", values.len()));
        }
        let values = match order {
            Order::C => values,
            Order::Fortran => {
                let line = |line| (0..columns).map(move |column| column * lines + line);
                (0..lines).flat_map(line).map(|place| values[place]).collect()
            }
        };
        Ok(Self { dimensions, lines, columns, values })
    }

    fn line(&self, line: usize) -> &[f64] {
        &self.values[line * self.columns..(line + 1) * self.columns]
    }
}

/// Elements of a file as they are stored, or the file if they are not of the type `T`.
fn elements<T: Deserialize, R: Read>(
    file: NpyFile<R>,
    to_f64: impl Fn(T) -> f64,
) -> std::result::Result<io::Result<Vec<f64>>, NpyFile<R>> {
    Ok(file.try_data::<T>()?.map(|element| element.map(&to_f64)).collect())
}

#[cfg(test)]
mod tests;
