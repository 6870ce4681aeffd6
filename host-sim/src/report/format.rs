//! Numbers and names as people read them.

use taxel_data::columns::without_unit;
use taxel_simulate::noise::NoiseKind;

/// Text for a value that is not defined.
pub const UNDEFINED: &str = "–";

/// Text of `value` with so many decimals and a true minus sign.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return UNDEFINED.into();
    }
    let text = format!("{:.decimals$}", value.abs());
    let zero = text.chars().all(|c| matches!(c, '0' | '.'));
    if value < 0.0 && !zero { format!("\u{2212}{text}") } else { text }
}

/// Number of decimals that gives `value` so many significant digits.
pub fn decimals(value: f64, digits: usize) -> usize {
    let magnitude = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    // A value that is not finite has no decimals: casts saturate, and NaN becomes 0.
    (digits as f64 - 1.0 - magnitude).clamp(0.0, 9.0) as usize
}

/// Text of `value` with so many significant digits.
pub fn significant(value: f64, digits: usize) -> String {
    fixed(value, decimals(value, digits))
}

/// Text of `value` with two significant digits, without zeros at its end: `0.5`, `1.5`, `200`.
pub fn short(value: f64) -> String {
    let text = significant(value, 2);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// Text of `count` in groups of three digits.
pub fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// Number of things, and their noun: `1 point`, `1 200 points`.
pub fn counted(count: usize, noun: &str) -> String {
    format!("{} {noun}{}", grouped(count), if count == 1 { "" } else { "s" })
}

/// Text of a fraction in per cent, without needless digits.
pub fn percent(fraction: f64) -> String {
    if !fraction.is_finite() {
        return UNDEFINED.into();
    }
    // Rounding first, since 0.07 · 100 is not 7.
    format!("{}\u{a0}%", (fraction * 1e8).round() / 1e6)
}

/// Level of noise with its unit.
pub fn noise(kind: NoiseKind, level: f64) -> String {
    kind.in_words(level).replace(' ', "\u{a0}")
}

/// Symbol of a group of outputs, without its unit: Δz for `dz_mm`, and words for a column's name.
pub fn symbol(group: &str) -> String {
    match axis(group) {
        Some(axis) if group.starts_with('d') => format!("Δ{axis}"),
        Some(axis) => format!("F{axis}"),
        None => without_unit(group).replace('_', " "),
    }
}

/// Text in which `groups` of outputs have their symbols.
pub fn named<'g>(text: &str, groups: impl Iterator<Item = &'g str>) -> String {
    groups.fold(text.to_owned(), |text, group| text.replace(group, &symbol(group)))
}

/// Text in which no number is parted from its unit at the end of a line.
pub fn unbroken(text: &str) -> String {
    const UNITS: [&str; 20] = [
        "%", "mm", "mm/s", "µs", "ms", "s", "min", "h", "Hz", "MHz", "N", "Ω", "B", "kB", "bytes",
        "cycles", "€", "cm²", "frames/s", "×",
    ];
    let mut whole = String::with_capacity(text.len());
    for (i, word) in text.split(' ').enumerate() {
        let unit = word.trim_end_matches(['.', ',', ';', ':', ')', '”', '!']);
        let after_number = whole.ends_with(|last: char| last.is_ascii_digit());
        if i > 0 {
            whole.push(if after_number && UNITS.contains(&unit) { '\u{a0}' } else { ' ' });
        }
        whole += word;
    }
    whole
}

/// Text `symbol (unit)`, for axes and headers.
pub fn with_unit(symbol: &str, unit: &str) -> String {
    if unit.is_empty() { symbol.into() } else { format!("{symbol} ({unit})") }
}

/// Axis x, y or z of the project's own groups (`dz_mm`, `fz_n`).
pub fn axis(group: &str) -> Option<char> {
    let component = group.strip_suffix("_mm").and_then(|g| g.strip_prefix('d'));
    let component = component.or(group.strip_suffix("_n").and_then(|g| g.strip_prefix('f')));
    match component {
        Some("x") => Some('x'),
        Some("y") => Some('y'),
        Some("z") => Some('z'),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(fixed(-1.25, 1), "\u{2212}1.2");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(f64::NAN, 2), "–");
        assert_eq!(significant(0.048_12, 3), "0.0481");
        assert_eq!(significant(12.34, 3), "12.3");
        assert_eq!(significant(1234.6, 3), "1235");
        assert_eq!(significant(0.0, 3), "0.00");
        assert_eq!(significant(f64::INFINITY, 3), "–");
        assert_eq!([0.05, 0.15, 1.0, 1.5, 200.0].map(short), ["0.05", "0.15", "1", "1.5", "200"]);
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(percent(0.07), "7\u{a0}%");
        assert_eq!(percent(0.005), "0.5\u{a0}%");
    }

    #[test]
    fn a_number_is_not_parted_from_its_unit() {
        let text = "0.05 mm (at 180 MHz), 3 % of 20 frames a second; K 16 ms.";
        let whole = "0.05_mm (at 180_MHz), 3_% of 20 frames a second; K 16_ms.";
        assert_eq!(unbroken(text), whole.replace('_', "\u{a0}"));
    }

    #[test]
    fn groups_are_written_by_their_symbols() {
        let names = ["dz_mm", "fx_n", "contact_depth_mm", "x_mm", "ch1", "b", "f_z (N)"];
        let symbols = ["Δz", "Fx", "contact depth", "x", "ch1", "b", "f z"];
        assert_eq!(names.map(symbol), symbols);
    }
}
