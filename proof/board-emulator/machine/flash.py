"""The flash and its controller: keys, erasing and programming, and the time that these take (RM0390, chapter 3)."""

import collections

from .bus import Registers
from .cpu import FLASH, FLASH_BYTES

ACR, KEYR, OPTKEYR, SR, CR, OPTCR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14
PRFTEN, ICEN, DCEN, DCRST = 1 << 8, 1 << 9, 1 << 10, 1 << 12
KEYS, OPTION_KEYS = (0x4567_0123, 0xCDEF_89AB), (0x0819_2A3B, 0x4C5D_6E7F)
PG, SER, SNB, STRT, LOCK = 1 << 0, 1 << 1, 15 << 3, 1 << 16, 1 << 31
OPTLOCK, OPTSTRT, BOR_LEVEL = 1 << 0, 1 << 1, 3 << 2
BSY, PGPERR, PGSERR, ERRORS = 1 << 16, 1 << 6, 1 << 7, 0x1F3
#: Option bytes as a chip comes, and with brown-out level 3.
FACTORY_OPTIONS = 0x0FFF_AAEC
LEVEL_3_OPTIONS = FACTORY_OPTIONS & ~BOR_LEVEL
#: Brown-out levels 3, 2, 1 in V while the supply falls, typically (DS10693); the last is off.
BROWN_OUT_V = (2.83, 2.50, 2.19, 0.0)
#: Offset and length of each sector.
SECTORS = [(0x0, 0x4000), (0x4000, 0x4000), (0x8000, 0x4000), (0xC000, 0x4000), (0x10000, 0x10000),
           (0x20000, 0x20000), (0x40000, 0x20000), (0x60000, 0x20000)]
#: Longest time in s to erase a sector of this length, by PSIZE: 8, 16 and 32 bits at once (DS10693).
ERASE_S = {0x4000: (0.8, 0.6, 0.5), 0x10000: (2.4, 1.4, 1.1), 0x20000: (4.0, 2.6, 2.0)}
LARGEST_SECTOR = 0x20000
#: Longest time in s to program once, whatever the width (DS10693).
PROGRAM_S = 100e-6


