//! The board's parts, set up.

use core::cell::RefCell;

use embedded_hal::spi::MODE_0;
use embedded_hal_bus::spi::{NoDelay, RefCellDevice};
use heapless::Vec;
use stm32f4xx_hal::gpio::{ErasedPin, Output, PinState, Pull, Speed};
use stm32f4xx_hal::pac::Peripherals;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::spi::Spi;
use stm32f4xx_hal::timer::{SysDelay, Timer};
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::bus::Bus;
use crate::clock::Clock;
use crate::flash::set_brown_out_level;
use crate::held_pin::{ChipSelect, HeldPin};
use crate::oscillator::{EXTERNAL_MHZ, INTERNAL_MHZ, Oscillator};
use crate::power;
use crate::reset::ResetCause;
use crate::serial::Serial;
use crate::slot::Slot;

/// Watchdog period in ms at 32 kHz. Erasing a slot takes up to 2 s, in which the watchdog is not fed. Its own clock has
/// 17 to 47 kHz, so it waits 5.4 to 15 s.
const WATCHDOG_MS: u32 = 8000;

/// Clock of the converters' bus in Hz.
pub const SPI_HZ: u32 = firmware::timing::NUCLEO_SPI_HZ;

/// Number of converters: three, and a fourth if the image has room for more than 24 columns.
pub const CONVERTERS: usize = if board_common::CONVERTERS > 3 { 4 } else { 3 };

/// One analogue-to-digital converter, an `embedded_hal::spi::SpiDevice`.
pub type Converter = RefCellDevice<'static, Bus, Select, NoDelay>;

/// Chip select of an MCP3208, which must be high for 500 ns between two samples.
pub type Select = ChipSelect<90>;

/// A wire to the 74HC595; it keeps each level for 100 ns, so that slow edges do no harm.
pub type RowPin = HeldPin<18, 18>;

/// The board's parts, ready for use.
pub struct Board {
    /// Cause of the reset that started the program.
    pub reset_cause: ResetCause,
    /// What the processor's clock is made of.
    pub oscillator: Oscillator,
    /// The green light LD2.
    pub led: ErasedPin<Output>,
    /// MCP3208 converters on one bus, of eight columns each.
    pub converters: [Converter; CONVERTERS],
    /// Serial data of the 74HC595 that drives the rows.
    pub row_data: RowPin,
    /// Shift clock of the 74HC595.
    pub row_clock: RowPin,
    /// Storage clock of the 74HC595.
    pub row_latch: RowPin,
    /// Serial line to the ST-LINK's virtual COM port.
    pub serial: Serial,
    /// Clock that counts microseconds and cycles since the start.
    pub clock: Clock,
    /// Delays, by SysTick.
    pub delay: SysDelay,
    /// The two model slots.
    pub slots: [Slot; 2],
    /// The two pages of the journal.
    pub pages: [Slot; 2],
    /// Whether the blue button was held at the start.
    pub is_button_held: bool,
    /// Watchdog, already running; it restarts the program if it is not fed for 5.4 to 15 s.
    pub watchdog: IndependentWatchdog,
}

impl Board {
    /// Sets up all parts: 180 MHz from the ST-LINK's 8 MHz if they are there, else 158 MHz; all chip selects and row
    /// signals idle.
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
        if set_brown_out_level(&parts.FLASH) {
            defmt::info!("brown-out level 3 is set: it holds from the next reset on");
        }
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
        let gpiob = parts.GPIOB.split(&mut rcc);
        let gpioc = parts.GPIOC.split(&mut rcc);
        // At once: splitting has made inputs of all pins, and the row registers' clocks must not float.
        let [row_data, row_clock, row_latch] = [
            gpioc.pc6.into_push_pull_output().erase(),
            gpioc.pc8.into_push_pull_output().erase(),
            gpioc.pc9.into_push_pull_output().erase(),
        ];

        // The pull-up makes a line that no converter drives read as no answer.
        let data_in = gpiob.pb14.into_alternate::<5>().internal_resistor(Pull::Up);
        // A slow clock pin delays the clock's feedback: the last bit of each byte would be wrong (ES0298).
        let clock_out = gpiob.pb13.into_alternate::<5>().speed(Speed::High);
        let pins = (Some(clock_out), Some(data_in), Some(gpiob.pb15));
        let spi = Spi::new(parts.SPI2, pins, MODE_0, SPI_HZ.Hz(), &mut rcc);
        let bus: &'static RefCell<Bus> =
            cortex_m::singleton!(: RefCell<Bus> = RefCell::new(Bus::new(spi)))?;
        let converter = |select: ErasedPin<Output>| {
            let Ok(device) = RefCellDevice::new_no_delay(bus, select.into());
            device
        };

        let serial = Serial::start(parts.USART2, gpioa.pa2, gpioa.pa3, &mut rcc)?;
        let clock = Clock::start(parts.TIM2, &mut rcc)?;
        let (slots, pages) = Slot::all(parts.FLASH);
        let high = PinState::High;
        let selects = [
            Some(gpiob.pb12.into_push_pull_output_in_state(high).erase()),
            Some(gpiob.pb1.into_push_pull_output_in_state(high).erase()),
            Some(gpioc.pc4.into_push_pull_output_in_state(high).erase()),
            // Without a fourth converter the pin stays as it is.
            (CONVERTERS > 3).then(|| gpioc.pc5.into_push_pull_output_in_state(high).erase()),
        ];
        let converters: Vec<_, CONVERTERS> = selects.into_iter().flatten().map(converter).collect();
        Some(Self {
            reset_cause,
            oscillator,
            led: gpioa.pa5.into_push_pull_output().erase(),
            converters: converters.into_array().ok()?,
            row_data: row_data.into(),
            row_clock: row_clock.into(),
            row_latch: row_latch.into(),
            serial,
            clock,
            // From the processor's own clock: from an eighth of it, the HAL's waits would be 2 % short.
            delay: Timer::syst(core.SYST, &rcc.clocks).delay(),
            slots,
            pages,
            is_button_held: gpioc.pc13.into_input().is_low(),
            watchdog,
        })
    }
}
