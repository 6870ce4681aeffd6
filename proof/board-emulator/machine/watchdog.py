"""IWDG, which runs from an oscillator of its own, LSI (RM0390, chapter 20)."""

from .bus import Registers

KR, PR, RLR = 0x00, 0x04, 0x08
UNLOCK, FEED, START = 0x5555, 0xAAAA, 0xCCCC


class Watchdog(Registers):
    """The independent watchdog. LSI has 17 to 47 kHz, 32 kHz typically."""

    AFTER_RESET = {PR: 0, RLR: 0xFFF}

    def __init__(self, time, rules, lsi_hz):
        super().__init__()
        self._time, self._rules, self._lsi_hz = time, rules, lsi_hz
        self.runs, self._open, self._fed_s = False, False, 0.0

    def limit_s(self):
        """Longest time without food, in s."""
        return (self.values[RLR] + 1) * (4 << min(self.values[PR], 6)) / self._lsi_hz

    def expires_s(self):
        """Second at which the watchdog resets the processor; infinite while it does not run."""
        return self._fed_s + self.limit_s() if self.runs else float("inf")

    def write(self, offset, value):
        if offset == KR:
            self._open = value == UNLOCK
            if value in (FEED, START):
                self._fed_s = self._time.seconds()
            self.runs |= value == START
        elif not self._open:
            self._rules.breach("watchdog-locked")
        else:
            super().write(offset, value)
