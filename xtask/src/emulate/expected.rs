//! Comparing a log with the expected one.

use crate::process::Outcome;

/// Compares the log `found` with the `expected` one. A number behind "about" depends on the compiler, and may differ.
pub fn compare(expected: &str, found: &str) -> Outcome {
    let (expected, found) = (without_estimates(expected), without_estimates(found));
    if expected == found {
        return Ok(());
    }
    let (expected, found) = (lines(&expected), lines(&found));
    let shorter = expected.len().min(found.len());
    let alike = |(a, b): &(&&str, &&str)| a == b;
    let before = expected.iter().zip(&found).take_while(alike).count();
    let after = expected.iter().rev().zip(found.iter().rev()).take_while(alike).count();
    let after = after.min(shorter - before);

    let mut difference = vec![format!("from line {} on, - expected, + found", before + 1)];
    for (lines, sign) in [(&expected, '-'), (&found, '+')] {
        let only = &lines[before..lines.len() - after];
        difference.extend(only.iter().map(|line| format!("        {sign} {line}")));
    }
    Err(difference.join("\n"))
}

/// The `text` without the words behind each "about".
fn without_estimates(text: &str) -> String {
    let mut parts = text.split("about ");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| {
        text + "about … " + part.split_once(' ').map_or("", |(_, rest)| rest)
    })
}

/// Splits `text` into lines so that a missing newline at the end is a difference.
fn lines(text: &str) -> Vec<&str> {
    text.split('\n').collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_shown_without_what_is_alike_around_it() {
        let difference = compare("a\nb\nc\nd\n", "a\nx\ny\nc\nd\n").unwrap_err();
        assert_eq!(
            difference,
            "from line 2 on, - expected, + found\n        - b\n        + x\n        + y"
        );
    }

    #[test]
    fn a_number_behind_about_may_differ_and_no_other() {
        assert!(compare("a: about 27 or 3\n", "a: about 28 or 3\n").is_ok());
        assert!(compare("a: about 27 or 3\n", "a: about 27 or 4\n").is_err());
    }

    #[test]
    fn extra_lines_missing_lines_and_line_ends_are_shown_once() {
        assert!(compare("a\n", "a").is_err() && compare("a\n", "a\n").is_ok());
        let difference = compare("a\na\n", "a\n").unwrap_err();
        assert_eq!(difference, "from line 2 on, - expected, + found\n        - a");
        let difference = compare("a\n", "a\na\n").unwrap_err();
        assert_eq!(difference, "from line 2 on, - expected, + found\n        + a");
    }
}
