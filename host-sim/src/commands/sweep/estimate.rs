//! How long a plan would take, and how much memory, from a few of its points.

use super::super::progress::Terminal;
use super::super::{Common, print};
use crate::Result;
use crate::report::Sections;
use crate::sweep::{Plan, Point, work};

/// Points that are computed.
const TRIED: usize = 5;
/// Numbers of shards for which times are told.
const SHARDS: [usize; 3] = [1, 8, 64];

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
    let hours_here = core_hours / threads as f64;
    let time = |hours: f64| match hours * 3600.0 {
        seconds if seconds < 120.0 => format!("{seconds:.0} s"),
        seconds if seconds < 7200.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{hours:.1} h"),
    };
    let ends = tried_s.iter().fold([f64::INFINITY, 0.0], |[a, b], s| [s.min(a), s.max(b)]);
    let mut sections = Sections::new(format!("The sweep {}", plan.name));
    sections.value("plan", &plan.name);
    sections.fact("points", "points", "", points.len());
    sections.value("tried_s", &tried_s);
    let each = format!(
        "{:.1} to {:.1} s, {mean_s:.1} s on average, of {} that were computed",
        ends[0],
        ends[1],
        tried_s.len()
    );
    sections.line("a point on one core", each);
    sections.value("core_hours", &core_hours);
    sections.value("hours_here", &hours_here);
    sections.value("threads", &threads);
    sections.line(
        "all points",
        format!(
            "about {} on one core, {} here on {threads} cores; less where points share their limit",
            time(core_hours),
            time(hours_here)
        ),
    );
    for shards in SHARDS.into_iter().filter(|shards| *shards <= points.len() && *shards > 1) {
        let of_shard = time(core_hours / shards as f64);
        sections.line("shards of one core", format!("{shards}, {of_shard} each"));
    }
    let peak_mb = peak_mb();
    sections.value("peak_mb", &peak_mb);
    let memory = peak_mb.map(|peak_mb| format!("{peak_mb:.0} MB at most, for each core"));
    sections.line("memory", memory.unwrap_or_default());
    failed.iter().for_each(|failed| sections.line("failed", failed.as_str()));
    sections.value("failed", &failed);
    Ok(print::sections(common, &sections))
}

/// Peak of this process's memory in MB.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1.024e-3)
}
