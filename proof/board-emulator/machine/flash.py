"""The flash and its controller: keys, erasing and programming, and the time in which the processor stands still
(RM0390, chapter 3)."""

from .bus import Registers
from .cpu import FLASH, FLASH_BYTES

ACR, KEYR, SR, CR = 0x00, 0x04, 0x0C, 0x10
DCEN, DCRST = 1 << 10, 1 << 12
KEYS = (0x4567_0123, 0xCDEF_89AB)
PG, SER, STRT, LOCK = 1 << 0, 1 << 1, 1 << 16, 1 << 31
PGPERR, PGSERR, ERRORS = 1 << 6, 1 << 7, 0x1F3
#: Offset and length of each sector.
SECTORS = [(0x0, 0x4000), (0x4000, 0x4000), (0x8000, 0x4000), (0xC000, 0x4000), (0x10000, 0x10000),
           (0x20000, 0x20000), (0x40000, 0x20000), (0x60000, 0x20000)]
#: Sectors that hold the program. The others hold the journal and two models; one is free.
PROGRAM = (0, 4, 5)
#: Longest time in s to erase 128 KiB, by PSIZE: 8, 16 and 32 bits at once (DS10693).
ERASE_S = (4.0, 2.6, 2.0, 2.0)
#: Time in s to program once, whatever the width.
PROGRAM_S = 16e-6


class Flash(Registers):
    """What the flash holds, and its controller. `stall` lets time pass in which the processor stands still."""

    AFTER_RESET = {CR: LOCK}

    def __init__(self, content, rules, stall, show, erase_s=None):
        super().__init__()
        self.content, self._rules = content, rules
        self._stall, self._show, self._erase_s = stall, show, erase_s
        self._key, self._dead = 0, False
        self._changed = None
        self.busy_s = 0.0
        #: Whether the data cache may hold bytes that the flash holds no more.
        self.stale = False
        self.wait_states_changed = lambda: None

    def wait_states(self):
        """Wait states of each access."""
        return self.values.get(ACR, 0) & 15

    def write(self, offset, value):
        if offset == KEYR:
            self._unlock(value)
        elif offset == SR:
            self.values[SR] = self.values.get(SR, 0) & ~(value & ERRORS)
        elif offset == CR:
            self._control(value)
        else:
            super().write(offset, value)
            if offset == ACR:
                self._caches(value)

    def _caches(self, value):
        if value & DCRST:
            if value & DCEN:
                self._rules.breach("cache-reset")
            else:
                self.stale = False
        self.wait_states_changed()

    def _unlock(self, key):
        expected = KEYS[self._key] if self._key < len(KEYS) else None
        if key != expected or self._dead:
            self._rules.breach("flash-key", f"{key:#x}")
            self._dead = True
            return
        self._key += 1
        if self._key == len(KEYS):
            self._key = 0
            self.values[CR] &= ~LOCK

    def _control(self, value):
        if self.values[CR] & LOCK:
            self._rules.breach("flash-locked", "its control register is written")
            return
        self.values[CR] = value & ~STRT
        if value & STRT:
            self._erase(value)
        if value & LOCK:
            self.publish()

    def _erase(self, value):
        number, parallel = value >> 3 & 15, value >> 8 & 3
        if not value & SER or number >= len(SECTORS):
            self._rules.breach("flash-sector", f"{number}")
            return
        if number in PROGRAM:
            self._rules.breach("flash-sector", f"{number} holds the program")
        start, length = SECTORS[number]
        self.content[start:start + length] = b"\xff" * length
        self._touch(start, start + length)
        share = length / 0x20000
        self._wait(share * (self._erase_s or ERASE_S[parallel]))

    def program(self, address, size, value):
        """Carries out a write to the flash by the program."""
        control = self.values[CR]
        if control & LOCK or not control & PG:
            self._rules.breach("flash-locked", f"{address:#x} is written")
            self._fail(PGSERR)
        elif 1 << (control >> 8 & 3) != size:
            self._rules.breach("flash-width", f"{size} bytes")
            self._fail(PGPERR)
        else:
            start = address - FLASH
            old = int.from_bytes(self.content[start:start + size], "little")
            value &= (1 << 8 * size) - 1
            if ~old & value:
                self._rules.breach("flash-not-erased", f"{address:#x}")
            self.content[start:start + size] = (old & value).to_bytes(size, "little")
            self._touch(start, start + size)
            self._wait(PROGRAM_S)

    def _fail(self, flag):
        self.values[SR] = self.values.get(SR, 0) | flag

    def _wait(self, seconds):
        self.busy_s += seconds
        self._stall(seconds)

    def _touch(self, start, end):
        if self.values.get(ACR, 0) & DCEN:
            self.stale = True
        first, last = self._changed or (FLASH_BYTES, 0)
        self._changed = min(first, start), max(last, end)

    def fill(self, start, data):
        """Puts `data` at the offset `start`, as a programmer outside does."""
        self.content[start:start + len(data)] = data
        self._show(FLASH + start, bytes(data))

    def publish(self):
        """Lets the processor see what was written. Once for each unlocking, since Unicorn is slow at it."""
        if self._changed:
            start, end = self._changed
            self._show(FLASH + start, bytes(self.content[start:end]))
            self._changed = None
