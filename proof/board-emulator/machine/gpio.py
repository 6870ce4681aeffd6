"""A port of general-purpose pins (RM0390, chapter 7)."""

from .bus import Registers

MODER, OSPEEDR, PUPDR, IDR, ODR, BSRR, AFRL = 0x00, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x20
INPUT, OUTPUT, ALTERNATE, ANALOGUE = 0, 1, 2, 3
NO_PULL, PULL_UP, PULL_DOWN = 0, 1, 2


class Port(Registers):
    """Sixteen pins."""

    def __init__(self, after_reset=None):
        super().__init__()
        self.values.update(after_reset or {})
        #: Functions by pin that tell whether something outside holds it high; without one it reads its output.
        self.inputs = {}
        #: Called after a change of outputs or modes.
        self.changed = lambda: None

    def _field(self, offset, pin):
        return self.values.get(offset, 0) >> 2 * pin & 3

    def mode(self, pin):
        """Mode: 0 input, 1 output, 2 alternate function, 3 analogue."""
        return self._field(MODER, pin)

    def pull(self, pin):
        """The pull that holds the pin: none where it is analogue."""
        return NO_PULL if self.mode(pin) == ANALOGUE else self._field(PUPDR, pin)

    def function(self, pin):
        """Number of the alternate function; `None` if the pin is not in that mode."""
        chosen = self.values.get(AFRL + 4 * (pin // 8), 0) >> 4 * (pin % 8) & 15
        return chosen if self.mode(pin) == ALTERNATE else None

    def high(self, pin):
        """Whether the output register has a one for the pin."""
        return bool(self.values.get(ODR, 0) >> pin & 1)

    def read(self, offset):
        if offset != IDR:
            return super().read(offset)
        levels = super().read(ODR)
        for pin, is_high in self.inputs.items():
            if self.mode(pin) == INPUT:
                levels = levels & ~(1 << pin) | is_high() << pin
        return levels

    def write(self, offset, value):
        if offset == BSRR:
            offset, value = ODR, self.values.get(ODR, 0) & ~(value >> 16) | value & 0xFFFF
        super().write(offset, value)
        if offset in (ODR, MODER):
            self.changed()
