//! Mends a recording that was cut: `recover FILE`.

use std::path::PathBuf;

use taxel_recording::{Recovered, recover};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = PathBuf::from(std::env::args_os().nth(1).ok_or("usage: recover FILE")?);
    match recover(&path)? {
        None => println!("whole"),
        Some(Recovered { frames, bytes_left_out }) => {
            println!("{frames} frames, {bytes_left_out} bytes left out");
        }
    }
    Ok(())
}
