"""The processor's own registers: SysTick, NVIC, reset, and the cycle counter (ARMv7-M, part B)."""

from .bus import Registers

CYCCNT_CONTROL, CYCCNT, DEMCR = 0x1000, 0x1004, 0xEDFC
SYST_CSR, SYST_RVR, SYST_CVR = 0xE010, 0xE014, 0xE018
ISER, ICER, ISPR = 0xE100, 0xE180, 0xE200
AIRCR, AIRCR_KEY, SYSRESETREQ = 0xED0C, 0x5FA, 1 << 2
ENABLE, CLKSOURCE, COUNTFLAG = 1 << 0, 1 << 2, 1 << 16
TRACE_ON = 1 << 24


class Core(Registers):
    """Registers from 0xE000_0000 on. `reset` is called when the program asks for a reset."""

    def __init__(self, time, rules, wait, reset):
        super().__init__()
        self._time, self._rules, self._wait, self._reset = time, rules, wait, reset
        #: Enabled interrupts, and those that the program asks for, a bit each.
        self.enabled = self.asked = 0
        self._tick_start, self._tick_pending = 0, False
        self._cycles_offset = 0

    def _tick_due(self):
        # Without CLKSOURCE, SysTick runs from HCLK/8.
        cycles = 1 if self.values.get(SYST_CSR, 0) & CLKSOURCE else 8
        return self._tick_start + (self.values.get(SYST_RVR, 0) + 1) * cycles

    def read(self, offset):
        if offset == SYST_CSR:
            return self._tick()
        if offset == SYST_CVR:
            return 0
        if offset == CYCCNT:
            return self._cycles()
        if ISER <= offset < ISER + 0x20:
            return self.enabled >> 8 * (offset - ISER) & 0xFFFF_FFFF
        return super().read(offset)

    def _tick(self):
        control = self.values.get(SYST_CSR, 0) & 7
        if not control & ENABLE or not self._tick_pending:
            return control
        # The program polls: time passes until the counter reaches zero.
        self._wait(self._tick_due())
        if self._time.now < self._tick_due():
            return control
        self._tick_start, self._tick_pending = self._tick_due(), False
        return control | COUNTFLAG

    def counts_cycles(self):
        """Whether the counter of cycles is on."""
        return bool(self.values.get(DEMCR, 0) & TRACE_ON and self.values.get(CYCCNT_CONTROL, 0) & 1)

    def _cycles(self):
        return self._time.now - self._cycles_offset & 0xFFFF_FFFF if self.counts_cycles() else 0

    def write(self, offset, value):
        super().write(offset, value)
        if offset == SYST_CSR or offset == SYST_CVR:
            self._tick_start, self._tick_pending = self._time.now, True
        elif offset == CYCCNT:
            self._cycles_offset = self._time.now - value
        elif ISER <= offset < ISER + 0x20:
            self.enabled |= value << 8 * (offset - ISER)
            self._time.due = self._time.now
        elif ICER <= offset < ICER + 0x20:
            self.enabled &= ~(value << 8 * (offset - ICER))
        elif ISPR <= offset < ISPR + 0x20:
            self.asked |= value << 8 * (offset - ISPR)
            self._time.due = self._time.now
        elif offset == AIRCR:
            if value >> 16 != AIRCR_KEY:
                self._rules.breach("reset-key")
            elif value & SYSRESETREQ:
                self._reset()
