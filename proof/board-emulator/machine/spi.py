"""SPI2 as master of 8-bit frames, with the bytes' exact times (RM0390, chapter 26)."""

from .bus import Registers

CR1, CR2, SR, DR = 0x00, 0x04, 0x08, 0x0C
CPHA, CPOL, MSTR, SPE, LSBFIRST = 1 << 0, 1 << 1, 1 << 2, 1 << 6, 1 << 7
RXNE, TXE, OVR, BSY = 1 << 0, 1 << 1, 1 << 6, 1 << 7
#: Fastest clock in Hz that an MCP3208 stands at 3.3 V.
FASTEST_HZ = 1_000_000


class Spi(Registers):
    """Shifts bytes through `exchange(byte, start, bit_cycles)`.

    A byte lasts eight clocks. RXNE rises with the last sample, half a clock before the end; BSY falls at the end.
    """

    AFTER_RESET = {CR2: 0, SR: 2}

    def __init__(self, time, rules, wait, pclk1, sck_slow, exchange):
        super().__init__()
        self._time, self._rules, self._wait = time, rules, wait
        self._pclk1, self._sck_slow, self._exchange = pclk1, sck_slow, exchange
        #: Cycle at which the last clock pulse ends.
        self.ends = 0
        #: When the last bit of the byte under way is sampled, and the byte received.
        self._sampled = None
        self._received, self._fresh, self._overrun = 0, False, False
        self._previous, self._polled = 1, False

    def _bit_cycles(self):
        divider = 2 << (self.values.get(CR1, 0) >> 3 & 7)
        return divider * self._time.hz / self._pclk1()

    def write(self, offset, value):
        if offset == DR:
            self._send(value & 0xFF)
            return
        super().write(offset, value)
        if offset == CR1 and value & SPE:
            hz = self._time.hz / self._bit_cycles()
            if hz > FASTEST_HZ:
                self._rules.breach("converter-speed", f"{hz / 1e3:.0f} kHz")
            if value & (CPHA | CPOL) not in (0, CPHA | CPOL) or value & LSBFIRST:
                self._rules.breach("spi-mode")
            if self._sck_slow():
                self._rules.breach("sck-slow")

    def _send(self, byte):
        if self.values.get(CR1, 0) & (SPE | MSTR) != SPE | MSTR:
            self._rules.breach("spi-off")
            return
        self._polled = False
        self._take()
        bit = self._bit_cycles()
        start = max(self._time.now, self.ends)
        received = self._exchange(byte, start, bit)
        last = received & 1
        if self._sck_slow():
            # ES0298: the feedback of the clock comes too late for the last bit, which keeps its former value.
            received = received & ~1 | self._previous
        self._previous = last
        self._sampled = (start + 7.5 * bit, received)
        self.ends = start + 8 * bit

    def _take(self):
        """Moves a byte whose last bit was sampled to the data register."""
        if self._sampled and self._time.now >= self._sampled[0]:
            self._overrun |= self._fresh
            self._received, self._fresh = self._sampled[1], True
            self._sampled = None

    def read(self, offset):
        if offset == SR:
            if self._polled:
                # Time passes until what is waited for.
                self._wait(self._sampled[0] if self._sampled else self.ends)
            self._polled = True
            self._take()
            busy = self._time.now < self.ends
            return TXE | (RXNE if self._fresh else 0) | (OVR if self._overrun else 0) | (BSY if busy else 0)
        if offset == DR:
            self._polled = False
            self._take()
            self._fresh = False
            return self._received
        return super().read(offset)
