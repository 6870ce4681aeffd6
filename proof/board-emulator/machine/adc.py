"""ADC1 to ADC3 in triple simultaneous mode, triggered by timer 8 (RM0390, chapter 13; DS10693, table 74)."""

import math

from .bus import Registers
from .cpu import FACTORY
from .rules import Fault

SR, CR1, CR2, SMPR1, SMPR2, SQR1, SQR3, DR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x2C, 0x34, 0x4C
CONVERTER_BYTES, CSR, CCR, CDR = 0x100, 0x300, 0x304, 0x308
SCAN, ADON = 1 << 8, 1 << 0
RISING, TIMER_8 = 1 << 28, 14 << 24
TRIPLE_SIMULTANEOUS, EACH_NUMBER, FOR_EVER = 0b10110, 1 << 14, 1 << 13
SWSTART, EOC = 1 << 30, 1 << 1
#: Bit of the common control that turns the sensors on; channels of ADC1 that they have; time in s that a temperature takes.
TSVREFE, REFERENCE, TEMPERATURE, SENSOR_S = 1 << 23, 17, 18, 10e-6
#: Temperatures in °C of the factory's numbers, and its supply in V.
FACTORY_CELSIUS, FACTORY_V = (30, 110), 3.3
OVERRUNS = 1 << 5 | 1 << 13 | 1 << 21
#: Cycles to sample, by their field; to convert 12 bits; and that a trigger may take.
SAMPLE_CYCLES = (3, 15, 28, 56, 84, 112, 144, 480)
CONVERT_CYCLES, TRIGGER_CYCLES = 12, 3
#: Cycles that must be left before the next trigger: its own latency is not the same each time (RM0390 13.3.9).
SLACK_CYCLES = 2
FASTEST_HZ, BITS = 36e6, 12
#: Resistance in Ω of the converter's switch, and its largest capacitance in F; resistance in Ω of a 74HC4053 at 3.3 V and the
#: op-amp before it.
SWITCH_OHM, SAMPLE_F, SOURCE_OHM = 6e3, 7e-12, 180.0
#: Where the common data register is for DMA, and the stream and channel of DMA2 that take its numbers.
DATA_ADDRESS, STREAM, CHANNEL = 0x4001_2308, 0, 0
#: Pins by channel.
PINS = (("A", 0), ("A", 1), ("A", 2), ("A", 3), ("A", 4), ("A", 5), ("A", 6), ("A", 7), ("B", 0), ("B", 1),
        ("C", 0), ("C", 1), ("C", 2), ("C", 3), ("C", 4), ("C", 5))
#: Channels that ADC3 has on 64 pins.
OF_THIRD = (0, 1, 2, 3, 10, 11, 12, 13)
ANALOGUE = 3


