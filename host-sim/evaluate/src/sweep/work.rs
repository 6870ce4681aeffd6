//! Work on the points of a shard, on all threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use taxel_data::Progress;

use super::judge::{self, Outcome};
use super::plan::{Plan, Point};
use super::store::{Found, Record, Store};
use crate::error::{Error, Result};

/// What came of the work on a shard.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Worked {
    pub computed: usize,
    /// Points that were there already.
    pub skipped: usize,
    /// Points that cannot be computed, and why.
    pub failed: Vec<String>,
    /// Files that were no results of their points, and are replaced.
    pub replaced: Vec<String>,
}

/// Computes the points in `groups`, indices of `points`, and keeps each that is done; those that are there already are
/// left alone. Points of a group share their limit.
///
/// Groups are worked on side by side. Threads that are left over compute within a group.
///
/// # Errors
/// [`Error`] for a result that cannot be read or written; those of others are kept.
pub fn run(
    plan: &Plan,
    points: &[Point],
    groups: &[Vec<usize>],
    store: &Store,
    progress: &dyn Progress,
) -> Result<Worked> {
    let mut worked = Worked::default();
    let mut left = Vec::new();
    for group in groups {
        let mut missing = Vec::new();
        for index in group {
            match store.find(plan, &points[*index])? {
                Found::Whole(record) => {
                    worked.skipped += 1;
                    worked.failed.extend(of_failed(plan, &points[*index], &record));
                }
                Found::Missing => missing.push(*index),
                Found::Unusable(why) => {
                    let path = store.path(&points[*index].id);
                    worked.replaced.push(format!("{}: {why}", path.display()));
                    missing.push(*index);
                }
            }
        }
        left.extend((!missing.is_empty()).then_some(missing));
    }
    let records = Mutex::new(&mut worked);
    let keep = |index: usize, record: &Record| {
        store.write(record)?;
        progress.step();
        let mut worked = records.lock().unwrap_or_else(PoisonError::into_inner);
        worked.computed += 1;
        worked.failed.extend(of_failed(plan, &points[index], record));
        Ok(())
    };
    progress.stage(stage(plan), left.iter().map(Vec::len).sum());
    each(plan, points, &left, &keep)?;
    Ok(worked)
}

/// What is done with each point, for people.
const fn stage(plan: &Plan) -> &'static str {
    if plan.train { "train and measure" } else { "measure" }
}

/// Computes all points, and returns their records in their order.
///
/// # Errors
/// [`Error`] for threads that cannot be started.
pub fn in_memory(
    plan: &Plan,
    points: &[Point],
    progress: &dyn Progress,
) -> Result<Vec<Option<Record>>> {
    until(plan, points, &|_, _| Ok(()), progress)
}

/// Computes all points as [`in_memory`] does, until `accept` refuses the record of one.
///
/// # Errors
/// The refusal, and [`Error`] for threads that cannot be started.
pub fn until(
    plan: &Plan,
    points: &[Point],
    accept: &(dyn Fn(usize, &Record) -> Result<()> + Sync),
    progress: &dyn Progress,
) -> Result<Vec<Option<Record>>> {
    let records = Mutex::new(vec![None; points.len()]);
    progress.stage(stage(plan), points.len());
    let keep = |index: usize, record: &Record| {
        accept(index, record)?;
        progress.step();
        records.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(record.clone());
        Ok(())
    };
    each(plan, points, &super::Shard::WHOLE.groups(points), &keep)?;
    Ok(records.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Seconds that a point takes on one core by itself, and its results: what others would share is counted.
///
/// # Errors
/// [`Error`] for a thread that cannot be started.
pub fn on_one_core(plan: &Plan, point: &Point) -> Result<(f64, Outcome)> {
    let (pool, mut found) = (pool(1)?, None);
    let begun = Instant::now();
    let mut keep = |_, outcome| {
        found = Some(outcome);
        Ok(())
    };
    pool.install(|| judge::compute(plan, std::slice::from_ref(point), &[0], &mut keep))?;
    let outcome = found.unwrap_or_else(|| Err("nothing was computed".into()));
    Ok((begun.elapsed().as_secs_f64(), outcome))
}

/// Number of threads that work here.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    built.map_err(|cause| Error::failed(format!("cannot start threads: {cause}")))
}

fn of_failed(plan: &Plan, point: &Point, record: &Record) -> Option<String> {
    record.failed.as_ref().map(|why| format!("{} ({}): {why}", point.id, plan.in_words(point)))
}

/// Computes the points of all groups, and hands each record to `keep` as soon as it is there.
fn each(
    plan: &Plan,
    points: &[Point],
    groups: &[Vec<usize>],
    keep: &(dyn Fn(usize, &Record) -> Result<()> + Sync),
) -> Result<()> {
    let threads = rayon::current_num_threads();
    let workers = threads.min(groups.len()).max(1);
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let work = || -> Result<()> {
        while let Some(group) = groups.get(next.fetch_add(1, Ordering::Relaxed)) {
            let mut keep = |index: usize, outcome: Outcome| {
                if stop.load(Ordering::Relaxed) {
                    return Err(Error::failed("another thread failed"));
                }
                keep(index, &Record::new(plan, &points[index], outcome))
            };
            if let Err(error) = judge::compute(plan, points, group, &mut keep) {
                // The first error is the one to tell.
                return if stop.swap(true, Ordering::Relaxed) { Ok(()) } else { Err(error) };
            }
        }
        Ok(())
    };
    let own = |worker: usize| threads / workers + usize::from(worker < threads % workers);
    let pools = (0..workers).map(|worker| pool(own(worker))).collect::<Result<Vec<_>>>()?;
    std::thread::scope(|scope| {
        let running: Vec<_> = pools.iter().map(|pool| scope.spawn(|| pool.install(work))).collect();
        let outcomes = running.into_iter().map(|thread| match thread.join() {
            Ok(outcome) => outcome,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        outcomes.collect::<Vec<_>>().into_iter().collect()
    })
}
