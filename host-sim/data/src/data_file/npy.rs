//! Arrays that numpy saved: `.npy` holds one, `.npz` several by name.

use std::io::{self, Cursor, Read};
use std::path::Path;

use npyz::{Deserialize, NpyFile, Order};
use zip::ZipArchive;

use super::{DataFile, numbered};
use crate::error::{Error, Problem, Result, in_words};
use crate::input::{MOST_DATA_BYTES, MOST_VALUES};

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
    let mut left_bytes = MOST_DATA_BYTES;
    let too_large = || format!("unpacked, the file has more than {}", in_words(MOST_DATA_BYTES));
    for index in 0..archive.len() {
        let mut entry =
            archive.by_index(index).map_err(|cause| unusable(path, cause.to_string()))?;
        let name = entry.name().map_err(|cause| unusable(path, cause.to_string()))?.into_owned();
        let name = name.strip_suffix(".npy").unwrap_or(&name).to_owned();
        let mut stored = vec![];
        // What is packed may be a thousand times as large as the file.
        let read = (&mut entry).take(left_bytes + 1).read_to_end(&mut stored);
        let array = read
            .map_err(|cause| format!("it cannot be read to its end: {cause}"))
            .and_then(|bytes| {
                left_bytes = left_bytes.checked_sub(bytes as u64).ok_or_else(too_large)?;
                Array::parse(&stored)
            })
            .map_err(|cause| unusable(path, format!("array {name:?}: {cause}")))?;
        let values = arrays.iter().map(|array| array.values.len()).sum::<usize>();
        if values + array.values.len() > MOST_VALUES {
            let cause = format!("its arrays have more than {MOST_VALUES} numbers together");
            return Err(unusable(path, cause));
        }
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

/// Longest header of a `.npy` file that is read, in bytes: that of numpy itself.
const MOST_HEADER_BYTES: usize = 10_000;
/// Deepest nesting of brackets in a header. The dictionary around the shape has two.
const MOST_BRACKETS: usize = 8;

/// Checks the header of a `.npy` file before the parser sees it, which takes memory for the length that is claimed,
/// calls itself for every bracket, and multiplies sizes unchecked.
fn check_header(bytes: &[u8]) -> std::result::Result<(), String> {
    let Some((head, rest)) = bytes.split_at_checked(8) else { return Ok(()) };
    let of_length = if head[6] == 1 { 2 } else { 4 };
    let Some((length, rest)) = rest.split_at_checked(of_length) else { return Ok(()) };
    let length = length.iter().rev().fold(0_usize, |length, byte| length << 8 | usize::from(*byte));
    if length > MOST_HEADER_BYTES {
        return Err(format!(
            "its header claims {length} bytes and not at most {MOST_HEADER_BYTES}"
        ));
    }
    let header = &rest[..length.min(rest.len())];
    let open = header.iter().filter(|byte| matches!(byte, b'(' | b'[' | b'{')).count();
    if open > MOST_BRACKETS {
        return Err(format!("its header has {open} brackets and not at most {MOST_BRACKETS}"));
    }
    let has_sum = header.contains(&b'+');
    let odd = |pair: &[u8]| {
        pair[0].is_ascii_digit() && (pair[1].is_ascii_alphabetic() || pair[1] == b'_')
    };
    if has_sum || header.windows(2).any(odd) {
        return Err("its header has other numbers than plain decimal ones".into());
    }
    // Every number counts, whether it is a size or not: others are small.
    let numbers = header.split(|byte| !byte.is_ascii_digit()).filter(|digits| !digits.is_empty());
    let mut sizes = numbers.map(|digits| str::from_utf8(digits).ok()?.parse::<u64>().ok());
    let count = sizes.try_fold(1_u64, |count, size| count.checked_mul(size?.max(1)));
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
        check_header(bytes)?;
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
        if count > MOST_VALUES {
            return Err(format!("it has {count} numbers and not at most {MOST_VALUES}"));
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
