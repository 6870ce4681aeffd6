//! Every test in one program: it is linked once.

mod text;
mod elementary;
mod random;
mod digest;
mod input;
mod output;
mod columns;
mod mat;
mod time;
mod dialect;
mod csv;
mod csv_file;
mod table;
mod dataset;
mod clock;
mod rest;
