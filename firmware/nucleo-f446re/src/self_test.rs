//! The readout's test of itself: what the host asks for with `Diagnose`.

use core::ptr::{
    read_volatile, with_exposed_provenance, with_exposed_provenance_mut, write_volatile,
};

use cortex_m::asm;
use cortex_m::peripheral::DWT;
use stm32f4xx_hal::pac::adc1::RegisterBlock;
use stm32f4xx_hal::pac::{GPIOA, GPIOB, GPIOC};
use taxel_firmware::readout::{Diagnosis, PINS, Sequencer};

use crate::own_converters::{
    CHANNELS, COLUMNS, COUNTING, END_COMPLETE, LINES, NUMBERS_COMPLETE, ON, OVERRUN, OwnConverters,
};

/// Where the factory's numbers are (DS10693, tables 80 and 83): the reference, and the temperature at 30 °C and 110 °C.
const FACTORY: [usize; 3] = [0x1FFF_7A2A, 0x1FFF_7A2C, 0x1FFF_7A2E];

/// Channels of the first converter: the reference and the temperature sensor.
const REFERENCE: u32 = 17;
const TEMPERATURE: u32 = 18;

/// The converters' common control: each by itself, an eighth of the processor's clock, and the sensors on.
const EACH_ALONE: u32 = 1 << 16 | 1 << 23;

/// Sampling for 480 cycles: 21 µs, of which a temperature takes 10 and a pull-up of 50 kΩ 6.
const LONG_SAMPLED: u32 = 0o777_777_777;
const START: u32 = 1 << 30;
const CONVERTED: u32 = 1 << 1;

/// Looks at a converter, of which one takes 22 µs at least.
const MOST_LOOKS: u32 = 2000;

/// Time in µs in which sensors and pulls settle, and the longest that a pass of idle rows may take.
const SETTLING_US: u32 = 20;
const LONGEST_PASS_US: u32 = 5000;

/// A port's registers of modes and pulls, from its start on; their fields have two bits a pin.
const MODES: usize = 0x00;
const PULLS: usize = 0x0C;
const INPUT: u32 = 0;
const ANALOGUE: u32 = 3;
const NO_PULL: u32 = 0;
const PULL_UP: u32 = 1;
const PULL_DOWN: u32 = 2;

/// Half of the converters' range.
const HALF_COUNTS: u16 = 2048;

impl OwnConverters {
    /// Tests the converters, their pins, and one pass in which all rows idle.
    pub(crate) fn test(&mut self) -> Diagnosis {
        let mut found = Diagnosis::default();
        self.stop();
        self.try_pass(&mut found);
        self.stop();
        self.sample_alone();
        found.reference = convert(&self.converters.0, REFERENCE);
        found.temperature = convert(&self.converters.0, TEMPERATURE);
        // SAFETY: the factory has written there, and nobody else does.
        found.factory = FACTORY.map(|at| unsafe { read_volatile(with_exposed_provenance(at)) });
        (0..PINS).for_each(|pin| set_pin(pin, INPUT, PULL_DOWN));
        found.pulled_down = self.sample_pins();
        for (pin, (up, along)) in found.pulled_up.iter_mut().zip(&mut found.rise_along).enumerate()
        {
            set_pin(pin, INPUT, PULL_UP);
            for (other, counts) in self.sample_pins().into_iter().enumerate() {
                if other == pin {
                    *up = counts;
                } else if counts > HALF_COUNTS && counts != Diagnosis::NO_ANSWER {
                    *along |= 1 << other;
                }
            }
            set_pin(pin, INPUT, PULL_DOWN);
        }
        (0..PINS).for_each(|pin| set_pin(pin, ANALOGUE, NO_PULL));
        self.stop();
        found
    }

    /// Lets one pass go by, and notes what each part of it did.
    fn try_pass(&mut self, found: &mut Diagnosis) {
        let lines = LINES as u16;
        found.items = [lines, lines, lines * COLUMNS as u16, 1];
        Sequencer::start(self, &[None; LINES], SETTLING_US, 1);
        let start = DWT::cycle_count();
        let is_over = || {
            let (low, high) = (self.dma.lisr().read().bits(), self.dma.hisr().read().bits());
            low & NUMBERS_COMPLETE != 0 && high & END_COMPLETE != 0
        };
        let passed = || DWT::cycle_count().wrapping_sub(start);
        while !is_over() && passed() < LONGEST_PASS_US * self.clock_mhz {}
        found.pass_cycles = passed();
        let [numbers, switches, end, rows] =
            self.streams().map(|stream| stream.ndtr().read().bits() as u16);
        found.items_left = [rows, switches, numbers, end];
        found.has_stopped = self.timers.0.cr1().read().bits() & COUNTING == 0;
        found.has_overrun = self.converters.3.csr().read().bits() & OVERRUN != 0;
    }

    /// Lets each converter sample one channel when it is told to.
    fn sample_alone(&self) {
        let (first, second, third, common) = &self.converters;
        // SAFETY: the fields are those that their constants tell.
        common.ccr().write(|w| unsafe { w.bits(EACH_ALONE) });
        let blocks: [&RegisterBlock; 3] = [first, second, third];
        for converter in blocks {
            // SAFETY: as above.
            unsafe {
                converter.cr1().write(|w| w.bits(0));
                converter.smpr1().write(|w| w.bits(LONG_SAMPLED));
                converter.smpr2().write(|w| w.bits(LONG_SAMPLED));
                converter.sqr1().write(|w| w.bits(0));
                converter.cr2().write(|w| w.bits(ON));
            }
        }
        asm::delay(SETTLING_US * self.clock_mhz);
    }

    /// Counts of all pins, each by the converter that scans it.
    fn sample_pins(&self) -> [u16; PINS] {
        asm::delay(SETTLING_US * self.clock_mhz);
        let (first, second, third, _) = &self.converters;
        let blocks: [&RegisterBlock; 3] = [first, second, third];
        let mut counts = [Diagnosis::NO_ANSWER; PINS];
        let channels =
            blocks.into_iter().zip(&CHANNELS).flat_map(|(it, all)| all.map(|one| (it, one)));
        for (place, (converter, channel)) in counts.iter_mut().zip(channels) {
            *place = convert(converter, channel);
        }
        counts
    }
}

/// One number of a converter that samples alone.
fn convert(converter: &RegisterBlock, channel: u32) -> u16 {
    // SAFETY: the fields are those that their constants tell.
    unsafe {
        converter.sqr3().write(|w| w.bits(channel));
        converter.cr2().write(|w| w.bits(ON | START));
    }
    let is_there = (0..MOST_LOOKS).any(|_| converter.sr().read().bits() & CONVERTED != 0);
    if is_there { converter.dr().read().bits() as u16 } else { Diagnosis::NO_ANSWER }
}

/// Sets the mode and the pull of one of the converters' pins.
fn set_pin(pin: usize, mode: u32, pull: u32) {
    let (a, b, c) = (GPIOA::PTR.addr(), GPIOB::PTR.addr(), GPIOC::PTR.addr());
    let pins = [(a, 0), (a, 1), (a, 4), (a, 6), (a, 7), (b, 0), (c, 0), (c, 1), (c, 2)];
    let Some((port, number)) = pins.get(pin) else { return };
    for (register, field) in [(MODES, mode), (PULLS, pull)] {
        let place = with_exposed_provenance_mut::<u32>(port + register);
        let (mask, field) = (3 << (2 * number), field << (2 * number));
        // SAFETY: a register of a port, of which only this pin's field changes; no interrupt changes ports.
        unsafe { write_volatile(place, read_volatile(place) & !mask | field) };
    }
}
