//! The image for the board NUCLEO-F446RE: the application, with the sensor at its pins.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod device;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: `cargo nucleo` flashes it");
}
