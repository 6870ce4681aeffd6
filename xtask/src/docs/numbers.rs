//! Numbers in the docs: where they stand in a sentence, and whether they are those that a command gives.

use std::ops::Range;

use regex::Regex;
use serde_json::Value;

use crate::process::Outcome;

/// A number as pages write it: thousands may be apart by a comma or a space.
const NUMBER: &str = r"([−+-]?(?:\d{1,3}(?:[ ,\u{202f}\u{a0}]\d{3})+|\d+)(?:\.\d+)?)";

/// Numbers of a sentence in a page, each with its place in the text. `{}` stands for each number; lines may be broken
/// anywhere.
pub fn find<'t>(text: &'t str, says: &str) -> Outcome<Vec<(&'t str, Range<usize>)>> {
    let words = |part: &str| {
        let words = part.split_whitespace().map(regex::escape);
        let ends = |at: Option<char>| at.is_some_and(char::is_whitespace);
        let joined = words.collect::<Vec<_>>().join(r"\s+");
        let [before, after] = [part.chars().next(), part.chars().next_back()].map(ends);
        match (joined.is_empty(), before, after) {
            (true, true, _) => r"\s+".to_owned(),
            (_, before, after) => {
                let space = |is: bool| if is { r"\s+" } else { "" };
                format!("{}{joined}{}", space(before), space(after))
            }
        }
    };
    let pattern = says.trim().split("{}").map(words).collect::<Vec<_>>().join(NUMBER);
    let pattern = Regex::new(&pattern).map_err(|cause| cause.to_string())?;
    let mut all = pattern.captures_iter(text);
    let (Some(found), None) = (all.next(), all.next()) else {
        return Err(format!("the page does not say it, or more than once: {says}"));
    };
    Ok(found.iter().skip(1).flatten().map(|group| (group.as_str(), group.range())).collect())
}

/// Values that a command gave: at a pointer in its JSON, whose `*` is every element of a list, or the groups of a pattern
/// in all that it printed.
pub fn values(said: &str, json: Option<&Value>, way: &str) -> Outcome<Vec<f64>> {
    let missing = || format!("the command's result has no {way}");
    let texts: Vec<String> = if way.starts_with('/') {
        let json = json.ok_or("the command prints no JSON")?;
        let (list, rest) = way.split_once("/*").unwrap_or((way, ""));
        let found = json.pointer(list).ok_or_else(missing)?;
        let found = if list == way {
            std::slice::from_ref(found)
        } else {
            found.as_array().ok_or_else(missing)?
        };
        let of_each = found.iter().map(|each| each.pointer(rest).map(Value::to_string));
        of_each.collect::<Option<_>>().ok_or_else(missing)?
    } else {
        let pattern = Regex::new(way).map_err(|cause| cause.to_string())?;
        let found = pattern.captures(said).ok_or_else(missing)?;
        found.iter().skip(1).flatten().map(|group| group.as_str().to_owned()).collect()
    };
    let number = |text: &String| parsed(text).ok_or_else(|| format!("{way}: {text} is no number"));
    texts.iter().map(number).collect()
}

/// The value, written like `shown`: with as many decimals and its kind of space and sign.
pub fn like(shown: &str, value: f64) -> String {
    let decimals = shown.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let plain = format!("{:.decimals$}", value.abs());
    let (whole, rest) = plain.split_once('.').unwrap_or((&plain, ""));
    let space = shown.chars().find(|letter| *letter == ',' || letter.is_whitespace());
    let mut grouped = String::new();
    for (place, digit) in whole.chars().enumerate() {
        if let Some(space) = space.filter(|_| place > 0 && (whole.len() - place).is_multiple_of(3))
        {
            grouped.push(space);
        }
        grouped.push(digit);
    }
    if !rest.is_empty() {
        grouped = format!("{grouped}.{rest}");
    }
    let is_zero = plain.bytes().all(|byte| matches!(byte, b'0' | b'.'));
    let sign = match shown.chars().next() {
        _ if is_zero => "",
        Some('+') if value > 0.0 => "+",
        Some('-') if value < 0.0 => "-",
        _ if value < 0.0 => "−",
        _ => "",
    };
    format!("{sign}{grouped}")
}

fn parsed(text: &str) -> Option<f64> {
    let plain: String =
        text.chars().filter(|letter| *letter != ',' && !letter.is_whitespace()).collect();
    plain.trim_matches('"').replace('−', "-").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_across_lines_and_written_as_they_were() {
        let text = "It takes 36 422 cycles\n  and errs by −0.047 mm.\n| a | 1.20 |";
        let found = find(text, "takes {} cycles and errs by {} mm").unwrap();
        let numbers: Vec<&str> = found.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, ["36 422", "−0.047"]);
        assert_eq!(find(text, "| a | {} |").unwrap()[0].0, "1.20");
        assert!(find(text, "takes {} s").is_err());
        assert!(find("1 mm, 2 mm", "{} mm").is_err(), "it says so twice");
        assert_eq!(like("36 422", 1_234_567.4), "1 234 567");
        let found = find("K is 16, 64 and 14,582", "K is {}, {} and {}").unwrap();
        assert_eq!(found.iter().map(|(it, _)| *it).collect::<Vec<_>>(), ["16", "64", "14,582"]);
        assert_eq!(like("14,582", 15_000.0), "15,000");
        assert_eq!(like("−0.047", -0.0466), "−0.047");
        assert_eq!(like("1.20", 1.2), "1.20");
        assert_eq!(like("0.05", -0.001), "0.00");
    }

    #[test]
    fn values_come_from_json_or_from_what_is_printed() {
        let json: Value = serde_json::from_str(r#"{"a": [{"rmse": 0.25}, {"rmse": 3}]}"#).unwrap();
        assert_eq!(values("", Some(&json), "/a/0/rmse"), Ok(vec![0.25]));
        assert_eq!(values("", Some(&json), "/a/*/rmse"), Ok(vec![0.25, 3.0]));
        assert_eq!(
            values("z: 1 234 mm, 5 %", None, r"z: ([\d ]+) mm, (\d)"),
            Ok(vec![1234.0, 5.0])
        );
        assert!(values("", Some(&json), "/b").is_err() && values("", None, "/b").is_err());
    }
}
