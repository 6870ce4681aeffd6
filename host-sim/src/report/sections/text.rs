//! Text of a result, for a terminal.

use super::{Card, Fact, Section, Sections, WIDTH};

impl Sections {
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
                Section::Cards(cards) => cards.iter().map(card).collect::<Vec<_>>().join("\n"),
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
}

/// An answer in three lines.
fn card(card: &Card) -> String {
    let fact = |Fact { label, value, unit }: &Fact| {
        format!("{label} {value} {unit}").trim_end().to_owned()
    };
    let facts = card.facts.iter().map(fact).collect::<Vec<_>>().join(", ");
    let command = match card.command.as_str() {
        "" => String::new(),
        command => format!("    {}\n", continued(command)),
    };
    wrapped(&format!("{}: {}", card.title, card.name)) + &wrapped(&facts) + &command
}

/// Command in lines of at most [`WIDTH`] characters, which a shell joins again: options begin them.
fn continued(command: &str) -> String {
    const START: &str = "        --";
    let mut lines = vec![];
    for part in command.split(" --") {
        match lines.last_mut() {
            None => lines.push(part.to_owned()),
            Some(line) if line.chars().count() + part.chars().count() + START.len() > WIDTH => {
                lines.push(format!("{START}{part}"));
            }
            Some(line) => line.extend([" --", part]),
        }
    }
    lines.join(" \\\n")
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