class Adc(Registers):
    """Three converters. `reference_v` is their reference in V. `counts(pin, cycle)` tells what a pin's voltage makes of it, with the cycle at which sampling
    begins. `advance` is called before an access.
    """

    def __init__(self, time, rules, rcc, ports, dma, advance, counts):
        super().__init__()
        self._time, self._rules, self._rcc, self._ports = time, rules, rcc, ports
        self._dma, self._advance, self._counts, self.reference_v = dma, advance, counts, FACTORY_V
        #: What a fault changes: pins by channel, converters that never answer, and the chip's temperature in °C.
        self.pins, self.dead, self.celsius = list(PINS), set(), 25.0

    def reset(self):
        """The clock controller resets all three."""
        self.values.clear()

    def read(self, offset):
        self._advance()
        converter, register = divmod(offset, CONVERTER_BYTES)
        if register == DR and converter < 3:
            self.values[offset - DR] = self._of(converter, SR) & ~EOC
        return super().read(offset)

    def write(self, offset, value):
        self._advance()
        converter = offset // CONVERTER_BYTES
        if converter < 3 and not self._rcc.converter_clocked(converter):
            self._rules.breach("clock-gate", f"ADC{converter + 1}")
        super().write(offset, value)
        if converter < 3 and offset % CONVERTER_BYTES == CR2 and value & SWSTART:
            self._convert_alone(converter)

    def _convert_alone(self, converter):
        """One number of one converter, as the program asks for it: it is there at once, and its time has passed."""
        common, channel = self.values.get(CCR, 0), self._of(converter, SQR3) & 31
        if common & 31 or self._of(converter, CR1) or self._of(converter, SQR1) or not self._of(converter, CR2) & ADON:
            raise Fault(f"ADC{converter + 1} has a mode that is not modelled: {common:#x}")
        cycles = self.sample_cycles(channel)
        if channel >= REFERENCE and cycles * self.cycle() < SENSOR_S * self._time.hz:
            self._rules.breach("adc-sample", f"{cycles} cycles of a sensor")
        if converter in self.dead:
            return
        self._time.now += int((cycles + CONVERT_CYCLES) * self.cycle())
        self.values[CONVERTER_BYTES * converter + DR] = self._sensor(channel) if channel >= REFERENCE else \
            self._counts(self.pins[channel], self._time.now)
        self.values[CONVERTER_BYTES * converter + SR] = self._of(converter, SR) | EOC

    def _sensor(self, channel):
        """Counts of the reference or the temperature sensor."""
        if not self.values.get(CCR, 0) & TSVREFE:
            return 0
        reference, cold, hot = FACTORY
        low, high = FACTORY_CELSIUS
        counts = reference if channel == REFERENCE else cold + (hot - cold) * (self.celsius - low) / (high - low)
        return min((1 << BITS) - 1, round(counts * FACTORY_V / self.reference_v))

    def cycle(self):
        """Ticks of the processor's clock in a cycle of the converters'."""
        hz = self._rcc.clocks.pclk2 / (2 + 2 * (self.values.get(CCR, 0) >> 16 & 3))
        if hz > FASTEST_HZ:
            self._rules.breach("adc-clock", f"{hz / 1e6:g} MHz")
        return self._time.hz / hz

    def _of(self, converter, register):
        return self.values.get(CONVERTER_BYTES * converter + register, 0)

    def channels(self):
        """Channels of each converter, in the order in which they are converted."""
        common = self.values.get(CCR, 0)
        if common & 31 != TRIPLE_SIMULTANEOUS or common >> 14 & 3 != 1 or not common & FOR_EVER:
            raise Fault(f"the converters have a mode that is not modelled: {common:#x}")
        found = []
        for converter in range(3):
            control = self._of(converter, CR2)
            wanted = ADON | (RISING | TIMER_8 if converter == 0 else 0)
            if control != wanted or self._of(converter, CR1) != SCAN:
                raise Fault(f"ADC{converter + 1} has a mode that is not modelled: {control:#x}")
            count = (self._of(converter, SQR1) >> 20 & 15) + 1
            found.append([self._of(converter, SQR3) >> 5 * place & 31 for place in range(count)])
        if len({len(channels) for channels in found}) > 1:
            raise Fault("the converters have sequences of different lengths")
        for channel in found[2]:
            if channel not in OF_THIRD:
                raise Fault(f"ADC3 has no channel {channel} on 64 pins")
        return found

    def sample_cycles(self, channel):
        """Cycles for which a channel is sampled, by each of the converters: they must agree."""
        register, place = (SMPR2, channel) if channel < 10 else (SMPR1, channel - 10)
        fields = [self._of(converter, register) >> 3 * place & 7 for converter in range(3)]
        return SAMPLE_CYCLES[fields[0]]

    def turns(self):
        """For each turn of the sequences: its channels; when sampling begins behind a trigger and when it ends, in ticks. And
        the ticks that a trigger takes in all.
        """
        tick, at, turns = self.cycle(), TRIGGER_CYCLES, []
        hz = self._time.hz / tick
        needed = (SOURCE_OHM + SWITCH_OHM) * SAMPLE_F * math.log(1 << BITS + 2) * hz + 0.5
        for channels in zip(*self.channels()):
            cycles = max(map(self.sample_cycles, channels))
            if min(map(self.sample_cycles, channels)) < needed:
                self._rules.breach("adc-sample", f"{cycles} cycles of {needed:.1f}")
            turns.append((channels, at * tick, (at + cycles) * tick))
            at += cycles + CONVERT_CYCLES
        for port, pin in (self.pins[channel] for channels, _, _ in turns for channel in channels):
            if self._ports[port].mode(pin) != ANALOGUE:
                self._rules.breach("adc-pin", f"P{port}{pin}")
        return turns, at * tick

    def convert(self, first, step, triggers):
        """So many triggers, from the cycle `first` on, every `step`. Nothing at the pins changes meanwhile."""
        turns, busy = self.turns()
        if triggers > 1 and busy + SLACK_CYCLES * self.cycle() > step:
            self._rules.breach("adc-busy", f"{busy:.0f} of {step:.0f} cycles")
        numbers = [0 if converter in self.dead else self._counts(self.pins[channel], first + begin)
                   for channels, begin, _ in turns for converter, channel in enumerate(channels)]
        numbers *= triggers
        if self._dma.to_memory(STREAM, CHANNEL, DATA_ADDRESS, numbers) < len(numbers):
            self._rules.breach("adc-overrun")
            self.values[CSR] = self.values.get(CSR, 0) | OVERRUNS
