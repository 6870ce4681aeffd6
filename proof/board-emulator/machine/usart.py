"""USART2 and the line to the host (RM0390, chapter 25)."""

import collections

from .bus import Registers

SR, DR, BRR, CR1 = 0x00, 0x04, 0x08, 0x0C
ORE, RXNE, TC, TXE = 1 << 3, 1 << 5, 1 << 6, 1 << 7
ERRORS = 0x1F
RE, TE, RXNEIE, TCIE, TXEIE, UE, OVER8 = 1 << 2, 1 << 3, 1 << 5, 1 << 6, 1 << 7, 1 << 13, 1 << 15
BITS_A_BYTE = 10
#: Largest difference of the two ends' speeds that a receiver stands with room for the ST-LINK's own error.
LARGEST_BAUD_ERROR = 0.02


class Usart(Registers):
    """A serial port. The host's bytes arrive one after the other, without a gap."""

    AFTER_RESET = {SR: TXE | TC}

    def __init__(self, time, rules, pclk1, clock_error, baud):
        super().__init__()
        self._time, self._rules, self._pclk1, self._baud = time, rules, pclk1, baud
        self._clock_error = clock_error
        self.to_host, self.from_host = bytearray(), collections.deque()
        #: Called before the device's bytes leave.
        self.on_send = lambda: None
        #: Cycle until which bytes may be lost, because the processor stood still for the flash. Hosts know that.
        self._excused_until = 0
        #: Error flags in the status when it was read last: reading the data clears these alone.
        self._errors_seen = 0
        self._waiting = None
        self._sent_at = self._arrives_at = None
        self._byte_cycles = 0

    def next_event(self):
        """Cycle of the next change, or `None`."""
        return min((at for at in (self._sent_at, self._arrives_at) if at is not None), default=None)

    def interrupt(self):
        """Whether the port asks for its interrupt."""
        status, control = self.values[SR], self.values.get(CR1, 0)
        return (control & RXNEIE and status & (RXNE | ORE) or control & TXEIE and status & TXE
                or control & TCIE and status & TC)

    def advance(self):
        """Lets bytes leave and arrive until now."""
        if not self.values.get(CR1, 0) & UE:
            self.from_host.clear()  # nobody listens
            return
        now = self._time.now
        while self._sent_at is not None and self._sent_at <= now:
            if self._waiting is None:
                self._sent_at = None
                self.values[SR] |= TC
            else:
                self.to_host.append(self._waiting)
                self._waiting = None
                self.values[SR] |= TXE
                self._sent_at += self._byte_cycles
        if self.from_host and self._arrives_at is None:
            self._arrives_at = now + self._host_byte()
        while self._arrives_at is not None and self._arrives_at <= now:
            self._receive(self.from_host.popleft())
            self._arrives_at = self._arrives_at + self._host_byte() if self.from_host else None

    def excuse(self):
        """Allows for the loss of bytes that arrived until now, or that find the byte before still there."""
        self._excused_until = self._time.now + 2 * self._host_byte()

    def overrun(self):
        """A byte is lost between a look at the status and one at the data: the error is there, and no byte."""
        self.values[SR] |= ORE
        self._time.due = self._time.now

    def _host_byte(self):
        return BITS_A_BYTE * self._time.hz / self._baud

    def _receive(self, byte):
        if self.values[SR] & RXNE:
            self.values[SR] |= ORE
            if self._time.now > self._excused_until:
                self._rules.breach("usart-overrun")
        else:
            self.values[DR] = byte
            self.values[SR] |= RXNE

    def read(self, offset):
        self.advance()
        if offset == SR:
            self._errors_seen = self.values[SR] & ERRORS
        elif offset == DR:
            self.values[SR] &= ~(RXNE | self._errors_seen)
            self._errors_seen = 0
        return super().read(offset)

    def write(self, offset, value):
        self.advance()
        if offset == SR:
            self.values[SR] &= value | ~0x360
        elif offset == DR:
            self._send(value & 0xFF)
        else:
            super().write(offset, value)
            if offset == CR1 and value & UE:
                self._set_speed()
                if self.interrupt():
                    self._time.due = self._time.now

    def _set_speed(self):
        divider = self.values.get(BRR, 0)
        over = 8 if self.values[CR1] & OVER8 else 16
        fraction = (divider & 7) / 8 if over == 8 else (divider & 15) / 16
        baud = self._pclk1() / over / max((divider >> 4) + fraction, 1)
        self._byte_cycles = BITS_A_BYTE * self._time.hz / baud
        # What the oscillator is off comes on top: docs/board.md tells how much the line stands.
        if abs(baud / (1 + self._clock_error()) / self._baud - 1) > LARGEST_BAUD_ERROR:
            self._rules.breach("baud", f"{baud:.0f}")

    def _send(self, byte):
        if self.values.get(CR1, 0) & (UE | TE) != UE | TE or not self.values[SR] & TXE:
            self._rules.breach("usart-send")
            return
        self.on_send()
        self.values[SR] &= ~TC
        if self._sent_at is None:
            self.to_host.append(byte)
            self._sent_at = self._time.now + self._byte_cycles
            self._time.wake_at(self._sent_at)
        else:
            self._waiting = byte
            self.values[SR] &= ~TXE
