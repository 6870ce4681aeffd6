#![no_main]

use hostile::target;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    (target("recording").check)(bytes);
});
