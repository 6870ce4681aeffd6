//! The board that is accepted: one at a serial port, or the emulated one.

use std::env;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use taxel_firmware::timing::NUCLEO_BAUD;
use taxel_rig::device::{Device, serial};

use crate::board::{Emulator, Options};
use crate::images::{NUCLEO, NUCLEO_IMAGE, PROFILE, build_image};
use crate::process::{Outcome, run};
use crate::toolchain::{Toolchain, elf};

/// Variable of the build's environment for another baud rate than the usual one.
const BAUD_VARIABLE: &str = "TAXEL_BAUD";

/// Chip of the board, as probe-rs names it.
const CHIP: &str = "STM32F446RETx";

/// Longest time that an answer may take: the emulated board is slower than its own time.
const PATIENCE: Duration = Duration::from_secs(20);

/// What the emulated board prints before the name of its port.
const PORT: &str = "taxel link ";

pub struct Board {
    port: String,
    /// Bits a second of its serial line.
    pub baud: u32,
    emulator: Option<Child>,
}

impl Board {
    /// The board at this `port`, with a serial line of this `baud` rate if it is not the usual one. The image is built and
    /// flashed, unless it is there already.
    pub fn real(
        port: &str,
        baud: Option<u32>,
        is_flashed: bool,
        toolchain: &Toolchain,
    ) -> Outcome<Self> {
        if !is_flashed {
            let mut build = toolchain.build();
            build.args(PROFILE).args(NUCLEO);
            run(build.envs(baud.map(|baud| (BAUD_VARIABLE, baud.to_string()))))?;
            flash(&elf(NUCLEO_IMAGE))?;
        }
        let baud = baud.map_or_else(usual_baud, Ok)?;
        Ok(Self { port: port.into(), baud, emulator: None })
    }

    /// The emulated board, running the image that was built. Nothing is at its pins, unless the `fault` planted in it shows in
    /// a circuit alone, or resistors of so many `ohm` are between its wires.
    pub fn emulated(emulator: &Emulator, fault: Option<&str>, ohm: Option<f32>) -> Outcome<Self> {
        let mut command = emulator.command(&elf(NUCLEO_IMAGE));
        if let Some(fault) = fault {
            command.args(["--fault", fault]);
        }
        match ohm {
            Some(ohm) => command.args(["--ohm", &ohm.to_string()]),
            None => command.arg("--bare"),
        };
        command.arg("serve").stdout(Stdio::piped());
        let mut emulator =
            command.spawn().map_err(|cause| format!("the emulated board: {cause}"))?;
        let said = emulator.stdout.take().ok_or("the emulated board prints nothing")?;
        let mut lines = BufReader::new(said).lines().map_while(Result::ok);
        let port = lines
            .find_map(|line| line.split_once(PORT)?.1.split_whitespace().next().map(str::to_owned));
        // What it says from now on is of no interest, but it must not be stopped by it.
        std::thread::spawn(move || lines.for_each(drop));
        let port = port.ok_or("the emulated board opens no port");
        Ok(Self { port: port?, baud: NUCLEO_BAUD, emulator: Some(emulator) })
    }

    /// Opens the line to the board.
    pub fn open(&mut self) -> Outcome<Device> {
        let wire = serial::open(&self.port, self.baud).map_err(|cause| cause.to_string())?;
        let mut device = Device::new(wire).map_err(|cause| cause.to_string())?;
        device.patience = PATIENCE;
        Ok(device)
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        if let Some(emulator) = &mut self.emulator {
            let _ = emulator.kill();
            let _ = emulator.wait();
        }
    }
}

/// Builds the image, and finds what the emulated board needs.
pub fn prepare_emulator(toolchain: &Toolchain) -> Outcome<Emulator> {
    build_image(toolchain, NUCLEO)?;
    Emulator::prepare(&Options::plain())
}

/// Baud rate of an image that is built in this environment.
fn usual_baud() -> Outcome<u32> {
    let Ok(text) = env::var(BAUD_VARIABLE) else { return Ok(NUCLEO_BAUD) };
    text.parse().map_err(|_| format!("{BAUD_VARIABLE}={text}: give a number of bits a second"))
}

/// Writes the image to the board at the only debug probe, and starts it.
fn flash(image: &Path) -> Outcome {
    for arguments in [&["download", "--verify"][..], &["reset"]] {
        let mut command = Command::new("probe-rs");
        command.args(arguments).args(["--chip", CHIP]);
        if arguments.len() > 1 {
            command.arg(image);
        }
        run(&mut command).map_err(|cause| {
            format!(
                "{cause}; flashing takes probe-rs (docs/board.md), or flash the image yourself and give --flashed"
            )
        })?;
    }
    Ok(())
}
