//! Why a session ends.

/// Why a session ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leave {
    /// Another model was committed, and must be put in force.
    NewModel,
    /// The memory for weights is needed for a recalibration, or is free again.
    MakeRoom,
    /// The host asked for a restart.
    Restart,
}
