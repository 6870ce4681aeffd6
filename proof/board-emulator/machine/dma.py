"""DMA1 and DMA2: streams between memory and registers (RM0390, chapter 9)."""

from .bus import Registers
from .cpu import SRAM, SRAM_BYTES
from .rules import Fault

LISR, LIFCR, FIRST_STREAM, STREAM_BYTES = 0x00, 0x08, 0x10, 0x18
CR, NDTR, PAR, M0AR = 0x00, 0x04, 0x08, 0x0C
EN, TCIE, FROM_MEMORY, CIRC, MEMORY_COUNTS = 1 << 0, 1 << 4, 1 << 6, 1 << 8, 1 << 10
#: Fields of the control register that are modelled with any value: those above, sizes, priority and channel.
ANY = EN | TCIE | FROM_MEMORY | CIRC | MEMORY_COUNTS | 3 << 11 | 3 << 13 | 3 << 16 | 7 << 25
COMPLETE, HALF = 1 << 5, 1 << 4
#: Where the flags of a stream stand among those of its four.
FLAG_PLACES = (0, 6, 16, 22)
STREAMS = 8


class Dma(Registers):
    """Streams. `register(address, value, cycle)` takes what DMA writes to a register; `advance` is called before an access,
    `seen` when the program looks at the flags and a transfer has ended since, `started` when it has started a stream.
    """

    def __init__(self, uc, rules, advance, register, seen=lambda: None, started=lambda: None):
        super().__init__()
        self._uc, self._rules, self._advance, self._register = uc, rules, advance, register
        self._seen, self._started = seen, started
        #: Streams that move nothing: a fault.
        self.stalled = set()
        #: Whether a transfer has ended that the program has not seen.
        self._news = False
        #: Flags of each stream, items that are left, and the next place in memory.
        self.flags, self._left, self._place = [0] * STREAMS, [0] * STREAMS, [0] * STREAMS

    def _stream(self, stream, register):
        return self.values.get(FIRST_STREAM + STREAM_BYTES * stream + register, 0)

    def read(self, offset):
        self._advance()
        if offset < LIFCR:
            first = offset
            found = sum(self.flags[first + index] << place for index, place in enumerate(FLAG_PLACES))
            if self._news:
                self._news = False
                self._seen()
            return found
        stream, register = divmod(offset - FIRST_STREAM, STREAM_BYTES)
        return self._left[stream] if register == NDTR else super().read(offset)

    def write(self, offset, value):
        self._advance()
        if offset < FIRST_STREAM:
            if offset >= LIFCR:
                for index, place in enumerate(FLAG_PLACES):
                    self.flags[offset - LIFCR + index] &= ~(value >> place & 0x3D)
            return
        stream, register = divmod(offset - FIRST_STREAM, STREAM_BYTES)
        was_on = self._stream(stream, CR) & EN
        if was_on and (register != CR or value & EN and value != self._stream(stream, CR)):
            self._rules.breach("dma-on", f"stream {stream}")
            return
        super().write(offset, value)
        if register == CR and value & EN and not was_on:
            self._start(stream, value)

    def _start(self, stream, control):
        if control & ~ANY or control >> 11 & 3 != control >> 13 & 3:
            raise Fault(f"DMA stream {stream} has a mode that is not modelled: {control:#x}")
        if self.flags[stream]:
            self._rules.breach("dma-flags", f"stream {stream}: {self.flags[stream]:06b}")
        self._rewind(stream)
        items = self._left[stream] if control & MEMORY_COUNTS else 1
        end = self._place[stream] + items * (1 << (control >> 11 & 3))
        if not SRAM <= self._place[stream] < end <= SRAM + SRAM_BYTES:
            self._rules.breach("dma-place", f"stream {stream}: {self._place[stream]:#x} to {end:#x}")
            self.values[FIRST_STREAM + STREAM_BYTES * stream + CR] &= ~EN
        self._started()

    def _rewind(self, stream):
        self._left[stream], self._place[stream] = self._stream(stream, NDTR), self._stream(stream, M0AR)

    def interrupt(self, stream):
        """Whether a stream asks for its interrupt."""
        return bool(self._stream(stream, CR) & TCIE and self.flags[stream] & COMPLETE)

    def _serves(self, stream, channel):
        control = self._stream(stream, CR)
        return stream not in self.stalled and control & EN and control >> 25 & 7 == channel

    def _count(self, stream, items):
        self._left[stream] -= items
        if not self._left[stream]:
            self._news = True
            self.flags[stream] |= COMPLETE | HALF
            if self._stream(stream, CR) & CIRC:
                self._rewind(stream)
                return
            self.values[FIRST_STREAM + STREAM_BYTES * stream + CR] &= ~EN

    def to_register(self, stream, channel, cycle, size=4):
        """A request for the next item of so many bytes from memory. Returns whether there was one."""
        if not self._serves(stream, channel):
            return False
        control = self._stream(stream, CR)
        if not control & FROM_MEMORY or 1 << (control >> 11 & 3) != size:
            raise Fault(f"DMA stream {stream} writes to memory, or not {size} bytes at once")
        item = int.from_bytes(self._uc.mem_read(self._place[stream], size), "little")
        self._place[stream] += size if control & MEMORY_COUNTS else 0
        self._count(stream, 1)
        self._register(self._stream(stream, PAR), item, cycle)
        return True

    def to_memory(self, stream, channel, address, numbers, size=2):
        """Requests for these numbers of so many bytes to be taken from the register at `address`, one by one. Returns how many
        were.
        """
        if not self._serves(stream, channel):
            return 0
        control = self._stream(stream, CR)
        if control & FROM_MEMORY or 1 << (control >> 11 & 3) != size or self._stream(stream, PAR) != address:
            raise Fault(f"DMA stream {stream} reads from memory, not {size} bytes at once, or another register")
        taken = min(len(numbers), self._left[stream])
        if not control & MEMORY_COUNTS:
            raise Fault(f"DMA stream {stream} writes to one place in memory")
        data = b"".join(number.to_bytes(size, "little") for number in numbers[:taken])
        self._uc.mem_write(self._place[stream], data)
        self._place[stream] += len(data)
        self._count(stream, taken)
        return taken
