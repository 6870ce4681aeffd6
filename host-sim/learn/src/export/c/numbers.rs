//! Numbers and texts as C writes them.

use std::fmt::Write as _;

/// Numbers on a line.
const ON_A_LINE: usize = 8;

/// An f32 in hexadecimal, which holds all its bits; it must be finite.
pub fn float(value: f32) -> String {
    const DIGITS: u32 = 23;
    let bits = value.to_bits();
    let exponent = (bits >> DIGITS & 0xff).cast_signed();
    let fraction = bits & ((1 << DIGITS) - 1);
    let sign = if value.is_sign_negative() { "-" } else { "" };
    if exponent == 0 && fraction == 0 {
        return format!("{sign}0x0p+0f");
    }
    // Six digits hold 24 bits, of which the last is 0.
    let digits = format!("{:06x}", fraction << 1);
    let digits = digits.trim_end_matches('0');
    let point = if digits.is_empty() { "" } else { "." };
    let (whole, exponent) = if exponent == 0 { (0, -126) } else { (1, exponent - 127) };
    format!("{sign}0x{whole}{point}{digits}p{exponent:+}f")
}

/// Lines of numbers.
fn lines(numbers: &[String]) -> String {
    let lines = numbers.chunks(ON_A_LINE).map(|line| format!("    {},\n", line.join(", ")));
    lines.collect::<Vec<_>>().concat()
}

/// Definition of an array of numbers of the type `kind`.
pub fn array(kind: &str, name: &str, numbers: impl IntoIterator<Item = String>) -> String {
    let numbers: Vec<String> = numbers.into_iter().collect();
    format!("static const {kind} {name}[{}] = {{\n{}}};\n", numbers.len(), lines(&numbers))
}

/// Definition of an array of floats.
pub fn floats(name: &str, values: &[f32]) -> String {
    array("float", name, values.iter().map(|value| float(*value)))
}

/// Definition of an array of words.
pub fn words(name: &str, values: &[u32]) -> String {
    array("uint32_t", name, values.iter().map(|value| word(*value)))
}

/// Definition of a table of numbers of the type `kind`, whose rows all have the length of the first one.
pub fn table(kind: &str, name: &str, rows: &[Vec<String>]) -> String {
    let length = rows.first().map_or(0, Vec::len);
    let rows: Vec<String> =
        rows.iter().map(|row| format!("    {{\n{}    }},\n", lines(row))).collect();
    format!("static const {kind} {name}[{}][{length}] = {{\n{}}};\n", rows.len(), rows.concat())
}

/// A word in hexadecimal.
pub fn word(value: u32) -> String {
    format!("0x{value:08x}u")
}

/// A text as a string literal. What is not ASCII, and a `?` of which three make a trigraph, are written by number.
pub fn string(text: &str) -> String {
    let plain = |byte: u8| (b' '..=b'~').contains(&byte) && !b"\"\\?".contains(&byte);
    let mut literal = String::from("\"");
    for byte in text.bytes() {
        if plain(byte) {
            literal.push(byte.into());
        } else {
            let _ = write!(literal, "\\{byte:03o}");
        }
    }
    literal + "\""
}

/// A text for a comment, on one line: what could end the comment, or disturb its lines, becomes `_`.
pub fn comment(text: &str) -> String {
    let harmless = |c: char| c.is_alphanumeric() || " -+.,:;()[]<>=%°²³µ·_".contains(c);
    text.chars().map(|c| if harmless(c) { c } else { '_' }).collect()
}
