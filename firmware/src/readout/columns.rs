//! Two ways to sample a column: MCP3208 converters, or an on-chip converter behind multiplexers.

use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;
use taxel_core::ColumnWire;

use super::ColumnSampler;
use super::rows::set_address;

/// Why a column could not be sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleError<B, P = B> {
    /// There is no such column.
    NotWired(ColumnWire),
    /// The bus or the converter failed.
    Converter(B),
    /// A pin failed.
    Pin(P),
    /// The converter did not answer (no null bit before the result), or not in time.
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

/// An analogue-to-digital converter on the microcontroller's own chip.
pub trait OnChipAdc {
    /// Error of a conversion.
    type Error;

    /// The largest count.
    const FULL_SCALE_COUNTS: u16;

    /// Starts a conversion of the pin that the multiplexers share.
    ///
    /// # Errors
    /// The converter failed.
    fn start(&mut self) -> Result<(), Self::Error>;

    /// Polls for the result in counts; returns at once, with `None` while the conversion is running.
    ///
    /// # Errors
    /// The converter failed.
    fn poll(&mut self) -> Result<Option<u16>, Self::Error>;
}

/// An [`OnChipAdc`] behind analogue multiplexers whose outputs are joined: 74HC4051 with
/// `ADDRESS_PINS` = 3 or 74HC4067 with 4. Column k is at input k mod 2^`ADDRESS_PINS` of
/// multiplexer k/2^`ADDRESS_PINS`.
///
/// Switching breaks before it makes: disable all, set the address, enable one. The multiplexer's resistance
/// (70 Ω) does not matter here, because no current flows into a converter.
#[derive(Debug)]
pub struct MultiplexedAdc<A, P, const ADDRESS_PINS: usize, const MULTIPLEXERS: usize> {
    /// The converter.
    pub adc: A,
    /// Address pins, S0 first, shared by all multiplexers.
    pub address: [P; ADDRESS_PINS],
    /// Enable pin E̅ of each multiplexer, active low.
    pub enable: [P; MULTIPLEXERS],
}

impl<A, P, const ADDRESS_PINS: usize, const MULTIPLEXERS: usize>
    MultiplexedAdc<A, P, ADDRESS_PINS, MULTIPLEXERS>
{
    /// Number of polls after which a conversion counts as failed: far beyond any converter's time.
    pub const MOST_POLLS: u32 = 10_000;
}

impl<A: OnChipAdc, P: OutputPin, const ADDRESS_PINS: usize, const MULTIPLEXERS: usize> ColumnSampler
    for MultiplexedAdc<A, P, ADDRESS_PINS, MULTIPLEXERS>
{
    type Error = SampleError<A::Error, P::Error>;

    const FULL_SCALE_COUNTS: u16 = A::FULL_SCALE_COUNTS;

    fn sample(&mut self, column: ColumnWire) -> Result<u16, Self::Error> {
        const { assert!(ADDRESS_PINS < 8, "a multiplexer has at most 128 inputs") }
        let wired = column.0 >> ADDRESS_PINS < MULTIPLEXERS;
        if !wired {
            return Err(SampleError::NotWired(column));
        }
        for enable in &mut self.enable {
            enable.set_high().map_err(SampleError::Pin)?;
        }
        set_address(&mut self.address, column.0).map_err(SampleError::Pin)?;
        if let Some(enable) = self.enable.get_mut(column.0 >> ADDRESS_PINS) {
            enable.set_low().map_err(SampleError::Pin)?;
        }
        self.adc.start().map_err(SampleError::Converter)?;
        for _ in 0..Self::MOST_POLLS {
            if let Some(counts) = self.adc.poll().map_err(SampleError::Converter)? {
                return Ok(counts);
            }
        }
        Err(SampleError::NoAnswer)
    }
}
