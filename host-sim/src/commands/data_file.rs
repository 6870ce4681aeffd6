//! Data files that commands read: how they are read, and cut to a part.

use std::ops::Not;
use std::path::Path;

use super::Common;
use super::arguments::{as_text, refuse};
use super::recordings::{self, is_recording};
use crate::{Error, Result};
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use taxel_data::DataFile;
use taxel_data::data_file::{Reading, Separator, Stated, Unreadable};

/// Heading of options for data files.
pub const DATA_FILES: &str = "Data files (CSV, .mcap)";

/// Refusal of an option of data files.
pub fn for_data(option: &str) -> String {
    format!("{option} is for data files; a scene has none: leave it out")
}

/// How data files are read: text of any dialect (with or without a header), recordings (.mcap).
#[derive(Clone, Args, Default, Serialize, Deserialize)]
#[command(next_help_heading = DATA_FILES)]
pub struct DataFileArguments {
    #[command(flatten)]
    #[serde(flatten)]
    fields: FieldArguments,
    /// Use only the first lines, this share of all: 0.8 leaves out the last fifth.
    #[arg(long, value_name = "SHARE")]
    first_share: Option<f64>,
    /// Use only the last lines, this share of all: 0.2 uses what --first-share 0.8 leaves out.
    #[arg(long, value_name = "SHARE", conflicts_with = "first_share")]
    last_share: Option<f64>,
}

/// Times of a log's lines.
#[derive(Clone, Args, Default, Serialize, Deserialize)]
#[command(next_help_heading = DATA_FILES)]
pub struct TimeArgument {
    /// Column of a log that holds the time of each line [default: a column called time, t, timestamp, …; without
    /// one, lines are counted].
    #[arg(long, value_name = "NAME")]
    pub time: Option<String>,
}

/// What the fields of a data file mean.
#[derive(Clone, Args, Default, Serialize, Deserialize)]
pub struct FieldArguments {
    /// Read the first line of a CSV file as names even if it holds only numbers. Otherwise such a file has no header,
    /// and its columns are called c1, c2, …
    #[arg(long)]
    #[serde(default, skip_serializing_if = "Not::not")]
    header: bool,
    /// Numbers that mark a missing value, such as -1.
    #[arg(long, value_name = "VALUE", value_delimiter = ',')]
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    missing: Vec<f64>,
    /// Separator between the fields of a text file, instead of the detected one: comma, semicolon, tab, space, or another
    /// character.
    #[arg(long, value_name = "NAME")]
    #[serde(default, with = "as_text")]
    separator: Option<Separator>,
    /// Decimal sign of a text file, instead of the detected one.
    #[arg(long, value_enum, value_name = "SIGN")]
    decimal: Option<Decimal>,
    /// Refuse a text file with a line that is cut or garbled. Otherwise such lines are skipped if they are at most 5 % of
    /// all.
    #[arg(long)]
    #[serde(default, skip_serializing_if = "Not::not")]
    strict: bool,
}

/// Decimal sign.
#[derive(Clone, Copy, PartialEq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Decimal {
    Point,
    Comma,
}

impl DataFileArguments {
    /// Reads the file at `path`, cut as was asked for.
    pub fn read(&self, path: &Path, common: &Common) -> Result<DataFile> {
        self.cut(self.fields.read(path, common)?)
    }

    /// Reads the file at `path` as [`read`](Self::read) does, with its text.
    pub fn read_with_text(&self, path: &Path, common: &Common) -> Result<DataFile> {
        self.cut(self.fields.read_as(path, true, common)?)
    }

    fn cut(&self, mut file: DataFile) -> Result<DataFile> {
        let lines = file.lines();
        let kept = match (self.first_share, self.last_share) {
            (Some(share), _) => {
                0..count("--first-share", share, lines, |share| first_lines(share, lines))?
            }
            (_, Some(share)) => {
                // What the first part leaves, so that both parts make the whole.
                let rest = |share| lines - first_lines(WHOLE - share, lines);
                lines - count("--last-share", share, lines, rest)?..lines
            }
            _ => 0..lines,
        };
        if kept.len() < lines {
            file.keep_lines(kept);
        }
        Ok(file)
    }

    /// What the fields of its files mean.
    pub fn fields(&self) -> &FieldArguments {
        &self.fields
    }

    /// Error if an option was given: they are for data files alone.
    pub fn refuse(&self) -> Result<()> {
        refuse(self, |_| true, for_data)
    }
}

