//! Columns of any scale and offset, through train, blob, decode and eval of the program.

use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;
use taxel_data::random::{Purpose, Random, Stream};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const SCALE: Promise = Promise {
    name: "scale-sweep",
    text: "1e-300 to 1e300: R² as at scale 1, or refused",
    share: 2,
    check: sweep,
};

/// Time after which a command hangs.
const PATIENCE: Duration = Duration::from_mins(1);
const LINES: usize = 150;
/// First cases, which are not drawn.
const LOST: u64 = 14;
/// Factors by which a column must be accepted: its range is about 1 before.
const ACCEPTED_FACTORS: RangeInclusive<f64> = 1e-27..=1e29;
/// The largest offset with which a column must be accepted. Far larger ones leave a format too few digits.
const ACCEPTED_OFFSET: f64 = 100.0;

/// What becomes of a column: its values times a factor, plus an offset.
#[derive(Debug, Clone, Copy)]
struct Change {
    factor: f64,
    offset: f64,
}

impl Change {
    const NONE: Self = Self { factor: 1.0, offset: 0.0 };

    fn times(factor: f64) -> Self {
        Self { factor, ..Self::NONE }
    }

    fn plus(offset: f64) -> Self {
        Self { offset, ..Self::NONE }
    }

    fn of(self, value: f64) -> f64 {
        value * self.factor + self.offset
    }

    /// Whether a column must be accepted with this change.
    fn is_moderate(self) -> bool {
        ACCEPTED_FACTORS.contains(&self.factor) && self.offset.abs() <= ACCEPTED_OFFSET
    }
}

/// How a command ended.
#[derive(Debug, Clone, Copy)]
enum Outcome {
    /// R² of the model on its training lines.
    Accepted(f64),
    /// The message named the column.
    Refused,
    /// The column does not change in f64, and the program says so.
    Noted,
}

fn sweep(effort: &Effort, tools: &Tools) -> Result<Found, String> {
    let program = &path_of(tools)?;
    let folder = folder(effort.seed())?;
    let base: Result<Vec<f64>, String> = FORMATS
        .iter()
        .map(|format| match run(program, &folder.join(format), format, [Change::NONE; 2])? {
            Outcome::Accepted(r_squared) => Ok(r_squared),
            _ => Err("the moderate case is refused".into()),
        })
        .collect();
    let base = base?;
    let noted = AtomicU64::new(0);
    let found = effort.worst_of_accepted((64, 20_000), (0.02, "of R²"), |seed| {
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let mut format = random.below(FORMATS.len());
        let size = 10_f64.powf(random.between([-300.0, 300.0]));
        // Offsets that matter are from 1 to 1e18.
        let most = [18.0, 300.0][random.below(2)];
        let offset = 10_f64.powf(random.between([0.0, most]));
        let change = match seed % 4 {
            0 | 1 => Change::times([size, size.powf(0.1)][random.below(2)]),
            _ => Change::plus(offset),
        };
        let mut changes =
            if seed.is_multiple_of(2) { [change, Change::NONE] } else { [Change::NONE, change] };
        let number = seed.wrapping_sub(effort.seed());
        if number < LOST {
            // Outputs of which fixed16 loses more and more: up to those that it must refuse.
            format = 2;
            changes = [Change::NONE, Change::plus(100.0 * 2_f64.powi(number as i32))];
        }
        let case = folder.join(seed.to_string());
        let outcome = run(program, &case, FORMATS[format], changes);
        let _ = fs::remove_dir_all(&case);
        let lost = outcome.and_then(|outcome| {
            noted.fetch_add(u64::from(matches!(outcome, Outcome::Noted)), Ordering::Relaxed);
            lost(changes, outcome, base[format])
        });
        lost.map_err(|why| format!("{}, {changes:?}: {why}", FORMATS[format]))
    });
    let _ = fs::remove_dir_all(&folder);
    Ok(found.noted(|| format!("{} more are said not to change", noted.into_inner())))
}

/// R² that a changed column costs, of `base`. What is moderate must not be refused.
fn lost(changes: [Change; 2], outcome: Outcome, base: f64) -> Result<Option<f64>, String> {
    let is_moderate = changes.into_iter().all(Change::is_moderate);
    match outcome {
        Outcome::Accepted(r_squared) => Ok(Some(base - r_squared)),
        Outcome::Refused if is_moderate => Err("refused, but moderate".into()),
        Outcome::Noted if is_moderate => Err("is said not to change".into()),
        Outcome::Refused => Ok(None),
        Outcome::Noted => Ok(Some(0.0)),
    }
}

const FORMATS: [&str; 2] = ["f32", "fixed16"];

