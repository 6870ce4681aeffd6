//! Named pieces of code, each with the number of times that it is executed.

use std::borrow::Cow;
use std::collections::BTreeMap;

/// Name of a piece of code.
pub type Name = Cow<'static, str>;

/// How often each piece of code is executed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pieces(BTreeMap<Name, u64>);

impl Pieces {
    /// Adds so many executions of the piece `name`.
    pub(super) fn add(&mut self, name: impl Into<Name>, times: usize) {
        if times > 0 {
            *self.0.entry(name.into()).or_default() += times as u64;
        }
    }

    /// Names, and how often each is executed: at least once.
    pub fn iter(&self) -> impl Iterator<Item = (&str, u64)> {
        self.0.iter().map(|(name, times)| (name.as_ref(), *times))
    }
}
