//! Page of a result.

use std::fmt::Write as _;

use super::{Card, Fact, Section, Sections};
use crate::report::figures::{Figures, Page, link};
use crate::report::format::unbroken;
use crate::report::svg::escape;

/// Headings from which a page lists them.
const FEW_HEADINGS: usize = 4;

impl Sections {
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
        include_str!("../style.css"),
        include_str!("../drawing.css")
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

fn facts_html(facts: &[Fact]) -> String {
    let fact = |Fact { label, value, unit }: &Fact| {
        let [label, value, unit] = [label, value, unit].map(|it| escape(it));
        format!("<div><dt>{label}</dt><dd>{value}\u{a0}<span>{unit}</span></dd></div>\n")
    };
    format!("<dl>\n{}</dl>\n", facts.iter().map(fact).collect::<String>())
}

fn card(card: &Card) -> String {
    let [title, name] = [&card.title, &card.name].map(|text| escape(&unbroken(text)));
    // A line may end between words alone, and not at the dashes of an option.
    let words = card.command.split(' ').map(|word| format!("<span>{}</span>", escape(word)));
    let words = words.collect::<Vec<_>>().join(" ");
    let command = if card.command.is_empty() { words } else { format!("<pre>{words}</pre>\n") };
    let facts = facts_html(&card.facts);
    format!("<section>\n<h3>{title}</h3>\n<p>{name}</p>\n{facts}{command}</section>\n")
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
            Section::Facts(facts) => facts_html(facts),
            Section::Cards(cards) => {
                let class = if cards.len() % 3 == 0 { "cards" } else { "cards pairs" };
                let cards: String = cards.iter().map(card).collect();
                format!("<div class=\"{class}\">\n{cards}</div>\n")
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
