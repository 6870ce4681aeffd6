//! Decodes logs that programs for a device wrote through defmt.

use std::fs;
use std::io::{Read, Write, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use defmt_decoder::{DecodeError, Table};

/// Print the log that comes on stdin, as a program for a device wrote it: `LEVEL message`, one entry after the other.
#[derive(Parser)]
struct Arguments {
    /// The program that wrote it.
    elf: PathBuf,
}

fn main() -> ExitCode {
    match print(&Arguments::parse().elf) {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("{cause}");
            ExitCode::FAILURE
        }
    }
}

fn print(elf: &Path) -> Result<(), String> {
    let mut logged = Vec::new();
    stdin().read_to_end(&mut logged).map_err(|cause| format!("stdin: {cause}"))?;
    let text = decode(&table(elf)?, &logged);
    stdout().write_all(text.as_bytes()).map_err(|cause| format!("stdout: {cause}"))
}

/// Table that decodes the logs of the program in `elf`.
fn table(elf: &Path) -> Result<Table, String> {
    let program = fs::read(elf).map_err(|cause| format!("{}: {cause}", elf.display()))?;
    Table::parse(&program)
        .map_err(|cause| format!("{}: {cause:#}", elf.display()))?
        .ok_or(format!("{} logs nothing through defmt", elf.display()))
}

/// Decodes a log to text.
fn decode(table: &Table, logged: &[u8]) -> String {
    let mut decoder = table.new_stream_decoder();
    decoder.received(logged);
    let mut text = String::new();
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let level = frame.level().map(|level| level.as_str().to_uppercase() + " ");
                text.extend([level.unwrap_or_default(), frame.display_message().to_string()]);
                text.push('\n');
            }
            Err(DecodeError::UnexpectedEof) => return text,
            Err(DecodeError::Malformed) => {
                text.push_str("(bytes that are no log)\n");
                if !table.encoding().can_recover() {
                    return text;
                }
            }
        }
    }
}
