//! Board at the other end of a line, which carries out the requests of `remote_readout`.

use std::io::{ErrorKind, Read, Write};

use remote_readout::Asked;

use super::board::VirtualBoard;
use super::pin::Pin;
use crate::error::{Error, Result};

/// Byte that a line reads as while nobody drives it.
const NOBODY: u8 = 0xFF;

impl VirtualBoard {
    /// Carries out the requests from the other end of `line` until it closes the line. Calls `scanned`
    /// when the last row that the world reads is released, which ends every scan.
    ///
    /// A request that a part refuses is answered by ones, like a line that nobody drives.
    ///
    /// # Errors
    /// [`Error`] at once if the line fails or asks for a part that does not exist; once it is closed if
    /// the parts refused anything, now or before.
    pub fn serve(&self, mut line: impl Read + Write, mut scanned: impl FnMut()) -> Result<()> {
        let mut pending = Vec::new();
        let mut bytes = [0; 4096];
        loop {
            match line.read(&mut bytes) {
                Ok(0) => return self.check(),
                // The line was closed while bytes were on their way.
                Err(cause) if cause.kind() == ErrorKind::ConnectionReset => return self.check(),
                Ok(count) => pending.extend_from_slice(&bytes[..count]),
                Err(cause) if cause.kind() == ErrorKind::Interrupted => continue,
                Err(cause) => return Err(cause.into()),
            }
            let mut rest = &pending[..];
            while let Some((asked, behind)) = Asked::parse(rest)
                .map_err(|byte| Error::UnknownRequest(format!("request {:#04x}", byte.0)))?
            {
                self.carry_out(asked, &mut line, &mut scanned)?;
                rest = behind;
            }
            let done = pending.len() - rest.len();
            pending.drain(..done);
        }
    }

    fn carry_out(
        &self,
        asked: Asked<'_>,
        line: &mut impl Write,
        scanned: &mut impl FnMut(),
    ) -> Result<()> {
        match asked {
            Asked::Pin { number, high } => {
                let pin = Pin::from_number(number)
                    .ok_or_else(|| Error::UnknownRequest(format!("pin {number}")))?;
                let before = self.active_row();
                // A refusal is recorded by the board.
                let _ = self.set_pin(pin, high);
                let last = self.wires().rows.last().map(|row| row.0);
                if before.is_some() && before == last && self.active_row().is_none() {
                    scanned();
                }
            }
            Asked::Transfer { chip, bytes } => {
                let mut answer = bytes.to_vec();
                if self.transfer(chip.into(), &mut answer).is_err() {
                    answer.fill(NOBODY);
                }
                line.write_all(&answer).and_then(|()| line.flush())?;
            }
            Asked::Wait { ns } => self.wait_ns(ns),
        }
        Ok(())
    }
}
