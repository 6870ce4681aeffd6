//! Sections: a result is declared once, and shown as text, as a page and as JSON.
//!
//! A result is a list of [`Section`]s: facts, tables, figures and notes. A [`Table`] has a column for each quantity, with
//! its heading, its unit and its digits. Text and page are made of the same sections, so that neither can say anything
//! else than the other. A page begins with the lead, and text ends with it, where a terminal shows it. What programs read of a
//! result are its values, by their keys.

use std::fmt::Write as _;

use serde::Serialize;

use super::data::number;
use super::figures::{Figure, Figures, Page, link};
use super::format::{UNDEFINED, decimals, fixed, significant, unbroken, with_unit};
use super::svg::escape;
use taxel_evaluate::metrics::Definition;

/// Characters in a line of text, at most.
const WIDTH: usize = 120;
/// Space between columns of text.
const GAP: &str = "  ";
/// Headings from which a page lists them.
const FEW_HEADINGS: usize = 4;
/// Sizes beyond which a number is written in powers of ten.
const TINY: f64 = 1e-4;
const HUGE: f64 = 1e6;

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
    heading: String,
    /// Whether it names what the line is about, and is not a quantity of it.
    is_name: bool,
    cells: Vec<String>,
}

/// Digits of a quantity.
#[derive(Debug, Clone, Copy)]
pub enum Digits {
    /// So many after the point.
    Decimals(usize),
    /// So many from the first that is not 0.
    Significant(usize),
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
            };
            format!("{} ± {}", fixed(value, decimals), fixed(error, decimals))
        };
        value.map_or(UNDEFINED.into(), text)
    }
}

