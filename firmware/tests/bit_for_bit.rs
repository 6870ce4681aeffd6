//! Host and emulator give the same results to the last bit. `cargo xtask emulate` compares the logs of the
//! emulator's programs with the files beside them; here the host's results are compared with the same files.

use std::fs;

use model_core::AlignedBytes;
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::rbf::Format;

mod models;

use crate::{checks, fixed};
use models::{FILES, with_blob};

fn in_testdata(name: &str) -> String {
    format!("{}/../testdata/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Expected log of a program in the emulator.
fn expected_log(program: &str) -> String {
    let path = format!("{}/qemu/src/bin/{program}.out", env!("CARGO_MANIFEST_DIR"));
    fs::read_to_string(&path).unwrap_or_else(|cause| panic!("{path}: {cause}"))
}

fn decoding<E: ExpKernel>(blob: &[u8]) -> String {
    let crc = checks::decoding::<E>(blob).expect("the model loads");
    format!("INFO decoding with {}: {crc:08x}\n", E::NAME)
}

fn decoding_many<E: ExpKernel>(format: Format) -> String {
    let format = format.name();
    let crc =
        with_blob(&format!("kernels-{format}.bin"), checks::decoding_many::<E, { checks::ROWS }>);
    format!("INFO {format}, {}: {:08x}\n", E::NAME, crc.expect("the model loads"))
}

fn clamping(format: Format) -> String {
    let format = format.name();
    let counts = with_blob(&format!("kernels-{format}.bin"), checks::clamping);
    let [frames, clamped, otherwise] = counts.expect("a model that clamps when it infers");
    assert!(clamped > frames / 3 && clamped < frames / 3 * 2, "{clamped} of {frames} clamped");
    format!(
        "INFO clamp, {format}: {clamped} of {frames} frames clamped, {otherwise} otherwise than the twin's\n"
    )
}

fn array(format: Format, kind: &str) -> String {
    let suffix = match kind {
        " without tail" => "-no-tail",
        " of components" => "-components",
        _ => "",
    };
    let file = &format!("array-{}{suffix}.bin", format.name());
    let crc = with_blob(file, checks::decoding_many::<Polynomial, { checks::ARRAY_ROWS }>);
    let crc = crc.expect("the model loads");
    format!("INFO array, {}{kind}: {crc:08x}\n", format.name())
}

fn gating() -> String {
    let counts = with_blob("kernels-fixed16.bin", checks::gating);
    let [rows, at_rest, otherwise] = counts.expect("the model loads");
    assert!(at_rest > rows / 10 && at_rest < rows / 10 * 9, "{at_rest} of {rows} rows at rest");
    format!("INFO gate: {at_rest} of {rows} rows at rest, {otherwise} otherwise than the twin's\n")
}

fn assessing(what: &str, assessed: Option<checks::Assessed>) -> String {
    let checks::Assessed { crc, novel, far, missing } = assessed.expect("a confidence");
    let many = checks::MANY;
    assert!(novel > many / 10 && novel < many * 9 / 10 && far > 0 && missing > 0, "{novel} novel");
    format!(
        "INFO confidence, {what}: {crc:08x}, {novel} frames novel, {far} of them far, {missing} missing\n"
    )
}

/// Readings that no sensor gives decode alike whatever a processor does with subnormals.
fn extremes(mode: &str) -> String {
    let of_format = |format: Format| {
        let name = format!("kernels-{}.bin", format.name());
        let crc = with_blob(&name, checks::decoding_extremes::<{ checks::ROWS }>);
        format!("INFO {}: {:08x}\n", format.name(), crc.expect("the model loads"))
    };
    let formats = [Format::F32, Format::Fixed16, Format::F32Direct];
    format!("INFO subnormals {mode}\n{}", formats.map(of_format).concat())
}

#[test]
fn the_models_in_testdata_are_those_made_here() {
    for (name, blob) in FILES {
        assert!(
            fs::read(in_testdata(name)).ok().as_deref() == Some(&*blob()),
            "{name}: changed on purpose? cargo test --package firmware --test all bit_for_bit -- --ignored"
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
fn every_exponential_decodes_on_the_host_as_in_the_emulator() {
    let of_host = with_blob("hand-made.bin", |blob| {
        [decoding::<Polynomial>(blob), decoding::<Libm>(blob), decoding::<Micromath>(blob)]
    });
    let end = "INFO within 4 KiB of RAM\nexit status 0\n";
    assert_eq!(of_host.concat() + end, expected_log("decode"));
}

#[test]
fn every_kernel_decodes_many_frames_on_the_host_as_in_the_emulator() {
    let of_host = [
        decoding_many::<Polynomial>(Format::F32),
        decoding_many::<Polynomial>(Format::Fixed16),
        decoding_many::<Polynomial>(Format::F32Direct),
        decoding_many::<Libm>(Format::F32Direct),
        decoding_many::<Micromath>(Format::F32Direct),
        clamping(Format::F32),
        clamping(Format::Fixed16),
        gating(),
        array(Format::F32, ""),
        array(Format::F32, " without tail"),
        array(Format::Fixed16, ""),
        array(Format::Fixed16, " without tail"),
        array(Format::F32Direct, ""),
        array(Format::F32, " of components"),
        array(Format::Fixed16, " of components"),
        array(Format::F32Direct, " of components"),
        assessing("assess_into", with_blob("array-fixed16-confidence.bin", checks::assessing_many)),
        assessing("1 to 12 directions", checks::assessing_sizes()),
        extremes("kept"),
        extremes("flushed to zero"),
        "exit status 0\n".to_owned(),
    ];
    assert!(
        of_host.iter().all(|line| !line.contains("otherwise") || line.contains(", 0 otherwise"))
    );
    assert_eq!(of_host.concat(), expected_log("kernels"));
}

#[test]
fn networks_of_fixed_size_decode_as_their_blobs_on_the_host_as_in_the_emulator() {
    let line = |name: &str, compared: Option<fixed::Compared>| {
        let fixed::Compared { crc, different } = compared.expect("the model loads");
        assert_eq!(different, 0, "{name}");
        let frames = fixed::FRAMES;
        format!("INFO {name}: {frames} of {frames} frames bit-identical to the blob's: {crc:08x}\n")
    };
    let row4 = AlignedBytes::copy_of(&fs::read(in_testdata("row4.bin")).unwrap());
    let of_host = [
        line("hand-made", with_blob("hand-made.bin", fixed::hand_made)),
        line("row4", fixed::row4(&row4)),
        "exit status 0\n".to_owned(),
    ];
    assert_eq!(of_host.concat(), expected_log("fixed"));
}

#[test]
fn recursive_least_squares_learns_on_the_host_as_in_the_emulator() {
    let crc = checks::recursion().expect("sound parameters");
    let of_host = format!("INFO recursion: {crc:08x}\nexit status 0\n");
    assert_eq!(of_host, expected_log("rls"));
}
