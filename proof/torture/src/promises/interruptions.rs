//! Jobs that are killed, interrupted, or find the disk full, at moments drawn by the seed.

use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use crate::effort::Effort;
use crate::found::Found;
use crate::jobs::{Job, Outcome, Place, is_running, wait};
use crate::promise::Promise;
use crate::tools::Tools;

pub const JOBS: Promise = Promise {
    name: "file-jobs",
    text: "an ended job leaves old files whole, or new ones",
    share: 8,
    check: jobs,
};

/// How a job is ended.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Kill,
    Interrupt,
    Terminate,
    /// Files may not grow beyond a size; to the program this is like a full disk.
    Full,
}

fn jobs(effort: &Effort, tools: &Tools) -> Result<Found, String> {
    let jobs = Job::all(tools.program()?)?;
    let least = if effort.is_planted() { 10 } else { 40 };
    let ended_early = AtomicU64::new(0);
    let mut found = effort.worst((least, 2000), (0.0, "broken"), |seed| {
        let mut draws = Draws(seed);
        let job = &jobs[(seed % jobs.len() as u64) as usize];
        let end = [End::Kill, End::Interrupt, End::Terminate, End::Full]
            [(seed / jobs.len() as u64 % 4) as usize];
        let place = job.place()?;
        let outcome = ended(job, &place, end, effort.is_planted(), &mut draws)?;
        ended_early.fetch_add(u64::from(!outcome.status.success()), Ordering::Relaxed);
        let judged = job.judge(&place, &outcome);
        judged.map(|()| 0.0).map_err(|cause| format!("{}, {end:?}: {cause}", job.name()))
    });
    if found.note.is_empty() {
        let ended_early = ended_early.into_inner();
        found.note =
            format!("{ended_early} of {} jobs were ended before they were done", found.cases);
    }
    Ok(found)
}

/// Begins a job, and ends it at some moment.
fn ended(
    job: &Job,
    place: &Place,
    end: End,
    is_planted: bool,
    draws: &mut Draws,
) -> Result<Outcome, String> {
    let blocks = match end {
        End::Full => draws.below(job.largest() as u64 / 512 + 1).to_string(),
        _ => "unlimited".to_owned(),
    };
    // In a self-test the job makes room for its outputs before it begins.
    let first = if is_planted { "rm -f data/*; " } else { "" };
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("ulimit -f {blocks}; {first}exec \"$0\" \"$@\"")]);
    let mut child =
        job.under(shell, place, true).spawn().map_err(|cause| format!("sh: {cause}"))?;
    let whole_us = job.took().as_micros() as u64;
    // Half of all moments are spread over the job; the others are soon after it begins to write.
    if draws.below(2) == 0 {
        thread::sleep(Duration::from_micros(draws.below(whole_us + whole_us / 5)));
    } else {
        thread::sleep(Duration::from_micros(draws.below(whole_us)));
        while !place.has_temporary() && is_running(&mut child)? {
            thread::yield_now();
        }
        thread::sleep(Duration::from_micros(draws.below(2000)));
    }
    match end {
        End::Kill => child.kill().map_err(|cause| format!("kill: {cause}"))?,
        End::Interrupt => signal(&mut child, "-INT")?,
        End::Terminate => signal(&mut child, "-TERM")?,
        End::Full => {}
    }
    wait(child, false)
}

fn signal(child: &mut Child, name: &str) -> Result<(), String> {
    // While it has not been waited for, its number belongs to nobody else.
    if is_running(child)? {
        let mut kill = Command::new("kill");
        kill.args([name, &child.id().to_string()]).stderr(Stdio::null());
        kill.status().map_err(|cause| format!("kill: {cause}"))?;
    }
    Ok(())
}

/// Draws of one case (SplitMix64).
struct Draws(u64);

impl Draws {
    /// A number below `bound`.
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ mixed >> 31) % bound.max(1)
    }
}
