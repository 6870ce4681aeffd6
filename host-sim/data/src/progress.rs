//! Progress of long work, told to whoever wants to show it.

/// A listener to the progress of long work. Steps may come from any thread.
pub trait Progress: Sync {
    /// A stage of so many steps begins.
    fn stage(&self, name: &str, steps: usize);

    /// A step of the stage is done.
    fn step(&self);
}

/// A listener that shows nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _: &str, _: usize) {}

    fn step(&self) {}
}
