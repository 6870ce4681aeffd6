//! Decodes 10,000 frames with every number format and exponential, with readings within and far beyond the
//! training range, gates as many, and tells their novelty and deviations. At last decodes readings that no sensor gives,
//! with subnormals kept and with them flushed to zero. `firmware/tests/bit_for_bit.rs` checks that the host gives the same
//! bits: it runs the compiled twins of the assembly routines.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use defmt::{assert_eq, info, unwrap};
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

/// Bit of FPSCR that flushes subnormals to zero.
const FLUSH_TO_ZERO: u32 = 1 << 24;
/// Bits of FPSCR: alternative half precision, default NaN, flush to zero, rounding mode.
const MODES: u32 = 1 << 26 | 1 << 25 | FLUSH_TO_ZERO | 3 << 22;

/// The modes of the floating-point unit.
fn modes() -> u32 {
    let fpscr: u32;
    // SAFETY: reading the status has no effect.
    unsafe { core::arch::asm!("vmrs {}, fpscr", out(reg) fpscr) };
    fpscr & MODES
}

/// Decodes readings that no sensor gives, in these modes of the floating-point unit.
fn extremes(mode: &str, bits: u32, models: [(Format, &[u8]); 3]) {
    // SAFETY: the mode changes results of floating-point instructions alone, which is what is tested.
    unsafe { core::arch::asm!("vmsr fpscr, {}", in(reg) bits) };
    let half = black_box(f32::MIN_POSITIVE) * black_box(0.5);
    assert_eq!(half.to_bits() == 0, bits == FLUSH_TO_ZERO);
    info!("subnormals {=str}", mode);
    for (format, blob) in models {
        let crc = unwrap!(checks::decoding_extremes::<{ checks::ROWS }>(blob));
        info!("{=str}: {=u32:08x}", format.name(), crc);
    }
    assert_eq!(modes(), bits);
}

#[entry]
fn main() -> ! {
    assert_eq!(modes(), 0);
    let (f32, fixed16) = (model!("kernels-f32.bin"), model!("kernels-fixed16.bin"));
    let f32_direct = model!("kernels-f32-direct.bin");
    decode::<Polynomial>(Format::F32, f32);
    decode::<Polynomial>(Format::Fixed16, fixed16);
    decode::<Polynomial>(Format::F32Direct, f32_direct);
    decode::<Libm>(Format::F32Direct, f32_direct);
    decode::<Micromath>(Format::F32Direct, f32_direct);
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
    let models: [(Format, &[u8]); 3] =
        [(Format::F32, f32), (Format::Fixed16, fixed16), (Format::F32Direct, f32_direct)];
    extremes("kept", 0, models);
    extremes("flushed to zero", FLUSH_TO_ZERO, models);
    exit::success()
}
