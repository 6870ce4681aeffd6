//! The sensor's size.

/// Number of row-wires.
pub const ROWS: usize = 2;
/// Number of column-wires.
pub const COLS: usize = 3;
/// Largest number of outputs of a row.
pub const OUTPUTS: usize = 2;
/// Length of the longest message in bytes.
pub const MESSAGE_BYTES: usize = 256;

/// Readings of a frame in Ω.
pub type TestFrame = [[f32; COLS]; ROWS];

/// Readings of the untouched sensor in Ω.
pub fn frame_at_rest() -> TestFrame {
    [[60.0, 61.0, 62.0], [63.0, 64.0, 65.0]]
}

/// The frame at rest with one other reading.
pub fn frame_with(row: usize, column: usize, ohm: f32) -> TestFrame {
    let mut frame = frame_at_rest();
    frame[row][column] = ohm;
    frame
}
