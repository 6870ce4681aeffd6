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

impl Pin {
    /// Every pin; its index is its number.
    pub const ALL: [Self; 21] = [
        Self::Row(0),
        Self::Row(1),
        Self::Row(2),
        Self::Row(3),
        Self::Row(4),
        Self::Row(5),
        Self::Row(6),
        Self::Row(7),
        Self::RowAddress(0),
        Self::RowAddress(1),
        Self::RowAddress(2),
        Self::RowEnable,
        Self::RowData,
        Self::RowClock,
        Self::RowLatch,
        Self::ColumnAddress(0),
        Self::ColumnAddress(1),
        Self::ColumnAddress(2),
        Self::ColumnEnable(0),
        Self::ColumnEnable(1),
        Self::ColumnEnable(2),
    ];

    /// Pin of a number, for callers that send numbers.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }
}
