"""Timers 1 and 8 as the on-chip readout uses them: a counter of rows, and triggers that it starts (RM0390, chapter 16)."""

from .bus import Registers
from .rules import Fault

CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CNT, PSC, ARR, RCR = (
    0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x24, 0x28, 0x2C, 0x30)
CCR1, CCR2, CCR3 = 0x34, 0x38, 0x3C
CEN, URS, OPM, UG = 1 << 0, 1 << 2, 1 << 3, 1 << 0
#: Output 1 as the trigger output, active from its count on; started by timer 1's; requests for DMA by an update and
#: channels 2 and 3.
BY_OUTPUT_1, FROM_COUNT_ON, STARTED_BY_TIMER_1, REQUESTS = 4 << 4, 7 << 4, 6, 0xD00
#: Streams of DMA2 that take timer 1's requests, by what they are for, and their channel.
SWITCH, END, ROW, CHANNEL = 2, 5, 6, 6
#: Ticks that DMA takes to write what was asked for.
DMA_TICKS = 16


class ScanTimer(Registers):
    """A timer of which the prescaler and the repetitions are loaded by an update, as on silicon."""

    AFTER_RESET = {ARR: 0xFFFF}

    def __init__(self, advance, started=lambda: None):
        super().__init__()
        self._advance, self._started, self.loaded = advance, started, (0, 0)

    def reset(self):
        """The clock controller resets it."""
        self.values, self.loaded = dict(self.AFTER_RESET), (0, 0)

    def read(self, offset):
        self._advance()
        return super().read(offset)

    def write(self, offset, value):
        self._advance()
        if offset == EGR:
            if value & UG:
                self.loaded = self.values.get(PSC, 0), self.values.get(RCR, 0)
            return
        starts = offset == CR1 and value & CEN and not self.values.get(CR1, 0) & CEN
        super().write(offset, value)
        if starts:
            self._started()

    def on(self):
        """Whether it counts."""
        return bool(self.values.get(CR1, 0) & CEN)

    def stop(self):
        """It has counted once."""
        self.values[CR1] &= ~CEN


class Passes:
    """What the timers do to rows, multiplexers and converters, one event after the other. `moment(cycle)` says when what
    follows happens; `busy` is called when a pass begins, and when its end is seen. Unless it `triggers`, timer 8 is deaf.
    """

    def __init__(self, time, rules, clock, dma, adc, moment, busy, triggers=True):
        self._time, self._rules, self._clock, self._dma, self._adc = time, rules, clock, dma, adc
        self._moment, self._busy, self.triggers_converters = moment, busy, triggers
        self.rows, self.triggers = ScanTimer(self.advance, self._start), ScanTimer(self.advance)
        #: Events to come, the last one first; the triggers to come: the first one's cycle, their number, their
        #: distance, and what the converters do at each; and the cycle at which the last column is sampled.
        self._events, self._waiting, self._sampled = [], None, 0
        #: Number of passes that were given up.
        self.cuts = 0
        #: Called when a pass begins and ends, with the cycle.
        self.on_start, self.on_end = lambda cycle: None, lambda cycle: None

    def reset(self):
        """The clock controller resets both timers."""
        self.cuts += bool(self._events)
        self.rows.reset()
        self.triggers.reset()
        self._events, self._waiting = [], None

    def next_event(self):
        """Cycle at which the pass ends; `None` without one."""
        return self._events[0][0] if self._events else None

    def _start(self):
        rows, triggers = self.rows.values, self.triggers.values
        modes = (rows.get(CR1) == CEN | URS | OPM and rows.get(CR2) == BY_OUTPUT_1
                 and rows.get(CCMR1) == FROM_COUNT_ON and rows.get(DIER) == REQUESTS
                 and triggers.get(CR1) == URS | OPM and triggers.get(CR2) == BY_OUTPUT_1
                 and triggers.get(CCMR1) == FROM_COUNT_ON and triggers.get(SMCR) == STARTED_BY_TIMER_1)
        if not modes or rows.get(CCR1, 0) > rows[ARR] or rows.get(CCR2, 0) > rows[ARR]:
            raise Fault(f"the scan's timers have a mode that is not modelled: {rows} {triggers}")
        self._busy()
        tick = self._time.hz / self._clock()
        divider, repetitions = self.rows.loaded[0] + 1, self.rows.loaded[1] + 1
        start, count = self._time.now, divider * tick
        for row in range(repetitions):
            first = start + row * (rows[ARR] + 1) * count
            # Compared when the counter has reached the value.
            self._events += [
                (first + rows.get(CCR3, 0) * count + DMA_TICKS, self._drive),
                (first + rows.get(CCR1, 0) * count, self._trigger),
                (first + rows.get(CCR2, 0) * count + DMA_TICKS, self._switch),
            ]
        end = start + repetitions * (rows[ARR] + 1) * count
        self._events.append((end + DMA_TICKS, self._end))
        self._events.sort(key=lambda event: event[0], reverse=True)
        self.on_start(start)

    def advance(self):
        """Lets everything happen that is due."""
        now = self._time.now
        while self._events and self._events[-1][0] <= now:
            cycle, event = self._events.pop()
            self._convert_until(cycle)
            event(cycle)
        if not self._events:
            self._convert_until(now)

    def _trigger(self, cycle):
        if not self.triggers_converters:
            return
        if self._waiting:
            self._rules.breach("triggers-cut", f"{self._waiting[1]} are left")
        tick = self._time.hz / self._clock()
        step = (self.triggers.values[ARR] + 1) * tick
        first = cycle + self.triggers.values.get(CCR1, 0) * tick
        self._waiting = first, self.triggers.loaded[1] + 1, step, self._adc.turns()[0]

    def _convert_until(self, cycle):
        """Converts what begins to be sampled before `cycle`: all of it sees the same pins."""
        if not self._waiting:
            return
        first, left, step, turns = self._waiting
        count = min(left, max(0, -int((first + turns[0][1] - cycle) // step)))
        if count:
            self._adc.convert(first, step, count)
            self._sampled = first + (count - 1) * step + turns[-1][2]
            self._waiting = (first + count * step, left - count, step, turns) if left > count else None

    def _check_sampled(self, cycle):
        if self._sampled > cycle:
            ns = self._time.ns(self._sampled - cycle)
            self._rules.breach("changed-early", f"{ns:.0f} ns before the end")

    def _drive(self, cycle):
        self._check_sampled(cycle)
        self._moment(cycle)
        self._dma.to_register(ROW, CHANNEL, cycle)

    def _switch(self, cycle):
        self._check_sampled(cycle)
        self._moment(cycle)
        self._dma.to_register(SWITCH, CHANNEL, cycle)

    def _end(self, cycle):
        self._check_sampled(cycle)
        self._moment(cycle)
        self._dma.to_register(END, CHANNEL, cycle)
        self.rows.stop()
        self._busy()
        self.on_end(cycle)
