//! Data files that commands read: how they are read, joined with another log, and cut to a part.

use std::path::{Path, PathBuf};

use crate::{Error, Result};
use clap::Args;
use taxel_data::columns;
use taxel_data::data_file::DataFile;
use taxel_data::join::Join;

use super::arguments::of_option;

/// How data files are read: CSV files (with or without a header), numpy's .npy and .npz.
#[derive(Args, Default)]
#[command(next_help_heading = "Data files (CSV, .npy, .npz)")]
pub struct DataFileArguments {
    #[command(flatten)]
    fields: FieldArguments,
    /// Log to join: each line of the data with this file's line whose time stamp is nearest. Columns of a name that the
    /// data has too are called b.NAME.
    #[arg(long, value_name = "FILE", requires_all = ["on", "tolerance"])]
    join: Option<PathBuf>,
    /// Column with the time stamps of both files, or two names: of the data, and of the file to join.
    #[arg(long, value_name = "NAME[,NAME]", requires = "join")]
    on: Option<String>,
    /// Largest distance of two time stamps that belong together, in their unit. Lines without a partner are left out.
    #[arg(long, value_name = "TIME", requires = "join", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Time to add to the joined file's time stamps [default: 0].
    #[arg(long, value_name = "TIME", requires = "join", allow_negative_numbers = true)]
    lag: Option<f64>,
    /// Use the first lines alone, this share of all: 0.8 leaves out the last fifth.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    first_share: Option<f64>,
    /// Use the last lines alone, this share of all: 0.2 is what --first-share 0.8 leaves out.
    #[arg(
        long,
        value_name = "SHARE",
        conflicts_with = "first_share",
        allow_negative_numbers = true
    )]
    last_share: Option<f64>,
}

/// What the fields of a data file mean.
#[derive(Args, Default)]
pub struct FieldArguments {
    /// Take the first line of a CSV file as names even if it holds numbers alone. Otherwise such a file has no header,
    /// and its columns are called c1, c2, …
    #[arg(long)]
    header: bool,
    /// Numbers that stand for a missing value, such as -1.
    #[arg(long, value_name = "VALUE", value_delimiter = ',', allow_negative_numbers = true)]
    missing: Vec<f64>,
}

/// Which lines of two logs belong together.
#[derive(Args)]
pub struct JoinArguments {
    /// Column with the time stamps of both files, or two names: of the first, and of the second.
    #[arg(long, value_name = "NAME[,NAME]")]
    on: String,
    /// Largest distance of two time stamps that belong together, in their unit. Lines without a partner are left out.
    #[arg(long, value_name = "TIME", allow_negative_numbers = true)]
    tolerance: f64,
    /// Time to add to the second file's time stamps.
    #[arg(long, value_name = "TIME", default_value_t = 0.0, allow_negative_numbers = true)]
    lag: f64,
}