/// Table of `rows`, whose columns are told by what they take from a row. A column in which nothing is defined is left out.
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
    pub fn names(self, heading: &str, name: impl Fn(&'r R) -> String) -> Self {
        self.column(heading, true, name)
    }

    /// Adds a column of a quantity in a `unit`, as text.
    #[must_use]
    pub fn texts(self, heading: &str, unit: &str, text: impl Fn(&'r R) -> String) -> Self {
        self.column(&with_unit(heading, unit), false, text)
    }

    /// Adds a column of a quantity in a `unit`; `None` where it is not defined.
    #[must_use]
    pub fn numbers(
        self,
        heading: &str,
        unit: &str,
        digits: Digits,
        value: impl Fn(&'r R) -> Option<f64>,
    ) -> Self {
        self.texts(heading, unit, |row| digits.text(value(row)))
    }

    /// Adds a column of a quantity in a `unit` with its standard error.
    #[must_use]
    pub fn estimates(
        self,
        heading: &str,
        unit: &str,
        digits: Digits,
        value: impl Fn(&'r R) -> Option<[f64; 2]>,
    ) -> Self {
        self.texts(heading, unit, |row| digits.with_error(value(row)))
    }

    /// Table as text, without its caption.
    pub fn text(&self) -> String {
        self.table.text()
    }

    /// Section of the table.
    pub fn section(self) -> Section {
        Section::Table(self.table)
    }

    fn column(mut self, heading: &str, is_name: bool, cell: impl Fn(&'r R) -> String) -> Self {
        let cells: Vec<String> = self.rows.iter().map(cell).collect();
        if cells.iter().any(|cell| cell != UNDEFINED) {
            self.table.columns.push(Column { heading: heading.into(), is_name, cells });
        }
        self
    }
}

impl Table {
    /// Lines of text of at most [`WIDTH`] characters: columns that do not fit follow below, behind the names once more.
    fn text(&self) -> String {
        let (names, quantities): (Vec<&Column>, Vec<&Column>) =
            self.columns.iter().partition(|column| column.is_name);
        let of_names: usize = names.iter().map(|column| column.width() + GAP.len()).sum();
        let mut blocks: Vec<Vec<&Column>> = vec![];
        let mut left = 0;
        for column in quantities {
            let width = column.width() + GAP.len();
            if left < width {
                blocks.push(names.clone());
                left = (WIDTH + GAP.len()).saturating_sub(of_names).max(width);
            }
            left -= width;
            blocks.last_mut().expect("pushed before").push(column);
        }
        let of_block = |block: &Vec<&Column>| -> String {
            let heading = |column: &&Column| column.padded(&column.heading);
            let cell = |line: usize| move |column: &&Column| column.padded(&column.cells[line]);
            let joined = |cells: Vec<String>| cells.join(GAP).trim_end().to_owned() + "\n";
            let lines = (0..self.lines).map(|line| joined(block.iter().map(cell(line)).collect()));
            joined(block.iter().map(heading).collect()) + &lines.collect::<String>()
        };
        blocks.iter().map(of_block).collect::<Vec<_>>().join("\n")
    }

    fn html(&self, number: usize) -> String {
        let tag = |column: &Column, tag: &str, text: &str| {
            let text = escape(text);
            let class = if column.is_name { "" } else { " class=\"number\"" };
            format!("<{tag}{class}>{text}</{tag}>")
        };
        let heads = self.columns.iter().map(|column| tag(column, "th", &column.heading));
        let mut html = format!(
            "<figure id=\"table-{number}\" class=\"table\">\n<figcaption><b>Table {number}.</b> {}</figcaption>\n<div class=\"scroll\" \
             tabindex=\"0\" role=\"region\" aria-label=\"Table {number}\">\n<table class=\"wrap\">\n<thead><tr>{}</tr></thead>\n<tbody>\n",
            escape(&self.caption),
            heads.collect::<String>()
        );
        for line in 0..self.lines {
            let cell = |column: &Column| tag(column, "td", &column.cells[line]);
            // Writing to a string cannot fail.
            let _ =
                writeln!(html, "<tr>{}</tr>", self.columns.iter().map(cell).collect::<String>());
        }
        html + "</tbody>\n</table>\n</div>\n</figure>\n"
    }
}

impl Column {
    fn width(&self) -> usize {
        let cells = self.cells.iter().chain([&self.heading]);
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    }

    fn padded(&self, cell: &str) -> String {
        let width = self.width();
        if self.is_name { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
    }
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
        self.sections.push(table.section());
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

    /// Text for a terminal.
    pub fn text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        for section in &self.sections {
            let part = match section {
                // Headings stand above figures alone in many places, which text goes without.
                Section::Heading(_)
                | Section::Figure(_)
                | Section::Folded(..)
                | Section::Listing(_) => continue,
                Section::Facts(facts) => {
                    let fact = |Fact { label, value, unit }: &Fact| {
                        format!("{label}: {value} {unit}").trim_end().to_owned() + "\n"
                    };
                    facts.iter().map(fact).collect()
                }
                Section::Table(table) => {
                    format!("{}\n{}", wrapped(&table.caption), table.text())
                }
                Section::Details(details) => {
                    let line = |(name, text): &(_, String)| wrapped(&format!("{name}: {text}"));
                    details.iter().map(line).collect()
                }
                Section::Note(note) => wrapped(note),
            };
            text += "\n";
            text += &part;
        }
        if !self.lead.is_empty() {
            text += "\n";
            text += &wrapped(&self.lead);
        }
        let warning = |text: &String| wrapped(&format!("warning: {text}"));
        text + &self.warnings.iter().map(warning).collect::<String>()
    }

    /// Page with the files of its figures, and the `command` that made it.
    pub fn page(&self, command: &str) -> Page {
        let mut html = format!("<h1>{}</h1>\n", escape(&self.title));
        if !self.lead.is_empty() {
            let _ = writeln!(html, "<p class=\"verdict\">{}</p>", paragraph(&self.lead));
        }
        if !self.warnings.is_empty() {
            let line = |text: &String| format!("<li>{}</li>\n", paragraph(text));
            let lines: String = self.warnings.iter().map(line).collect();
            let _ = writeln!(html, "<ul class=\"warnings\">\n{lines}</ul>");
        }
        let figures =
            if self.is_alone { Figures::default() } else { Figures::in_files(&self.prefix) };
        let mut numbers = Numbers { figures, tables: 0, headings: vec![] };
        let body: String = self.sections.iter().map(|section| numbers.html(section)).collect();
        let (top, body) = body.split_at(body.find("<h2").unwrap_or(0));
        html += top;
        if numbers.headings.len() >= FEW_HEADINGS {
            let links = numbers.headings.iter().enumerate();
            let links = links.map(|(i, text)| format!("<a href=\"#heading-{}\">{text}</a>", i + 1));
            let links = links.collect::<Vec<_>>().join(" ");
            let _ = writeln!(html, "<nav aria-label=\"Contents\">{links}</nav>");
        }
        let files: Vec<String> = self.files.iter().map(|file| link(file, file)).collect();
        let files =
            if files.is_empty() { String::new() } else { format!(": {}", files.join(", ")) };
        let (command, version) = (escape(command), env!("CARGO_PKG_VERSION"));
        let made = format!(
            "<p class=\"note\">Made by <code>{command}</code> (version {version}){files}</p>\n"
        );
        let title = format!("Taxel: {}", self.title);
        Page { html: document(&title, &(html + body + &made)), figures: numbers.figures.files }
    }
}

/// Page with this title around `body`, which is HTML: no script, no file beside it.
fn document(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n\
         <style>\n{}{}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escape(title),
        include_str!("style.css"),
        include_str!("drawing.css")
    )
}

/// Text as HTML: what stands between backticks is code.
fn paragraph(text: &str) -> String {
    let text = escape(&unbroken(text));
    let part = |(i, part): (usize, &str)| match i % 2 {
        0 => part.to_owned(),
        _ => format!("<code>{part}</code>"),
    };
    text.split('`').enumerate().map(part).collect()
}

/// Numbers of figures and tables, as they come.
struct Numbers {
    figures: Figures,
    tables: usize,
    /// Headings as HTML.
    headings: Vec<String>,
}

impl Numbers {
    fn html(&mut self, section: &Section) -> String {
        match section {
            Section::Heading(text) => {
                self.headings.push(escape(text));
                format!("<h2 id=\"heading-{}\">{}</h2>\n", self.headings.len(), escape(text))
            }
            Section::Facts(facts) => {
                let fact = |Fact { label, value, unit }: &Fact| {
                    let [label, value, unit] = [label, value, unit].map(|it| escape(it));
                    format!(
                        "<div><dt>{label}</dt><dd>{value}\u{a0}<span>{unit}</span></dd></div>\n"
                    )
                };
                format!("<dl>\n{}</dl>\n", facts.iter().map(fact).collect::<String>())
            }
            Section::Table(table) => {
                self.tables += 1;
                table.html(self.tables)
            }
            Section::Figure(figure) => self.figures.html(figure),
            Section::Details(details) => {
                let line = |(name, text): &(_, String)| {
                    format!("<div><dt>{name}</dt><dd>{}</dd></div>\n", paragraph(text))
                };
                let lines: String = details.iter().map(line).collect();
                format!("<dl class=\"facts\">\n{lines}</dl>\n")
            }
            Section::Note(note) => format!("<p class=\"note\">{}</p>\n", paragraph(note)),
            Section::Folded(summary, sections) => {
                let inner: String = sections.iter().map(|section| self.html(section)).collect();
                let summary = escape(summary);
                format!("<details>\n<summary>{summary}</summary>\n{inner}</details>\n")
            }
            Section::Listing(text) => format!("<pre>{}</pre>\n", escape(text)),
        }
    }
}

/// Text in lines of at most [`WIDTH`] characters.
fn wrapped(text: &str) -> String {
    let (mut lines, mut line) = (String::new(), String::new());
    for word in text.split(' ') {
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.extend([&line, "\n"]);
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line += word;
    }
    lines + &line + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_page_have_the_same_cells() {
        let rows = [("dz", Some([0.0371, 0.0002]), 0.998), ("d<x", None, -0.5)];
        let table = TableOf::new(&rows, "Errors <of> two outputs.")
            .names("output", |row| row.0.into())
            .estimates("RMSE", "mm", Digits::Decimals(4), |row| row.1)
            .numbers("R²", "", Digits::Significant(2), |row| Some(row.2));
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
    fn columns_that_do_not_fit_stand_below_behind_the_names() {
        let mut table = TableOf::new(&["row 1"], "Many.").names("wire", |row| (*row).into());
        for column in 0..20 {
            let heading = format!("column {column}");
            table = table.numbers(&heading, "", Digits::Decimals(1), |_| Some(f64::from(column)));
        }
        let text = table.table.text();
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert_eq!(text.matches("row 1").count(), 2);
        assert_eq!(text.matches("column").count(), 20);
    }
}
