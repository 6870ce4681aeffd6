//! Sections: a result is declared once, and shown as text, as a page and as JSON.
//!
//! A result is a list of [`Section`]s: facts, tables, figures and notes. A [`Table`] has a column for each quantity, with
//! its key, its heading, its unit and its digits. Text and page are made of the same sections, so that neither can say anything
//! else than the other. A page begins with the lead, and text ends with it, where a terminal shows it. What programs read of a
//! result are its values, by their keys; those of a table are its columns, unrounded.

use serde::Serialize;

use super::data::number;
use super::figures::Figure;

mod table;
mod text;
mod page;

pub use table::{Digits, Table, TableOf, number_value};

/// Characters in a line of text, at most.
const WIDTH: usize = 120;

/// Result as people read it.
#[derive(Debug, Default)]
pub struct Sections {
    pub title: String,
    /// What the result means, in a few sentences; empty for none.
    pub lead: String,
    /// What to beware of.
    pub warnings: Vec<String>,
    /// Whether the page is one file, without those of its figures beside it.
    pub is_alone: bool,
    /// What names of figures' files begin with.
    pub prefix: String,
    /// Files beside the page that have the numbers.
    pub files: Vec<String>,
    pub sections: Vec<Section>,
    /// What programs read: keys, and their values in JSON.
    values: Vec<(&'static str, String)>,
}

/// Part of a result.
#[derive(Debug)]
pub enum Section {
    /// Heading of the sections that follow.
    Heading(String),
    /// Numbers that are read first, each with its label and its unit.
    Facts(Vec<Fact>),
    /// Answers that are read first, beside each other.
    Cards(Vec<Card>),
    /// How a result was made: names, and what they are.
    Details(Vec<(&'static str, String)>),
    Table(Table),
    /// Figure, which text goes without.
    Figure(Figure),
    /// Paragraph of plain text.
    Note(String),
    /// Sections behind a summary that a reader opens, which text goes without.
    Folded(String, Vec<Section>),
    /// Text with its own lines, which text goes without.
    Listing(String),
}

/// Number with its label.
#[derive(Debug)]
pub struct Fact {
    pub label: String,
    pub value: String,
    pub unit: String,
}

/// Answer with its numbers, and how to have it.
#[derive(Debug)]
pub struct Card {
    pub title: String,
    /// What it is, in a few words.
    pub name: String,
    /// The first is the number that a reader looks for.
    pub facts: Vec<Fact>,
    /// What to type for it; empty for nothing.
    pub command: String,
}

impl Sections {
    /// No section yet.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    pub fn heading(&mut self, text: impl Into<String>) {
        self.sections.push(Section::Heading(text.into()));
    }

    pub fn note(&mut self, text: impl Into<String>) {
        self.sections.push(Section::Note(text.into()));
    }

    pub fn table<R>(&mut self, table: TableOf<'_, R>) {
        self.show(table.table());
    }

    fn show(&mut self, table: Table) {
        if !table.is_empty() {
            self.sections.push(Section::Table(table));
        }
    }

    /// Adds a table that programs read as well.
    pub fn table_as<R>(&mut self, key: &'static str, table: TableOf<'_, R>) {
        let table = table.table();
        self.value(key, &table);
        self.show(table);
    }

    /// Adds a table that programs read alone.
    pub fn rows<R>(&mut self, key: &'static str, table: TableOf<'_, R>) {
        self.value(key, &table.table());
    }

    pub fn figure(&mut self, figure: Figure) {
        self.sections.push(Section::Figure(figure));
    }

    /// Adds sections that a page shows when a reader asks for them, unless there are none.
    pub fn folded(&mut self, summary: impl Into<String>, sections: Vec<Section>) {
        if !sections.is_empty() {
            self.sections.push(Section::Folded(summary.into(), sections));
        }
    }

    /// Adds what `others` have, but for their title and their lead.
    pub fn extend(&mut self, others: Self) {
        self.sections.extend(others.sections);
        self.values.extend(others.values);
    }

    /// Adds a value that programs read, and text does not show.
    ///
    /// # Panics
    /// If the value is a map whose keys are no text.
    pub fn value(&mut self, key: &'static str, value: &(impl Serialize + ?Sized)) {
        let json = serde_json::to_string_pretty(value).expect("keys are text");
        self.values.push((key, json.replace('\n', "\n  ")));
    }

    /// Adds the values of `others` as an object.
    pub fn object(&mut self, key: &'static str, others: &Self) {
        self.values.push((key, others.json().replace('\n', "\n  ")));
    }

    /// Adds a line that people read, and JSON does not have; none for an empty text.
    pub fn line(&mut self, label: &'static str, text: impl Into<String>) {
        let text = text.into();
        match self.sections.last_mut() {
            _ if text.is_empty() => {}
            Some(Section::Details(details)) => details.push((label, text)),
            _ => self.sections.push(Section::Details(vec![(label, text)])),
        }
    }

    /// Adds a value that both read. Text has no line for one that is missing.
    pub fn fact(
        &mut self,
        key: &'static str,
        label: &'static str,
        unit: &str,
        value: impl Serialize,
    ) {
        self.value(key, &value);
        let (_, json) = &self.values[self.values.len() - 1];
        let text = match json.as_str() {
            "null" | "[]" => return,
            "true" => "yes".into(),
            "false" => "no".into(),
            _ if json.starts_with('"') => serde_json::from_str(json).unwrap_or_default(),
            _ if json.contains(['.', 'e']) => {
                let rounded =
                    json.parse().map_or(json.clone(), |value: f64| format!("{value:.3e}"));
                rounded.parse().map_or(rounded, number)
            }
            _ => json.clone(),
        };
        self.line(label, format!("{text} {unit}").trim_end());
    }

    /// Object of all values in JSON.
    pub fn json(&self) -> String {
        let members = self.values.iter().map(|(key, value)| format!("\n  \"{key}\": {value}"));
        format!("{{{}\n}}", members.collect::<Vec<_>>().join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_page_have_the_same_cells() {
        const RMSE: Digits = Digits::Decimals(4);
        let rows = [("dz", Some([0.0371, 0.0002]), 0.998), ("d<x", None, -0.5)];
        let table = TableOf::new(&rows, "Errors <of> two outputs.")
            .names("output", "output", |row| row.0.into())
            .estimates(["rmse_mm", "rmse_standard_error_mm"], "RMSE", "mm", RMSE, |row| row.1)
            .numbers("r_squared", "R²", "", Digits::Significant(2), |row| Some(row.2));
        let mut sections = Sections::new("A & B");
        sections.table(table);
        let text = sections.text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[4], "output        RMSE (mm)     R²");
        assert_eq!(lines[5], "dz      0.0371 ± 0.0002   1.00");
        assert_eq!(lines[6], "d<x                   –  −0.50");
        let page = sections.page("taxel x").html;
        let line =
            "<tr><td>d&lt;x</td><td class=\"number\">–</td><td class=\"number\">−0.50</td></tr>";
        assert!(page.contains(line) && page.contains("<title>Taxel: A &amp; B</title>"), "{page}");
    }

    #[test]
    fn csv_and_json_have_the_columns_of_text_unrounded_and_more() {
        let rows = [("d,z", Some([0.037_123, 0.0002]), 7), ("dx", None, 8)];
        let table = TableOf::new(&rows, "Errors.")
            .names("output", "output", |row| row.0.into())
            .estimates(["rmse_mm", "error_mm"], "RMSE", "mm", Digits::Significant(2), |row| row.1)
            .values("count", |row| row.2.into());
        let mut sections = Sections::new("A");
        sections.table_as("errors", table);
        let json: serde_json::Value = serde_json::from_str(&sections.json()).unwrap();
        let of = |value: serde_json::Value, error: serde_json::Value, output: &str, count: i32| serde_json::json!({ "output": output, "rmse_mm": value, "error_mm": error, "count": count });
        let none = serde_json::Value::Null;
        let expected =
            [of(0.037_123.into(), 0.0002.into(), "d,z", 7), of(none.clone(), none, "dx", 8)];
        assert_eq!(json["errors"], serde_json::json!(expected));
        let Some(Section::Table(table)) = sections.sections.first() else { panic!("a table") };
        let csv = "output,rmse_mm,error_mm,count\n\"d,z\",0.037123,0.0002,7\ndx,,,8\n";
        assert_eq!(table.csv(), csv);
        assert!(sections.text().contains("0.037 ± 0.000") && !sections.text().contains("count"));
    }

    #[test]
    fn columns_that_do_not_fit_stand_below_behind_the_names() {
        let mut table =
            TableOf::new(&["row 1"], "Many.").names("wire", "wire", |row| (*row).into());
        for column in 0..20 {
            let heading = format!("column {column}");
            let digits = Digits::Decimals(1);
            table = table.numbers(&heading, &heading, "", digits, |_| Some(f64::from(column)));
        }
        let text = table.table().text();
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert_eq!(text.matches("row 1").count(), 2);
        assert_eq!(text.matches("column").count(), 20);
    }
}