/// Parts of a share of 1. Whole numbers of these do not round, so that no line is in two parts of a file.
const WHOLE: u64 = 1_000_000_000_000;

/// Number of lines that are the first `share` of all `lines`, to the nearest; half a line counts as one.
fn first_lines(share: u64, lines: usize) -> usize {
    let (share, lines, whole) = (u128::from(share), lines as u128, u128::from(WHOLE));
    ((share * lines + whole / 2) / whole) as usize
}

/// Number of lines that `lines_of` makes of a `share` in parts of [`WHOLE`].
fn count(option: &str, share: f64, lines: usize, lines_of: impl Fn(u64) -> usize) -> Result<usize> {
    if !(share > 0.0 && share <= 1.0) {
        let message = format!("{option} {share}: give a share above 0, up to 1, such as 0.8");
        return Err(Error::Usage(message));
    }
    let count = lines_of((share * WHOLE as f64).round() as u64);
    if count == 0 {
        let message = format!("{option} {share}: no line of {lines} is left; give a larger share");
        return Err(Error::Usage(message));
    }
    Ok(count)
}

impl FieldArguments {
    /// How a file is read.
    pub fn reading(&self) -> Reading {
        let stated = Stated {
            separator: self.separator,
            decimal_comma: self.decimal.map(|sign| sign == Decimal::Comma),
        };
        Reading { has_header: self.header, is_strict: self.strict, stated, ..Reading::default() }
    }

    /// Reads the file at `path`, and says on stderr what it made of it.
    pub fn read(&self, path: &Path, common: &Common) -> Result<DataFile> {
        self.read_as(path, false, common)
    }

    fn read_as(&self, path: &Path, keeps_text: bool, common: &Common) -> Result<DataFile> {
        if is_recording(path) {
            let of_text = |field: &str| ["separator", "decimal", "strict"].contains(&field);
            refuse(self, of_text, |option| {
                format!("{option} is for text files; {} is none: leave it out", path.display())
            })?;
        }
        let mut file = if let Some(table) = common.table(path) {
            table
        } else if is_recording(path) {
            recordings::read(path, common)?
        } else {
            DataFile::read_as(path, &Reading { keeps_text, ..self.reading() })?
        };
        note_found(&file, common);
        let name = path.display();
        if let Some(Unreadable { lines, first }) = &file.unreadable {
            common.remark(format_args!(
                "note: {lines} of {} lines of {name} are cut or garbled and are skipped (--strict refuses them); the first: \
                 {first}",
                file.lines() + lines
            ));
        }
        if !file.names_columns {
            common.remark(format_args!(
                "note: {name} has no column names: columns are called c1 to c{} (c2..c5 selects four of them)",
                file.header.len()
            ));
        }
        if file.lacks_last_line_end {
            let last = file.line_number(file.lines() - 1);
            common.remark(format_args!(
                "note: {name} ends without a line end: if it is not whole, the last number of line {last} may be wrong"
            ));
        }
        for code in &self.missing {
            let marked = file.mark_missing(*code);
            common.remark(format_args!(
                "note: {marked} values of {name} are {code}, and count as missing"
            ));
        }
        Ok(file)
    }
}

/// Says on stderr what is not plain CSV in a `file`.
fn note_found(file: &DataFile, common: &Common) {
    if !file.found.is_empty() {
        common.remark(format_args!("note: {}: {}", file.path.display(), file.found));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_that_make_the_whole_have_each_line_once() {
        for count in [7, 10, 11, 13, 25, 50, 101, 150] {
            let text = (0..count).map(|line| line.to_string()).collect::<Vec<_>>().join("\n");
            let file =
                DataFile::parse(Path::new("d.csv"), text.as_bytes(), &Reading::default()).unwrap();
            let lines = |first_share, last_share| {
                let cut = DataFileArguments { first_share, last_share, ..Default::default() };
                cut.cut(file.clone()).map_or(vec![], |file| {
                    (0..file.lines()).map(|line| file.value(line, 0)).collect()
                })
            };
            for percent in 1..100 {
                let share = |percent: i32| format!("0.{percent:02}").parse::<f64>().ok();
                let first = lines(share(percent), None);
                let last = lines(None, share(100 - percent));
                let all = [first, last].concat();
                let whole: Vec<f64> = (0..count).map(f64::from).collect();
                assert_eq!(all, whole, "{percent} % of {count} lines");
            }
        }
    }
}
