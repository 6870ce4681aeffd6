//! Numbers at the extremes: formats, training and least squares. `TAXEL_CASES` asks for more cases.

mod formats;
mod training;
mod scale;
mod least_squares;
mod recursion;
