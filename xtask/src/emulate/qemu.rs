//! Running one program in QEMU.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use crate::process::{Outcome, cargo, first_line, run as run_command, target_dir};

/// Name of the emulator's program.
pub const QEMU: &str = "qemu-system-arm";

/// Package and name of the program that decodes logs.
const LOG_DECODER: &str = "device-log";

/// Time limit of a program; none takes more than half a minute.
const LIMIT: Duration = Duration::from_mins(5);

/// Checks that QEMU is installed.
pub fn present() -> Outcome {
    first_line(QEMU, &["--version"]).map(drop).ok_or(format!(
        "{QEMU} is not there. On Debian,\n  apt-get install qemu-system-arm\nor, for all that the \
         firmware needs,\n  bash firmware/setup.sh"
    ))
}

/// Decodes a log that was saved while the program in `elf` ran.
pub fn decoded(log: &Path, elf: &Path) -> Outcome<String> {
    let logged = fs::read(log).map_err(|cause| format!("{}: {cause}", log.display()))?;
    decode(&logged, elf)
}

/// Result of a program that ended by itself.
pub struct Ended {
    /// Decoded log, one entry a line, and the exit status.
    pub log: String,
    /// Messages of QEMU itself.
    pub complaints: String,
}

/// Runs the program in `elf` to its end.
pub fn run(elf: &Path) -> Outcome<Ended> {
    let mut command = machine(elf);
    // Time is counted by instructions, 32 ns each, so that a program runs alike on a busy computer.
    command.args(["-icount", "shift=5"]);
    let mut child = command.spawn().map_err(|cause| format!("cannot start {QEMU}: {cause}"))?;
    // Both pipes must be read, because a full pipe makes its writer wait.
    let logged = reader(child.stdout.take());
    let complaints = reader(child.stderr.take());
    let status = wait(&mut child, LIMIT)?;
    let (logged, complaints) = (logged.join(), complaints.join());
    let (Ok(logged), Ok(complaints)) = (logged, complaints) else {
        return Err(format!("cannot read what {QEMU} writes"));
    };

    let complaints = String::from_utf8_lossy(&complaints).into_owned();
    let log = decode(&logged, elf)?;
    match status.and_then(|status| status.code()) {
        Some(code) => Ok(Ended { log: format!("{log}exit status {code}\n"), complaints }),
        None => Err(format!(
            "it did not end by itself within {} s; it logged\n{log}{complaints}",
            LIMIT.as_secs()
        )),
    }
}

/// Command that runs the program in `elf` in QEMU, with its log on stdout.
pub fn machine(elf: &Path) -> Command {
    let mut command = Command::new(QEMU);
    command.args(["-M", "mps2-an386", "-cpu", "cortex-m4", "-display", "none", "-monitor", "none"]);
    command.args(["-semihosting-config", "enable=on,target=native"]);
    command.arg("-kernel").arg(elf);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Reads `stream` to its end, in a thread.
pub fn reader(stream: Option<impl Read + Send + 'static>) -> thread::JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        // The bytes before an error are shown, so the error itself can be ignored.
        _ = stream.map(|mut stream| stream.read_to_end(&mut bytes));
        bytes
    })
}

/// Waits for a program's exit status; `None` if the time limit was reached and the program killed.
pub fn wait(child: &mut Child, limit: Duration) -> Outcome<Option<ExitStatus>> {
    let failed = |cause| format!("cannot wait for {QEMU}: {cause}");
    let start = Instant::now();
    while start.elapsed() < limit {
        if let Some(status) = child.try_wait().map_err(failed)? {
            return Ok(Some(status));
        }
        thread::sleep(Duration::from_millis(5));
    }
    child.kill().map_err(failed)?;
    child.wait().map_err(failed)?;
    Ok(None)
}

/// Decodes a log of the program in `elf` to text: `LEVEL message`, one entry after the other.
pub fn decode(logged: &[u8], elf: &Path) -> Outcome<String> {
    let mut command = Command::new(log_decoder()?);
    command.arg(elf).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let failed = |cause| format!("cannot run {LOG_DECODER}: {cause}");
    let mut child = command.spawn().map_err(failed)?;
    // It reads all before it writes. If it stops early, it says why itself.
    _ = child.stdin.take().map(|mut stdin| stdin.write_all(logged));
    let output = child.wait_with_output().map_err(failed)?;
    let [text, said] =
        [output.stdout, output.stderr].map(|it| String::from_utf8_lossy(&it).into_owned());
    if output.status.success() { Ok(text) } else { Err(said.trim_end().to_owned()) }
}

/// Path of the program that decodes logs, which is built when it is first asked for.
fn log_decoder() -> Outcome<&'static Path> {
    static BUILT: OnceLock<Outcome<PathBuf>> = OnceLock::new();
    let build = || {
        let mut build = cargo(&["build", "--quiet", "--package", LOG_DECODER]);
        run_command(&mut build).map(|()| target_dir().join("debug").join(LOG_DECODER))
    };
    BUILT.get_or_init(build).as_ref().map(PathBuf::as_path).map_err(Clone::clone)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(command: &str) -> Child {
        Command::new("sh").args(["-c", command]).spawn().unwrap()
    }

    #[test]
    fn a_program_that_ends_tells_its_exit_status() {
        let status = wait(&mut shell("exit 3"), LIMIT).unwrap();
        assert_eq!(status.and_then(|status| status.code()), Some(3));
    }

    #[test]
    fn a_program_that_does_not_end_is_killed() {
        let mut child = shell("exec sleep 600");
        assert_eq!(wait(&mut child, Duration::from_millis(50)), Ok(None));
        assert_eq!(child.wait().unwrap().code(), None); // a signal, no status
    }
}
