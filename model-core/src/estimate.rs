//! The estimate that a frame is decoded to.

/// Status of one row of a decoded frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// The row was decoded; its outputs are valid.
    Decoded,
    /// At least one reading of the row was missing (not a finite number); the outputs are NaN. For networks that see
    /// whole frames, a missing reading of any row counts.
    MissingReading,
    /// Readings or weights were so large that an output overflowed; the outputs are NaN. Of several networks that see
    /// whole frames, those outputs are whose network overflowed.
    Overflow,
    /// No touch is strong enough to have a place: outputs that are places are NaN, all others are valid.
    NoTouch,
}

/// Memory for the outputs of a frame, and for the status of each row.
#[derive(Debug, PartialEq)]
pub struct Estimate<'e> {
    /// `rows × outputs` numbers, row after row, in the units of the model's output columns. NaN where a row could
    /// not be decoded.
    pub outputs: &'e mut [f32],
    /// Status of each row.
    pub status: &'e mut [RowStatus],
}
