//! Tables: a column is declared once, and text, page, CSV and JSON are made of it.

use std::fmt::Write as _;

use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value;
use taxel_evaluate::metrics::Definition;

use super::WIDTH;
use crate::report::data::Data;
use crate::report::format::{UNDEFINED, decimals, fixed, grouped, significant, with_unit};
use crate::report::svg::escape;

/// Space between columns of text.
const GAP: &str = "  ";
/// Sizes beyond which a number is written in powers of ten.
const TINY: f64 = 1e-4;
const HUGE: f64 = 1e6;

/// Quantities of several things, one thing a line.
#[derive(Debug)]
pub struct Table {
    /// Sentence that tells what it has.
    pub caption: String,
    columns: Vec<Column>,
    lines: usize,
}

#[derive(Debug)]
struct Column {
    /// Name in CSV and JSON, with the unit of a number.
    key: String,
    /// Heading for people; `None` for a column that only programs read.
    heading: Option<String>,
    /// Whether it names what the line is about, and is not a quantity of it.
    is_name: bool,
    /// Rounded, for people.
    cells: Vec<String>,
    /// As they are, for programs.
    values: Vec<Value>,
}

/// Digits of a quantity.
#[derive(Debug, Clone, Copy)]
pub enum Digits {
    /// So many after the point.
    Decimals(usize),
    /// So many from the first that is not 0.
    Significant(usize),
    /// Whole numbers in groups of three digits; one after the point of others below 1000.
    Count,
}

impl Digits {
    /// Digits of errors by a definition.
    pub fn of(definition: &Definition) -> Self {
        definition.decimals.map_or(Self::Significant(3), Self::Decimals)
    }

    /// Text of a number; a dash for one that is missing.
    pub fn text(self, value: Option<f64>) -> String {
        match (value, self) {
            (None, _) => UNDEFINED.into(),
            (Some(value), Self::Count) if value.fract() == 0.0 || value >= 1000.0 => {
                grouped(value.round() as usize)
            }
            (Some(value), Self::Count) => fixed(value, 1),
            (Some(value), _) if value.is_finite() && value.abs() >= HUGE => format!("{value:.1e}"),
            (Some(value), Self::Significant(digits)) if value != 0.0 && value.abs() < TINY => {
                format!("{value:.*e}", digits - 1)
            }
            (Some(value), Self::Decimals(decimals)) => fixed(value, decimals),
            (Some(value), Self::Significant(digits)) => significant(value, digits),
        }
    }

    /// Text of a number with its standard error, which has as many decimals.
    pub fn with_error(self, value: Option<[f64; 2]>) -> String {
        let text = |[value, error]: [f64; 2]| {
            let decimals = match self {
                Self::Decimals(decimals) => decimals,
                Self::Significant(digits) => decimals(value, digits),
                Self::Count => 0,
            };
            format!("{} ± {}", fixed(value, decimals), fixed(error, decimals))
        };
        value.map_or(UNDEFINED.into(), text)
    }
}

/// Table of `rows`, whose columns are told by what they take from a row. People do not see a column in which nothing is
/// defined; programs do.
#[derive(Debug)]
pub struct TableOf<'r, R> {
    rows: &'r [R],
    table: Table,
}

impl<'r, R> TableOf<'r, R> {
    /// Table without columns.
    pub fn new(rows: &'r [R], caption: impl Into<String>) -> Self {
        Self { rows, table: Table { caption: caption.into(), columns: vec![], lines: rows.len() } }
    }

