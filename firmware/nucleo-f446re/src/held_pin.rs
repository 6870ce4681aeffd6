//! Output pins that hold each level long enough for the chips that read it.

use core::convert::Infallible;

use cortex_m::asm;
use cortex_m::peripheral::DWT;
use embedded_hal::digital::{ErrorType, OutputPin};
use stm32f4xx_hal::gpio::{ErasedPin, Output};

/// An output pin that stays high for at least `HIGH` cycles of the processor (5.6 ns each), and low for at
/// least `LOW`.
pub struct HeldPin<const HIGH: u32, const LOW: u32>(ErasedPin<Output>);

impl<const HIGH: u32, const LOW: u32> From<ErasedPin<Output>> for HeldPin<HIGH, LOW> {
    fn from(pin: ErasedPin<Output>) -> Self {
        Self(pin)
    }
}

impl<const HIGH: u32, const LOW: u32> ErrorType for HeldPin<HIGH, LOW> {
    type Error = Infallible;
}

impl<const HIGH: u32, const LOW: u32> OutputPin for HeldPin<HIGH, LOW> {
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set_high();
        asm::delay(HIGH);
        Ok(())
    }

    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set_low();
        asm::delay(LOW);
        Ok(())
    }
}

/// A chip select that falls no sooner than so many `CYCLES` of the processor after it rose. What the program does
/// meanwhile counts.
pub struct ChipSelect<const CYCLES: u32> {
    pin: ErasedPin<Output>,
    /// Cycle at which it rose.
    rose: u32,
}

impl<const CYCLES: u32> From<ErasedPin<Output>> for ChipSelect<CYCLES> {
    fn from(pin: ErasedPin<Output>) -> Self {
        Self { pin, rose: DWT::cycle_count() }
    }
}

impl<const CYCLES: u32> ErrorType for ChipSelect<CYCLES> {
    type Error = Infallible;
}

impl<const CYCLES: u32> OutputPin for ChipSelect<CYCLES> {
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.pin.set_high();
        self.rose = DWT::cycle_count();
        Ok(())
    }

    fn set_low(&mut self) -> Result<(), Infallible> {
        // Bounded, in case that the counter stands.
        (0..CYCLES).find(|_| DWT::cycle_count().wrapping_sub(self.rose) >= CYCLES);
        self.pin.set_low();
        Ok(())
    }
}
