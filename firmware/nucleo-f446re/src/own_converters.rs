//! The chip's own three converters. Timers and DMA scan whole passes without the processor (RM0390, chapters 9, 13, 16):
//!
//! - Timer 1 counts a row. At count 1 DMA drives the row, or lets all idle, and switches the multiplexers to the first half
//!   of the columns; later it starts timer 8, and switches them to the second half. After the last row it stops, and DMA lets
//!   all rows idle.
//! - Timer 8 triggers the converters twice as often as there are samples of a reading, then stops until the next row.
//! - At each trigger the converters sample three columns each, all three at once; DMA takes the nine numbers to memory.
//!
//! A number and a row's word may meet in DMA2, which then writes the word twice (ES0298): it is the same one. Prefetch
//! is on, although it adds noise to the converters (AN4073).
//!
//! `docs/board.md` has the pins.

use core::cell::UnsafeCell;
use core::sync::atomic::{Ordering, fence};

use board_common::CAPACITY;
use cortex_m::asm;
use stm32f4xx_hal::pac::adc1::RegisterBlock;
use stm32f4xx_hal::pac::dma2::ST;
use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, ADC2, ADC3, DMA2, GPIOB, RCC, TIM1, TIM8};
use stm32f4xx_hal::rcc::Rcc;
use taxel_core::RowWire;
use taxel_firmware::readout::{
    Diagnosis, RowTimes, ScanSettings, Sequencer, SequencerFault, add_samples,
};
use taxel_firmware::timing::{
    ONCHIP_COLUMNS, ONCHIP_ROWS, ONCHIP_SAMPLES, ONCHIP_TRIGGER_TICKS, RowCounts, ScanPlan,
};

use crate::dma::{self, COUNT_UP, FROM_MEMORY};

/// Number of columns.
pub const COLUMNS: usize = ONCHIP_COLUMNS as usize;

/// Number of lines of a pass: the rows, and one in which all idle.
pub const LINES: usize = CAPACITY.rows + 1;

/// Pins of port B that drive the rows, and the one that switches the multiplexers.
const ROW_PINS: [u32; 8] = [5, 6, 7, 8, 9, 10, 12, 13];
const SELECT: u32 = 1 << 14;

/// Whether a 74HC4514 drives the rows, of which there are more than pins: the first four pins are a row's number, and the
/// fifth lets all idle.
pub const BY_DECODER: bool = CAPACITY.rows > ROW_PINS.len();
const INHIBIT: u32 = 1 << ROW_PINS[4];

const _: () = assert!(
    CAPACITY.rows <= ONCHIP_ROWS as usize && CAPACITY.columns <= COLUMNS,
    "the pins are for 16 rows and 18 columns"
);

/// Word for the port's register of changes that clears all pins, and so chooses the first half of the columns.
const CLEAR: u32 = {
    let (mut pins, mut row) = (SELECT, 0);
    while row < ROW_PINS.len() {
        pins |= 1 << ROW_PINS[row];
        row += 1;
    }
    pins << 16
};

/// The word that lets all rows idle.
const REST: u32 = CLEAR | if BY_DECODER { INHIBIT } else { 0 };

/// The word that drives a row: what is set wins over what is cleared. All rows idle for one that is not there.
fn row_word(row: RowWire) -> u32 {
    if BY_DECODER && row.0 < CAPACITY.rows {
        return CLEAR | (row.0 as u32) << ROW_PINS[0];
    }
    let pin = ROW_PINS.get(row.0).filter(|_| !BY_DECODER);
    pin.map_or(REST, |pin| CLEAR | 1 << pin)
}

/// Channels of each converter, in the order in which it converts them: PA0, PA1, PA4; PA6, PA7, PB0; PC0, PC1, PC2.
pub(crate) const CHANNELS: [[u32; 3]; 3] = [[0, 1, 4], [6, 7, 8], [10, 11, 12]];

/// Field of a stream of DMA2 that chooses timer 1's requests; those of the converters are 0.
const OF_TIMER_1: u32 = 6 << 25;

