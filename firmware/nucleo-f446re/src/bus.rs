//! SPI2, which the converters share.

use embedded_hal::spi::{ErrorType, SpiBus};
use stm32f4xx_hal::pac::SPI2;
use stm32f4xx_hal::spi::{Error, Spi};

/// Number of looks at whether the clock has ended, after which it is taken to have. Half a clock is left when a byte
/// has been received: 711 ns, or 128 cycles.
const MOST_LOOKS: usize = 128;

/// SPI2 whose `flush` waits for the clock's last edge.
///
/// The HAL's own does nothing, and a byte counts as received half a clock before its end. The chip select would rise
/// while the clock is still high.
pub struct Bus(Spi<SPI2>);

impl Bus {
    pub(crate) fn new(spi: Spi<SPI2>) -> Self {
        Self(spi)
    }
}

impl ErrorType for Bus {
    type Error = Error;
}

impl SpiBus for Bus {
    fn read(&mut self, words: &mut [u8]) -> Result<(), Error> {
        self.0.read(words)
    }

    fn write(&mut self, words: &[u8]) -> Result<(), Error> {
        self.0.write(words)
    }

    fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), Error> {
        SpiBus::transfer(&mut self.0, read, write)
    }

    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Error> {
        self.0.transfer_in_place(words)
    }

    fn flush(&mut self) -> Result<(), Error> {
        (0..MOST_LOOKS).find(|_| !self.0.is_busy());
        Ok(())
    }
}
