//! Host and emulator give the same results to the last bit. `cargo xtask emulate` compares the logs of the
//! emulator's programs with the files beside them; here the host's results are compared with the same files.

use std::fmt::{Arguments, Write};
use std::fs;

use taxel_core::AlignedBytes;

mod models;

use crate::{checks, fixed};
use models::FILES;

fn in_testdata(name: &str) -> String {
    format!("{}/../testdata/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn model(name: &str) -> &'static [u8] {
    let bytes = fs::read(in_testdata(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"));
    Box::leak(Box::new(AlignedBytes::copy_of(&bytes)))
}

/// Compares the lines that `work` says with the log of a program in the emulator, which says them too.
fn expect(program: &str, work: impl FnOnce(checks::Say<'_>) -> Option<()>) {
    let mut log = String::new();
    work(&mut |line: Arguments<'_>| _ = writeln!(log, "INFO {line}")).expect("models that load");
    let path = format!("{}/qemu/src/bin/{program}.out", env!("CARGO_MANIFEST_DIR"));
    let of_target = fs::read_to_string(&path).unwrap_or_else(|cause| panic!("{path}: {cause}"));
    assert_eq!(log + "exit status 0\n", of_target);
}

#[test]
fn the_models_in_testdata_are_those_made_here() {
    for (name, blob) in FILES {
        assert!(
            fs::read(in_testdata(name)).ok().as_deref() == Some(&*blob()),
            "{name}: changed on purpose? cargo test --package taxel-firmware --test all bit_for_bit -- --ignored"
        );
    }
}

#[test]
#[ignore = "writes the models in testdata"]
fn write_the_models_in_testdata() {
    for (name, blob) in FILES {
        fs::write(in_testdata(name), &*blob()).unwrap();
    }
}

#[test]
fn the_hand_made_model_decodes_on_the_host_as_in_the_emulator() {
    expect("decode", |say| {
        say(format_args!("decoding: {:08x}", checks::decoding(model("hand-made.bin"))?));
        say(format_args!("within 4 KiB of RAM"));
        Some(())
    });
}

#[test]
fn every_format_decodes_on_the_host_as_in_the_emulator() {
    expect("kernels", |say| {
        let mut judged = |line: Arguments<'_>| {
            let text = line.to_string();
            assert!(!text.contains("otherwise") || text.contains(", 0 otherwise"), "{text}");
            say(line);
        };
        checks::kernels(&model, &mut judged)?;
        // Alike, whatever a processor does with subnormals.
        checks::extremes("kept", &model, &mut judged)?;
        checks::extremes("flushed to zero", &model, &mut judged)
    });
}

#[test]
fn models_of_fixed_size_decode_on_the_host_as_in_the_emulator() {
    let blobs = ["hand-made.bin", "row4.bin", "array-touch.bin"].map(model);
    expect("fixed", |say| fixed::compare_all(blobs, say));
}
