//! Studies: answers to one question each, with their figures.

pub mod recursion;
