"""RCC and PWR: oscillators, PLL, supply, over-drive, prescalers, and the clocks of the peripherals (RM0390, chapters 5,
6)."""

from dataclasses import dataclass

from .bus import PAGE_BITS, Registers

CR, PLLCFGR, CFGR, APB1RSTR, APB2RSTR, CSR = 0x00, 0x04, 0x08, 0x20, 0x24, 0x74
AHB1ENR, APB1ENR, APB2ENR = 0x30, 0x40, 0x44
HSION, HSIRDY, HSEON, HSERDY, PLLON, PLLRDY = 1 << 0, 1 << 1, 1 << 16, 1 << 17, 1 << 24, 1 << 25
CSSON = 1 << 19
PLLSRC = 1 << 22
LSION, LSIRDY, RMVF = 1 << 0, 1 << 1, 1 << 24
HSI_HZ, HSE_HZ = 16_000_000, 8_000_000
#: Voltages in V from which on a wait state lasts for so many Hz (table 5).
WAIT_STATE_HZ = ((2.7, 30e6), (2.4, 24e6), (2.1, 22e6), (0.0, 20e6))
#: Highest HCLK in Hz by the regulator's scale 3, 2, 1, and with over-drive (DS10693).
SCALE_HZ = {1: (120e6, 120e6), 2: (144e6, 168e6), 3: (168e6, 180e6)}

#: Bits of ADC1, and of what resets timer 1, timer 8 and all converters, on APB2.
FIRST_CONVERTER, TIMERS_RESET, CONVERTERS_RESET = 8, 3, 1 << 8

#: Enable bits by register and bit, with the page of the peripheral.
GATES = {
    (AHB1ENR, 0): 0x20000, (AHB1ENR, 1): 0x20400, (AHB1ENR, 2): 0x20800,
    (AHB1ENR, 21): 0x26000, (AHB1ENR, 22): 0x26400, (APB2ENR, 0): 0x10000, (APB2ENR, 1): 0x10400, (APB2ENR, 8): 0x12000,
    (APB1ENR, 0): 0x00000, (APB1ENR, 14): 0x03800, (APB1ENR, 17): 0x04400, (APB1ENR, 28): 0x07000,
}


@dataclass
class Clocks:
    """Frequencies in Hz."""

    pll_input: float
    vco: float
    hclk: float
    pclk1: float
    pclk2: float
    from_pll: bool

    @property
    def timer1(self):
        """Clock of the timers on APB1."""
        return self.pclk1 * (1 if self.pclk1 == self.hclk else 2)

    @property
    def timer2(self):
        """Clock of the timers on APB2."""
        return self.pclk2 * (1 if self.pclk2 == self.hclk else 2)


class Pwr(Registers):
    """Power controller: the regulator's scale, over-drive, and the detector of a low supply, `supply_v()`."""

    CR, CSR = 0x0, 0x4
    ODEN, ODSWEN = 1 << 16, 1 << 17
    PVDE, PVDO = 1 << 4, 1 << 2
    #: The detector's levels in V while the supply falls, typically (DS10693).
    LEVELS_V = (2.04, 2.19, 2.35, 2.51, 2.66, 2.84, 2.93, 3.03)
    AFTER_RESET = {0x0: 0xC000}

    def __init__(self, changed, supply_v):
        super().__init__()
        self._changed, self._supply_v = changed, supply_v

    def read(self, offset):
        value, control = super().read(offset), super().read(self.CR)
        if offset != self.CSR:
            return value
        low = control & self.PVDE and self._supply_v() < self.LEVELS_V[control >> 5 & 7]
        # Ready bits stand where the bits of CR stand, and follow them.
        return 0x4000 | control & (self.ODEN | self.ODSWEN) | (self.PVDO if low else 0)

    def scale(self):
        """Bits of the regulator's scale: 3 for scale 1."""
        return self.values[self.CR] >> 14 & 3

    def write(self, offset, value):
        super().write(offset, value)
        self._changed()

    def over_drive(self):
        """Whether over-drive is on and switched through."""
        both = self.ODEN | self.ODSWEN
        return self.values[self.CR] & both == both


