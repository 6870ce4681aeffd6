//! `taxel`: from a scene or a CSV file to a trained, checked weight blob.

use std::process::ExitCode;

fn main() -> ExitCode {
    // glibc returns large blocks to the system one by one, until it has seen such a block freed: refinement would spend a
    // twentieth of its time on new pages.
    drop(std::hint::black_box(Vec::<u8>::with_capacity(31 << 20)));
    host_sim::program::main_from(std::env::args_os()).into()
}
