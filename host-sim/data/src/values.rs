//! Numbers of a table.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// Numbers that copies of a table share, until one of the copies is changed.
#[derive(Clone, Default)]
pub struct Values(Arc<Vec<f64>>);

impl Values {
    /// The numbers, which are copied only if another table shares them.
    pub fn into_vec(self) -> Vec<f64> {
        Arc::unwrap_or_clone(self.0)
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Self(Arc::new(values))
    }
}

impl From<&[f64]> for Values {
    fn from(values: &[f64]) -> Self {
        values.to_vec().into()
    }
}

impl FromIterator<f64> for Values {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        Vec::from_iter(values).into()
    }
}

impl Deref for Values {
    type Target = Vec<f64>;

    fn deref(&self) -> &Vec<f64> {
        &self.0
    }
}

impl DerefMut for Values {
    fn deref_mut(&mut self) -> &mut Vec<f64> {
        Arc::make_mut(&mut self.0)
    }
}

impl<T: ?Sized> PartialEq<T> for Values
where
    Vec<f64>: PartialEq<T>,
{
    fn eq(&self, other: &T) -> bool {
        *self.0 == *other
    }
}

impl PartialEq for Values {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl fmt::Debug for Values {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
