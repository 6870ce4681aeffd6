//! Errors with data files, as values that a program can match.

use std::path::{Path, PathBuf};

mod text;

use text::short;
pub use text::{cut, in_words, number, printable, quoted};

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Setting that cannot be used: its name, its value, and which values can be used.
///
/// ```
/// let bad = taxel_data::BadValue::new("noise.level", 5.0, "give a fraction from 0 to 1");
/// assert_eq!(bad.field, "noise.level");
/// assert_eq!(bad.to_string(), "noise.level = 5: give a fraction from 0 to 1");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field} = {value}: {rule}")]
pub struct BadValue {
    pub field: String,
    pub value: String,
    /// Rule for values that can be used.
    pub rule: String,
}

impl BadValue {
    /// Describes a setting `field` whose `value` breaks `rule`.
    #[expect(clippy::needless_pass_by_value, reason = "callers give literals and numbers")]
    pub fn new(field: impl Into<String>, value: impl ToString, rule: impl Into<String>) -> Self {
        Self { field: field.into(), value: short(value.to_string()), rule: rule.into() }
    }

    /// Returns the same problem under another name, such as that of a command's option.
    #[must_use]
    pub fn named(self, field: impl Into<String>) -> Self {
        Self { field: field.into(), ..self }
    }
}

/// Checks that a setting `holds`; its `value` and the `rule` for it are told if not.
pub fn require(
    holds: bool,
    field: impl Into<String>,
    value: impl ToString,
    rule: impl FnOnce() -> String,
) -> std::result::Result<(), BadValue> {
    if holds { Ok(()) } else { Err(BadValue::new(field, value, rule())) }
}

/// Refusal or failure of the crates that compute.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Setting that cannot be used, by itself or with this data.
    #[error(transparent)]
    Setting(#[from] BadValue),
    /// Data or model that cannot be used for what was asked. The `field` is the setting that asks for it; empty if
    /// none does.
    #[error("{reason}")]
    Unfit { field: &'static str, reason: String },
    /// Work that failed.
    #[error("{0}")]
    Failed(String),
    /// File that cannot be read.
    #[error("cannot read {}: {cause}; check the path and its permissions", path.display())]
    Read { path: PathBuf, cause: std::io::Error },
    /// File that cannot be written.
    #[error("cannot write {}: {cause}; choose another place", path.display())]
    Write { path: PathBuf, cause: std::io::Error },
    /// Output file that would replace one of the inputs.
    #[error("{} would be written over {}, which is read; choose another output", output.display(), input.display())]
    WrittenOverInput { output: PathBuf, input: PathBuf },
    /// Data file that cannot be used.
    #[error("{}: {problem}", path.display())]
    File { path: PathBuf, problem: Problem },
}

impl Error {
    /// Error for data or a model that cannot be used, and the `reason`.
    pub fn unfit(reason: impl Into<String>) -> Self {
        Self::unfit_for("", reason)
    }

    /// Error for data or a model that does not allow the setting `field`, and the `reason`.
    pub fn unfit_for(field: &'static str, reason: impl Into<String>) -> Self {
        Self::Unfit { field, reason: reason.into() }
    }

    /// Error for work that failed, and the `reason`.
    pub fn failed(reason: impl Into<String>) -> Self {
        Self::Failed(reason.into())
    }

    /// Error for a `problem` with the file at `path`.
    pub fn file(path: &Path, problem: Problem) -> Self {
        Self::File { path: path.into(), problem }
    }

    /// Error for a file at `path` that cannot be read.
    pub fn read(path: &Path, cause: std::io::Error) -> Self {
        Self::Read { path: path.into(), cause }
    }

    /// Error for a file at `path` that cannot be written.
    pub fn write(path: &Path, cause: std::io::Error) -> Self {
        Self::Write { path: path.into(), cause }
    }
}

/// Role of the columns that a pattern selects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Columns that a decoder is given.
    Inputs,
    /// Columns that it should predict.
    Outputs,
}

impl Role {
    /// Name of the role in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inputs => "inputs",
            Self::Outputs => "outputs",
        }
    }
}

