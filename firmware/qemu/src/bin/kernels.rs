//! Decodes 10,000 frames with every number format and exponential, with readings within and far beyond the
//! training range, gates as many, and tells their novelty and deviations. `firmware/tests/bit_for_bit.rs` checks that the host gives the same bits.
//! Assembly routines and their compiled twins agree here.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use defmt::{info, unwrap};
use model_core::Aligned;
use model_core::exp::{ExpKernel, Libm, Micromath, Polynomial};
use model_core::rbf::Format;
use qemu_image::checks::Assessed;
use qemu_image::{checks, exit};

/// Bytes of a model in testdata, aligned.
macro_rules! model {
    ($name:literal) => {{
        static MODEL: Aligned<[u8; include_bytes!(concat!("../../../../testdata/", $name)).len()]> =
            Aligned(*include_bytes!(concat!("../../../../testdata/", $name)));
        &MODEL.0
    }};
}

fn decode<E: ExpKernel>(format: Format, blob: &[u8]) {
    let crc = unwrap!(checks::decoding_many::<E, { checks::ROWS }>(blob));
    info!("{=str}, {=str}: {=u32:08x}", format.name(), E::NAME, crc);
}

fn compare(format: Format, blob: &[u8]) {
    let [compared, different] = unwrap!(checks::twins(blob));
    let format = format.name();
    info!("{=str}: {=usize} of {=usize} rows differ from the twin's", format, different, compared);
}

fn clamp(format: Format, blob: &[u8]) {
    let [frames, clamped, otherwise] = unwrap!(checks::clamping(blob));
    info!(
        "clamp, {=str}: {=usize} of {=usize} frames clamped, {=usize} otherwise than the twin's",
        format.name(),
        clamped,
        frames,
        otherwise
    );
}

/// Decodes with one network for all rows, behind a projection.
fn array(format: Format, kind: &str, blob: &[u8]) {
    let crc = unwrap!(checks::decoding_many::<Polynomial, { checks::ARRAY_ROWS }>(blob));
    info!("array, {=str}{=str}: {=u32:08x}", format.name(), kind, crc);
    if let Some([compared, different]) = checks::array_twins(blob) {
        info!("{=usize} of {=usize} frames differ from the twins'", different, compared);
    }
}

fn gate(blob: &[u8]) {
    let [rows, at_rest, otherwise] = unwrap!(checks::gating(blob));
    info!(
        "gate: {=usize} of {=usize} rows at rest, {=usize} otherwise than the twin's",
        at_rest, rows, otherwise
    );
}

/// Prints what frames are by a confidence, or several.
fn assess(what: &str, assessed: Option<Assessed>) {
    let Assessed { crc, novel, far, missing } = unwrap!(assessed);
    info!(
        "confidence, {=str}: {=u32:08x}, {=usize} frames novel, {=usize} of them far, {=usize} missing",
        what, crc, novel, far, missing
    );
}

#[entry]
fn main() -> ! {
    let (f32, fixed16) = (model!("kernels-f32.bin"), model!("kernels-fixed16.bin"));
    let f32_direct = model!("kernels-f32-direct.bin");
    decode::<Polynomial>(Format::F32, f32);
    decode::<Polynomial>(Format::Fixed16, fixed16);
    decode::<Polynomial>(Format::F32Direct, f32_direct);
    decode::<Libm>(Format::F32Direct, f32_direct);
    decode::<Micromath>(Format::F32Direct, f32_direct);
    compare(Format::F32, f32);
    compare(Format::Fixed16, fixed16);
    clamp(Format::F32, f32);
    clamp(Format::Fixed16, fixed16);
    gate(fixed16);
    array(Format::F32, "", model!("array-f32.bin"));
    array(Format::F32, " without tail", model!("array-f32-no-tail.bin"));
    array(Format::Fixed16, "", model!("array-fixed16.bin"));
    array(Format::Fixed16, " without tail", model!("array-fixed16-no-tail.bin"));
    array(Format::F32Direct, "", model!("array-f32-direct.bin"));
    array(Format::F32, " of components", model!("array-f32-components.bin"));
    array(Format::Fixed16, " of components", model!("array-fixed16-components.bin"));
    array(Format::F32Direct, " of components", model!("array-f32-direct-components.bin"));
    assess("assess_into", checks::assessing_many(model!("array-fixed16-confidence.bin")));
    assess("1 to 12 directions", checks::assessing_sizes());
    exit::success()
}
