//! Commands of the program, called in this process.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use std::{mem, process, thread};

use host_sim::commands::Stopped;
use host_sim::program;
use numpy::PyReadonlyArray2;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use taxel_data::DataFile;

/// Time between two looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Error of Python for a message and the program's exit status.
pub fn error((message, status): (String, u8)) -> PyErr {
    if status == 2 { PyValueError::new_err(message) } else { PyRuntimeError::new_err(message) }
}

/// Pool that decodes, with its process and its number of threads.
static KEPT: Mutex<Option<(u32, usize, Arc<ThreadPool>)>> = Mutex::new(None);

fn new_pool(threads: usize) -> PyResult<ThreadPool> {
    let built = ThreadPoolBuilder::new().num_threads(threads).stack_size(16 << 20).build();
    built.map_err(|cause| PyRuntimeError::new_err(format!("cannot start threads: {cause}")))
}

/// Does short `work` on so many threads, or on all cores for 0. Their pool is kept, but not over a fork: a child has none of
/// its parent's threads.
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let own = process::id();
    // A parent may have held the lock at the fork: nobody waits for it.
    let mut kept = KEPT.try_lock().ok();
    let found = kept.as_deref().and_then(Option::as_ref);
    let found = found.filter(|it| (it.0, it.1) == (own, threads)).map(|it| Arc::clone(&it.2));
    let pool = found.map_or_else(|| new_pool(threads).map(Arc::new), Ok)?;
    if let Some(kept) = kept.as_deref_mut()
        && let Some(before) = kept.replace((own, threads, Arc::clone(&pool)))
        && before.0 != own
    {
        mem::forget(before); // its end would wait for the parent's threads
    }
    drop(kept);
    Ok(pool.install(work))
}

/// Does `work` in a thread of its own, and on so many others (0: one a core), while other threads of Python run and Ctrl-C is
/// heard. `stop` is set by the latter, and the work is waited for.
pub fn apart<T: Send + 'static>(
    py: Python<'_>,
    stop: &Arc<AtomicBool>,
    threads: usize,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = new_pool(threads)?; // of this work alone, and of this process
    let (sender, receiver) = mpsc::channel();
    let worker = thread::Builder::new().name("taxel".into()).spawn(move || {
        // Nothing of what the work shares is used after a panic.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(|| pool.install(work))));
    })?;
    let done = wait(py, stop, receiver);
    let _ = worker.join();
    match done? {
        Some(Ok(value)) => Ok(value),
        Some(Err(panic)) if panic.is::<Stopped>() => Err(PyRuntimeError::new_err("stopped")),
        _ => Err(PyRuntimeError::new_err(
            "an error in taxel: its work ended by a panic; please report what you called",
        )),
    }
}

/// Waits for what a thread sends, while other threads of Python run; `None` if it ends without. Ctrl-C sets `stop`, and the
/// thread is waited for all the same.
pub fn wait<T: Send>(
    py: Python<'_>,
    stop: &AtomicBool,
    receiver: mpsc::Receiver<T>,
) -> PyResult<Option<T>> {
    let receiver = Mutex::new(receiver); // which Python may look at from any thread
    let look = || receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(LOOK);
    let mut interrupted = None;
    loop {
        match (py.detach(look), interrupted) {
            (Ok(_) | Err(RecvTimeoutError::Disconnected), Some(interrupted)) => {
                return Err(interrupted);
            }
            (Ok(sent), None) => return Ok(Some(sent)),
            (Err(RecvTimeoutError::Disconnected), None) => return Ok(None),
            (Err(RecvTimeoutError::Timeout), before) => {
                interrupted = before.or_else(|| py.check_signals().err());
                stop.store(interrupted.is_some(), Ordering::Relaxed);
            }
        }
    }
}

/// A table: its path among the arguments of a command, the names of its columns, and its lines.
type Table<'py> = (String, Vec<String>, PyReadonlyArray2<'py, f64>);

/// Calls a command of `taxel` with these arguments, of which some are paths of `tables`, on so many threads. Returns its
/// result as JSON, and its remarks.
#[pyfunction]
pub fn call(
    py: Python<'_>,
    arguments: Vec<String>,
    tables: Vec<Table<'_>>,
    threads: usize,
) -> PyResult<(String, Vec<String>)> {
    let table = |(path, header, lines): Table<'_>| {
        let table = DataFile::of_table(Path::new(&path), header, lines.as_slice()?.to_vec());
        table.map_err(|cause| PyValueError::new_err(cause.to_string()))
    };
    let tables = tables.into_iter().map(table).collect::<PyResult<Vec<_>>>()?;
    let stop = Arc::default();
    let flag = Arc::clone(&stop);
    let called = apart(py, &stop, threads, move || program::call(&arguments, tables, &flag))?
        .map_err(error)?;
    Ok((called.json, called.remarks))
}

/// Runs the program with this command line, whose first argument is its name. Returns its exit status.
#[pyfunction]
pub fn main(py: Python<'_>, arguments: Vec<String>) -> u8 {
    py.detach(|| program::main_from(arguments))
}
