//! Outputs while calls of the real program fail, by `strace`. Where there is no strace, this is not tested.

use std::fs;
use std::process::{Command, Stdio};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::effort::Effort;
use crate::found::Found;
use crate::jobs::{Job, wait};
use crate::tools::Tools;

/// Calls to the system, and what they are made to do.
const FAULTS: &[(&str, &[&str])] = &[
    (
        "write",
        &["error=ENOSPC", "error=EIO", "error=EINTR", "error=EPIPE", "signal=KILL", "signal=TERM"],
    ),
    ("openat", &["error=ENOSPC", "error=EMFILE", "signal=KILL"]),
    ("close", &["error=EIO", "signal=KILL"]),
    ("fsync", &["error=EIO", "error=ENOSPC", "signal=KILL", "signal=INT"]),
    ("rename", &["error=ENOSPC", "error=EIO", "signal=KILL", "signal=INT"]),
    ("mkdir", &["error=ENOSPC", "signal=KILL"]),
    ("unlink", &["error=EIO", "signal=KILL"]),
    ("rmdir", &["error=EIO", "signal=KILL"]),
    ("fchmod", &["error=EPERM", "signal=KILL"]),
    ("flock", &["error=ENOLCK", "signal=KILL"]),
];

/// Adds to `found` what happens if the n-th of each call fails, for every n, as far as there is time.
pub fn test(effort: &Effort, tools: &Tools, found: &mut Found) -> Result<(), String> {
    let works = Command::new("strace").arg("-V").stdout(Stdio::null()).status();
    if !works.is_ok_and(|status| status.success()) {
        found.note += "not tested: calls of the program itself, for which strace is missing";
        return Ok(());
    }
    let jobs = Job::of_each_kind(tools.program()?)?;
    let kinds =
        FAULTS.iter().flat_map(|(call, faults)| faults.iter().map(move |fault| (call, fault)));
    let kinds =
        jobs.iter().flat_map(|job| kinds.clone().map(move |(call, fault)| (job, call, fault)));
    let tested = kinds.collect::<Vec<_>>().into_par_iter().map(|(job, call, fault)| {
        let mut failed = None;
        for number in 1.. {
            if effort.is_over() {
                return Ok((number - 1, failed));
            }
            let (struck, outcome) = traced(job, &format!("{call}:{fault}:when={number}"))?;
            if !struck {
                return Ok((number - 1, failed));
            }
            let at = format!("{} with {call} {number}, {fault}", job.name());
            failed = outcome.err().map(|cause| format!("{at}: {cause}")).or(failed);
        }
        Ok((0, failed))
    });
    for (cases, failed) in tested.collect::<Result<Vec<(u64, Option<String>)>, String>>()? {
        found.cases += cases;
        if let Some(cause) = failed {
            found.worst = f64::INFINITY;
            found.note = cause;
        }
    }
    Ok(())
}

/// Runs a job with a fault, and returns whether it struck and what is left.
fn traced(job: &Job, fault: &str) -> Result<(bool, Result<(), String>), String> {
    let place = job.place()?;
    let log = place.path().join(".strace");
    let call = fault.split(':').next().unwrap_or_default();
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-o"]).arg(&log).args(["-e", &format!("trace={call}")]);
    command.args(["-e", &format!("inject={fault}"), "--"]);
    let child = job.under(command, &place, true).spawn();
    let may_panic = fault.starts_with("close:error");
    let outcome = wait(child.map_err(|cause| format!("strace: {cause}"))?, may_panic)?;
    let text = fs::read_to_string(&log).unwrap_or_default();
    let _ = fs::remove_file(&log);
    let is_signal = fault.contains("signal=");
    let struck = text.contains("INJECTED") || (is_signal && is_killed(&text));
    Ok((struck, job.judge(&place, &outcome)))
}

fn is_killed(log: &str) -> bool {
    log.contains("+++ killed by") || log.contains("--- SIG")
}
