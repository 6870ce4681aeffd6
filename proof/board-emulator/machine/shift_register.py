"""The 74HC595s that control the rows' switches."""

#: Shortest time in ns of set-up and of each level at 3.3 V (between the data sheet's figures for 2 V and 4.5 V).
SHORTEST_NS = 50
#: Longest time in s that a row may be driven, besides its settling: 32 samples and the code between them.
LONGEST_DRIVEN_S = 2e-3


class ShiftRegister:
    """Registers in series with so many `outputs`. These are undefined (`None`) until the first latch."""

    def __init__(self, time, rules, outputs, settling_us):
        self._time, self._rules, self._mask = time, rules, (1 << outputs) - 1
        self.outputs = None
        #: Cycle at which the outputs changed.
        self.changed_at = 0
        #: Second at which a row began to be driven; `None` while none is.
        self._driven_since, self._settling_us = None, settling_us
        self._bits, self._data = 0, False
        self._edges = {}

    def _edge(self, pin):
        self._edges[pin] = self._time.now

    def _since(self, pin):
        at = self._edges.get(pin)
        return float("inf") if at is None else self._time.ns(self._time.now - at)

    def data(self, high):
        """An edge of SER."""
        self._data = high
        self._edge("data")

    def clock(self, high):
        """An edge of SRCLK."""
        if high:
            self._check("data", "SER before SRCLK")
            self._check("clock", "SRCLK low")
            self._bits = (self._bits << 1 | self._data) & self._mask
        self._edge("clock")

    def latch(self, high):
        """An edge of RCLK."""
        if high:
            self._check("clock", "SRCLK before RCLK")
            if self._bits & (self._bits - 1):
                self._rules.breach("two-rows", f"{self._bits:b}")
            self.check_rest()
            if self._bits != self.outputs:
                self.outputs, self.changed_at = self._bits, self._time.now
                self._driven_since = self._time.seconds() if self._bits else None
        self._edge("latch")

    def check_rest(self):
        """Checks that no row is driven for longer than its scan takes."""
        if self._driven_since is not None:
            driven_s = self._time.seconds() - self._driven_since
            if driven_s > LONGEST_DRIVEN_S + self._settling_us() * 1e-6:
                self._rules.breach("row-left", f"{driven_s * 1e3:.1f} ms")

    def _check(self, pin, what):
        if self._since(pin) < SHORTEST_NS:
            self._rules.breach("register-timing", f"{what}: {self._since(pin):.0f} ns")
