//! One array: its header, checked before the parser sees it, and its numbers.

use std::io::{self, BufReader, Chain, Cursor, Read};

use npyz::{Deserialize, NpyFile, NpyHeader, Order};

use crate::error::cut;
use crate::input::MOST_VALUES;

/// Said of a shape whose number of elements no computer can count.
const TOO_LARGE: &str = "its shape has more elements than any memory";

/// Longest header of a `.npy` file that is read, in bytes: that of numpy itself.
const MOST_HEADER_BYTES: usize = 10_000;
/// Bytes before a header: magic, version and the header's length.
const PREFIX_BYTES: u64 = 12;
/// Deepest nesting of brackets in a header. The dictionary around the shape has two.
const MOST_BRACKETS: usize = 8;
/// Most columns of an array: each has a name, which takes memory.
pub const MOST_COLUMNS: usize = 1_000_000;

/// Checks the header of a `.npy` file before the parser sees it, which takes memory for the length that is claimed,
/// calls itself for every bracket, and multiplies sizes unchecked.
fn check_header(bytes: &[u8]) -> Result<(), String> {
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

/// Array whose header was read, and whose numbers are still to come from `R`.
pub struct Array<R> {
    header: NpyHeader,
    numbers: R,
    /// Number of dimensions, 1 or 2.
    pub dimensions: usize,
    /// Number of lines, at least 1.
    pub lines: usize,
    /// Number of columns, at least 1.
    pub columns: usize,
}

impl<R: Read> Array<Chain<Cursor<Vec<u8>>, R>> {
    /// Reads the header that `file` begins with.
    pub fn open(mut file: R) -> Result<Self, String> {
        let mut head = vec![];
        let most = PREFIX_BYTES + MOST_HEADER_BYTES as u64;
        (&mut file).take(most).read_to_end(&mut head).map_err(|cause| unread(&cause))?;
        check_header(&head)?;
        let mut numbers = Cursor::new(head).chain(file);
        let header = NpyHeader::from_reader(&mut numbers)
            .map_err(|cause| format!("not a .npy file: {}", cut(&cause.to_string())))?;
        let shape: Option<Vec<usize>> =
            header.shape().iter().map(|size| usize::try_from(*size).ok()).collect();
        let dimensions = header.shape().len();
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
        if columns > MOST_COLUMNS {
            return Err(format!("it has {columns} columns and not at most {MOST_COLUMNS}"));
        }
        Ok(Self { header, numbers, dimensions, lines, columns })
    }
}

impl<R: Read> Array<R> {
    /// Number of elements.
    pub fn count(&self) -> usize {
        self.lines * self.columns
    }

    /// Reads all elements into the columns from `first` on of `values`, whose lines have so many columns, `width`.
    ///
    /// # Errors
    /// What is wrong, in words: elements of a type that is not read, fewer or more of them than the shape takes.
    pub fn read_into(self, values: &mut [f64], width: usize, first: usize) -> Result<(), String> {
        let (lines, columns) = (self.lines, self.columns);
        let (outer, inner, of_outer, of_inner) = match self.header.order() {
            Order::C => (lines, columns, width, 1),
            Order::Fortran => (columns, lines, 1, width),
        };
        let places =
            (0..outer).flat_map(|i| (0..inner).map(move |j| first + i * of_outer + j * of_inner));
        let kind = self.header.dtype().descr();
        // Numbers are taken one by one, which a packed file is slow at.
        let mut numbers = BufReader::new(self.numbers);
        let file = NpyFile::with_header(self.header, &mut numbers);
        let mut place = Places { values, places };
        place
            .fill::<f64, _>(file, |value| value)
            .or_else(|file| place.fill::<f32, _>(file, f64::from))
            .or_else(|file| place.fill::<i64, _>(file, |value| value as f64))
            .or_else(|file| place.fill::<i32, _>(file, f64::from))
            .or_else(|file| place.fill::<i16, _>(file, f64::from))
            .or_else(|file| place.fill::<i8, _>(file, f64::from))
            .or_else(|file| place.fill::<u64, _>(file, |value| value as f64))
            .or_else(|file| place.fill::<u32, _>(file, f64::from))
            .or_else(|file| place.fill::<u16, _>(file, f64::from))
            .or_else(|file| place.fill::<u8, _>(file, f64::from))
            .or_else(|file| place.fill::<bool, _>(file, f64::from))
            .map_err(|_| {
                format!(
                    "its elements are {}; those that are read are float32 and float64, integers of 8 to 64 bits, and \
                     bool",
                    cut(&kind)
                )
            })?
            .map_err(|cause| unread(&cause))?;
        // The end of a packed array is where its sum is checked.
        match numbers.read(&mut [0]) {
            Ok(0) => Ok(()),
            Ok(_) => Err("it has more bytes than its shape takes".into()),
            Err(cause) => Err(unread(&cause)),
        }
    }
}

fn unread(cause: &io::Error) -> String {
    format!("it cannot be read to its end: {cause}")
}

/// Places for the elements of an array, in the order in which these are stored.
struct Places<'v, P> {
    values: &'v mut [f64],
    places: P,
}

impl<P: Iterator<Item = usize>> Places<'_, P> {
    /// Puts all elements into their places; returns the file if they are not of the type `T`.
    fn fill<T: Deserialize, R: Read>(
        &mut self,
        file: NpyFile<R>,
        to_f64: impl Fn(T) -> f64,
    ) -> Result<io::Result<()>, NpyFile<R>> {
        let elements = file.try_data::<T>()?;
        for (place, element) in (&mut self.places).zip(elements) {
            match element {
                Ok(element) => self.values[place] = to_f64(element),
                Err(cause) => return Ok(Err(cause)),
            }
        }
        Ok(Ok(()))
    }
}