    /// Adds a column of names, which say what rows are about.
    #[must_use]
    pub fn names(self, key: &str, heading: &str, name: impl Fn(&'r R) -> String) -> Self {
        self.named(key, heading, |row| of_text(name(row)))
    }

    /// Adds a column of names with their text and their value, such as numbers of row-wires.
    #[must_use]
    pub fn named(self, key: &str, heading: &str, name: impl Fn(&'r R) -> (String, Value)) -> Self {
        self.column((key, Some(heading.into()), true), name)
    }

    /// Adds a column of a quantity as text.
    #[must_use]
    pub fn texts(self, key: &str, heading: &str, text: impl Fn(&'r R) -> String) -> Self {
        self.column((key, Some(heading.into()), false), |row| of_text(text(row)))
    }

    /// Adds a column of a quantity with its text and its value.
    #[must_use]
    pub fn cells(self, key: &str, heading: &str, cell: impl Fn(&'r R) -> (String, Value)) -> Self {
        self.column((key, Some(heading.into()), false), cell)
    }

    /// Adds a column of a quantity in a `unit`; `None` where it is not defined.
    #[must_use]
    pub fn numbers(
        self,
        key: &str,
        heading: &str,
        unit: &str,
        digits: Digits,
        value: impl Fn(&'r R) -> Option<f64>,
    ) -> Self {
        self.column((key, Some(with_unit(heading, unit)), false), |row| {
            let value = value(row);
            (digits.text(value), number_value(value))
        })
    }

    /// Adds a column of a quantity in a `unit` with its standard error, which has the second key.
    #[must_use]
    pub fn estimates(
        self,
        keys: [&str; 2],
        heading: &str,
        unit: &str,
        digits: Digits,
        value: impl Fn(&'r R) -> Option<[f64; 2]>,
    ) -> Self {
        let of_value = |row| {
            let value = value(row);
            (digits.with_error(value), number_value(value.map(|[value, _]| value)))
        };
        self.column((keys[0], Some(with_unit(heading, unit)), false), of_value)
            .values(keys[1], |row| number_value(value(row).map(|[_, error]| error)))
    }

    /// Adds a column that only programs read.
    #[must_use]
    pub fn values(self, key: &str, value: impl Fn(&'r R) -> Value) -> Self {
        self.column((key, None, false), |row| (String::new(), value(row)))
    }

    /// The table, of which the rows are no longer needed.
    pub fn table(self) -> Table {
        self.table
    }

    fn column(
        mut self,
        (key, heading, is_name): (&str, Option<String>, bool),
        cell: impl Fn(&'r R) -> (String, Value),
    ) -> Self {
        let is_new = self.table.columns.iter().all(|column| column.key != key);
        debug_assert!(is_new, "two columns have the key {key}");
        let (cells, values): (Vec<String>, Vec<Value>) = self.rows.iter().map(cell).unzip();
        let is_told = |cell: &String| !cell.is_empty() && cell != UNDEFINED;
        let heading = heading.filter(|_| cells.iter().any(is_told));
        self.table.columns.push(Column { key: key.into(), heading, is_name, cells, values });
        self
    }
}

/// Value of a number: whole ones without a point, and none for one that is missing.
pub fn number_value(value: Option<f64>) -> Value {
    match value {
        Some(whole) if whole.fract() == 0.0 && whole.abs() < 1e15 => Value::from(whole as i64),
        value => Value::from(value),
    }
}

/// Cell of a text, and its value.
fn of_text(text: String) -> (String, Value) {
    let value = if text == UNDEFINED { Value::Null } else { text.as_str().into() };
    (text, value)
}

impl Table {
    pub fn is_empty(&self) -> bool {
        self.lines == 0
    }

    /// Text of a CSV file: a line of keys, then the values of each row.
    pub fn csv(&self) -> String {
        let field = |value: &Value| match value {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let line =
            |line: usize| self.columns.iter().map(|column| field(&column.values[line])).collect();
        let heads = self.columns.iter().map(|column| column.key.clone()).collect();
        Data { heads, lines: (0..self.lines).map(line).collect() }.csv()
    }

    /// Columns that people see.
    fn shown(&self) -> impl Iterator<Item = (&Column, &str)> {
        self.columns.iter().filter_map(|column| Some((column, column.heading.as_deref()?)))
    }

    /// Lines of text of at most [`WIDTH`] characters: columns that do not fit follow below, behind the names once more.
    pub(super) fn text(&self) -> String {
        type Shown<'t> = (&'t Column, &'t str);
        let (names, quantities): (Vec<Shown<'_>>, Vec<Shown<'_>>) =
            self.shown().partition(|(column, _)| column.is_name);
        let of_names: usize = names.iter().map(|(column, _)| column.width() + GAP.len()).sum();
        // Names alone are shown where no quantity is defined.
        let mut blocks = if quantities.is_empty() { vec![names.clone()] } else { vec![] };
        let mut left = 0;
        for shown in quantities {
            let width = shown.0.width() + GAP.len();
            if left < width {
                blocks.push(names.clone());
                left = (WIDTH + GAP.len()).saturating_sub(of_names).max(width);
            }
            left -= width;
            blocks.last_mut().expect("pushed before").push(shown);
        }
        let of_block = |block: &Vec<Shown<'_>>| -> String {
            let heading = |(column, heading): &Shown<'_>| column.padded(heading);
            let cell =
                |line: usize| move |(column, _): &Shown<'_>| column.padded(&column.cells[line]);
            let joined = |cells: Vec<String>| cells.join(GAP).trim_end().to_owned() + "\n";
            let lines = (0..self.lines).map(|line| joined(block.iter().map(cell(line)).collect()));
            joined(block.iter().map(heading).collect()) + &lines.collect::<String>()
        };
        blocks.iter().map(of_block).collect::<Vec<_>>().join("\n")
    }

    /// The table with its number, as HTML.
    pub(super) fn html(&self, number: usize) -> String {
        let tag = |column: &Column, tag: &str, text: &str| {
            let text = escape(text);
            let class = if column.is_name { "" } else { " class=\"number\"" };
            format!("<{tag}{class}>{text}</{tag}>")
        };
        let heads = self.shown().map(|(column, heading)| tag(column, "th", heading));
        let mut html = format!(
            "<figure id=\"table-{number}\" class=\"table\">\n<figcaption><b>Table {number}.</b> {}</figcaption>\n<div class=\"scroll\" \
             tabindex=\"0\" role=\"region\" aria-label=\"Table {number}\">\n<table class=\"wrap\">\n<thead><tr>{}</tr></thead>\n<tbody>\n",
            escape(&self.caption),
            heads.collect::<String>()
        );
        for line in 0..self.lines {
            let cells = self.shown().map(|(column, _)| tag(column, "td", &column.cells[line]));
            // Writing to a string cannot fail.
            let _ = writeln!(html, "<tr>{}</tr>", cells.collect::<String>());
        }
        html + "</tbody>\n</table>\n</div>\n</figure>\n"
    }
}

/// A list of rows, each an object with the values by their keys.
impl Serialize for Table {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq((0..self.lines).map(|line| Row { table: self, line }))
    }
}

struct Row<'t> {
    table: &'t Table,
    line: usize,
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let columns = &self.table.columns;
        let mut object = serializer.serialize_map(Some(columns.len()))?;
        for column in columns {
            object.serialize_entry(&column.key, &column.values[self.line])?;
        }
        object.end()
    }
}

impl Column {
    fn width(&self) -> usize {
        let cells = self.cells.iter().chain(&self.heading);
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    }

    fn padded(&self, cell: &str) -> String {
        let width = self.width();
        if self.is_name { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
    }
}
