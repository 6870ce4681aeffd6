"""Rows and multiplexers at pins of port B, as wired: switches with pull-downs, or a 74HC4514 before them; and three
74HC4053.
"""

from . import gpio, wired

#: Pins of a decoder's number, least bit first, and the one that lets all idle, with a pull-up.
NUMBER, INHIBIT = (5, 6, 7, 8), 9
#: Time in ns in which a 74HC4053 switches at 3.3 V (between the data sheet's figures for 2 V and 4.5 V).
SWITCH_NS = 100
#: Longest time in s that a row may be driven, besides its settling: 32 samples of half a reading.
LONGEST_DRIVEN_S = 0.4e-3


class RowPins:
    """Drives the rows whose pins are high; a pin that is no output is low. More `rows` than pins are behind a decoder."""

    def __init__(self, time, rules, port, rows, settling_us):
        self._time, self._rules, self._port, self._settling_us = time, rules, port, settling_us
        self._by_decoder = rows > len(wired.ROWS)
        #: Rows that are driven, a bit each; the half of the columns; and the cycles at which they changed.
        self.outputs, self.half, self.changed_at, self.half_changed_at = 0, 0, 0, 0
        self._driven_since = None
        #: Called with the cycle of each change of rows.
        self.on_change = lambda cycle: None

    def _level(self, pin):
        return self._port.mode(pin) == gpio.OUTPUT and self._port.high(pin)

    def _driven(self):
        if not self._by_decoder:
            return sum(1 << row for pin, row in wired.ROWS.items() if self._level(pin))
        if self._level(INHIBIT) or self._port.mode(INHIBIT) != gpio.OUTPUT:
            return 0
        return 1 << sum(1 << bit for bit, pin in enumerate(NUMBER) if self._level(pin))

    def update(self, cycle):
        """The port has changed at this cycle."""
        outputs = self._driven()
        half = int(self._level(wired.SELECT))
        if half != self.half:
            self.half, self.half_changed_at = half, cycle
        if outputs == self.outputs:
            return
        self.check_rest(cycle)
        if outputs & (outputs - 1):
            self._rules.breach("two-rows", f"{outputs:b}")
        self.outputs, self.changed_at = outputs, cycle
        self._driven_since = cycle if outputs else None
        self.on_change(cycle)

    def check_rest(self, cycle=None):
        """Checks that no row is driven for longer than its pass takes."""
        if self._driven_since is None:
            return
        driven_s = self._time.ns((self._time.now if cycle is None else cycle) - self._driven_since) * 1e-9
        if driven_s > LONGEST_DRIVEN_S + self._settling_us() * 1e-6:
            self._rules.breach("row-left", f"{driven_s * 1e3:.2f} ms")

    def column(self, pin, cycle):
        """The column at a converter's pin, which is sampled from `cycle` on; `None` at one without a multiplexer."""
        if pin not in wired.COLUMNS:
            return None
        ns = self._time.ns(cycle - self.half_changed_at)
        if ns < SWITCH_NS:
            self._rules.breach("mux-late", f"{ns:.0f} ns")
        return wired.COLUMNS[pin][self.half]