/// Fields of a stream's control register: words, or half-words.
const WORDS: u32 = 2 << 11 | 2 << 13;
const HALF_WORDS: u32 = 1 << 11 | 1 << 13;

/// Flags of streams 0 to 3 and 4 to 7: complete are the numbers, and the end; an error of any stream.
pub(crate) const NUMBERS_COMPLETE: u32 = 1 << 5;
pub(crate) const END_COMPLETE: u32 = 1 << 11;
const LOW_ERRORS: u32 = 1 << 2 | 1 << 3 | 1 << 19;
const HIGH_ERRORS: u32 = 1 << 9 | 1 << 19;
const LOW_FLAGS: u32 = 0x3D | 0x3D << 16;
const HIGH_FLAGS: u32 = 0x3D << 6 | 0x3D << 16;

/// The converters' common control: triple simultaneous conversions, a request for each number, for ever, and an eighth of
/// the processor's clock.
const COMMON: u32 = 0b10110 | 1 << 13 | 1 << 14 | 1 << 16;

/// A number that nobody took before the next one came, of any converter.
pub(crate) const OVERRUN: u32 = 1 << 5 | 1 << 13 | 1 << 21;

/// Fields of the converters' control: several channels; on; trigger by a rising edge of timer 8's output.
const SEVERAL: u32 = 1 << 8;
pub(crate) const ON: u32 = 1 << 0;
const BY_TIMER_8: u32 = 14 << 24 | 1 << 28;

/// Sampling for 15 cycles, for channels from 10 on and below.
const HIGH_SAMPLED: u32 = 0o111_111_111;
const LOW_SAMPLED: u32 = 0o1_111_111_111;

/// Fields of the timers: counting; only an overflow makes an update; the first one is the last; trigger output
/// by channel 1, which is active from its count on; started by timer 1; load everything.
pub(crate) const COUNTING: u32 = 1 << 0;
const BY_OVERFLOW: u32 = 1 << 2;
const ONCE: u32 = 1 << 3;
const OUTPUT_1: u32 = 4 << 4;
const FROM_COUNT_ON: u32 = 7 << 4;
const STARTED_BY_TIMER_1: u32 = 6;
const LOAD: u32 = 1 << 0;

/// Requests of timer 1 for DMA: update, and channels 2 and 3.
const REQUESTS: u32 = 1 << 8 | 1 << 10 | 1 << 11;

/// Bits of the timers and the converters in the registers that turn peripherals of this bus on, and reset them.
const TIMERS: u32 = 0b11;
const CONVERTERS: u32 = 0b111 << 8;
const CONVERTERS_RESET: u32 = 1 << 8;

/// Looks at whether a stream is off, which takes the transfer under way.
const MOST_LOOKS: u32 = 1000;

/// Time in µs that a converter takes until it is ready.
const READY_US: u32 = 3;

/// What DMA reads and writes. It is in RAM, so that a pass ends in time while flash is erased.
struct Memory {
    /// Words for the rows of a pass, for the second half, and for the end.
    rows: [u32; LINES],
    select: u32,
    rest: u32,
    numbers: [u16; LINES * COLUMNS * ONCHIP_SAMPLES as usize],
}

struct Place(UnsafeCell<Memory>);

// SAFETY: only `OwnConverters` uses the place, of which there is one.
unsafe impl Sync for Place {}

static MEMORY: Place = Place(UnsafeCell::new(Memory {
    rows: [0; LINES],
    select: 0,
    rest: 0,
    numbers: [0; LINES * COLUMNS * ONCHIP_SAMPLES as usize],
}));

/// The converters, DMA, and the timers of the rows and of the triggers.
pub struct OwnConverters {
    pub(crate) converters: (ADC1, ADC2, ADC3, ADC_COMMON),
    pub(crate) dma: DMA2,
    pub(crate) timers: (TIM1, TIM8),
    pub(crate) clock_mhz: u32,
    /// Samples of a reading in the pass under way.
    samples: u16,
}

