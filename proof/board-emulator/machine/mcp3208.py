"""The MCP3208 converter, bit by bit (Microchip DS21298, figures 5-1 and 6-1)."""

#: Shortest time in ns that the chip select must be high between two samples.
SHORTEST_HIGH_NS = 500
#: Clocks from the start bit (0) on: channel complete, null bit, and the bits behind it.
CHANNEL_COMPLETE, NULL_BIT = 4, 6
BITS = 12


class Mcp3208:
    """One converter. `volts(channel, cycle)` tells what is at an input when it is sampled."""

    def __init__(self, time, rules, reference_v, volts):
        self._time, self._rules = time, rules
        self._reference_v, self._volts = reference_v, volts
        self.selected = False
        self._raised_at = None
        self._clock, self._command, self._counts = None, 0, 0

    def select(self, low):
        """The chip select falls or rises."""
        now = self._time.now
        if low and not self.selected:
            if self._raised_at is not None and self._time.ns(now - self._raised_at) < SHORTEST_HIGH_NS:
                self._rules.breach("select-short", f"{self._time.ns(now - self._raised_at):.0f} ns")
            self._clock, self._command = None, 0
        if not low:
            self._raised_at = now
        self.selected = low

    def rise(self, data_in, cycle):
        """A rising edge of the clock. Returns the bit at the output; `None` while it is not driven."""
        if self._clock is None:
            if data_in:
                self._clock = 0
            return None
        self._clock += 1
        clock = self._clock
        if clock <= CHANNEL_COMPLETE:
            self._command = self._command << 1 | data_in
            return None
        if clock < NULL_BIT:
            return None
        if clock == NULL_BIT:
            self._sample(cycle)
            return 0
        # First the result from its highest bit on, then again from the second lowest upwards, then zeros.
        place = clock - NULL_BIT
        shift = BITS - place if place <= BITS else place - BITS
        return self._counts >> shift & 1 if shift < BITS else 0

    def _sample(self, cycle):
        if not self._command & 8:
            self._rules.breach("converter-command", f"{self._command:04b}")
        volts = self._volts(self._command & 7, cycle)
        self._counts = max(0, min((1 << BITS) - 1, int(volts / self._reference_v * (1 << BITS))))
