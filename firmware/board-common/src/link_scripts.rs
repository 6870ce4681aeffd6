//! Linker scripts for the build scripts of images.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Copies the image's `regions.x` and the shared `memory.x` to where the linker finds them, and passes it the
/// scripts of cortex-m-rt and defmt. Does nothing in a build for a host.
///
/// # Panics
/// If a script cannot be copied, or if the build script was not started by cargo.
pub fn hand_over() {
    let (regions, memory) = (Path::new("regions.x"), Path::new("../../memory.x"));
    println!("cargo:rerun-if-env-changed=TAXEL_CAPACITY");
    for script in [regions, memory] {
        println!("cargo:rerun-if-changed={}", script.display());
    }
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let text = fs::read_to_string(regions).expect("regions.x can be read");
    fs::write(out.join("regions.x"), with_room(text)).expect("regions.x can be written");
    fs::copy(memory, out.join("memory.x")).expect("memory.x can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
}

/// Regions for the capacity that the image is built with: the buffers of a large one take RAM from the copy of the model.
fn with_room(regions: String) -> String {
    let capacity = env::var("TAXEL_CAPACITY").unwrap_or_default();
    let numbers: Vec<usize> =
        capacity.split('x').filter_map(|number| number.parse().ok()).collect();
    let [rows, columns, outputs] = numbers[..] else { return regions };
    let (readings, outputs) = (rows * columns, rows * outputs);
    let buffers = 22 * readings + 22 * outputs + 2 * (4 * readings).max(8 * outputs);
    // Samples of the NUCLEO-F446RE's own converters, and their sums.
    let buffers = buffers + 648 * (rows + 1);
    if buffers <= 21 * 1024 {
        return regions;
    }
    let larger = [
        ("LENGTH = 24K", "LENGTH = 56K"),
        ("0x20008000, LENGTH = 96K", "0x20010000, LENGTH = 64K"),
    ];
    larger.iter().fold(regions, |text, (usual, larger)| {
        assert!(text.contains(usual), "regions.x has {usual}");
        text.replace(usual, larger)
    })
}