/// Problem with a data file. Lines and columns count from 1; the header is line 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// Header that cannot be read.
    #[error("header: {cause}; save as UTF-8")]
    Header { cause: String },
    /// File that holds bytes which no text has.
    #[error("it is not text; save the table as CSV")]
    NoText,
    /// What gzip packed, and cannot be unpacked.
    #[error("it cannot be unpacked: {cause}; pack it again with gzip")]
    Packed { cause: String },
    /// What gzip packed, and is larger than any log of its size.
    #[error("it has more than {} unpacked; unpack it yourself if it is a log", in_words(*most_bytes))]
    UnpackedTooLarge { most_bytes: u64 },
    /// Numbers in which a comma may stand for a point or part thousands.
    #[error(
        "line {line}: {} may be a fraction or a number above a thousand; give --decimal comma, or write numbers \
         without thousands separators",
        quoted(field)
    )]
    ThousandsOrDecimals { line: u64, field: String },
    /// Number with a point in a file with decimal commas.
    #[error(
        "line {line}: {} has a point, and other numbers have decimal commas; write numbers without thousands \
         separators, or give --decimal point",
        quoted(field)
    )]
    PointAmongCommas { line: u64, field: String },
    /// Commas between fields, and twice as many as the header has.
    #[error(
        "line {line} has {fields} fields, and the header {columns}: commas seem to be decimal commas; give --decimal \
         comma for a single column, or save with semicolons between fields"
    )]
    CommasForBoth { line: u64, fields: usize, columns: usize },
    /// File without content.
    #[error("the file is empty: write numbers into it, with names of the columns on line 1")]
    Empty,
    /// File with a header and nothing else.
    #[error("the file has a header but no line of data")]
    NoLines,
    /// Folder where a file is expected.
    #[error("it is a folder; give the path of a file in it")]
    Folder,
    /// File larger than any that is read.
    #[error("it has more than {}; check the path", in_words(*most_bytes))]
    FileTooLarge {
        /// Largest size that is read, in bytes.
        most_bytes: u64,
    },
    /// Blank line in a file of one column, where it could be a missing value.
    #[error("line {line} is blank; in a file of one column write NaN for a missing value")]
    BlankLine { line: usize },
    /// Column name that holds a control character.
    #[error("header: column {column} has no usable name {}", quoted(name))]
    UnusableName { column: usize, name: String },
    /// Name that two columns share.
    #[error("header: column {} appears twice; rename one", quoted(name))]
    RepeatedName { name: String },
    /// Line that cannot be split into fields.
    #[error("{cause}; check quotes and line ends")]
    Line {
        /// Reason, with the place.
        cause: String,
    },
    /// Line with more or fewer fields than the header.
    #[error(
        "line {line} has {fields} fields; the header names {columns}; correct or remove the line"
    )]
    FieldCount { line: u64, fields: usize, columns: usize },
    /// Line with more or fewer fields than the first one, in a file without a header.
    #[error(
        "line {line} has {fields} fields; the first line has {columns}; correct or remove the line"
    )]
    UnevenLine {
        line: u64,
        fields: usize,
        /// Fields in the first line.
        columns: usize,
    },
    /// More lines that are cut or garbled than are skipped.
    #[error(
        "{lines} of {of} lines are cut or garbled, and at most 5 % are skipped; the first: {first}"
    )]
    Unreadable { lines: usize, of: usize, first: Box<Problem> },
    /// Field that is not a number.
    #[error(
        "line {line}, column {}: {} is not a number; {}",
        quoted(column),
        quoted(field),
        if field.contains(',') && field.contains('.') {
            "write numbers without thousands separators, and times as 2026-11-25 09:59:00"
        } else if field.contains(',') && field.starts_with(|c: char| c.is_ascii_digit() || c == '-') {
            "give --decimal comma if it is one, or write it without thousands separators"
        } else {
            "leave the field empty if the value is missing, or use another column"
        }
    )]
    NotANumber { line: u64, column: String, field: String },
    /// Value of a table that is infinite.
    #[error(
        "line {line}, column {}: the value is infinite; write NaN if it is missing",
        quoted(column)
    )]
    Infinite { line: u64, column: String },
    /// Column that is needed and missing.
    #[error("column {} is missing; the file has: {known}", quoted(name))]
    MissingColumn {
        /// Name of the missing column.
        name: String,
        known: String,
    },
    /// Part of a pattern that matches no column.
    #[error("no column matches {glob:?} of the {} {pattern:?}; the file has: {known}", role.name())]
    NoMatch {
        role: Role,
        /// Part that matches nothing.
        glob: String,
        pattern: String,
        known: String,
    },
    /// Pattern whose parts leave out every column that others choose.
    #[error(
        "the {} {pattern:?} choose no column: parts with ! leave columns out of those that other parts choose, as in \
         '*,!{}'",
        role.name(),
        pattern.rsplit('!').next().unwrap_or_default()
    )]
    AllLeftOut { role: Role, pattern: String },
    /// File without any column of the project's own names, and no pattern given.
    #[error("no column has a name like {pattern}; choose the {}; the file has: {known}", role.name())]
    NoUsualNames {
        role: Role,
        /// Pattern of the project's own names.
        pattern: String,
        known: String,
    },
    /// Column that both patterns select, as input and as output.
    #[error("column {} is chosen as an input and as an output", quoted(name))]
    InputAndOutput { name: String },
    /// Value too large to train on.
    #[error(
        "line {line}, column {}: {value:?} is beyond {bound:e}, the largest number that a decoder in f32 is trained on; \
         give the column another unit",
        quoted(column)
    )]
    TooLarge {
        line: u64,
        column: String,
        value: f64,
        /// Largest magnitude that is accepted.
        bound: f64,
    },
    /// File in which every line lacks a value in some selected column.
    #[error("no line has a value in every chosen column; check the columns")]
    NoCompleteLine,
    /// Value beyond a physical bound.
    #[error(
        "line {line}, column {}: {value:?} {unit} is beyond {bound_of} ({bound:?} {unit})",
        quoted(column)
    )]
    OutOfBound {
        line: u64,
        column: String,
        value: f64,
        /// Largest magnitude that is accepted.
        bound: f64,
        /// Meaning of the bound, for the message.
        bound_of: &'static str,
        unit: &'static str,
    },
    /// Missing value in a column where every line needs one.
    #[error("line {line}: {rule}")]
    MissingValue {
        line: u64,
        /// Values that every line needs, for the message.
        rule: String,
    },
}