class Flash(Registers):
    """What the flash holds, and its controller. `stall` lets time pass in which the processor stands still.

    An operation goes on beside the processor, which finds its next instructions in the cache of the flash. It stands
    still once it looks for the end a second time, or does anything that is not in the cache (`finish`).
    """

    AFTER_RESET = {CR: LOCK}

    def __init__(self, store, time, rules, stall, show, erase_s=None):
        super().__init__()
        self._store, self.content, self._time, self._rules = store, store.content, time, rules
        self._stall, self._show, self._erase_s = stall, show, erase_s
        self.values[OPTCR] = store.options | OPTLOCK
        #: Threshold in V of the brown-out reset: of the options that this start has loaded.
        self.brown_out_v = BROWN_OUT_V[store.options >> 2 & 3]
        self._keys, self._dead = {KEYR: 0, OPTKEYR: 0}, False
        self._changed = None
        #: Second at which the operation under way ends, and how often the program has looked for that.
        self._ends_s, self._looks = 0.0, 0
        #: Whether the data cache may hold bytes that the flash holds no more.
        self.stale = False
        self.wait_states_changed = lambda: None

    def wait_states(self):
        """Wait states of each access."""
        return self.values.get(ACR, 0) & 15

    def caches_on(self):
        """Whether both caches and the prefetch are on."""
        on = PRFTEN | ICEN | DCEN
        return self.values.get(ACR, 0) & on == on

    def finish(self):
        """Lets the processor stand still until the operation under way has ended."""
        left_s = self._ends_s - self._time.seconds()
        if left_s > 0:
            self._stall(left_s)

    def _busy(self):
        return self._time.seconds() < self._ends_s

    def _must_be_idle(self, what):
        if self._busy():
            self._rules.breach("flash-busy", what)
            self.finish()

    def read(self, offset):
        value = super().read(offset)
        if offset != SR or not self._busy():
            return value
        self._looks += 1
        if self._looks == 1:
            return value | BSY
        self.finish()
        return value

    def write(self, offset, value):
        if offset in self._keys:
            self._unlock(offset, value)
        elif offset == SR:
            self.values[SR] = self.values.get(SR, 0) & ~(value & ERRORS)
        elif offset == CR:
            self._control(value)
        elif offset == OPTCR:
            self._set_options(value)
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

    def _unlock(self, register, key):
        keys = KEYS if register == KEYR else OPTION_KEYS
        if key != keys[self._keys[register]] or self._dead:
            self._rules.breach("flash-key", f"{key:#x}")
            self._dead = True
            return
        self._keys[register] = (self._keys[register] + 1) % len(keys)
        if not self._keys[register]:
            locked, bit = (CR, LOCK) if register == KEYR else (OPTCR, OPTLOCK)
            self.values[locked] &= ~bit

    def unlocked(self):
        """Whether the controller, or the option bytes, can be written."""
        return not (self.values[CR] & LOCK and self.values[OPTCR] & OPTLOCK)

    def _control(self, value):
        self._must_be_idle("its control register is written")
        if self.values[CR] & LOCK:
            self._rules.breach("flash-locked", "its control register is written")
            return
        chosen = self.values[CR]
        self.values[CR] = value & ~STRT
        if value & STRT:
            if (value ^ chosen) & (SER | SNB):
                self._rules.breach("flash-start", f"CR was {chosen:#x}, and {value:#x} is written")
            self._erase(value)
        if value & LOCK:
            self.publish()

    def _set_options(self, value):
        self._must_be_idle("option bytes are written")
        if self.values[OPTCR] & OPTLOCK:
            self._rules.breach("flash-locked", "option bytes are written")
            return
        self.values[OPTCR] = value & ~OPTSTRT
        if value & OPTSTRT:
            options = value & ~(OPTSTRT | OPTLOCK)
            if (options ^ self._store.options) & ~BOR_LEVEL:
                self._rules.breach("option-bytes", f"{options:#010x}, and they were {self._store.options:#010x}")
            self._store.options = options
            self._store.options_written += 1
            self._begin(ERASE_S[0x4000][2])

    def _begin(self, seconds):
        self._ends_s, self._looks = self._time.seconds() + seconds, 0
        self._store.busy_s += seconds

    def _erase(self, value):
        number, parallel = value >> 3 & 15, value >> 8 & 3
        if not value & SER or number >= len(SECTORS):
            self._rules.breach("flash-sector", f"{number}")
            return
        if number in self._store.program:
            self._rules.breach("flash-sector", f"{number} holds the program")
        start, length = SECTORS[number]
        self._store.erased[number] += 1
        self.content[start:start + length] = b"\xff" * length
        self._touch(start, start + length)
        slot_s = self._erase_s if length == LARGEST_SECTOR else None
        self._begin(slot_s or ERASE_S[length][min(parallel, 2)])

    def program(self, address, size, value):
        """Carries out a write to the flash by the program."""
        self._must_be_idle(f"{address:#x} is written")
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
            self._begin(PROGRAM_S)

    def _fail(self, flag):
        self.values[SR] = self.values.get(SR, 0) | flag

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


class Store:
    """What outlasts a reset: the flash's bytes, its option bytes, and what was done to them. `segments` are the
    program's, by address."""

    def __init__(self, segments, options):
        self.content = bytearray(b"\xff" * FLASH_BYTES)
        #: Sectors that hold the program.
        self.program = set()
        for address, data in segments:
            start, end = address - FLASH, address - FLASH + len(data)
            self.content[start:end] = data
            self.program |= {number for number, (first, length) in enumerate(SECTORS)
                             if first < end and start < first + length}
        self.options, self.options_written = options, 0
        #: How often each sector was erased by the program, and the time in s that all operations took.
        self.erased, self.busy_s = collections.Counter(), 0.0
