//! The application in the emulator, held to the host by `host-sim emulate`.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::PathBuf;

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

/// A test of host-sim that lets the image answer the same requests on both lines, byte for byte.
const ON_BOTH: &[&str] = &[
    "test",
    "--quiet",
    "--package=host-sim",
    "--test=all",
    "--",
    "--ignored",
    "--exact",
    "device::the_image_answers_alike_on_both_lines",
];

/// How a test ends that was found, and passed.
const PASSED: &str = "test result: ok. 1 passed";

/// How cargo runs host-sim.
const HOST_SIM: &[&str] = &["run", "--quiet", "--package=host-sim", "--"];

/// One run of the application.
pub struct Check {
    pub name: &'static str,
    /// What cargo runs.
    arguments: Vec<OsString>,
    /// What must be among its output.
    says: &'static str,
}

/// What the first check leaves of the application's log.
pub fn log() -> PathBuf {
    target_dir().join("qemu-app.defmt")
}

/// What is to be checked, once the models for it are trained.
pub fn checks() -> Outcome<[Check; 4]> {
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
        Check {
            name: "application on both lines",
            arguments: ON_BOTH.iter().map(OsString::from).collect(),
            says: PASSED,
        },
    ])
}

impl Check {
    fn new(name: &'static str, checks: &[&str], files: &[&OsStr]) -> Self {
        let image = elf(IMAGE).into_os_string();
        let arguments = HOST_SIM.iter().chain(&["emulate", "press"]).chain(checks).chain(&LIMITS);
        let files = files.iter().map(OsString::from).chain(["--image".into(), image]);
        let arguments = arguments.map(OsString::from).chain(files).collect();
        Self { name, arguments, says: "" }
    }

    /// Runs it; its output comes when it is done.
    pub fn run(&self) -> Said {
        let mut said = capture(cargo(&[]).args(&self.arguments).env("TAXEL_IMAGE", elf(IMAGE)));
        if said.outcome.is_ok() && !said.out.contains(self.says) {
            said.outcome = Err(format!("it does not say {:?}", self.says));
        }
        said
    }
}

fn train(options: &[&str], model: &OsStr) -> Outcome {
    let mut command = cargo(HOST_SIM);
    run(command.args(["train", "press"]).args(options).arg("--output").arg(model))
}
