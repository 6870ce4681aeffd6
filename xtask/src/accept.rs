//! Acceptance of a board: what it does, as it says itself over the link, beside what is predicted, in one JSON file.

mod board;
mod record;

use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};

use taxel_core::Decoder;
use taxel_data::output::write_bytes;
use taxel_data::{Dataset, Silent, Stream};
use taxel_firmware::link::message::{Configuration, Memory, ModelIdentity, UploadState};
use taxel_firmware::timing::ScanPlan;
use taxel_learn::ModelBlob;
use taxel_learn::cost::{Cost, Design};
use taxel_rig::device::{Device, stream, upload};
use taxel_simulate::{Synthesis, World};

use crate::cycles::{Model, train_all};
use crate::images::NUCLEO_IMAGE;
use crate::process::{Outcome, cargo, first_line, root, run as run_command, target_dir};
use crate::size::Size;
use crate::toolchain::{Toolchain, elf};
use board::Board;
use record::{Beside, Decoding, Record};

/// Bytes below which models are tried: larger ones say nothing more, and take longer to upload.
const SMALL_BYTES: usize = 60_000;

/// Frames that each model decodes, of other presses than it was trained with.
const FRAMES: usize = 10;

/// Time in µs between scans while flash is erased: long enough for a scan.
const PERIOD_US: u32 = 20_000;

/// Least and most time in ms to erase a slot of 128 KiB, 32 bits at once (DS10693, table 45: typical and largest).
const ERASE_MS: [u32; 2] = [1000, 2000];

/// Trains a model with a full reading model.
const TRAIN_CONFIDENCE: [&str; 12] = [
    "run",
    "--quiet",
    "--package",
    "host-sim",
    "--",
    "train",
    "press",
    "--no-refine",
    "--centres=16",
    "--format=fixed16",
    "--reading-model=full",
    "--output",
];

/// Most bytes that the stack may take, of the 8192 that the image has for it.
const STACK_BYTES: u32 = 7168;

/// What to accept.
#[derive(clap::Args)]
pub struct Options {
    /// Serial port of the board, such as /dev/ttyACM0.
    #[arg(required_unless_present = "emulated")]
    port: Option<String>,
    /// Take the emulated board (proof/board-emulator) instead.
    #[arg(long, conflicts_with_all = ["port", "flashed"])]
    emulated: bool,
    /// The board has this revision's image already: do not flash it.
    #[arg(long)]
    flashed: bool,
    /// Let the chip reset while its supply is below 2.7 to 2.9 V: it writes an option byte, for good. A power cut in that half
    /// second may leave read protection on, which a mass erase removes.
    #[arg(long)]
    set_brown_out: bool,
    /// Speed of the serial line in bits a second: the image is built for it [default: TAXEL_BAUD of the environment, or 921600]
    #[arg(long, value_name = "N", conflicts_with = "emulated", value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// Where to write the file. By default proof/silicon, or a build folder for the emulated board.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Accepts a board, and writes the file.
pub fn run(options: &Options) -> Outcome {
    let frames = Synthesis::new(&World::press()).frames(Stream::Test, FRAMES);
    let toolchain = Toolchain::find()?;
    let mut board = if let Some(port) = &options.port {
        Board::real(port, options.baud, options.flashed, &toolchain)?
    } else {
        Board::emulated(&toolchain)?
    };
    let mut device = board.open()?;
    let identity = device.identify().map_err(text)?;
    println!("{}, firmware {}", identity.board, identity.firmware);
    let image = elf(NUCLEO_IMAGE);
    // Who flashed the board without a build has nothing to compare with.
    if image.exists() {
        check_image(&identity.memory, Size::new(&image)?.of_flash())?;
    }
    if options.set_brown_out {
        device.set_brown_out().map_err(text)?;
        println!("brown-out level 3 is set");
    }
    let unique_id = identity.unique_id_text();
    let decoding = decode_all(&mut device, &frames)?;
    let (erase_ms, scan_us) = erase_and_scan(&mut device)?;
    let last = device.identify().map_err(text)?.memory.stack_high_water;
    let stack_bytes = decoding.iter().map(|it| it.stack_bytes).fold(last, u32::max);
    println!("the stack took {stack_bytes} of {} bytes", identity.memory.stack_reserved);
    let restart = restart(&mut device)?;
    let git = ["-C", &root().to_string_lossy(), "describe", "--always", "--dirty"];
    let record = Record {
        is_emulated: options.emulated,
        revision: first_line("git", &git),
        compiler: toolchain.compiler()?,
        board: &identity.board,
        firmware: &identity.firmware,
        unique_id: &unique_id,
        memory: identity.memory,
        stack_bytes: Beside { measured: stack_bytes, predicted: STACK_BYTES },
        decoding,
        scan_us,
        erase_ms,
        keeps_its_model_over_a_restart: restart,
    };
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| default_file(&identity.board, &unique_id, options.emulated));
    path.parent().map_or(Ok(()), fs::create_dir_all).map_err(text)?;
    write_bytes(&path, &serde_json::to_vec_pretty(&record).map_err(text)?).map_err(text)?;
    println!("written to {}", path.display());
    if record.is_as_predicted() {
        Ok(())
    } else {
        Err("the board does something else than it should: see the file".into())
    }
}

/// Fails unless a board, by its use of `memory`, runs the image of this `built` size.
fn check_image(memory: &Memory, built: [u64; 4]) -> Outcome {
    let found = [memory.vector_table, memory.text, memory.rodata, memory.data].map(u64::from);
    if found == built {
        return Ok(());
    }
    Err(format!(
        "the board runs another image than the one that was built: vector table, code, constants and start values take \
         {found:?} bytes on the board, {built:?} in the image. Leave --flashed out, and the board at the debug probe gets \
         this image"
    ))
}

