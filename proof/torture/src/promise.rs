//! A promise, and its line in the table.

use std::time::Duration;

use crate::effort::Effort;
use crate::found::Found;
use crate::tools::Tools;

/// A promise, and how it is tested.
#[derive(Debug)]
pub struct Promise {
    /// Name in the table and on the command line.
    pub name: &'static str,
    pub text: &'static str,
    /// Share of the time for tests of more than the least number of cases. 0 for a test that is always whole.
    pub share: u16,
    /// Tests the promise.
    pub check: fn(&Effort, &Tools) -> Result<Found, String>,
}

/// A line of the table.
#[derive(Debug)]
pub struct Tested {
    pub promise: &'static Promise,
    pub outcome: Result<Found, String>,
    pub time: Duration,
}

impl Tested {
    /// Whether the promise was kept.
    pub fn is_kept(&self) -> bool {
        self.outcome.as_ref().is_ok_and(Found::keeps)
    }
}
