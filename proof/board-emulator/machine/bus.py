"""The way from an address to a register: peripherals, their bit-band alias, and the processor's own registers."""

PAGE_BITS = 10


class Registers:
    """A peripheral whose registers only keep what is written, by offset. Others are built on it."""

    #: Values after a reset by offset; 0 where there is none.
    AFTER_RESET = {}

    def __init__(self):
        self.values = dict(self.AFTER_RESET)

    def read(self, offset):
        """Value of the register at `offset`."""
        return self.values.get(offset, 0)

    def write(self, offset, value):
        """Writes `value` to the register at `offset`."""
        self.values[offset] = value


class Bus:
    """Peripherals by their page of 1 KiB. An access takes time, and needs the peripheral's clock."""

    READ_CYCLES, WRITE_CYCLES = 4, 2

    def __init__(self, time, rules):
        self.time, self._rules = time, rules
        self._pages = {}
        self._plain = Registers()
        #: Pages that have a clock now; the clock controller keeps this. Pages that need none are not in `gated`.
        self.gated, self.clocked = {}, set()

    def attach(self, offset, peripheral, name, gated=True):
        """Puts `peripheral` at `offset` from the start of the peripherals."""
        page = offset >> PAGE_BITS
        self._pages[page] = peripheral
        if gated:
            self.gated[page] = name

    def _at(self, offset):
        page = offset >> PAGE_BITS
        if page in self.gated and page not in self.clocked:
            self._rules.breach("clock-gate", self.gated[page])
            return None
        return self._pages.get(page, self._plain)

    def read(self, offset, size):
        self.time.now += self.READ_CYCLES
        peripheral = self._at(offset)
        if peripheral is None:
            return 0
        low = offset & 3
        register = offset & ~3 if peripheral is self._plain else offset & 0x3FC
        value = peripheral.read(register)
        return value if size == 4 else value >> 8 * low & (1 << 8 * size) - 1

    def write(self, offset, size, value):
        self.time.now += self.WRITE_CYCLES
        peripheral = self._at(offset)
        if peripheral is None:
            return
        register = offset & ~3 if peripheral is self._plain else offset & 0x3FC
        peripheral.write(register, value)

    def write_by_dma(self, offset, value):
        """Writes a word without the processor, and without its time."""
        peripheral = self._at(offset)
        if peripheral is not None:
            peripheral.write(offset & 0x3FC, value)

    def read_bit(self, alias):
        """Reads through the alias where each bit has a word."""
        return self.read(alias >> 5 & ~3, 4) >> (alias >> 2 & 31) & 1

    def write_bit(self, alias, value):
        """Writes one bit through the alias: reads and writes the whole register."""
        offset, bit = alias >> 5 & ~3, alias >> 2 & 31
        self.write(offset, 4, self.read(offset, 4) & ~(1 << bit) | (value & 1) << bit)
