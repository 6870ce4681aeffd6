//! The file of accepted times, which each step of CI takes on the reference machine.

use std::time::Duration;

use crate::process::Outcome;

/// Multiple of its accepted time that a step may take without a warning.
const SLOW: f64 = 2.0;

/// Steps and their accepted times.
#[derive(Debug, PartialEq, Eq)]
pub struct Times<'a>(Vec<(&'a str, Duration)>);

impl<'a> Times<'a> {
    /// Parses lines of `name seconds`, one for each step; `#` starts a comment.
    ///
    /// # Errors
    /// The number of a line that cannot be parsed.
    pub fn parse(text: &'a str) -> Outcome<Self> {
        let mut times = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let said = line.split('#').next().unwrap_or_default();
            let words: Vec<_> = said.split_whitespace().collect();
            let time = match words[..] {
                [] => continue,
                [name, seconds] => {
                    seconds.parse().ok().filter(|seconds| *seconds > 0).zip(Some(name))
                }
                _ => None,
            };
            let (seconds, name) =
                time.ok_or(format!("line {number} is not `name seconds`: {said}"))?;
            times.push((name, Duration::from_secs(seconds)));
        }
        Ok(Self(times))
    }

    /// Names of the steps, in the file's order.
    #[cfg(test)]
    pub fn names(&self) -> Vec<&'a str> {
        self.0.iter().map(|(name, _)| *name).collect()
    }

    /// `time` of the step beside the accepted one, as columns of a table: seconds, accepted seconds, ratio.
    pub fn beside(&self, name: &str, time: Duration) -> String {
        let seconds = time.as_secs_f64();
        match self.ratio(name, time) {
            Some(ratio) => {
                let accepted = seconds / ratio;
                format!("{seconds:6.0} s of {accepted:5.0} s accepted, {ratio:4.1} times that")
            }
            None => format!("{seconds:6.0} s, none accepted"),
        }
    }

    /// Warning about a step that takes much longer than accepted.
    pub fn warning(&self, name: &str, time: Duration) -> Option<String> {
        let ratio = self.ratio(name, time).filter(|ratio| *ratio > SLOW)?;
        Some(format!("{name} took {ratio:.1} times its accepted time"))
    }

    fn ratio(&self, name: &str, time: Duration) -> Option<f64> {
        let (_, accepted) = self.0.iter().find(|(step, _)| *step == name)?;
        Some(time.as_secs_f64() / accepted.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_empty_lines_count_for_nothing() {
        let times = Times::parse("# seconds\n\nformat 1\ntests  300 # cold\n").unwrap();
        assert_eq!(times.names(), ["format", "tests"]);
    }

    #[test]
    fn a_line_that_says_something_else_is_refused_by_number() {
        for line in ["tests", "tests soon", "tests 0", "tests -1", "tests 1 s"] {
            let text = format!("# seconds\n{line}\n");
            assert_eq!(Times::parse(&text), Err(format!("line 2 is not `name seconds`: {line}")));
        }
    }

    #[test]
    fn a_step_stands_beside_its_accepted_time() {
        let times = Times::parse("tests 20\n").unwrap();
        let beside = |name, seconds| times.beside(name, Duration::from_secs(seconds));
        assert_eq!(beside("tests", 30), "    30 s of    20 s accepted,  1.5 times that");
        assert_eq!(beside("other", 30), "    30 s, none accepted");
    }

    #[test]
    fn a_step_is_pointed_out_beyond_twice_its_time_and_not_before() {
        let times = Times::parse("tests 20\n").unwrap();
        let warning = |name, seconds| times.warning(name, Duration::from_secs(seconds));
        assert_eq!(warning("tests", 40), None);
        assert_eq!(warning("other", 4000), None);
        assert_eq!(warning("tests", 50), Some("tests took 2.5 times its accepted time".into()));
    }
}
