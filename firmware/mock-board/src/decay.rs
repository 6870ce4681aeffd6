//! Memory that loses bits while a session has borrowed it, as radiation does.

use std::fs::OpenOptions;
use std::os::unix::fs::FileExt;

/// Flips bit number `bit` from `address` on of this process's memory, through the kernel.
pub fn flip_bit(address: usize, bit: usize) {
    let memory = OpenOptions::new().read(true).write(true).open("/proc/self/mem").unwrap();
    let (place, mut byte) = ((address + bit / 8) as u64, [0]);
    memory.read_exact_at(&mut byte, place).unwrap();
    memory.write_all_at(&[byte[0] ^ 1 << (bit % 8)], place).unwrap();
}