/// Path of the program from any folder.
fn path_of(tools: &Tools) -> Result<PathBuf, String> {
    let program = tools.program()?;
    program.canonicalize().map_err(|cause| format!("{}: {cause}", program.display()))
}

/// Empty folder for the files of a test.
fn folder(seed: u64) -> Result<PathBuf, String> {
    let path = std::env::temp_dir().join(format!("taxel-scale-{}-{seed}", std::process::id()));
    fs::create_dir_all(&path).map_err(|cause| format!("{}: {cause}", path.display()))?;
    Ok(path)
}

/// Trains on lines whose first input and whose output are changed, decodes and evaluates them.
fn run(
    program: &Path,
    folder: &Path,
    format: &str,
    changes: [Change; 2],
) -> Result<Outcome, String> {
    fs::create_dir_all(folder).map_err(|cause| cause.to_string())?;
    fs::write(folder.join("d.csv"), csv(changes)).map_err(|cause| cause.to_string())?;
    let train = ["train", "d.csv", "--inputs", "a,b", "--outputs", "y", "--centres", "14"];
    let train = [&train[..], &["--no-refine", "--format", format, "-o", "m.bin"]].concat();
    let trained = command(program, folder, &train)?;
    let said = String::from_utf8_lossy(&[trained.stdout, trained.stderr].concat()).into_owned();
    match trained.status.code() {
        Some(0) => {}
        Some(2) if said.contains("\"a\"") || said.contains("\"y\"") => return Ok(Outcome::Refused),
        code => return Err(format!("train ends with {code:?}: {said}")),
    }
    if said.contains("a never changes") || said.contains("y does not change") {
        return Ok(Outcome::Noted);
    }
    let decoded = command(program, folder, &["decode", "m.bin", "d.csv", "-o", "e.csv"])?;
    let estimates = fs::read_to_string(folder.join("e.csv")).unwrap_or_default();
    let first = |line: &str| line.split(',').next().and_then(|value| value.parse::<f64>().ok());
    let numbers = estimates.lines().skip(1).filter_map(first);
    if !decoded.status.success() || numbers.filter(|y| y.is_finite()).count() != LINES {
        return Err("decode gives no number for every line".into());
    }
    let evaluated = command(program, folder, &["--json", "eval", "m.bin", "d.csv"])?;
    let result: Value = serde_json::from_slice(&evaluated.stdout)
        .map_err(|cause| format!("eval prints no JSON: {cause}"))?;
    let r_squared = result["decoders"][0]["errors"][0]["r_squared"].as_f64();
    match r_squared {
        Some(r_squared) => Ok(Outcome::Accepted(r_squared)),
        // What hardly differs in f64 does not change.
        None if String::from_utf8_lossy(&evaluated.stdout).contains("y does not change") => {
            Ok(Outcome::Noted)
        }
        None => Err("eval gives no R²".into()),
    }
}

/// Lines of two inputs and an output.
fn csv(changes: [Change; 2]) -> String {
    let mut random = Random::new(1, Stream::Training, Purpose::Noise, 0, 0);
    let line = |_| {
        let (a, b) = (random.unit(), random.unit());
        let y = (3.0 * a).sin() * (2.0 * b).cos() + 0.5 * b * b;
        format!("{:e},{b:e},{:e}\n", changes[0].of(a), changes[1].of(y))
    };
    format!("a,b,y\n{}", (0..LINES).map(line).collect::<String>())
}

/// Output of a command, which must end in time.
fn command(program: &Path, folder: &Path, arguments: &[&str]) -> Result<Output, String> {
    let mut child = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|cause| format!("{}: {cause}", program.display()))?;
    let start = Instant::now();
    while child.try_wait().map_err(|cause| cause.to_string())?.is_none() {
        if start.elapsed() > PATIENCE {
            let _ = child.kill();
            return Err(format!("{arguments:?} hangs"));
        }
        sleep(Duration::from_millis(2));
    }
    child.wait_with_output().map_err(|cause| cause.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_extreme_may_be_refused() {
        let moderate = [1e-27, 1e-9, 1.0, 1e29].map(Change::times);
        for change in moderate.into_iter().chain([Change::plus(1.0), Change::plus(100.0)]) {
            for outcome in [Outcome::Refused, Outcome::Noted] {
                assert!(lost([change; 2], outcome, 1.0).is_err(), "{change:?}, {outcome:?}");
            }
            assert_eq!(lost([change; 2], Outcome::Accepted(0.75), 1.0), Ok(Some(0.25)));
        }
        for change in [1e-29, 1e31].map(Change::times).into_iter().chain([Change::plus(1e9)]) {
            assert_eq!(lost([change, Change::NONE], Outcome::Refused, 1.0), Ok(None), "{change:?}");
        }
    }
}
