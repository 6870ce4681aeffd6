//! Why a session ends.

/// Why a session ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionEnd {
    /// Another model must be put in force.
    NewModel,
    /// The host asked for a restart.
    Restart,
}
