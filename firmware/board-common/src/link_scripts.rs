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
    for script in [regions, memory] {
        println!("cargo:rerun-if-changed={}", script.display());
    }
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy(regions, out.join("regions.x")).expect("regions.x can be copied");
    fs::copy(memory, out.join("memory.x")).expect("memory.x can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
}
