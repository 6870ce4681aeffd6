//! Integration tests in one program, which is linked once; `hostile` counts the memory of a program of its own.

mod common;

mod foreign;
mod round_trip;
