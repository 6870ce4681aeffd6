"""USART2, which DMA1 serves, and the line to the host (RM0390, chapter 25)."""

import collections

from .bus import Registers
from .rules import Fault

SR, DR, BRR, CR1, CR3 = 0x00, 0x04, 0x08, 0x0C, 0x14
ORE, RXNE, TC, TXE = 1 << 3, 1 << 5, 1 << 6, 1 << 7
TE, INTERRUPTS, UE, OVER8 = 1 << 3, 0x1F << 4, 1 << 13, 1 << 15
#: Requests for DMA by received bytes and by room for the next one to send; where the data is for it; its streams and channel.
DMAR, DMAT, DATA_ADDRESS, RECEIVED, SENT, CHANNEL = 1 << 6, 1 << 7, 0x4000_4404, 5, 6, 4
BITS_A_BYTE = 10
#: Largest difference of the two ends' speeds that a receiver stands with room for the ST-LINK's own error.
LARGEST_BAUD_ERROR = 0.02


class Usart(Registers):
    """A serial port. The host's bytes arrive one after the other, without a gap. `dma` is set once it is there."""

    AFTER_RESET = {SR: TXE | TC}

    def __init__(self, time, rules, pclk1, clock_error, baud):
        super().__init__()
        self._time, self._rules, self._pclk1, self._baud = time, rules, pclk1, baud
        self._clock_error = clock_error
        self.to_host, self.from_host, self.dma = bytearray(), collections.deque(), None
        #: Called when a byte has arrived or begins to leave.
        self.on_byte = lambda: None
        self._waiting = None
        self._sent_at = self._arrives_at = None
        self._byte_cycles = 0

    def next_event(self):
        """Cycle of the next change, or `None`."""
        return min((at for at in (self._sent_at, self._arrives_at) if at is not None), default=None)

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
                self.serve()
        if self.from_host and self._arrives_at is None:
            self._arrives_at = now + self._host_byte()
        while self._arrives_at is not None and self._arrives_at <= now:
            self._receive(self.from_host.popleft())
            self._arrives_at = self._arrives_at + self._host_byte() if self.from_host else None

    def serve(self):
        """Lets DMA take the byte that was received, and give bytes to send."""
        status, control, dma = self.values, self.values.get(CR3, 0), self.dma
        while control & DMAT and status[SR] & TXE and dma.to_register(SENT, CHANNEL, self._time.now, 1):
            pass
        if control & DMAR and status[SR] & RXNE and dma.to_memory(RECEIVED, CHANNEL, DATA_ADDRESS, [status[DR]], 1):
            status[SR] &= ~RXNE
        if dma.interrupt(SENT):
            self._time.due = self._time.now

    def send_by_dma(self, address, byte, _cycle):
        """A byte to send, to the register at `address`. "All sent" stays set: what the program reads and writes clears it."""
        if address != DATA_ADDRESS:
            raise Fault(f"DMA1 writes to {address:#x}")
        self._send(byte)

    def _host_byte(self):
        return BITS_A_BYTE * self._time.hz / self._baud

    def _receive(self, byte):
        if self.values[SR] & RXNE:
            self.values[SR] |= ORE
            self._rules.breach("usart-overrun")
        else:
            self.values[DR] = byte
            self.values[SR] |= RXNE
            self.on_byte()
            self.serve()

    def read(self, offset):
        self.advance()
        return super().read(offset)

    def write(self, offset, value):
        self.advance()
        if offset == SR:
            self.values[SR] &= value | ~0x360
        else:
            super().write(offset, value)
            if offset == DR or offset == CR1 and value & INTERRUPTS:
                raise Fault("USART2 has a mode that is not modelled: without DMA")
            if offset == CR1 and value & UE:
                self._set_speed()

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
        self.on_byte()
        if self._sent_at is None:
            self.to_host.append(byte)
            self._sent_at = self._time.now + self._byte_cycles
            self._time.wake_at(self._sent_at)
        else:
            self._waiting = byte
            self.values[SR] &= ~TXE
