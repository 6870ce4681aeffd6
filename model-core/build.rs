//! Tells the crate whether it is built for a Cortex-M4F, whose inner loops are in assembly.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(cortex_m4f)");
    // The one target with the DSP extension and a single-precision FPU (Cortex-M7 as well).
    if std::env::var("TARGET").as_deref() == Ok("thumbv7em-none-eabihf") {
        println!("cargo::rustc-cfg=cortex_m4f");
    }
}
