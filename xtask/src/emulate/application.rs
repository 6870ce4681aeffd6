//! The application in the emulator, compared with the host by `taxel emulate`.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::PathBuf;

use crate::images::APPLICATION;
use crate::process::{Outcome, Said, capture, cargo, run, target_dir};
use crate::toolchain::elf;

/// Name of the application's image.
pub const IMAGE: &str = APPLICATION;

/// Limits in bytes: flash without a model, and RAM with the stack at its deepest.
const LIMITS: [(&str, u32); 2] = [("flash", 98_304), ("RAM", 18_432)];

/// Options of the check with a network a row.
const OF_ROWS: &[&str] = &["-n10000"];

/// Options of the check with one network for the whole array. Only decoding differs; it takes more stack.
const OF_ARRAY: &[&str] = &["-n1000"];

/// Options of the check of a filter in time, of frames a millisecond after one another.
const FILTERED: &[&str] = &["-n500", "--filter-ms=5", "--lead-ms=2", "--period-ms=1"];

/// Options of the check of a tracker, on a log of contacts that move.
const TRACKED: &[&str] = &["-n500"];

/// Training options of networks for each row, in the format that takes the longest.
const ROWS: &[&str] = &["--each-row", "--format=f32"];

/// Arguments for the test of taxel that the image keeps settings over restarts.
const BY_TESTS: &[&str] = &[
    "test",
    "--quiet",
    "--package=host-sim",
    "--test=all",
    "--",
    "--ignored",
    "--exact",
    "settings::the_image_keeps_settings_over_restarts",
];

/// Output of a test that was found, and passed.
const PASSED: &str = "test result: ok. 1 passed";

/// Arguments with which cargo runs taxel.
const TAXEL: &[&str] = &["run", "--quiet", "--package=host-sim", "--"];

/// One run of the application.
pub struct Check {
    pub name: &'static str,
    arguments: Vec<OsString>,
    /// Text that the output must contain; that of the image's check tells its memory instead.
    says: Option<&'static str>,
}

/// File in which the first check saves the application's log.
pub fn log() -> PathBuf {
    target_dir().join("qemu-app.defmt")
}

/// Trains the models for the checks, and returns the checks.
pub fn checks() -> Outcome<[Check; 5]> {
    let files = ["rows.bin", "array.bin", "tracked.bin", "moving.csv", "rest.csv"];
    let [rows, array, tracked, moving, rest] =
        files.map(|name| target_dir().join(format!("qemu-{name}")).into_os_string());
    let log = log().into_os_string();
    // Removes the log of the previous run, if there was one.
    let _ = fs::remove_file(&log);
    make(&["train", "press", "--no-refine"], ROWS, &rows)?;
    make(&["train", "press", "--no-refine"], &[], &array)?;
    make(&["train", "moving", "--no-refine"], &["--track"], &tracked)?;
    // A gain that a tracker knows by the baseline alone.
    make(&["synth", "moving", "--scale=1.02"], TRACKED, &moving)?;
    make(&["synth", "moving", "--scale=1.02", "--untouched"], TRACKED, &rest)?;
    let (press, model) = (OsStr::new("press"), OsStr::new("--model"));
    Ok([
        Check::new("application", press, OF_ROWS, &[model, &rows, "--log".as_ref(), &log]),
        Check::new("application with one network", press, OF_ARRAY, &[model, &array]),
        Check::new("application with a filter", press, FILTERED, &[model, &array]),
        Check::new(
            "application with a tracker",
            &moving,
            TRACKED,
            &[model, &tracked, "--baseline".as_ref(), &rest],
        ),
        Check {
            name: "application by tests",
            arguments: BY_TESTS.iter().map(OsString::from).collect(),
            says: Some(PASSED),
        },
    ])
}

impl Check {
    fn new(name: &'static str, frames: &OsStr, checks: &[&str], files: &[&OsStr]) -> Self {
        let image = elf(IMAGE).into_os_string();
        let checks = checks.iter().map(OsStr::new).chain(files.iter().copied());
        let arguments = TAXEL.iter().chain(&["emulate"]).map(OsStr::new).chain([frames]);
        let arguments = arguments.chain(checks).chain(["--image".as_ref(), &*image]);
        let arguments = arguments.map(OsString::from).collect();
        Self { name, arguments, says: None }
    }

    /// Runs the check, and returns its output when it is done.
    pub fn run(&self) -> Said {
        let mut said = capture(cargo(&[]).args(&self.arguments).env("TAXEL_IMAGE", elf(IMAGE)));
        if said.outcome.is_ok() {
            said.outcome = match self.says {
                Some(says) if said.out.contains(says) => Ok(()),
                Some(says) => Err(format!("it does not say {says:?}")),
                None => check_memory(&said.out),
            };
        }
        said
    }
}

/// Checks what the image takes, by the output of `taxel emulate`, against the [`LIMITS`].
fn check_memory(out: &str) -> Outcome {
    for (part, limit) in LIMITS {
        let bytes = out.lines().find_map(|line| {
            let bytes = line.strip_prefix(part)?.strip_prefix(':')?;
            bytes.split_whitespace().next()?.parse::<u32>().ok()
        });
        match bytes {
            Some(bytes) if bytes <= limit => {}
            Some(bytes) => return Err(format!("{part} takes {bytes} bytes, more than {limit}")),
            None => return Err(format!("it does not say what {part} takes")),
        }
    }
    Ok(())
}

fn make(command: &[&str], options: &[&str], output: &OsStr) -> Outcome {
    run(cargo(TAXEL).args(command).args(options).arg("--output").arg(output))
}

#[cfg(test)]
mod tests {
    use super::check_memory;

    #[test]
    fn an_image_that_takes_more_than_its_limits_is_refused() {
        let out = |flash: u32, ram: u32| {
            format!(
                "flash: {flash} bytes without the model: vector table 8\nRAM: {ram} bytes: variables 8\n"
            )
        };
        assert!(check_memory(&out(98_304, 18_432)).is_ok());
        assert!(check_memory(&out(98_305, 18_432)).is_err());
        assert!(check_memory(&out(98_304, 18_433)).is_err());
        assert!(check_memory("frames: 7").is_err());
    }
}
