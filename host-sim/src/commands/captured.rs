//! A command called in the same process: the tables that it is given, and what it says, instead of files, stdout and stderr.

use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use taxel_data::DataFile;

/// What a command has said so far.
#[derive(Default)]
pub struct Captured {
    /// Its result.
    pub result: String,
    /// Its remarks, one each.
    pub remarks: Vec<String>,
    /// Tables that it reads under their paths, in place of files.
    tables: Vec<DataFile>,
    /// Flag that ends its work when it is set.
    stop: Arc<AtomicBool>,
}

/// What long work unwinds with when its caller wants it to stop.
pub struct Stopped;

thread_local! {
    static CAPTURED: RefCell<Option<Captured>> = const { RefCell::new(None) };
}

/// Does `work` in this thread and keeps what it says. It finds these `tables` under their paths. Where it shows progress, it
/// unwinds with [`Stopped`] once `stop` is set.
pub fn capture<T>(
    stop: &Arc<AtomicBool>,
    tables: Vec<DataFile>,
    work: impl FnOnce() -> T,
) -> (T, Captured) {
    let captured = Captured { tables, stop: Arc::clone(stop), ..Captured::default() };
    CAPTURED.set(Some(captured));
    let done = work();
    (done, CAPTURED.take().unwrap_or_default())
}

/// Table that the caller gave under this path.
pub fn table(path: &Path) -> Option<DataFile> {
    with(|captured| captured.tables.iter().find(|table| table.path == path).cloned()).flatten()
}

/// Keeps a result. Returns whether somebody wants it.
pub fn keep_result(text: &str) -> bool {
    with(|captured| captured.result.push_str(text)).is_some()
}

/// Keeps a remark. Returns whether somebody wants it.
pub fn keep_remark(text: &str) -> bool {
    with(|captured| captured.remarks.push(text.into())).is_some()
}

/// Flag that ends the work of this thread when it is set; `None` if nobody captures it.
pub fn stop() -> Option<Arc<AtomicBool>> {
    with(|captured| Arc::clone(&captured.stop))
}

fn with<T>(look: impl FnOnce(&mut Captured) -> T) -> Option<T> {
    CAPTURED.with_borrow_mut(|captured| captured.as_mut().map(look))
}
