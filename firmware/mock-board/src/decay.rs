//! Memory that loses bits while a session has borrowed it, as radiation does.

use std::fs::OpenOptions;
use std::os::unix::fs::FileExt;

/// Flips bit 3 of the byte at `address` of this process's memory, through the kernel.
///
/// # Panics
/// The memory cannot be written.
pub fn flip_bit(address: usize) {
    let memory = OpenOptions::new().read(true).write(true).open("/proc/self/mem").unwrap();
    let mut byte = [0];
    memory.read_exact_at(&mut byte, address as u64).unwrap();
    memory.write_all_at(&[byte[0] ^ 8], address as u64).unwrap();
}
