//! The board's parts, set up.

use stm32f4xx_hal::gpio::{ErasedPin, Output, PinState};
use stm32f4xx_hal::pac::Peripherals;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::clock::Clock;
use crate::oscillator::{EXTERNAL_MHZ, INTERNAL_MHZ, Oscillator};
use crate::own_converters::{BY_DECODER, OwnConverters};
use crate::power;
use crate::reset::ResetCause;
use crate::serial::Serial;
use crate::slot::Slot;

/// Watchdog period in ms at 32 kHz. Erasing a slot takes up to 2 s, in which the watchdog is not fed. Its own clock has
/// 17 to 47 kHz, so it waits 5.4 to 15 s.
const WATCHDOG_MS: u32 = 8000;

/// The board's parts, ready for use.
pub struct Board {
    /// Cause of the reset that started the program.
    pub reset_cause: ResetCause,
    /// What the processor's clock is made of.
    pub oscillator: Oscillator,
    /// The green light LD2.
    pub led: ErasedPin<Output>,
    /// Outputs that tell touch, load and slip.
    pub events: [ErasedPin<Output>; 3],
    /// What reads the sensor.
    pub readout: OwnConverters,
    /// Serial line to the ST-LINK's virtual COM port.
    pub serial: Serial,
    /// Clock that counts microseconds and cycles since the start.
    pub clock: Clock,
    /// The two model slots.
    pub slots: [Slot; 2],
    /// The two pages of the journal.
    pub pages: [Slot; 2],
    /// Watchdog, already running; it restarts the program if it is not fed for 5.4 to 15 s.
    pub watchdog: IndependentWatchdog,
}

impl Board {
    /// Sets up all parts: 180 MHz from the ST-LINK's 8 MHz if they are there, else 158 MHz; all rows idle.
    ///
    /// `None` if it was called before.
    pub fn take() -> Option<Self> {
        let parts = Peripherals::take()?;
        let mut core = cortex_m::Peripherals::take()?;
        let mut watchdog = IndependentWatchdog::new(parts.IWDG);
        watchdog.stop_on_debug(&parts.DBGMCU, true);
        watchdog.start(WATCHDOG_MS.millis());

        let reset_cause = ResetCause::read(&parts.RCC);
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        let oscillator = Oscillator::find(&parts.RCC);
        power::watch(&parts.RCC, &parts.PWR);
        let source = match oscillator {
            Oscillator::External => {
                Config::hse(8.MHz()).bypass_hse_oscillator().sysclk(EXTERNAL_MHZ.MHz())
            }
            Oscillator::Internal => Config::hsi().sysclk(INTERNAL_MHZ.MHz()),
        };
        let mut rcc = parts.RCC.freeze(source);
        if oscillator == Oscillator::External {
            rcc.cr().modify(|_, w| w.csson().set_bit());
        }
        let gpioa = parts.GPIOA.split(&mut rcc);
        let (gpiob, gpioc) = (parts.GPIOB.split(&mut rcc), parts.GPIOC.split(&mut rcc));
        // All rows idle: with a decoder by its inhibit input, PB9.
        let (low, inhibit) = (PinState::Low, PinState::from(BY_DECODER));
        let _ = (
            gpiob.pb5.into_push_pull_output_in_state(low),
            gpiob.pb6.into_push_pull_output_in_state(low),
            gpiob.pb7.into_push_pull_output_in_state(low),
            gpiob.pb8.into_push_pull_output_in_state(low),
            gpiob.pb9.into_push_pull_output_in_state(inhibit),
            gpiob.pb10.into_push_pull_output_in_state(low),
            gpiob.pb12.into_push_pull_output_in_state(low),
            gpiob.pb13.into_push_pull_output_in_state(low),
            gpiob.pb14.into_push_pull_output_in_state(low),
        );
        let _ = (gpioa.pa0.into_analog(), gpioa.pa1.into_analog(), gpioa.pa4.into_analog());
        let _ = (gpioa.pa6.into_analog(), gpioa.pa7.into_analog(), gpiob.pb0.into_analog());
        let _ = (gpioc.pc0.into_analog(), gpioc.pc1.into_analog(), gpioc.pc2.into_analog());
        let converters = (parts.ADC1, parts.ADC2, parts.ADC3, parts.ADC_COMMON);
        let readout =
            OwnConverters::start(converters, parts.DMA2, (parts.TIM1, parts.TIM8), &mut rcc);

        let serial = Serial::start(parts.USART2, parts.DMA1, (gpioa.pa2, gpioa.pa3), &mut rcc)?;
        let clock = Clock::start(parts.TIM2, &mut rcc)?;
        let (slots, pages) = Slot::all(parts.FLASH);
        Some(Self {
            reset_cause,
            oscillator,
            led: gpioa.pa5.into_push_pull_output().erase(),
            events: [
                gpioc.pc8.into_push_pull_output_in_state(low).erase(),
                gpioc.pc6.into_push_pull_output_in_state(low).erase(),
                gpioc.pc5.into_push_pull_output_in_state(low).erase(),
            ],
            readout,
            serial,
            clock,
            slots,
            pages,
            watchdog,
        })
    }
}
