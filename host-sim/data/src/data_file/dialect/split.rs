//! Lines of a text, the fields of a line, and quotes around them.

use std::borrow::Cow;
use std::fmt::{self, Display};
use std::str::FromStr;

/// What stands between the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    Char(char),
    /// Any number of spaces and tabs.
    Spaces,
}

impl FromStr for Separator {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut chars = text.chars();
        Ok(match (text, chars.next(), chars.next()) {
            ("comma", ..) => Self::Char(','),
            ("semicolon", ..) => Self::Char(';'),
            ("tab" | "\\t", ..) => Self::Char('\t'),
            ("space" | "spaces" | " ", ..) => Self::Spaces,
            (_, Some(char), None) if !char.is_alphanumeric() && !"\"+-.\r\n".contains(char) => {
                Self::Char(char)
            }
            _ => return Err("give comma, semicolon, tab, space, or one character".into()),
        })
    }
}

impl Display for Separator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Char('\t') => f.write_str("tab"),
            Self::Char(char) => write!(f, "{char}"),
            Self::Spaces => f.write_str("space"),
        }
    }
}

impl Separator {
    pub(super) fn in_words(self) -> String {
        match self {
            Self::Char(',') => "commas".into(),
            Self::Char(';') => "semicolons".into(),
            Self::Char('\t') => "tabs".into(),
            Self::Char(char) => format!("separator {char:?}"),
            Self::Spaces => "spaces".into(),
        }
    }
}

/// Lines of a text, each with its end: LF, CR or both.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let at = memchr::memchr2(b'\n', b'\r', rest.as_bytes()).unwrap_or(rest.len());
        let (line, behind) = rest.split_at(at);
        let end = behind.len().min(if behind.starts_with("\r\n") { 2 } else { 1 });
        let (end, next) = behind.split_at(end);
        let is_over = rest.is_empty();
        rest = next;
        (!is_over).then_some((line, end))
    })
}

/// Fields of a line, without spaces and quotes around; `None` if a quote has no end.
pub(super) fn split(line: &str, separator: Separator) -> Option<Vec<Cow<'_, str>>> {
    let is_end = |c: char| match separator {
        Separator::Char(separator) => c == separator,
        Separator::Spaces => c == ' ' || c == '\t',
    };
    let (mut fields, mut rest) = (vec![], line);
    loop {
        if separator == Separator::Spaces {
            rest = rest.trim();
            if rest.is_empty() {
                return Some(fields);
            }
        }
        let (field, behind) = if let Some(text) = rest.trim_start_matches(' ').strip_prefix('"') {
            let (field, behind) = quoted_field(text)?;
            let behind = behind.trim_start_matches(|c| c == ' ' && !is_end(c));
            if !behind.is_empty() && !behind.starts_with(is_end) {
                return None;
            }
            (field, behind)
        } else {
            let (field, behind) = rest.split_at(rest.find(is_end).unwrap_or(rest.len()));
            (field.trim().into(), behind)
        };
        fields.push(field);
        let Some(separator) = behind.chars().next() else { return Some(fields) };
        rest = &behind[separator.len_utf8()..];
    }
}

/// Text up to the closing quote, and what stands behind it. A doubled quote stands for one.
fn quoted_field(text: &str) -> Option<(Cow<'_, str>, &str)> {
    let mut from = 0;
    loop {
        let end = from + text[from..].find('"')?;
        if !text[end + 1..].starts_with('"') {
            let field = text[..end].trim();
            let field = if from == 0 { field.into() } else { field.replace("\"\"", "\"").into() };
            return Some((field, &text[end + 1..]));
        }
        from = end + 2;
    }
}

/// Appends a field of plain CSV text.
pub(super) fn push_field(plain: &mut String, field: &str) {
    if field.contains([',', '"', '\n', '\r']) {
        plain.push('"');
        plain.push_str(&field.replace('"', "\"\""));
        plain.push('"');
    } else {
        plain.push_str(field);
    }
}
