//! The emulated board, which is a Python program: what it needs, and running it.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use taxel_firmware::timing::ScanPlan;

use super::Options;
use crate::images::NUCLEO_WIDE;
use crate::process::{Outcome, cargo, first_line, root, run, target_dir};
use crate::toolchain::elf;

const FOLDER: &str = "proof/board-emulator";

/// Python as `firmware/setup.sh` installs it.
const OWN_PYTHON: &str = "proof/board-emulator/.venv/bin/python";

/// A Python program that fails if a package is missing, and prints a line otherwise.
const NEEDS: &str = "import elftools, unicorn; print(unicorn.__version__)";

/// Arguments that train the model which scenarios upload, small enough that an upload takes seconds.
const TRAIN: [&str; 7] =
    ["train", "press", "--no-refine", "--each-row", "--format=f32", "--centres=16", "--output"];

/// What a scenario needs besides the image.
pub struct Emulator {
    python: PathBuf,
    /// Arguments that are the same for all scenarios.
    arguments: Vec<OsString>,
}

impl Emulator {
    /// Finds Python and its packages, builds taxel, and trains the model.
    pub fn prepare(options: &Options) -> Outcome<Self> {
        let python = python()?;
        let folder = folder();
        fs::create_dir_all(&folder).map_err(|cause| format!("{}: {cause}", folder.display()))?;
        run(&mut cargo(&["build", "--quiet", "--package", "host-sim"]))?;
        let taxel = target_dir().join("debug").join("taxel");
        let model = if let Some(model) = &options.model {
            root().join(model)
        } else {
            let model = folder.join("model.bin");
            run(Command::new(&taxel).args(TRAIN).arg(&model).current_dir(root()))?;
            model
        };
        let frames = options.frames.to_string();
        let named = [
            ("--taxel", taxel),
            ("--model", model),
            ("--directory", folder),
            ("--wide-image", elf(NUCLEO_WIDE)),
        ];
        let mut arguments = vec![root().join(FOLDER).join("run.py").into_os_string()];
        for (name, value) in named {
            arguments.extend([name.into(), value.into_os_string()]);
        }
        arguments.extend(["--frames".into(), frames.into()]);
        let seconds = options.seconds.to_string();
        arguments.extend(["--seconds".into(), seconds.into()]);
        let scans = [1, 12].map(|samples| {
            let plan = ScanPlan::of_nucleo_onchip(8, 18, samples);
            format!("{},{}", plan.scan_us(), plan.longest_us())
        });
        arguments.extend(["--scans".into(), scans.join(",").into()]);
        Ok(Self { python, arguments })
    }

    /// Runs the scenarios of these names on `image`, or all; their output is passed through.
    pub fn run(&self, image: &Path, scenarios: &[String]) -> Outcome {
        run(self.command(image).args(scenarios)).map_err(|_| "a scenario failed: see above".into())
    }

    /// The emulator with this `image`, before the names of scenarios.
    pub fn command(&self, image: &Path) -> Command {
        let mut command = Command::new(&self.python);
        command.args(&self.arguments).arg("--image").arg(image).current_dir(root());
        command
    }
}

/// File of a scenario's log.
pub fn log(scenario: &str) -> PathBuf {
    folder().join(format!("{scenario}.defmt"))
}

/// Folder for models, tables and logs.
fn folder() -> PathBuf {
    target_dir().join("board")
}

fn python() -> Outcome<PathBuf> {
    let candidates = [root().join(OWN_PYTHON), "python3".into()];
    let complete = |python: &PathBuf| first_line(python, &["-c", NEEDS]).is_some();
    candidates.into_iter().find(complete).ok_or(format!(
        "the emulated board needs Python with the packages in {FOLDER}/requirements.txt. For all that the \
         firmware needs,\n  bash firmware/setup.sh"
    ))
}
