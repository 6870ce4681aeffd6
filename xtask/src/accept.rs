//! Acceptance of a board: what it does, as it says itself over the link, beside what is predicted, in one JSON file.

mod board;
mod stage;
mod readout;
mod line;
mod cells;
mod record;
mod faults;

use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

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
use board::{Board, prepare_emulator};
use cells::Cells;
use readout::Pin;
use record::{Beside, Decoding, Record};
use stage::Stage;

/// Bytes below which models are tried: larger ones say nothing more, and take longer to upload.
const SMALL_BYTES: usize = 60_000;

/// Frames that each model decodes, of other presses than it was trained with.
const FRAMES: usize = 10;

/// Time in µs between scans while flash is erased: long enough for a scan.
const PERIOD_US: u32 = 20_000;

/// Most time in ms to erase a slot of 128 KiB, 32 bits at once (DS10693, table 45), and one period of scans.
const ERASE_MS: u32 = 2000 + PERIOD_US / 1000;

/// Largest difference of a scan from its plan, as a share: of the emulated board, and of one on silicon.
const SCAN_OFF: f64 = 0.03;
const SCAN_OFF_ON_SILICON: f64 = 0.1;

/// Time in µs that the program takes of a scan: to start it, and to add up one sample of each reading before it looks at the
/// time. From the emulated board.
const PROGRAM_US: u32 = 29;

/// Rounds of scans that are looked at, and the time of each: a board makes a hundred scans, a busy emulated one some.
const ROUNDS: usize = 3;
const ROUND: Duration = Duration::from_secs(1);

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

/// Resistances of the emulated sensor in Ω.
const EMULATED_OHM: f32 = 60.0;

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
    /// Plant this fault in the emulated board (proof/board-emulator/faults.py); `all`: each in turn, and each must be named.
    #[arg(long, value_name = "NAME", requires = "emulated")]
    fault: Option<String>,
    /// The board has this revision's image already: do not flash it.
    #[arg(long)]
    flashed: bool,
    /// Let the chip reset while its supply is below 2.7 to 2.9 V: it writes an option byte, for good. A power cut in that half
    /// second may leave read protection on, which a mass erase removes.
    #[arg(long)]
    set_brown_out: bool,
    /// What is between the wires: `sensor`, untouched, or the Ω of a resistor in every cell, such as 100.
    #[arg(long, value_name = "sensor|OHM")]
    cells: Option<Cells>,
    /// Speed of the serial line in bits a second: the image is built for it [default: TAXEL_BAUD of the environment, or 921600]
    #[arg(long, value_name = "N", conflicts_with = "emulated", value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// Seconds for which readings are sent as fast as the line carries them [default: 60, or 2 of the emulated board]
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..))]
    stream: Option<u32>,
    /// Where to write the file. By default proof/silicon, or a build folder for the emulated board.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Accepts a board, and writes the file.
pub fn run(options: &Options) -> Outcome {
    if options.fault.as_deref() == Some(faults::ALL) {
        return faults::each_is_named(options);
    }
    let toolchain = Toolchain::find()?;
    let mut board = if let Some(port) = &options.port {
        Board::real(port, options.baud, options.flashed, &toolchain)?
    } else {
        let ohm = options.cells.map(|cells| match cells {
            Cells::Resistors(ohm) => ohm,
            Cells::Sensor => EMULATED_OHM,
        });
        Board::emulated(&prepare_emulator(&toolchain)?, options.fault.as_deref(), ohm)?
    };
    let record = accept(&mut board, options, &toolchain)?;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| default_file(&record.board, &record.unique_id, options.emulated));
    path.parent().map_or(Ok(()), fs::create_dir_all).map_err(text)?;
    write_bytes(&path, &serde_json::to_vec_pretty(&record).map_err(text)?).map_err(text)?;
    println!("written to {}", path.display());
    if record.is_right() {
        Ok(())
    } else {
        Err("the board failed a test: see the lines that begin with FAILED".into())
    }
}

