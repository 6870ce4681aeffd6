//! Running one program in QEMU.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use defmt_decoder::{DecodeError, Table};

use crate::process::{Outcome, first_line};

/// Name of the emulator's program.
pub const QEMU: &str = "qemu-system-arm";

/// Time limit of a program; none takes more than half a minute.
const LIMIT: Duration = Duration::from_mins(5);

/// Checks that QEMU is installed.
pub fn present() -> Outcome {
    first_line(QEMU, &["--version"]).map(drop).ok_or(format!(
        "{QEMU} is not there. On Debian,\n  apt-get install qemu-system-arm\nor, for all that the \
         firmware needs,\n  bash firmware/setup.sh"
    ))
}

/// The table that decodes the logs of the program in `elf`.
pub fn table(elf: &Path) -> Outcome<Table> {
    let program = fs::read(elf).map_err(|cause| format!("{}: {cause}", elf.display()))?;
    Table::parse(&program)
        .map_err(|cause| format!("{}: {cause:#}", elf.display()))?
        .ok_or(format!("{} logs nothing through defmt", elf.display()))
}

/// Decodes a log that was saved while the program in `elf` ran.
pub fn decoded(log: &Path, elf: &Path) -> Outcome<String> {
    let logged = fs::read(log).map_err(|cause| format!("{}: {cause}", log.display()))?;
    Ok(decode(&table(elf)?, &logged))
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
    let table = table(elf)?;

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
    let log = decode(&table, &logged);
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

/// Decodes a log to text: `LEVEL message`, one entry after the other.
pub fn decode(table: &Table, logged: &[u8]) -> String {
    let mut decoder = table.new_stream_decoder();
    decoder.received(logged);
    let mut text = String::new();
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let level = frame.level().map(|level| level.as_str().to_uppercase() + " ");
                text.extend([level.unwrap_or_default(), frame.display_message().to_string()]);
                text.push('\n');
            }
            Err(DecodeError::UnexpectedEof) => return text,
            Err(DecodeError::Malformed) => {
                text.push_str("(bytes that are no log)\n");
                if !table.encoding().can_recover() {
                    return text;
                }
            }
        }
    }
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
