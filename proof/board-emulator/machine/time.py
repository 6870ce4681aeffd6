"""Virtual time, in cycles of the processor and in seconds."""

import ctypes


class Time(ctypes.Structure):
    """Time as `blocks.c` sees it, and its seconds. `now` may be moved forward: time passes without instructions."""

    _fields_ = [
        ("now", ctypes.c_int64),
        ("due", ctypes.c_int64),
        ("fresh", ctypes.c_int64),
        ("stop", ctypes.c_void_p),
    ]

    def __init__(self):
        super().__init__()
        self.hz = 16_000_000
        self._mark, self._seconds_at_mark = 0, 0.0

    def seconds(self):
        """Seconds since power-on."""
        return self._seconds_at_mark + (self.now - self._mark) / self.hz

    def change_clock(self, hz):
        """Lets the processor run at `hz` from now on."""
        self._seconds_at_mark, self._mark, self.hz = self.seconds(), self.now, hz

    def cycles(self, seconds):
        """Cycles in so many seconds."""
        return int(seconds * self.hz)

    def ns(self, cycles):
        """Nanoseconds in so many cycles."""
        return cycles * 1e9 / self.hz

    def wake_at(self, cycle):
        """Makes the processor stop at `cycle`, if nothing is due before."""
        if cycle < self.due:
            self.due = int(cycle)
