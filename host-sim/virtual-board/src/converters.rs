//! Parts that sample a column, as strict as the real ones.

use super::COLUMNS;
use super::pin::Pin;
use super::rows::{number, set_address};

/// Column that three bytes ask MCP3208 number `chip` for, or the fault in these bytes.
pub(super) fn mcp3208_column(chip: usize, bytes: &[u8]) -> Result<usize, String> {
    let [first, second, _] = bytes else {
        return Err(format!("an MCP3208 was sent {} bytes; a conversion takes 3", bytes.len()));
    };
    if first >> 2 != 1 {
        return Err(format!("an MCP3208 was sent {first:#010b}: no start bit in its place"));
    }
    if first & 0b10 == 0 {
        return Err(format!("an MCP3208 was sent {first:#010b}: a differential conversion"));
    }
    let channel = usize::from((first & 1) << 2 | second >> 6);
    wired(chip * 8 + channel)
}

/// Answer of an MCP3208: undefined bits before the null bit, then twelve bits of the sample.
pub(super) fn mcp3208_answer(counts: u16) -> [u8; 3] {
    let [high, low] = counts.to_be_bytes();
    [0xFF, 0b1110_0000 | high, low]
}

/// Three 74HC4051 in front of the converter on the microcontroller.
#[derive(Debug)]
pub(super) struct ColumnSelector {
    address: [bool; 3],
    disabled: [bool; 3],
    /// Counts of a conversion that was started, and for how many more looks it will not be ready.
    pub(super) conversion: Option<(u16, u32)>,
}

impl ColumnSelector {
    pub(super) fn new() -> Self {
        Self { address: [false; 3], disabled: [true; 3], conversion: None }
    }

    /// Column that is selected, or the fault in the selection.
    pub(super) fn column(&self) -> Result<usize, String> {
        match self.disabled.iter().position(|disabled| !disabled) {
            Some(multiplexer) => wired(multiplexer * 8 + number(&self.address)),
            None => Err("a conversion was started with no column selected".into()),
        }
    }

    /// Sets one of the selector's pins; `None` if it has no such pin, otherwise whether the part accepts
    /// it.
    pub(super) fn set(&mut self, pin: Pin, high: bool) -> Option<Result<(), String>> {
        match pin {
            Pin::ColumnAddress(bit) => {
                let enabled = self.disabled.contains(&false);
                let pin = self.address.get_mut(usize::from(bit))?;
                Some(set_address(pin, high, enabled, "column"))
            }
            Pin::ColumnEnable(multiplexer) => {
                *self.disabled.get_mut(usize::from(multiplexer))? = high;
                let enabled = self.disabled.iter().filter(|disabled| !**disabled).count();
                Some(if enabled > 1 {
                    Err("two column multiplexers were enabled at once: their columns touch".into())
                } else {
                    Ok(())
                })
            }
            _ => None,
        }
    }
}

fn wired(column: usize) -> Result<usize, String> {
    if column < COLUMNS {
        Ok(column)
    } else {
        Err(format!("column {column} (from 0) was sampled; {COLUMNS} are wired"))
    }
}
