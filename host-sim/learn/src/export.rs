//! Models as source code, for a program that never changes its model.

mod text;

pub mod c;
pub mod rust;