/// Goes through the stages. Models are tried only if readout and line are right.
fn accept(board: &mut Board, options: &Options, toolchain: &Toolchain) -> Outcome<Record> {
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
    let git = ["-C", &root().to_string_lossy(), "describe", "--always", "--dirty"];
    let mut record = Record {
        is_emulated: options.emulated,
        revision: first_line("git", &git),
        compiler: toolchain.compiler()?,
        unique_id: identity.unique_id_text(),
        board: identity.board,
        firmware: identity.firmware,
        memory: identity.memory,
        stages: Vec::new(),
        decoding: Vec::new(),
    };
    println!(
        "the readout tests itself: supply, temperature, converters, pins, and a pass by timers and DMA"
    );
    // A board whose readings fail restarts again and again, but not while it does not scan.
    let found = device.while_paused(Device::diagnose).map_err(text)?;
    record.add(readout::stages(&found));
    if !record.is_right() {
        println!("the readout is faulty: nothing else is tested");
        return Ok(record);
    }
    let seconds = options.stream.unwrap_or(if options.emulated { 2 } else { 60 });
    println!("readings come as fast as the line carries them, for {seconds} s");
    record.add(line::stream(&mut device, seconds, board.baud)?);
    if readout::pins(&found).contains(&Pin::Biased) {
        println!("readings after the usual wait are compared with others after a long one");
        record.add([line::settling(&mut device)?]);
    }
    match options.cells {
        Some(Cells::Resistors(ohm)) => record.add([cells::resistors(&mut device, ohm)?]),
        Some(Cells::Sensor) => record.add(cells::sensor(&mut device)?),
        None => {}
    }
    if !record.is_right() {
        println!("the line or the circuit is faulty: nothing else is tested");
        return Ok(record);
    }
    let frames = Synthesis::new(&World::press()).frames(Stream::Test, FRAMES);
    println!("models of each number format decode {FRAMES} frames each");
    record.decoding = decode_all(&mut device, &frames)?;
    let (wrong, all) =
        (record.decoding.iter().filter(|it| !it.is_identical()).count(), record.decoding.len());
    let other =
        "the board computes other bits than the host: another compiler, or RAM or flash that fails";
    let cause = (wrong > 0).then_some(other);
    record.add([Stage::new("models decoded bit for bit", all - wrong, all.to_string(), cause)]);
    record.add([erase(&mut device)?]);
    let last = device.identify().map_err(text)?.memory.stack_high_water;
    let stack_bytes = record.decoding.iter().map(|it| it.stack_bytes).fold(last, u32::max);
    let deep =
        "the stack is deeper than it should be: another compiler than the image was measured with";
    record.add([Stage::within("stack, bytes", stack_bytes, [0, STACK_BYTES], deep)]);
    record.add([restart(&mut device)?, scan(&mut device, options.emulated)?]);
    Ok(record)
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

/// Erases the slot that is not in force while the sensor is scanned: the time that it took, by the scans that were missed.
fn erase(device: &mut Device) -> Outcome<Stage> {
    let own = device.configuration().map_err(text)?;
    let scanning = Configuration { frame_period_us: PERIOD_US, send_estimates: false, ..own };
    device.configure(scanning).map_err(text)?;
    let missed_before = device.statistics().map_err(text)?.frames_missed;
    let head = fs::read(own_folder().join("fixed16-rows-16.bin")).map_err(text)?;
    let begun = upload::step(device, upload::begin(&head)).map_err(text)?;
    if !matches!(begun, Ok(UploadState::Receiving { .. })) {
        return Err(format!("an upload begins with {begun:?}"));
    }
    let missed = device.statistics().map_err(text)?.frames_missed.wrapping_sub(missed_before);
    let slow = "erasing flash takes another time than in the data sheet: it is worn, or the supply is weak";
    Ok(Stage::within("erasing a slot, ms", missed * (PERIOD_US / 1000), [0, ERASE_MS], slow))
}

/// The longest scan of a round, beside its plan. A scan whose end the program sees late, since it answers a request, does not
/// count: the round is repeated.
fn scan(device: &mut Device, is_emulated: bool) -> Outcome<Stage> {
    let mut least_us = u32::MAX;
    for _ in 0..ROUNDS {
        device.restart().map_err(text)?;
        thread::sleep(ROUND);
        let longest_us = device.statistics().map_err(text)?.longest_scan_us;
        // 0 without a scan.
        if longest_us > 0 {
            least_us = least_us.min(longest_us);
        }
    }
    let own = device.configuration().map_err(text)?;
    let planned =
        ScanPlan::of_nucleo_onchip(8, 18, own.scan.oversampling).longest_us() + PROGRAM_US;
    let off = if is_emulated { SCAN_OFF } else { SCAN_OFF_ON_SILICON };
    let bounds = [1.0 - off, 1.0 + off].map(|share| (share * f64::from(planned)).round() as u32);
    let slow = "the scan is not as planned: without the ST-LINK's 8 MHz it takes a seventh longer (docs/board.md)";
    Ok(Stage::within("longest scan, µs", least_us, bounds, slow))
}

/// Restarts the board: the same model must be in force afterwards.
fn restart(device: &mut Device) -> Outcome<Stage> {
    let before = device.identify().map_err(text)?.model;
    let after = device.restart().map_err(text)?.model;
    let crc = |model: Option<ModelIdentity>| model.map(|model| model.crc_32);
    let is_kept = after.is_some() && crc(before) == crc(after);
    let cause = (!is_kept).then_some("the journal or the slot lost what was written: flash fails");
    Ok(Stage::new("keeps its model over a restart", is_kept, "true", cause))
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
