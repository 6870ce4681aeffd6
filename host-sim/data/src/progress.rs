//! Progress of long work, reported to whoever wants to show it.

/// Listener to the progress of long work; its methods may be called from any thread.
pub trait Progress: Sync {
    /// Begins a stage called `name` of so many `steps`.
    fn stage(&self, name: &str, steps: usize);

    /// Counts one step of the current stage as done.
    fn step(&self);
}

/// Listener that shows nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _: &str, _: usize) {}

    fn step(&self) {}
}
