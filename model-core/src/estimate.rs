//! What a frame is decoded to.

/// What became of one row of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// All readings were there; the outputs are valid.
    Decoded,
    /// At least one reading of the row, or behind a projection of any row, was missing (not a finite number);
    /// the outputs are NaN.
    MissingReading,
    /// Readings or weights so large that an output overflowed; the outputs are NaN.
    Overflow,
    /// All readings are near those at rest ([`Gate`](crate::Gate)); the outputs are those at rest.
    AtRest,
}

/// The outputs of every row, in the units of the model's output columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate<const ROWS: usize, const OUTPUTS: usize> {
    /// `[row][output]`; NaN where the row could not be decoded.
    pub outputs: [[f32; OUTPUTS]; ROWS],
    /// What became of each row.
    pub status: [RowStatus; ROWS],
}
