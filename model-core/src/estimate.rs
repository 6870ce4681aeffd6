//! The estimate that a frame is decoded to.

/// How the decoding of one row of a frame ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// The row was decoded; its outputs are valid.
    Decoded,
    /// At least one reading of the row was missing (not a finite number); the outputs are NaN. Behind a
    /// projection, a missing reading of any row counts.
    MissingReading,
    /// Readings or weights were so large that an output overflowed; the outputs are NaN.
    Overflow,
    /// The row is untouched: its readings are near those at rest ([`Gate`](crate::Gate)). The row was skipped; the
    /// outputs are those at rest.
    AtRest,
}

/// The decoded outputs of every row, in the units of the model's output columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate<const ROWS: usize, const OUTPUTS: usize> {
    /// `[row][output]`; NaN where the row could not be decoded.
    pub outputs: [[f32; OUTPUTS]; ROWS],
    /// How the decoding of each row ended.
    pub status: [RowStatus; ROWS],
}
