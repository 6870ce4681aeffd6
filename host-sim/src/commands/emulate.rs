//! Command `emulate`: the device's image in an emulator, compared with the host.

use std::path::PathBuf;
use std::time::Duration;

use crate::Result;
use clap::Args;
use taxel_data::output;
use taxel_rig::device::Device;
use taxel_rig::device::check::check;
use taxel_rig::emulator::{self, Emulator};

use super::check_arguments::{CheckArguments, Checked, conclude};
use super::progress::Terminal;
use super::{Common, print};

/// Frames on their way at a time: the mailbox holds bytes back while the device is busy.
const WINDOW: usize = 4;
/// Longest time for an answer: the emulator loses nothing, but a busy computer makes it slow.
const PATIENCE: Duration = Duration::from_mins(1);

/// Run the firmware in QEMU and compare its estimates with the host's.
///
/// Decodes frames of a scene, or of a CSV file with a model of it. Fails (exit status 1) unless every frame is bit-identical.
#[derive(Args)]
#[command(
    after_help = "Example: cargo xtask firmware && taxel emulate press -n 10000\n\nNeeds qemu-system-arm and the image; docs/board.md describes how to get both."
)]
pub struct Arguments {
    #[command(flatten)]
    check: CheckArguments,
    /// Image of the firmware for mps2-an386.
    #[arg(
        long,
        value_name = "ELF",
        default_value = "target/thumb/thumbv7em-none-eabihf/firmware/qemu-app"
    )]
    image: PathBuf,
    /// File for the image's log, as defmt encodes it: `cargo xtask log FILE` prints it.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

pub fn execute(arguments: &Arguments, common: &Common) -> Result<print::Outcome> {
    if let Some(log) = &arguments.log {
        print::check_output(log, &[&arguments.image])?;
    }
    let scratch = output::Scratch::new();
    let scratch =
        scratch.map_err(|cause| taxel_data::Error::write(&std::env::temp_dir(), cause))?;
    let options = emulator::Options {
        image: arguments.image.clone(),
        model: None,
        log: arguments.log.is_some().then(|| scratch.path().join("log.defmt")),
        mailbox: scratch.path().join("mailbox.ram"),
    };
    options.check()?;
    let Checked { frames, model } = arguments.check.load(common)?;

    // QEMU puts the blob at the place where a board has it in flash.
    let blob = scratch.path().join("model.bin");
    let written = std::fs::write(&blob, model.bytes());
    written.map_err(|cause| taxel_data::Error::write(&blob, cause))?;
    let log = options.log.clone();
    let started = Emulator::start(&emulator::Options { model: Some(blob.clone()), ..options });
    let outcome = started.and_then(|emulator| {
        let mut device = Device::new(emulator)?;
        device.patience = PATIENCE;
        let plan = arguments.check.plan(WINDOW);
        check(&mut device, &frames, &model, &plan, &Terminal::new(common))
    });
    if let Some((temporary, wanted)) = log.zip(arguments.log.as_ref()) {
        let logged = std::fs::read(&temporary).unwrap_or_default();
        if !logged.is_empty() {
            output::write_bytes(wanted, &logged)?;
        }
    }
    Ok(conclude(&outcome?, common))
}