/// The file of a board: one for each chip.
fn default_file(board: &str, unique_id: &str, emulated: bool) -> PathBuf {
    let folder = if emulated { own_folder() } else { root().join("proof/silicon") };
    folder.join(format!("{board}-{unique_id}.json"))
}

/// Folder for models, and the file of the emulated board.
fn own_folder() -> PathBuf {
    target_dir().join("accept")
}

/// Uploads models of every format and several sizes, and lets each decode the same frames as the host.
fn decode_all(device: &mut Device, frames: &Dataset) -> Outcome<Vec<Decoding>> {
    let folder = own_folder();
    fs::create_dir_all(&folder).map_err(text)?;
    let small = |model: &&Model| model.is_of_press() && model.blob.bytes().len() < SMALL_BYTES;
    let models = train_all()?;
    let files = models.iter().filter(small).map(|model| Ok(model.write(&folder)?.model));
    let mut models: Vec<PathBuf> = files.collect::<Outcome<_>>()?;
    let assessed = folder.join("fixed16-16-confidence.bin");
    run_command(cargo(&TRAIN_CONFIDENCE).arg(&assessed))?;
    models.push(assessed);
    models.iter().map(|model| decode(device, model, frames)).collect()
}

fn decode(device: &mut Device, path: &Path, frames: &Dataset) -> Outcome<Decoding> {
    let blob = ModelBlob::read(path).map_err(text)?;
    device.while_paused(|device| upload::replace(device, blob.bytes(), &Silent)).map_err(text)?;
    // So that the counters start anew.
    device.restart().map_err(text)?;
    let host = Decoder::<8>::load(blob.bytes()).map_err(text)?;
    let per_frame = frames.inputs.names.len();
    let readings: Vec<f32> = frames.inputs.values.iter().map(|value| *value as f32).collect();
    let mut bit_identical = 0;
    let start_us = [0; FRAMES];
    let decoded = device.while_paused(|device| {
        stream::decode_frames(device, &readings, &start_us, 1, |frame, estimate| {
            let start = frame as usize * per_frame;
            let expected = host.decode(&readings[start..start + per_frame]);
            let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            let found: Vec<f32> = estimate.outputs.iter().collect();
            let is_same = expected.is_ok_and(|expected| bits(&expected.outputs) == bits(&found));
            bit_identical += usize::from(is_same);
        })
    });
    decoded.map_err(text)?;
    let measured = u64::from(device.statistics().map_err(text)?.shortest_decode_cycles);
    let predicted = Cost::of_frame(&Design::new(&blob)).cycles;
    let model = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    println!(
        "{model:24} {bit_identical} of {FRAMES} frames bit-identical, {measured} cycles a frame, predicted {predicted}"
    );
    Ok(Decoding {
        model,
        frames: FRAMES,
        bit_identical: Beside { measured: bit_identical, predicted: FRAMES },
        cycles: Beside { measured, predicted },
        stack_bytes: device.identify().map_err(text)?.memory.stack_high_water,
    })
}

/// Erases the slot that is not in force while the sensor is scanned, and lets it scan on. Returns the time in ms that the
/// erase took, by the scans that were missed meanwhile, and that of the longest scan in µs.
fn erase_and_scan(device: &mut Device) -> Outcome<(Beside<Vec<u32>>, Beside<u32>)> {
    let own = device.configuration().map_err(text)?;
    let scanning = Configuration { frame_period_us: PERIOD_US, send_estimates: false, ..own };
    device.configure(scanning).map_err(text)?;
    let missed_before = device.statistics().map_err(text)?.frames_missed;
    let head = fs::read(own_folder().join("fixed16-rows-16.bin")).map_err(text)?;
    let begun = upload::step(device, upload::begin(&head)).map_err(text)?;
    if !matches!(begun, Ok(UploadState::Receiving { .. })) {
        return Err(format!("an upload begins with {begun:?}"));
    }
    let after = device.statistics().map_err(text)?;
    let erase_ms = after.frames_missed.wrapping_sub(missed_before) * (PERIOD_US / 1000);
    let plan = ScanPlan::of_nucleo_onchip(8, 18, scanning.scan.oversampling);
    let (scan_us, predicted) = (after.longest_scan_us, plan.longest_us());
    println!(
        "erasing a slot took {erase_ms} ms; the longest scan {scan_us} µs, predicted {predicted}"
    );
    let erase_ms = Beside { measured: vec![erase_ms], predicted: ERASE_MS.to_vec() };
    Ok((erase_ms, Beside { measured: scan_us, predicted }))
}

/// Restarts the board; returns whether the same model is in force afterwards.
fn restart(device: &mut Device) -> Outcome<Beside<bool>> {
    let before = device.identify().map_err(text)?.model;
    let after = device.restart().map_err(text)?.model;
    let crc = |model: Option<ModelIdentity>| model.map(|model| model.crc_32);
    let measured = after.is_some() && crc(before) == crc(after);
    println!("after a restart the same model is in force: {measured}");
    Ok(Beside { measured, predicted: true })
}

fn text(cause: impl Display) -> String {
    cause.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_runs_another_image_is_told_by_the_bytes_of_both() {
        let memory = Memory { vector_table: 1, text: 20, rodata: 3, data: 4, ..Memory::default() };
        assert_eq!(check_image(&memory, [1, 20, 3, 4]), Ok(()));
        let error = check_image(&memory, [1, 24, 3, 4]).unwrap_err();
        assert!(error.contains("[1, 20, 3, 4]") && error.contains("[1, 24, 3, 4]"), "{error}");
    }
}
