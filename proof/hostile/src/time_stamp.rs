//! Time stamps by ISO 8601: any text in a file of one field.

use std::path::Path;

use taxel_data::data_file::{DataFile, Reading, Separator, Stated};

/// Bytes of a time stamp, or of a plain number of seconds.
pub fn check(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    if text.contains(['"', '\n', '\r', '\0']) {
        return false;
    }
    let seconds = |text: &str| {
        let text = format!("t,x\n\"{text}\",1\n");
        // A comma is one of the fraction of a second.
        let stated = Stated {
            separator: Some(Separator::Char(',')),
            decimal_comma: Some(false),
            ..Stated::default()
        };
        let reading = Reading { stated, ..Reading::default() };
        let file = DataFile::parse(Path::new("f.csv"), text.as_bytes(), &reading).ok()?;
        file.column("t").ok().map(|column| file.value(0, column)).filter(|time| !time.is_nan())
    };
    let Some(time) = seconds(text) else { return false };
    if text.trim().parse::<f64>().is_ok() {
        return false; // a number
    }
    // Years 0 to 9999, and an offset of a day.
    assert!((-62_167_305_600.0..=253_402_387_200.0).contains(&time), "{text:?} is {time}");
    if let Some(local) = text.trim().strip_suffix(['Z', 'z']) {
        assert_eq!(seconds(local), Some(time), "{text:?} is UTC");
        assert_eq!(seconds(&format!("{local}+01:00")), Some(time - 3600.0), "{text:?}");
    }
    true
}
