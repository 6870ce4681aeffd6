//! MCP3208 converters, which sample columns.

use embedded_hal::spi::SpiDevice;
use taxel_core::ColumnWire;

use super::ColumnSampler;

/// Why a column could not be sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleError<B> {
    /// There is no such column.
    NotWired(ColumnWire),
    /// The bus or the converter failed.
    Converter(B),
    /// The converter did not answer: there is no null bit before the result.
    NoAnswer,
}

/// MCP3208 converters, eight columns each: column k at channel k mod 8 of chip k/8.
///
/// A sample is single-ended and takes three bytes (Microchip DS21298, figure 6-1): `0000 011c`, `cc·· ····` and
/// eight more clocks, with ccc the channel. The result is the lower twelve bits of the reply, after a null bit.
/// SPI mode 0, at most 1 MHz at 3.3 V (2 MHz only at 5 V).
#[derive(Debug)]
pub struct Mcp3208s<S, const CHIPS: usize> {
    /// One SPI device for each chip.
    pub chips: [S; CHIPS],
}

impl<S: SpiDevice, const CHIPS: usize> ColumnSampler for Mcp3208s<S, CHIPS> {
    type Error = SampleError<S::Error>;

    const FULL_SCALE_COUNTS: u16 = 4095;

    fn sample(&mut self, column: ColumnWire) -> Result<u16, Self::Error> {
        let chip = self.chips.get_mut(column.0 / 8).ok_or(SampleError::NotWired(column))?;
        let channel = (column.0 % 8) as u8;
        let mut bytes = [0b0000_0110 | channel >> 2, channel << 6, 0];
        chip.transfer_in_place(&mut bytes).map_err(SampleError::Converter)?;
        let [_, high, low] = bytes;
        // The null bit must be 0. An undriven line, which is pulled up, reads as ones.
        if high & 0b1_0000 != 0 {
            return Err(SampleError::NoAnswer);
        }
        Ok(u16::from_be_bytes([high & 0b1111, low]))
    }
}
