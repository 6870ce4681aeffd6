//! One array: its header and its numbers, by numpy's own description of the format (numpy.lib.format, versions 1 to 3).

use std::io::{self, BufReader, Read};

use crate::data_file::MOST_EXACT;
use crate::error::cut;
use crate::input::MOST_VALUES;

/// Said of a shape whose number of elements no computer can count.
const TOO_LARGE: &str = "its shape has more elements than any memory";

/// Longest header of a `.npy` file that is read, in bytes: that of numpy itself.
const MOST_HEADER_BYTES: usize = 10_000;
/// Most columns of an array: each has a name, which takes memory.
pub const MOST_COLUMNS: usize = 1_000_000;

/// What a header says: a Python dictionary of three entries, in any order.
struct Header {
    /// Type of the elements, such as `<f8`.
    kind: String,
    is_column_major: bool,
    shape: Vec<u64>,
}

impl Header {
    /// Reads the header that `file` begins with, and nothing behind it.
    fn read(file: &mut impl Read) -> Result<Self, String> {
        let not_an_array = |_| "not a .npy file".to_owned();
        let mut prefix = [0; 8];
        file.read_exact(&mut prefix).map_err(not_an_array)?;
        if prefix[..6] != *b"\x93NUMPY" || !(1..=3).contains(&prefix[6]) {
            return Err(not_an_array(io::ErrorKind::InvalidData.into()));
        }
        let mut length = [0; 4];
        let of_length = if prefix[6] == 1 { 2 } else { 4 };
        file.read_exact(&mut length[..of_length]).map_err(not_an_array)?;
        let length = u32::from_le_bytes(length) as usize;
        if length > MOST_HEADER_BYTES {
            return Err(format!(
                "its header claims {length} bytes and not at most {MOST_HEADER_BYTES}"
            ));
        }
        let mut text = vec![0; length];
        file.read_exact(&mut text).map_err(not_an_array)?;
        let text = String::from_utf8_lossy(&text);
        Self::parse(&text)
            .ok_or_else(|| format!("not a .npy file: its header is {}", cut(text.trim())))
            .and_then(|header| header)
    }

    /// Parses the dictionary; `None` for what is none.
    fn parse(text: &str) -> Option<Result<Self, String>> {
        let text = text.trim().strip_prefix('{')?.strip_suffix('}')?;
        let behind = |name: &str| Some(text.split_once(&format!("'{name}':"))?.1.trim_start());
        let kind = behind("descr")?;
        // A list of fields has no plain type, and is told as it stands.
        let kind = match kind.strip_prefix('\'') {
            Some(kind) => kind.split_once('\'')?.0,
            None => kind.split_once(']').map_or(kind, |(fields, _)| fields),
        };
        let is_column_major = match behind("fortran_order")? {
            order if order.starts_with("True") => true,
            order if order.starts_with("False") => false,
            _ => return None,
        };
        let sizes = behind("shape")?.strip_prefix('(')?.split_once(')')?.0;
        let sizes = sizes.split(',').map(str::trim).filter(|size| !size.is_empty());
        let mut shape = vec![];
        for size in sizes {
            if !size.bytes().all(|byte| byte.is_ascii_digit()) {
                return Some(Err("its shape has other numbers than plain decimal ones".into()));
            }
            match size.parse() {
                Ok(size) => shape.push(size),
                Err(_) => return Some(Err(TOO_LARGE.into())),
            }
        }
        Some(Ok(Self { kind: kind.into(), is_column_major, shape }))
    }
}

/// Array whose header was read, and whose numbers are still to come from `R`.
pub struct Array<R> {
    header: Header,
    numbers: R,
    /// Number of dimensions, 1 or 2.
    pub dimensions: usize,
    /// Number of lines, at least 1.
    pub lines: usize,
    /// Number of columns, at least 1.
    pub columns: usize,
}

impl<R: Read> Array<R> {
    /// Reads the header that `numbers` begin with.
    ///
    /// # Errors
    /// What it is instead, in words.
    pub fn open(mut numbers: R) -> Result<Self, String> {
        let header = Header::read(&mut numbers)?;
        let dimensions = header.shape.len();
        // A size of 0 hides no other that is too large.
        let count =
            header.shape.iter().try_fold(1_u64, |count, size| count.checked_mul((*size).max(1)));
        count.ok_or(TOO_LARGE)?;
        let (lines, columns) = match header.shape[..] {
            [lines] => (lines, 1),
            [lines, columns] => (lines, columns),
            _ => return Err(format!("it has {dimensions} dimensions and not 1 or 2")),
        };
        let count = lines * columns;
        if count == 0 {
            return Err("it holds no number".into());
        }
        if count > MOST_VALUES as u64 {
            return Err(format!("it has {count} numbers and not at most {MOST_VALUES}"));
        }
        let [lines, columns] = [lines, columns].map(|size| size as usize);
        if columns > MOST_COLUMNS {
            return Err(format!("it has {columns} columns and not at most {MOST_COLUMNS}"));
        }
        Ok(Self { header, numbers, dimensions, lines, columns })
    }

