//! Texts of files as messages repeat them.

use std::borrow::Cow;

use taxel_data::BadValue;
use taxel_data::columns::some_names;
use taxel_data::error::{Problem, cut, printable, quoted};

#[test]
fn control_characters_are_escaped_and_other_text_stays() {
    assert_eq!(printable("a\u{1b}[2J\u{9b}b\r.csv\nµ"), "a\\u{1b}[2J\\u{9b}b\\r.csv\nµ");
    assert!(matches!(printable("x.csv → é\n"), Cow::Borrowed(_)));
}

#[test]
fn no_message_repeats_a_long_text_of_a_file() {
    let long = "ä".repeat(3_000_000);
    assert_eq!(quoted("ch1\u{1b}"), "\"ch1\\u{1b}\"");
    assert_eq!(cut("ch1"), "ch1");
    let (column, line) = (long.clone(), 2);
    for problem in [
        Problem::UnusableName { column: 1, name: long.clone() },
        Problem::RepeatedName { name: long.clone() },
        Problem::NotANumber { line, column: column.clone(), field: long.clone() },
        Problem::Infinite { line, column: column.clone() },
        Problem::MissingColumn { name: long.clone(), known: some_names(&vec![long.clone(); 9]) },
        Problem::InputAndOutput { name: long.clone() },
        Problem::TooLarge { line, column, value: 1e300, bound: 1e30 },
    ] {
        let message = problem.to_string();
        assert!(message.len() < 1600, "{} bytes: {}", message.len(), cut(&message));
    }
    assert!(BadValue::new("name", &long, "give less").to_string().len() < 200);
}
