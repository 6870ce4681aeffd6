//! Texts and numbers of files as messages repeat them: no longer than people read.

use std::borrow::Cow;

/// Most characters of a file's text that a message repeats.
const MOST_CHARS: usize = 60;

/// Text of a file as a message repeats it: what is long is cut.
pub fn cut(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(MOST_CHARS) {
        Some((end, _)) => format!("{} … ({} bytes)", &text[..end], text.len()).into(),
        None => text.into(),
    }
}

/// Text of a file as a message repeats it: in quotes, and cut if it is long.
pub fn quoted(text: &str) -> String {
    match text.char_indices().nth(MOST_CHARS) {
        Some((end, _)) => format!("{:?} … ({} bytes)", &text[..end], text.len()),
        None => format!("{text:?}"),
    }
}

/// Text for a terminal: control characters other than the ends of lines are escaped, since names of files and devices
/// may hold any.
pub fn printable(text: &str) -> Cow<'_, str> {
    let is_control = |c: char| c.is_control() && c != '\n';
    if !text.contains(is_control) {
        return text.into();
    }
    text.chars()
        .fold(String::new(), |mut printable, c| {
            if is_control(c) {
                printable.extend(c.escape_default());
            } else {
                printable.push(c);
            }
            printable
        })
        .into()
}

/// Number of a file as a message repeats it: one of many digits with a power of ten.
pub fn number(value: f64) -> String {
    short(value.to_string())
}

/// Value as text; a number of many digits as one with a power of ten, and other text cut if it is long.
pub(super) fn short(value: String) -> String {
    /// Length from which a number is hard to read.
    const LONG: usize = 24;
    match value.parse::<f64>() {
        Ok(number) if value.len() > LONG => format!("{number:e}"),
        Ok(_) => value,
        Err(_) => cut(&value).into_owned(),
    }
}

/// Number of bytes in the unit that people use for it.
pub fn in_words(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{} kB", bytes / 1_000),
        1_000_000..1_000_000_000 => format!("{} MB", bytes / 1_000_000),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}
