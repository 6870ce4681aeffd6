//! Driver of the CMSDK APB UART, by polling.

use crate::registers::Registers;

const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CTRL: usize = 0x08;
const BAUD_DIVIDER: usize = 0x10;

const TRANSMIT_FULL: u32 = 1;
const RECEIVE_FULL: u32 = 2;
const BOTH_ENABLED: u32 = 3;

/// A UART. QEMU takes a byte from the other end only when there is room for it, so that none is lost
/// however late the program reads.
pub struct Uart(Registers);

impl Uart {
    /// Starts the UART of the first `-serial` on QEMU's command line.
    pub fn first() -> Self {
        // SAFETY: UART0 lies at this address.
        let registers = unsafe { Registers::at(0x4000_4000) };
        registers.write(BAUD_DIVIDER, 25_000_000 / 921_600);
        registers.write(CTRL, BOTH_ENABLED);
        Self(registers)
    }

    /// Receives the next byte; `None` if there is none yet.
    pub fn try_read(&mut self) -> Option<u8> {
        (self.0.read(STATE) & RECEIVE_FULL != 0).then(|| self.0.read(DATA) as u8)
    }

    /// Sends `byte`; returns `false`, and sends nothing, while the previous byte is being sent.
    #[must_use]
    pub fn try_write(&mut self, byte: u8) -> bool {
        let free = self.0.read(STATE) & TRANSMIT_FULL == 0;
        if free {
            self.0.write(DATA, byte.into());
        }
        free
    }
}
