"""TIM2 as a counter of microseconds (RM0390, chapter 17)."""

from .bus import Registers

CR1, EGR, CNT, PSC, ARR = 0x00, 0x14, 0x24, 0x28, 0x2C
CEN, UG = 1 << 0, 1 << 0


class Timer(Registers):
    """A 32-bit counter. `look` is called when the program looks at it; `idle` when it does nothing else."""

    AFTER_RESET = {ARR: 0xFFFF_FFFF}
    #: More looks in a row than while a frame is scanned, decoded and reported.
    LOOKS_WHEN_IDLE = 6

    def __init__(self, time, rate, look, idle):
        super().__init__()
        self._time, self._rate, self._look, self._idle = time, rate, look, idle
        self._start, self._prescaler = 0, 0
        #: Number of looks since the program did anything else.
        self.looks = 0

    def period(self):
        """Counts until it starts anew."""
        return self.values[ARR] + 1

    def read(self, offset):
        if offset != CNT:
            return super().read(offset)
        self._look()
        self.looks += 1
        if self.looks > self.LOOKS_WHEN_IDLE:
            self._idle()
        return self.count() if self.values.get(CR1, 0) & CEN else 0

    def count(self):
        """What it has counted."""
        seconds = (self._time.now - self._start) / self._time.hz
        return int(seconds * self._rate() / (self._prescaler + 1)) % self.period()

    def write(self, offset, value):
        if offset == CR1 and value & CEN and not self.values.get(CR1, 0) & CEN:
            self._start = self._time.now
        if offset == EGR and value & UG:
            self._prescaler, self._start = self.values.get(PSC, 0), self._time.now
        super().write(offset, value)