    /// Number of elements.
    pub fn count(&self) -> usize {
        self.lines * self.columns
    }

    /// Reads all elements into the columns from `first` on of `values`, whose lines have so many columns, `width`. Returns
    /// the columns of integers from [`MOST_EXACT`] on, which may be rounded.
    ///
    /// # Errors
    /// What is wrong, in words: elements of a type that is not read, fewer or more of them than the shape takes.
    pub fn read_into(
        self,
        values: &mut [f64],
        width: usize,
        first: usize,
    ) -> Result<Vec<usize>, String> {
        let (lines, columns) = (self.lines, self.columns);
        let (outer, inner, of_outer, of_inner) = if self.header.is_column_major {
            (columns, lines, 1, width)
        } else {
            (lines, columns, width, 1)
        };
        let places =
            (0..outer).flat_map(|i| (0..inner).map(move |j| first + i * of_outer + j * of_inner));
        let kind = self.header.kind;
        let is_big_endian = kind.starts_with('>');
        // Numbers are taken one by one, which a packed file is slow at.
        let mut numbers = Elements { bytes: BufReader::new(self.numbers), is_big_endian };
        match kind.trim_start_matches(['<', '>', '=', '|']) {
            "f8" => numbers.fill(values, places, f64::from_le_bytes),
            "f4" => numbers.fill(values, places, |bytes| f32::from_le_bytes(bytes).into()),
            "i8" => numbers.fill(values, places, |bytes| i64::from_le_bytes(bytes) as f64),
            "i4" => numbers.fill(values, places, |bytes| i32::from_le_bytes(bytes).into()),
            "i2" => numbers.fill(values, places, |bytes| i16::from_le_bytes(bytes).into()),
            "i1" => numbers.fill(values, places, |bytes| i8::from_le_bytes(bytes).into()),
            "u8" => numbers.fill(values, places, |bytes| u64::from_le_bytes(bytes) as f64),
            "u4" => numbers.fill(values, places, |bytes| u32::from_le_bytes(bytes).into()),
            "u2" => numbers.fill(values, places, |bytes| u16::from_le_bytes(bytes).into()),
            "u1" => numbers.fill(values, places, |[byte]| byte.into()),
            "b1" => numbers.fill(values, places, |[byte]| f64::from(byte != 0)),
            _ => {
                return Err(format!(
                    "its elements are {}; those that are read are float32 and float64, integers of 8 to 64 bits, and \
                     bool",
                    cut(&kind)
                ));
            }
        }
        .map_err(|cause| unread(&cause))?;
        // The end of a packed array is where its sum is checked.
        match numbers.bytes.read(&mut [0]) {
            Ok(0) => {}
            Ok(_) => return Err("it has more bytes than its shape takes".into()),
            Err(cause) => return Err(unread(&cause)),
        }
        let is_whole = kind.ends_with("i8") || kind.ends_with("u8");
        let mut own = (first..first + columns).filter(|_| is_whole).collect::<Vec<_>>();
        own.retain(|&column| {
            values[column..].iter().step_by(width).any(|value| value.abs() >= MOST_EXACT)
        });
        Ok(own)
    }
}

fn unread(cause: &io::Error) -> String {
    format!("it cannot be read to its end: {cause}")
}

/// Elements of an array, as bytes.
struct Elements<R> {
    bytes: R,
    is_big_endian: bool,
}

impl<R: Read> Elements<R> {
    /// Puts an element of `BYTES` bytes into each of the `places` of `values`, in the order in which they are stored.
    fn fill<const BYTES: usize>(
        &mut self,
        values: &mut [f64],
        places: impl Iterator<Item = usize>,
        from_little_endian: impl Fn([u8; BYTES]) -> f64,
    ) -> io::Result<()> {
        for place in places {
            let mut bytes = [0; BYTES];
            self.bytes.read_exact(&mut bytes)?;
            if self.is_big_endian {
                bytes.reverse();
            }
            values[place] = from_little_endian(bytes);
        }
        Ok(())
    }
}
