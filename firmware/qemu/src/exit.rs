//! Ending QEMU with an exit status.

/// Ends QEMU with exit status 0.
pub fn success() -> ! {
    semihosting::process::exit(0)
}

/// Ends QEMU with exit status 1.
pub fn failure() -> ! {
    semihosting::process::exit(1)
}