impl OwnConverters {
    /// Starts the parts. All rows must idle.
    pub(crate) fn start(
        converters: (ADC1, ADC2, ADC3, ADC_COMMON),
        dma: DMA2,
        timers: (TIM1, TIM8),
        rcc: &mut Rcc,
    ) -> Self {
        rcc.ahb1enr().modify(|_, w| w.dma2en().set_bit());
        // SAFETY: the other peripherals' bits stay as they are.
        rcc.apb2enr().modify(|r, w| unsafe { w.bits(r.bits() | TIMERS | CONVERTERS) });
        asm::dsb(); // a write that follows at once may be lost (ES0298)
        let clock_mhz = rcc.clocks.hclk().to_MHz();
        let mut this = Self { converters, dma, timers, clock_mhz, samples: 1 };
        this.stop();
        this
    }

    /// Streams of the numbers, of the second half, of the end and of the rows.
    pub(crate) fn streams(&self) -> [&ST; 4] {
        [self.dma.st(0), self.dma.st(2), self.dma.st(5), self.dma.st(6)]
    }
}

impl Sequencer<COLUMNS> for OwnConverters {
    const FULL_SCALE_COUNTS: u16 = 4095;
    const MOST_SAMPLES: u16 = ONCHIP_SAMPLES;

    fn start(&mut self, rows: &[Option<RowWire>], settling_us: u32, samples: u16) {
        self.samples = samples.clamp(1, ONCHIP_SAMPLES);
        let at = RowCounts::new(settling_us, self.samples, self.clock_mhz);
        let lines = rows.len().clamp(1, LINES);
        let memory = MEMORY.0.get();
        // SAFETY: DMA does not use it: no stream is on before the ones below.
        let memory = unsafe { &mut *memory };
        (memory.select, memory.rest) = (SELECT, REST);
        for (word, row) in memory.rows.iter_mut().zip(rows) {
            *word = row.map_or(REST, row_word);
        }
        let numbers = lines * COLUMNS * usize::from(self.samples);
        let changes = GPIOB::PTR.addr() + 0x18;
        let number = ADC_COMMON::PTR.addr() + 0x08;
        // SAFETY: writing ones clears these flags.
        unsafe {
            self.dma.lifcr().write(|w| w.bits(LOW_FLAGS));
            self.dma.hifcr().write(|w| w.bits(HIGH_FLAGS));
        }
        let [of_numbers, of_switch, of_end, of_rows] = self.streams();
        let fields = OF_TIMER_1 | FROM_MEMORY | WORDS;
        // SAFETY: the addresses are of `MEMORY` and of registers, and the items are as many as there is room for.
        unsafe {
            dma::start(of_numbers, &raw mut memory.numbers, number, numbers, HALF_WORDS | COUNT_UP);
            dma::start(of_rows, &raw const memory.rows, changes, lines, fields | COUNT_UP);
            dma::start(of_switch, &raw const memory.select, changes, lines, fields);
            dma::start(of_end, &raw const memory.rest, changes, 1, fields);
        }
        let (rows, triggers) = &self.timers;
        // SAFETY: all are counts or the fields that their constants tell.
        unsafe {
            triggers.rcr().write(|w| w.bits(2 * u32::from(self.samples) - 1));
            triggers.egr().write(|w| w.bits(LOAD));
            rows.psc().write(|w| w.bits(u32::from(at.divider) - 1));
            rows.arr().write(|w| w.bits(u32::from(at.period) - 1));
            rows.rcr().write(|w| w.bits(lines as u32 - 1));
            rows.ccr1().write(|w| w.bits(at.trigger.into()));
            rows.ccr2().write(|w| w.bits(at.switch.into()));
            rows.ccr3().write(|w| w.bits(1));
            rows.egr().write(|w| w.bits(LOAD));
            rows.sr().write(|w| w.bits(0));
            rows.dier().write(|w| w.bits(REQUESTS));
            rows.cr1().write(|w| w.bits(BY_OVERFLOW | ONCE | COUNTING));
        }
    }

