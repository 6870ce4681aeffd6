//! How long a plan would take, and how much memory, from a few of its points.

use serde::Serialize;

use super::super::progress::Terminal;
use super::super::{Common, print};
use crate::Result;
use crate::report::format::counted;
use crate::sweep::{Plan, Point, work};

/// Points that are computed.
const TRIED: usize = 5;
/// Numbers of shards for which times are told.
const SHARDS: [usize; 3] = [1, 8, 64];

/// What a plan would take.
#[derive(Serialize)]
struct Estimate<'e> {
    plan: &'e str,
    points: usize,
    /// Seconds that each of a few points took on one core.
    tried_s: Vec<f64>,
    /// Reasons of those that failed.
    failed: Vec<String>,
    /// Hours on one core.
    core_hours: f64,
    /// Hours here, on all cores.
    hours_here: f64,
    threads: usize,
    /// Peak of the memory in MB with one core; `None` where the system does not tell it.
    peak_mb: Option<f64>,
}

pub fn execute(plan: &Plan, points: &[Point], common: &Common) -> Result<print::Outcome> {
    let tried = TRIED.min(points.len());
    let last = points.len().saturating_sub(1);
    let terminal = Terminal::new(common);
    taxel_data::Progress::stage(&terminal, "a few points", tried);
    let (mut tried_s, mut failed) = (Vec::new(), Vec::new());
    for place in 0..tried {
        let point = &points[place * last / (tried - 1).max(1)];
        let (seconds, outcome) = work::on_one_core(plan, point)?;
        tried_s.push(seconds);
        failed.extend(
            outcome
                .err()
                .map(|cause: String| format!("{} ({}): {cause}", point.id, plan.in_words(point))),
        );
        taxel_data::Progress::step(&terminal);
    }
    drop(terminal);
    let mean_s = tried_s.iter().sum::<f64>() / tried_s.len().max(1) as f64;
    let core_hours = mean_s * points.len() as f64 / 3600.0;
    let threads = work::threads();
    let estimate = Estimate {
        plan: &plan.name,
        points: points.len(),
        tried_s,
        failed,
        core_hours,
        hours_here: core_hours / threads as f64,
        threads,
        peak_mb: peak_mb(),
    };
    print::result(common, &estimate, || page(&estimate, mean_s))
}

fn page(estimate: &Estimate<'_>, mean_s: f64) -> print::Page {
    let mut page = print::Page::default();
    let time = |hours: f64| match hours * 3600.0 {
        seconds if seconds < 120.0 => format!("{seconds:.0} s"),
        seconds if seconds < 7200.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{hours:.1} h"),
    };
    let ends = estimate.tried_s.iter().fold([f64::INFINITY, 0.0], |[a, b], s| [s.min(a), s.max(b)]);
    page.line(format_args!(
        "{}: {}. {} of them took {:.1} to {:.1} s on one core, {mean_s:.1} s on average.",
        estimate.plan,
        counted(estimate.points, "point"),
        estimate.tried_s.len(),
        ends[0],
        ends[1]
    ));
    page.line(format_args!(
        "All: about {} on one core, {} here on {} cores; less where points share their limit.",
        time(estimate.core_hours),
        time(estimate.hours_here),
        estimate.threads
    ));
    for shards in SHARDS.into_iter().filter(|shards| *shards <= estimate.points && *shards > 1) {
        let of_shard = time(estimate.core_hours / shards as f64);
        page.line(format_args!("{shards} shards of one core: {of_shard} each"));
    }
    if let Some(peak_mb) = estimate.peak_mb {
        page.line(format_args!("Memory: {peak_mb:.0} MB at most, for each core"));
    }
    estimate.failed.iter().for_each(|failed| page.line(format_args!("failed: {failed}")));
    page
}

/// Peak of this process's memory in MB.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1.024e-3)
}
