//! Time stamps by ISO 8601.

/// Seconds since 1970 of a time stamp such as `2026-11-01T07:30:00.25Z`; `None` for other text. A space may stand for
/// the T, a comma for the point, and an offset such as +01:00 for the Z. Without one it is taken for UTC.
pub fn seconds(text: &str) -> Option<f64> {
    let bytes = text.as_bytes();
    let number = |at: usize, digits: usize| -> Option<i64> {
        let digits = bytes.get(at..at + digits)?;
        digits.iter().try_fold(0, |number, digit| {
            digit.is_ascii_digit().then(|| 10 * number + i64::from(digit - b'0'))
        })
    };
    let is = |at: usize, any: &[u8]| bytes.get(at).is_some_and(|byte| any.contains(byte));
    let (year, month, day) = (number(0, 4)?, number(5, 2)?, number(8, 2)?);
    let (hour, minute) = (number(11, 2)?, number(14, 2)?);
    let is_separated = is(4, b"-/") && bytes[7] == bytes[4] && is(10, b"Tt ") && is(13, b":");
    let (second, mut end) = if is(16, b":") { (number(17, 2)?, 19) } else { (0, 16) };
    let mut fraction = 0.0;
    if end == 19 && is(end, b".,") {
        let digits = bytes[20..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        fraction =
            format!("0.{}", text.get(20..20 + digits).filter(|it| !it.is_empty())?).parse().ok()?;
        end = 20 + digits;
    }
    let offset = match bytes.get(end..)? {
        [] | [b'Z' | b'z'] => 0,
        [sign @ (b'+' | b'-'), rest @ ..] => {
            let minutes = match rest {
                [_, _] => 0,
                [_, _, b':', _, _] => number(end + 4, 2)?,
                [_, _, _, _] => number(end + 3, 2)?,
                _ => return None,
            };
            let minutes = 60 * number(end + 1, 2)? + minutes;
            if *sign == b'+' { minutes } else { -minutes }
        }
        _ => return None,
    };
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + i64::from(is_leap),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    };
    let is_time = (1..=12).contains(&month)
        && (1..=days).contains(&day)
        && hour < 24
        && minute < 60
        && second <= 60
        && offset.abs() < 24 * 60;
    if !is_separated || !is_time {
        return None;
    }
    // Years begin in March, so that a leap day is the last of one (Hinnant, chrono-Compatible Low-Level Date Algorithms).
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    let days = 365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - 719_468;
    let seconds = ((24 * days + hour) * 60 + minute - offset) * 60 + second;
    Some(seconds as f64 + fraction)
}