    fn poll(&mut self, sums: &mut [[u32; COLUMNS]]) -> Option<Result<(), SequencerFault>> {
        let (low, high) = (self.dma.lisr().read().bits(), self.dma.hisr().read().bits());
        let overrun = self.converters.3.csr().read().bits() & OVERRUN;
        if low & LOW_ERRORS | high & HIGH_ERRORS | overrun != 0 {
            self.stop();
            return Some(Err(SequencerFault));
        }
        if low & NUMBERS_COMPLETE == 0 || high & END_COMPLETE == 0 {
            return None;
        }
        fence(Ordering::SeqCst); // nothing is read before that
        let count = sums.len() * COLUMNS * usize::from(self.samples);
        let numbers = MEMORY.0.get();
        // SAFETY: DMA has ended, and no stream is on before the next start.
        let numbers = unsafe { &(*numbers).numbers };
        add_samples(numbers.get(..count).unwrap_or_default(), self.samples, sums);
        Some(Ok(()))
    }

    fn line_times(&self, lines: usize, settings: ScanSettings) -> RowTimes {
        let plan = ScanPlan::of_nucleo_onchip(lines as u16, ONCHIP_COLUMNS, settings.oversampling);
        ScanPlan { settling_us: settings.settling_us, ..plan }.row_times()
    }

    fn diagnose(&mut self) -> Option<Diagnosis> {
        Some(self.test())
    }

    /// Sets everything up anew, which a pass that was cut needs: the converters deliver their numbers in turn.
    fn stop(&mut self) {
        // SAFETY: nobody else uses these peripherals, and the other ones' bits stay as they are.
        let rcc = unsafe { RCC::steal() };
        let resets = TIMERS | CONVERTERS_RESET;
        for bits in [resets, 0] {
            // SAFETY: as above.
            rcc.apb2rstr().modify(|r, w| unsafe { w.bits(r.bits() & !resets | bits) });
        }
        for stream in self.streams() {
            let control = stream.cr();
            control.modify(|_, w| w.en().clear_bit());
            (0..MOST_LOOKS).find(|_| control.read().en().bit_is_clear());
        }
        // SAFETY: only the rows' pins and the multiplexers' change.
        unsafe { GPIOB::steal() }.bsrr().write(|w| unsafe { w.bits(REST) });

        let (first, second, third, common) = &self.converters;
        // SAFETY: the fields are those that their constants tell.
        common.ccr().write(|w| unsafe { w.bits(COMMON) });
        let blocks: [&RegisterBlock; 3] = [first, second, third];
        for (index, (converter, [one, two, three])) in blocks.into_iter().zip(CHANNELS).enumerate()
        {
            let trigger = if index == 0 { BY_TIMER_8 } else { 0 };
            // SAFETY: as above.
            unsafe {
                converter.cr1().write(|w| w.bits(SEVERAL));
                converter.smpr1().write(|w| w.bits(HIGH_SAMPLED));
                converter.smpr2().write(|w| w.bits(LOW_SAMPLED));
                converter.sqr1().write(|w| w.bits(2 << 20));
                converter.sqr3().write(|w| w.bits(one | two << 5 | three << 10));
                converter.cr2().write(|w| w.bits(ON | trigger));
            }
        }
        asm::delay(READY_US * self.clock_mhz);
        let (rows, triggers) = &self.timers;
        // SAFETY: as above. Timer 1 has a count for its output before it has an output: that must not rise now.
        unsafe {
            rows.ccr1().write(|w| w.bits(u32::from(u16::MAX)));
            rows.ccmr1_output().write(|w| w.bits(FROM_COUNT_ON));
            rows.cr2().write(|w| w.bits(OUTPUT_1));
            rows.cr1().write(|w| w.bits(BY_OVERFLOW | ONCE));
            triggers.arr().write(|w| w.bits(u32::from(ONCHIP_TRIGGER_TICKS) - 1));
            triggers.ccr1().write(|w| w.bits(1));
            triggers.ccmr1_output().write(|w| w.bits(FROM_COUNT_ON));
            triggers.cr2().write(|w| w.bits(OUTPUT_1));
            triggers.cr1().write(|w| w.bits(BY_OVERFLOW | ONCE));
            triggers.smcr().write(|w| w.bits(STARTED_BY_TIMER_1));
        }
    }
}
