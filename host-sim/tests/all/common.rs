//! Runs of the binary as by a user, in a folder of the test's own.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Output};

use host_sim::experiment::Experiment;
use taxel_learn::Options;

/// Folder that is removed after the test.
pub struct Folder(PathBuf);

/// Path of the program.
const PROGRAM: &str = env!("CARGO_BIN_EXE_taxel");

/// The program as a terminal starts it: signals end it, even if whoever runs the tests ignores some, as behind a
/// script's `&`.
pub fn program() -> Command {
    // Bits of SIGHUP, SIGINT and SIGTERM, by Linux's description of the file.
    const ENDING: u64 = 1 | 1 << 1 | 1 << 14;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    if ignored.unwrap_or(0) & ENDING == 0 {
        return Command::new(PROGRAM);
    }
    let mut command = Command::new("env");
    command.args(["--default-signal=HUP,INT,TERM", PROGRAM]);
    command
}

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, content).unwrap();
        path
    }

    /// Text of a file in the folder.
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|cause| panic!("{name}: {cause}"))
    }

    /// Names of everything in the folder, hidden files too.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Runs `taxel` in this folder.
    pub fn run(&self, arguments: &[&str]) -> Output {
        self.run_with_threads(arguments, 2)
    }

    pub fn run_with_threads(&self, arguments: &[&str], threads: usize) -> Output {
        Command::new(PROGRAM)
            .args(arguments)
            .current_dir(&self.0)
            .env("RAYON_NUM_THREADS", threads.to_string())
            .output()
            .unwrap()
    }

    /// Runs the program, which must end with this exit `status`, and returns what it says on stderr.
    pub fn fail(&self, arguments: &[&str], status: i32) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {stderr}");
        stderr
    }

    /// Runs `taxel` and expects success; returns stdout.
    pub fn succeed(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(
            output.status.success(),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs `taxel` and expects success; returns what it says on stderr.
    pub fn notes(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{arguments:?}: {stderr}");
        stderr
    }

    /// Runs `taxel` with `--json` and expects success; returns its result.
    pub fn json(&self, arguments: &[&str]) -> serde_json::Value {
        let text = self.succeed(&[arguments, &["--json"]].concat());
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{arguments:?}: {error}: {text}"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Status as a shell tells it: 128 and the signal, if one ended the program.
#[cfg(unix)]
pub fn shell_status(status: ExitStatus) -> Option<i32> {
    use std::os::unix::process::ExitStatusExt;
    status.code().or(status.signal().map(|signal| 128 + signal))
}

/// RMSE of a group of outputs in the `errors` of a decoder.
pub fn rmse(errors: &serde_json::Value, group: &str) -> f64 {
    let of_group = errors.as_array().unwrap().iter().find(|errors| errors["group"] == group);
    of_group.unwrap()["rmse"].as_f64().unwrap()
}

/// Printed JSON without the time that the command took, which differs from run to run.
pub fn untimed(json: &str) -> String {
    let lines = json.lines().filter(|line| !line.starts_with("  \"seconds\": "));
    let untimed = lines.collect::<Vec<_>>().join("\n");
    assert!(untimed.lines().count() < json.lines().count(), "no time in {json}");
    untimed
}

/// A built-in scene with a network for each row in f32, whose centres stay where K-means puts them.
pub fn unrefined(scene: &str) -> Experiment {
    let mut experiment = Experiment::load(scene).unwrap();
    let Options { centres, features, .. } = experiment.training.options;
    experiment.training.options = Options { centres, features, ..Options::of_rows() };
    experiment.training.refine = false;
    experiment
}

/// A scene's text, in which each of the texts is replaced by another.
fn replaced(scene: &str, texts: &[(&str, &str)]) -> String {
    let mut scene = scene.to_owned();
    for (from, to) in texts {
        assert!(scene.contains(from), "{from}");
        scene = scene.replacen(from, to, 1);
    }
    scene
}

/// Scene that runs in a moment: rows 4 and 5 of `press`, without refinement; a network for each row in f32.
pub fn small_scene() -> String {
    replaced(
        include_str!("../../../scenes/press.toml"),
        &[
            ("name = \"press\"", "name = \"small\""),
            ("[training]", "[training]\nrefine = false\neach_row = true\nformat = \"f32\""),
            ("spread = 0.4", "spread = 0.8"),
            ("[outputs]", "[readout]\nrow_wires = [4, 5]\n\n[outputs]"),
            ("frames = 20000", "frames = 3000"),
            ("test_frames = 8000", "test_frames = 80"),
            ("centres = 64", "centres = 12"),
        ],
    )
}

/// [`small_scene`] with as few frames as its least possible error needs.
pub fn tiny_scene() -> String {
    small_scene()
        .replace("frames = 3000", "frames = 200")
        .replace("test_frames = 80", "test_frames = 50")
}

/// A quarter of the sensor of `moving`, two trajectories, and few frames.
pub fn tiny_moving_scene() -> String {
    replaced(
        include_str!("../../../scenes/moving.toml"),
        &[
            ("row_wires = 8", "row_wires = 4"),
            ("electrodes_per_row_wire = 6", "electrodes_per_row_wire = 3"),
            ("column_wires = 18", "column_wires = 9"),
            ("[20.0, 18.0, 5.0]", "[10.0, 9.0, 5.0]"),
            ("[[8.0, 12.0], [7.0, 11.0]]", "[[4.0, 6.0], [3.0, 5.0]]"),
            ("[[0.5, 7.5], [0.5, 6.5]]", "[[0.5, 2.5], [0.5, 2.5]]"),
            ("trajectories = 64", "trajectories = 2"),
            ("[training]", "[training]\nrefine = false"),
            ("frames = 20000", "frames = 400"),
            ("test_frames = 8000", "test_frames = 60"),
            ("centres = 64", "centres = 8"),
        ],
    )
}

/// [`small_scene`] with a Table 1, which takes most of its time.
pub fn small_scene_with_table1() -> String {
    small_scene()
        + "\n[table1]\nspreads = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]\n\
           noise_levels = [0.01]\nframes = 1500\ntest_frames = 60\ncentres = 10\n\
           standard_frames = 40\n"
}
