//! The pins of a virtual board.

/// Pin of the board. Which pins exist depends on the parts in the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pin {
    /// Control line of a row, from 0.
    Row(u8),
    /// Address line of the rows' 74HC4051, S0 first.
    RowAddress(u8),
    /// E̅ of the rows' 74HC4051.
    RowEnable,
    /// SER of the rows' 74HC595.
    RowData,
    /// SRCLK of the rows' 74HC595.
    RowClock,
    /// RCLK of the rows' 74HC595.
    RowLatch,
    /// Address line of the columns' 74HC4051s, S0 first.
    ColumnAddress(u8),
    /// E̅ of one of the columns' 74HC4051s.
    ColumnEnable(u8),
}
