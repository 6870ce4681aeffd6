//! What can go wrong with data, as values that a program can match.

use std::path::{Path, PathBuf};

/// Result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A setting that cannot be used: which, its value, and what would be right.
///
/// ```
/// let bad = taxel_data::BadValue::new("noise.level", 5.0, "give a fraction from 0 to 1");
/// assert_eq!(bad.field, "noise.level");
/// assert_eq!(bad.to_string(), "noise.level = 5: give a fraction from 0 to 1");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field} = {value}: {rule}")]
pub struct BadValue {
    /// Name of the setting.
    pub field: String,
    /// Value that was given.
    pub value: String,
    /// Which values can be used.
    pub rule: String,
}

impl BadValue {
    /// A setting `field` whose `value` breaks `rule`.
    pub fn new(field: impl Into<String>, value: impl ToString, rule: impl Into<String>) -> Self {
        Self { field: field.into(), value: value.to_string(), rule: rule.into() }
    }

    /// The same under another name, such as that of a command's option.
    #[must_use]
    pub fn named(self, field: impl Into<String>) -> Self {
        Self { field: field.into(), ..self }
    }
}

/// A failure to read, to write, or to use data.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read.
    #[error("cannot read {}: {cause}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {cause}; choose another place", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// A file would be written over another that is read.
    #[error("{} would be written over {}, which is read; choose another output", output.display(), input.display())]
    WrittenOverInput {
        /// The file to be written.
        output: PathBuf,
        /// The file that is read.
        input: PathBuf,
    },
    /// A data file cannot be used.
    #[error("{}: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and where.
        problem: Problem,
    },
}

impl Error {
    /// A problem with the file at `path`.
    #[must_use]
    pub fn file(path: &Path, problem: Problem) -> Self {
        Self::File { path: path.into(), problem }
    }

    /// A file that cannot be read.
    #[must_use]
    pub fn read(path: &Path, cause: std::io::Error) -> Self {
        Self::Read { path: path.into(), cause }
    }

    /// A file that cannot be written.
    #[must_use]
    pub fn write(path: &Path, cause: std::io::Error) -> Self {
        Self::Write { path: path.into(), cause }
    }
}

/// Which columns of a file a pattern chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Columns that a decoder is given.
    Inputs,
    /// Columns that it is to answer.
    Outputs,
}

impl Role {
    /// Name in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Inputs => "inputs",
            Self::Outputs => "outputs",
        }
    }
}

/// What is wrong with a data file. Lines and columns count from 1, the header is line 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// The header cannot be read.
    #[error("line 1: {cause}; save as UTF-8")]
    Header {
        /// Why.
        cause: String,
    },
    /// The file is empty.
    #[error("the file is empty: line 1 must name the columns")]
    Empty,
    /// There is a header and nothing else.
    #[error("the file has a header but no line of data")]
    NoLines,
    /// A file of one column has a blank line.
    #[error("line {line} is blank; in a file of one column write NaN for a missing value")]
    BlankLine {
        /// The line.
        line: usize,
    },
    /// A column's name is empty or holds a control character.
    #[error("line 1: column {column} has no usable name {name:?}")]
    UnusableName {
        /// The column.
        column: usize,
        /// Its name.
        name: String,
    },
    /// Two columns have the same name.
    #[error("line 1: column {name:?} stands twice; rename one")]
    RepeatedName {
        /// The name.
        name: String,
    },
    /// A line cannot be cut into fields.
    #[error("{cause}; check quotes and line ends")]
    Line {
        /// Why, with the place.
        cause: String,
    },
    /// A line has more or fewer fields than the header.
    #[error("line {line} has {fields} fields; the header names {columns}; mend or remove the line")]
    FieldCount {
        /// The line.
        line: u64,
        /// Its fields.
        fields: usize,
        /// Columns of the header.
        columns: usize,
    },
    /// A field is no number.
    #[error(
        "line {line}, column {column:?}: {field:?} is not a number; leave the field empty if the value is missing"
    )]
    NotANumber {
        /// The line.
        line: u64,
        /// Name of the column.
        column: String,
        /// What stands there.
        field: String,
    },
    /// A column is missing.
    #[error("column {name:?} is missing; the file has: {known}")]
    MissingColumn {
        /// The name that was looked for.
        name: String,
        /// The first columns that there are.
        known: String,
    },
    /// No column matches a part of a pattern.
    #[error("no column matches {glob:?} of the {} {pattern:?}; the file has: {known}", role.name())]
    NoMatch {
        /// What the columns are for.
        role: Role,
        /// The part that nothing matches.
        glob: String,
        /// The whole pattern.
        pattern: String,
        /// The first columns that there are.
        known: String,
    },
    /// No column has the project's own names, and no pattern was given.
    #[error("no column is named like {pattern}; choose the {}; the file has: {known}", role.name())]
    NoUsualNames {
        /// What the columns are for.
        role: Role,
        /// What the project's own names look like.
        pattern: String,
        /// The first columns that there are.
        known: String,
    },
    /// A column is an input and an output.
    #[error("column {name:?} is chosen as an input and as an output")]
    InputAndOutput {
        /// The column.
        name: String,
    },
    /// A value is too large to train on.
    #[error(
        "line {line}, column {column:?}: {value} is beyond {bound:e}, the largest number that a decoder in f32 is trained on; give the column another unit"
    )]
    TooLarge {
        /// The line.
        line: u64,
        /// Name of the column.
        column: String,
        /// The value.
        value: f64,
        /// Largest magnitude.
        bound: f64,
    },
    /// Every line lacks a value in some chosen column.
    #[error("no line has a value in every chosen column; check the columns")]
    NoCompleteLine,
    /// A value is outside what it may be.
    #[error("line {line}, column {column:?}: {value} {unit} is beyond {bound_of} ({bound} {unit})")]
    OutOfBound {
        /// The line.
        line: u64,
        /// Name of the column.
        column: String,
        /// The value.
        value: f64,
        /// Largest magnitude.
        bound: f64,
        /// What the bound is.
        bound_of: &'static str,
        /// Unit of value and bound.
        unit: &'static str,
    },
    /// A value is missing that must be there.
    #[error("line {line}: {rule}")]
    MissingValue {
        /// The line.
        line: u64,
        /// What every line needs.
        rule: String,
    },
}
