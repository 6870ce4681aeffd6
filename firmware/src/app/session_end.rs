//! Why a session ends.

/// Why a session ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionEnd {
    /// Another model must be put in force.
    NewModel,
    /// What is decoded from is damaged: a sound model must be put in force.
    Damaged,
    /// The host asked for a restart.
    Restart,
}