class Rcc(Registers):
    """Reset and clock control."""

    AFTER_RESET = {CR: 0x83, PLLCFGR: 0x2400_3010, CFGR: 0}

    def __init__(self, bus, time, rules, hse_present, hsi_error, reset_flags, on_change, supply_v):
        super().__init__()
        self._bus, self._time, self._rules = bus, time, rules
        self._hse_present, self._on_change, self._supply_v = hse_present, on_change, supply_v
        #: By how much, as a share, HSI is too fast.
        self.hsi_error = hsi_error
        self.values[CSR] = reset_flags
        #: Called with the bits of APB2's peripherals that are reset.
        self.on_reset = lambda bits: None
        self.pwr, self.flash_wait_states = Pwr(self.check, supply_v), lambda: 0
        self.clocks = self._tree()

    def read(self, offset):
        value = super().read(offset)
        if offset == CR:
            return self._ready(value)
        if offset == CFGR:
            return value & ~0xC | (value & 3) << 2
        if offset == CSR:
            return value & ~LSIRDY | (LSIRDY if value & LSION else 0)
        return value

    def _ready(self, value):
        value &= ~(HSIRDY | HSERDY | PLLRDY)
        value |= HSIRDY if value & HSION else 0
        value |= HSERDY if value & HSEON and self._hse_present else 0
        source = HSERDY if super().read(PLLCFGR) & PLLSRC else HSIRDY
        return value | (PLLRDY if value & PLLON and value & source else 0)

    def write(self, offset, value):
        if offset == PLLCFGR and super().read(CR) & PLLON:
            self._rules.breach("pll-running")
        if offset == CSR and value & RMVF:
            value &= 0xFFFFFF
        super().write(offset, value)
        if offset in (AHB1ENR, APB1ENR, APB2ENR):
            self._gate(offset, value)
        if offset == APB2RSTR and value:
            self.on_reset(value)
        if offset == CFGR:
            self._switch()

    def _gate(self, register, value):
        for (at, bit), page in GATES.items():
            if at == register:
                change = self._bus.clocked.add if value >> bit & 1 else self._bus.clocked.discard
                change(page >> PAGE_BITS)

    def converter_clocked(self, converter):
        """Whether a converter of the chip, counted from 0, has a clock."""
        return bool(super().read(APB2ENR) >> FIRST_CONVERTER + converter & 1)

    def clock_error(self):
        """By how much, as a share, the clock in use is too fast."""
        internal = not super().read(PLLCFGR) & PLLSRC if self.clocks.from_pll else super().read(CFGR) & 3 != 1
        return self.hsi_error if internal else 0.0

    def stop_hse(self):
        """The clock from outside stops. Returns whether the clock security system has seen it: then HSI goes on."""
        self._hse_present = False
        if not super().read(CR) & CSSON:
            return False
        self.values[CR] &= ~(HSEON | PLLON | CSSON)
        self.values[CFGR] &= ~3
        self._switch()
        return True

    def _tree(self):
        pll, cfgr = super().read(PLLCFGR), super().read(CFGR)
        hsi_hz = HSI_HZ * (1 + self.hsi_error)
        source = HSE_HZ if pll & PLLSRC else hsi_hz
        pll_input = source / max(pll & 63, 1)
        vco = pll_input * (pll >> 6 & 511)
        system = (hsi_hz, HSE_HZ, vco / (2 * (pll >> 16 & 3) + 2), hsi_hz)[cfgr & 3]
        ahb = cfgr >> 4 & 15
        hclk = system / (1 if ahb < 8 else (2, 4, 8, 16, 64, 128, 256, 512)[ahb - 8])

        def divided(bits):
            return hclk / (1 if bits < 4 else 2 << (bits - 4))

        return Clocks(pll_input, vco, hclk, divided(cfgr >> 10 & 7), divided(cfgr >> 13 & 7), cfgr & 3 == 2)

    def _switch(self):
        clocks = self.clocks = self._tree()
        if clocks.from_pll and not self._ready(super().read(CR)) & PLLRDY:
            self._rules.breach("pll-not-ready")
        if clocks.hclk != self._time.hz:
            self._time.change_clock(clocks.hclk)
            self._on_change(clocks)
        self.check()

    def check(self):
        """Checks the clocks against what supply, regulator and flash allow."""
        clocks = self.clocks
        if clocks.from_pll and not (0.95e6 <= clocks.pll_input <= 2.1e6 and 100e6 <= clocks.vco <= 432e6):
            self._rules.breach("pll-range", f"{clocks.pll_input / 1e6:g} MHz in, {clocks.vco / 1e6:g} MHz out")
        if clocks.hclk > 180e6 or clocks.pclk1 > 45e6 or clocks.pclk2 > 90e6:
            self._rules.breach("bus-speed", f"{clocks.hclk:g}, {clocks.pclk1:g}, {clocks.pclk2:g} Hz")
        if clocks.hclk > 168e6 and not self.pwr.over_drive():
            self._rules.breach("over-drive")
        elif clocks.hclk > SCALE_HZ.get(self.pwr.scale(), (0, 0))[self.pwr.over_drive()]:
            self._rules.breach("voltage-scale", f"bits {self.pwr.scale():02b}")
        step_hz = next(hz for volts, hz in WAIT_STATE_HZ if self._supply_v() >= volts)
        needed = int((clocks.hclk - 1) // step_hz)
        if self.flash_wait_states() < needed:
            self._rules.breach("wait-states", f"{self.flash_wait_states()} of {needed}")
