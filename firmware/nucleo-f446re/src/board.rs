//! The board's parts, set up.

use core::cell::RefCell;

use cortex_m::peripheral::SYST;
use embedded_hal::spi::MODE_0;
use embedded_hal_bus::spi::{NoDelay, RefCellDevice};
use heapless::Vec;
use stm32f4xx_hal::gpio::{ErasedPin, Output, PinState, Pull, Speed, gpiob};
use stm32f4xx_hal::gpio::{PA0, PA1, PA4, PA6, PA7};
use stm32f4xx_hal::gpio::{PC0, PC1, PC2, PC4, PC5, PC6, PC8, PC9};
use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, ADC2, ADC3, DMA2, Peripherals, SPI2, TIM1, TIM8};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};
use stm32f4xx_hal::spi::Spi;
use stm32f4xx_hal::timer::{SysDelay, Timer};
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::bus::Bus;
use crate::clock::Clock;
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
pub const SPI_HZ: u32 = taxel_firmware::timing::NUCLEO_SPI_HZ;

/// Number of converters: three, and a fourth if the image has room for more than 24 columns.
pub const CONVERTERS: usize = if board_common::CONVERTERS > 3 { 4 } else { 3 };

/// One analogue-to-digital converter, an `embedded_hal::spi::SpiDevice`.
pub type Converter = RefCellDevice<'static, Bus, Select, NoDelay>;

/// Chip select of an MCP3208, which must be high for 500 ns between two samples.
pub type Select = ChipSelect<90>;

/// A wire to the 74HC595; it keeps each level for 100 ns, so that slow edges do no harm.
pub type RowPin = HeldPin<18, 18>;

/// What reads the sensor: converters around the board, or its own.
pub trait Readout: Sized {
    /// Name of the board with this readout, as the link reports it.
    const BOARD: &'static str;

    /// Sets the readout up, with all rows idle.
    fn set_up(parts: ReadoutParts, rcc: &mut Rcc) -> Option<Self>;
}

/// Pins and peripherals that are left to a readout.
#[expect(missing_docs, reason = "names of the chip's parts")]
pub struct ReadoutParts {
    pub pa0: PA0,
    pub pa1: PA1,
    pub pa4: PA4,
    pub pa6: PA6,
    pub pa7: PA7,
    pub gpiob: gpiob::Parts,
    pub pc0: PC0,
    pub pc1: PC1,
    pub pc2: PC2,
    pub pc4: PC4,
    pub pc5: PC5,
    pub pc6: PC6,
    pub pc8: PC8,
    pub pc9: PC9,
    pub spi2: SPI2,
    pub own: OwnConverters,
    pub syst: SYST,
}

/// The chip's own converters, and what works with them.
pub type OwnConverters = (ADC1, ADC2, ADC3, ADC_COMMON, DMA2, TIM1, TIM8);

/// Converters around the board, and a register for the rows.
pub struct Converters {
    /// MCP3208 converters on one bus, of eight columns each.
    pub converters: [Converter; CONVERTERS],
    /// Serial data of the 74HC595 that drives the rows.
    pub row_data: RowPin,
    /// Shift clock of the 74HC595.
    pub row_clock: RowPin,
    /// Storage clock of the 74HC595.
    pub row_latch: RowPin,
    /// Delays, by SysTick.
    pub delay: SysDelay,
}

/// The board's parts, ready for use.
pub struct Board<R> {
    /// Cause of the reset that started the program.
    pub reset_cause: ResetCause,
    /// What the processor's clock is made of.
    pub oscillator: Oscillator,
    /// The green light LD2.
    pub led: ErasedPin<Output>,
    /// What reads the sensor.
    pub readout: R,
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

impl<R: Readout> Board<R> {
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
        let gpioc = parts.GPIOC.split(&mut rcc);
        // At once: splitting has made inputs of all pins, and the rows' control lines must not float.
        let readout = R::set_up(
            ReadoutParts {
                pa0: gpioa.pa0,
                pa1: gpioa.pa1,
                pa4: gpioa.pa4,
                pa6: gpioa.pa6,
                pa7: gpioa.pa7,
                gpiob: parts.GPIOB.split(&mut rcc),
                pc0: gpioc.pc0,
                pc1: gpioc.pc1,
                pc2: gpioc.pc2,
                pc4: gpioc.pc4,
                pc5: gpioc.pc5,
                pc6: gpioc.pc6,
                pc8: gpioc.pc8,
                pc9: gpioc.pc9,
                spi2: parts.SPI2,
                own: (
                    parts.ADC1,
                    parts.ADC2,
                    parts.ADC3,
                    parts.ADC_COMMON,
                    parts.DMA2,
                    parts.TIM1,
                    parts.TIM8,
                ),
                syst: core.SYST,
            },
            &mut rcc,
        )?;

        let serial = Serial::start(parts.USART2, gpioa.pa2, gpioa.pa3, &mut rcc)?;
        let clock = Clock::start(parts.TIM2, &mut rcc)?;
        let (slots, pages) = Slot::all(parts.FLASH);
        Some(Self {
            reset_cause,
            oscillator,
            led: gpioa.pa5.into_push_pull_output().erase(),
            readout,
            serial,
            clock,
            slots,
            pages,
            watchdog,
        })
    }
}

impl Readout for Converters {
    const BOARD: &'static str = "nucleo-f446re";

    fn set_up(parts: ReadoutParts, rcc: &mut Rcc) -> Option<Self> {
        let [row_data, row_clock, row_latch] = [
            parts.pc6.into_push_pull_output().erase(),
            parts.pc8.into_push_pull_output().erase(),
            parts.pc9.into_push_pull_output().erase(),
        ];
        let gpiob = parts.gpiob;

        // The pull-up makes a line that no converter drives read as no answer.
        let data_in = gpiob.pb14.into_alternate::<5>().internal_resistor(Pull::Up);
        // A slow clock pin delays the clock's feedback: the last bit of each byte would be wrong (ES0298).
        let clock_out = gpiob.pb13.into_alternate::<5>().speed(Speed::High);
        let pins = (Some(clock_out), Some(data_in), Some(gpiob.pb15));
        let spi = Spi::new(parts.spi2, pins, MODE_0, SPI_HZ.Hz(), rcc);
        let bus: &'static RefCell<Bus> =
            cortex_m::singleton!(: RefCell<Bus> = RefCell::new(Bus::new(spi)))?;
        let converter = |select: ErasedPin<Output>| {
            let Ok(device) = RefCellDevice::new_no_delay(bus, select.into());
            device
        };

        let high = PinState::High;
        let selects = [
            Some(gpiob.pb12.into_push_pull_output_in_state(high).erase()),
            Some(gpiob.pb1.into_push_pull_output_in_state(high).erase()),
            Some(parts.pc4.into_push_pull_output_in_state(high).erase()),
            // Without a fourth converter the pin stays as it is.
            (CONVERTERS > 3).then(|| parts.pc5.into_push_pull_output_in_state(high).erase()),
        ];
        let converters: Vec<_, CONVERTERS> = selects.into_iter().flatten().map(converter).collect();
        Some(Self {
            converters: converters.into_array().ok()?,
            row_data: row_data.into(),
            row_clock: row_clock.into(),
            row_latch: row_latch.into(),
            // From the processor's own clock: from an eighth of it, the HAL's waits would be 2 % short.
            delay: Timer::syst(parts.syst, &rcc.clocks).delay(),
        })
    }
}