impl DataFileArguments {
    /// Reads the file at `path`, joined and cut as was asked for.
    pub fn read(&self, path: &Path) -> Result<DataFile> {
        let mut file = self.fields.read(path)?;
        if let (Some(other), Some(on), Some(tolerance)) = (&self.join, &self.on, self.tolerance) {
            let lag = self.lag.unwrap_or(0.0);
            file = JoinArguments { on: on.clone(), tolerance, lag }
                .join(&file, &self.fields.read(other)?)?;
        }
        let lines = file.lines();
        let kept = match (self.first_share, self.last_share) {
            (Some(share), _) => {
                let last = count("--first-share", share, lines, |lines| (lines + 0.5).floor())?;
                0..last
            }
            (_, Some(share)) => {
                // Half a line goes to the first part, so that both parts make the whole.
                let count = count("--last-share", share, lines, |lines| (lines - 0.5).ceil())?;
                lines - count..lines
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

    /// File that is joined, if one was given.
    pub fn join(&self) -> Option<&Path> {
        self.join.as_deref()
    }

    /// Whether a part of the file's lines is taken, so that the file alone does not tell which.
    pub fn takes_a_share(&self) -> bool {
        self.first_share.is_some() || self.last_share.is_some()
    }

    /// Error if an option was given: they are for data files alone.
    pub fn refuse_for_scene(&self) -> Result<()> {
        for (option, given) in [
            ("--header", self.fields.header),
            ("--missing", !self.fields.missing.is_empty()),
            ("--join", self.join.is_some()),
            ("--first-share", self.first_share.is_some()),
            ("--last-share", self.last_share.is_some()),
        ] {
            if given {
                let message = format!("{option} is for data files; a scene has none: leave it out");
                return Err(Error::Usage(message));
            }
        }
        Ok(())
    }
}

/// Number of lines that are a `share` of all `lines`, as `rounded` makes it a whole number.
fn count(option: &str, share: f64, lines: usize, rounded: fn(f64) -> f64) -> Result<usize> {
    if !(share > 0.0 && share <= 1.0) {
        let message = format!("{option} {share}: give a share above 0, up to 1, such as 0.8");
        return Err(Error::Usage(message));
    }
    let count = rounded(lines as f64 * share) as usize;
    if count == 0 {
        let message = format!("{option} {share}: no line of {lines} is left; give a larger share");
        return Err(Error::Usage(message));
    }
    Ok(count)
}

impl FieldArguments {
    /// Whether a CSV file has a header whatever its first line holds, and the numbers that stand for a missing value.
    pub fn settings(&self) -> (bool, &[f64]) {
        (self.header, &self.missing)
    }

    /// Reads the file at `path`, and says on stderr what it made of it.
    pub fn read(&self, path: &Path) -> Result<DataFile> {
        let mut file =
            if self.header { DataFile::read_with_header(path)? } else { DataFile::read(path)? };
        let name = path.display();
        if !file.names_columns {
            eprintln!(
                "note: {name} names no columns: they are called c1 to c{} (c2..c5 stands for four of them)",
                file.header.len()
            );
        }
        if file.lacks_last_line_end {
            let last = file.line_number(file.lines() - 1);
            eprintln!(
                "note: {name} ends without a line end: if it is not whole, the last number of line {last} may be wrong"
            );
        }
        for code in &self.missing {
            let marked = file.mark_missing(*code);
            eprintln!("note: {marked} values of {name} are {code}, and count as missing");
        }
        Ok(file)
    }
}

impl JoinArguments {
    /// Joins each line of `first` with one of `second`, and says on stderr what came of it.
    pub fn join(&self, first: &DataFile, second: &DataFile) -> Result<DataFile> {
        let names: Vec<&str> = self.on.split(',').map(str::trim).collect();
        let on = match names[..] {
            [name] => [name, name],
            [of_first, of_second] => [of_first, of_second],
            _ => {
                let message = format!(
                    "--on {}: give the column with the time stamps, or one for each file, as in time,stamp",
                    self.on
                );
                return Err(Error::Usage(message));
            }
        };
        for (file, name) in [first, second].into_iter().zip(on) {
            if let Err(taxel_data::Error::File { path, problem }) = file.column(name) {
                return Err(Error::Unfit { path, message: format!("{problem} (--on)") });
            }
        }
        let (on, tolerance, lag) = (on.map(str::to_owned), self.tolerance, self.lag);
        let join = Join { on, tolerance, lag };
        let options = [("tolerance", "--tolerance"), ("lag", "--lag")];
        join.check().map_err(|bad| of_option(bad, &options))?;
        let joined = join.join(first, second)?;
        eprintln!(
            "note: {} of {} lines of {} have a partner in {}, at most {} away;\n      {} are left out; the partner's columns are {}",
            joined.file.lines(),
            first.lines(),
            first.path.display(),
            second.path.display(),
            significant(joined.largest_distance),
            joined.left_out,
            columns::some_names(&joined.file.header[first.header.len()..])
        );
        if joined.repeated > 0 {
            eprintln!(
                "note: {} lines of {} repeat the time stamp before them and are not used",
                joined.repeated,
                second.path.display()
            );
        }
        Ok(joined.file)
    }
}

/// Three digits of a positive number.
fn significant(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
