//! The application in the emulator, held to the host by `host-sim emulate`.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::process::{Outcome, Said, capture, cargo, run, target_dir};
use crate::toolchain::elf;

/// The application's image.
pub const IMAGE: &str = "qemu-app";

/// Flash that it may take without a model, and RAM with the stack at its deepest, in bytes.
const LIMITS: [&str; 2] = ["--flash-limit=49152", "--ram-limit=8192"];

/// What must hold of it with a network a row.
const OF_ROWS: &[&str] =
    &["-n10000", "--scans=20", "--damaged-uploads=1000", "--interruptions", "--garbage=100000"];

/// What must hold on the UART, where every byte takes a turn of QEMU's main loop: enough to show that its
/// driver loses nothing, and that the link finds its messages again after damage.
const ON_UART: &[&str] = &[
    "--line=uart",
    "-n200",
    "--scans=5",
    "--damaged-uploads=7",
    "--interruptions",
    "--garbage=20000",
];

/// What must hold with one network for the whole array: decoding is what differs, and takes more stack.
const OF_ARRAY: &[&str] = &["-n1000", "--scans=20"];

/// The network for the whole array: the format and number of centres that take a device the least time.
const ARRAY: &[&str] = &["--whole-array", "--format=fixed16", "--centres=64"];

/// One run of the application.
pub struct Check {
    pub name: &'static str,
    arguments: Vec<OsString>,
}

/// What the first check leaves of the application's log.
pub fn log() -> PathBuf {
    target_dir().join("qemu-app.defmt")
}

/// What is to be checked, once the models for it are trained.
pub fn checks() -> Outcome<[Check; 3]> {
    let [rows, array] =
        ["qemu-rows.bin", "qemu-array.bin"].map(|name| target_dir().join(name).into_os_string());
    let log = log().into_os_string();
    // That of the run before, if there was one.
    let _ = fs::remove_file(&log);
    train(&[], &rows)?;
    train(ARRAY, &array)?;
    Ok([
        Check::new("application", OF_ROWS, &["--model".as_ref(), &rows, "--log".as_ref(), &log]),
        // The smaller model, which is uploaded on that line as well.
        Check::new("application on the UART", ON_UART, &["--model".as_ref(), &array]),
        Check::new("application with one network", OF_ARRAY, &["--model".as_ref(), &array]),
    ])
}

impl Check {
    fn new(name: &'static str, checks: &[&str], files: &[&OsStr]) -> Self {
        let image = elf(IMAGE).into_os_string();
        let arguments = checks.iter().chain(&LIMITS).map(OsString::from);
        let files = files.iter().map(OsString::from).chain(["--image".into(), image]);
        Self { name, arguments: arguments.chain(files).collect() }
    }

    /// Runs it; its output comes when it is done.
    pub fn run(&self) -> Said {
        capture(host_sim(&["emulate", "press"]).args(&self.arguments))
    }
}

fn train(options: &[&str], model: &OsStr) -> Outcome {
    run(host_sim(&["train", "press"]).args(options).arg("--output").arg(model))
}

fn host_sim(arguments: &[&str]) -> Command {
    let mut command = cargo(&["run", "--quiet", "--package", "host-sim", "--"]);
    command.args(arguments);
    command
}
