"""The whole board: the microcontroller, what hangs on its pins, and the loop that runs it."""

from . import circuit, flash, gpio
from .adc import BITS, Adc
from .bus import Bus
from .core import Core
from .cpu import FLASH, FLASH_BYTES, PERIPHERALS, SRAM, SRAM_BYTES, Cpu
from .dma import Dma
from .image import Image
from .rcc import CONVERTERS_RESET, HSI_HZ, TIMERS_RESET, Rcc
from .row_pins import RowPins
from .rtt import Rtt
from .rules import Fault, Rules
from .scan_timers import Passes
from .timer import Timer
from .time import Time
from .usart import SENT, Usart
from .watchdog import Watchdog

#: Number of the interrupt of the stream that sends, and of the first interrupt among the exceptions.
DMA1_STREAM6, FIRST_INTERRUPT = 17, 16
#: Numbers of exceptions.
NMI, HARD_FAULT = 2, 3
#: How the name of the function ends that all panics go through.
PANIC = "9panic_fmt"
#: An address where nothing is.
NOWHERE = 0x6000_0000
#: Time in s after which a supply that has sagged is back, if the processor is held in reset meanwhile.
DIP_S = 1e-3
#: Flags of RCC_CSR after power-on, after a reset by the watchdog, by the program, and by a low supply.
POWER_ON, BY_WATCHDOG, BY_PROGRAM, BROWN_OUT = 0x0E00_0000, 0x2400_0000, 0x1400_0000, 0x0600_0000
#: Alternate function that the pins of USART2 need: PA2 and PA3.
USART_FUNCTION, TX, RX = 7, 2, 3
#: Counts of a pin at which nothing is, by its pull, and with none.
PULLED_UP, PULLED_DOWN, FLOATING = 4090, 3, 700
#: Longest time in s between two looks at the host's end of the line.
GLANCE_S = 0.2e-3
#: Longest time in cycles from one look to the next at whether an interrupt can be taken.
LONGEST_PATIENCE = 2048


class Board:
    """A board that runs the image at `path`, with the resistances `ohm[row][column]` at its wires. More than eight rows are
    driven by a decoder.

    `hse`: the ST-LINK gives its 8 MHz. `hsi_error`: by how much, as a share, the internal oscillator is too fast.
    `lsi_hz`: the watchdog's own clock. `erase_s`: how long erasing a slot takes, whatever the data sheet says. `options`:
    the option bytes. `sensor`: the converters answer their triggers. `settling_us`: the wait after each change of rows that
    the device is configured to. `op_amp_hz`: the gain-bandwidth product of the op-amps. `bare`: nothing is at the converters' pins. `plant(board)` plants
    a fault after each reset.
    """

    def __init__(self, path, ohm, *, hse=True, hsi_error=0.0, lsi_hz=32_000, erase_s=None,
                 options=flash.LEVEL_3_OPTIONS, sensor=True, baud=921_600, settling_us=20.0, bare=False, plant=lambda board: None,
                 op_amp_hz=circuit.OP_AMP_HZ, log=print):
        self.image = Image(path)
        self._ohm, self._hse, self._lsi_hz, self._erase_s = ohm, hse, lsi_hz, erase_s
        self._hsi_error, self._supply_v, self._op_amp_hz = hsi_error, 3.3, op_amp_hz
        self._bare, self._plant = bare, plant
        self._sensor, self._baud, self.settling_us, self._log = sensor, baud, settling_us, log
        self.time = Time()
        self.rules = Rules(self.where, self.note)
        #: What its flash and option bytes hold, and what was done to them.
        self.store = flash.Store(self.image.segments, options)
        #: Whether the next fault is the scenario's own.
        self._derailed = False
        #: Causes of the resets so far.
        self.resets = []
        #: Bytes of the log so far.
        self.logged = bytearray()
        #: Number of interrupts taken.
        self.interrupts = 0
        #: Called again and again while the board runs, with whether the program idles.
        self.glance = lambda idle: None
        self._reset_flags, self._pending_reset = POWER_ON, None
        self._start(bytes(SRAM_BYTES))

    def note(self, text):
        """Logs `text` with the time."""
        self._log(f"[{self.time.seconds():9.6f} s] {text}")

    def where(self):
        """The function that is executed."""
        return self.image.place(self.cpu.where())

    # Start and resets

    def _start(self, sram):
        time, rules = self.time, self.rules
        time.change_clock(HSI_HZ * (1 + self._hsi_error))
        time.due = time.now
        bus = self._bus = Bus(time, rules)
        self.cpu = Cpu(time, self, self.store.content, sram)
        self.rtt = Rtt(self.cpu, self.image.symbols["_SEGGER_RTT"])
        self.ports = {
            "A": gpio.Port({gpio.MODER: 0xA800_0000, gpio.OSPEEDR: 0x0C00_0000, gpio.PUPDR: 0x6400_0000}),
            "B": gpio.Port({gpio.MODER: 0x280, gpio.OSPEEDR: 0xC0, gpio.PUPDR: 0x100}),
            "C": gpio.Port(),
        }
        #: What drives the rows.
        self.rows = RowPins(time, rules, self.ports["B"], len(self._ohm), lambda: self.settling_us)
        self.circuit = circuit.Circuit(time, rules, self.rows, self._ohm, self._op_amp_hz)
        self.rcc = Rcc(bus, time, rules, self._hse, self._hsi_error, self._reset_flags, self._clocks_changed,
                       self.supply_v)
        self.flash = flash.Flash(self.store, time, rules, self._stall, self.cpu.uc.mem_write, self._erase_s)
        self.rcc.flash_wait_states = self.flash.wait_states
        self.flash.wait_states_changed = self.rcc.check
        self.core = Core(time, rules, self._wait, self._ask_for_reset)
        self.usart = Usart(time, rules, lambda: self.rcc.clocks.pclk1, lambda: self.rcc.clock_error(), self._baud)
        self.usart.on_byte = self._before_byte
        usart_dma = self.usart.dma = Dma(self.cpu.uc, rules, self.usart.advance, self.usart.send_by_dma, started=self.usart.serve)
        self.timer = Timer(time, lambda: self.rcc.clocks.timer1, self._look, self._idle)
        self.watchdog = Watchdog(time, rules, self._lsi_hz)
        bus.attach(0x00000, self.timer, "TIM2")
        bus.attach(0x03000, self.watchdog, "IWDG", gated=False)
        bus.attach(0x04400, self.usart, "USART2")
        bus.attach(0x07000, self.rcc.pwr, "PWR")
        for index, port in enumerate(self.ports.values()):
            bus.attach(0x20000 + 0x400 * index, port, f"GPIO{'ABC'[index]}")
        bus.attach(0x23800, self.rcc, "RCC", gated=False)
        bus.attach(0x23C00, self.flash, "FLASH", gated=False)
        bus.attach(0x26000, usart_dma, "DMA1")
        self._start_converters(bus)
        self._plant(self)
        self._idles, self._pins_checked, self._next_glance, self._patience = False, False, 0, 1

    def _start_converters(self, bus):
        """Puts the chip's converters on the bus, with the timers and the DMA that they work with."""
        time, rules = self.time, self.rules
        self._pins_at = None
        #: Counts of pins that a fault holds.
        self.held = {}

        def moment(cycle):
            self._pins_at = cycle

        def advance():
            self.passes.advance()
            self._pins_at = None

        def write(address, value, _cycle):
            bus.write_by_dma(address - PERIPHERALS, value)

        def counts(pin, cycle):
            port, number = pin
            if pin in self.held:
                return self.held[pin]
            if self._bare:
                return {gpio.PULL_UP: PULLED_UP, gpio.PULL_DOWN: PULLED_DOWN}.get(self.ports[port].pull(number), FLOATING)
            column = self.rows.column(pin, cycle)
            waited_us = self.time.ns(cycle - self.rows.changed_at) / 1e3 * (1 + self.rcc.clock_error())
            if waited_us < self.settling_us:
                rules.breach("wait-short", f"{waited_us:.2f} us of {self.settling_us:g}")
            volts = 0.0 if column is None else self.circuit.volts(column, cycle)
            return max(0, min((1 << BITS) - 1, int(volts / circuit.REFERENCE_V * (1 << BITS))))

        def reset(bits):
            advance()
            if bits & TIMERS_RESET == TIMERS_RESET:
                self.passes.reset()
            if bits & CONVERTERS_RESET:
                adc.reset()

        dma = self.dma = Dma(self.cpu.uc, rules, advance, write, self._busy)
        adc = self.adc = Adc(time, rules, self.rcc, self.ports, dma, advance, counts)
        #: What the converters scan, and what lets it go on until now.
        self.passes = Passes(time, rules, lambda: self.rcc.clocks.timer2, dma, adc, moment, self._busy, self._sensor)
        self.advance = advance
        self.ports["B"].changed = lambda: self.rows.update(
            time.now if self._pins_at is None else self._pins_at)
        self.rcc.on_reset = reset
        bus.attach(0x10000, self.passes.rows, "TIM1")
        bus.attach(0x10400, self.passes.triggers, "TIM8")
        bus.attach(0x12000, adc, "ADC1")
        bus.attach(0x26400, dma, "DMA2")

    def _ask_for_reset(self):
        self._pending_reset = ("program", BY_PROGRAM)
        self.cpu.stop()

    def _reset(self, cause, flags):
        self.note(f"RESET by {cause}")
        self.resets.append(cause)
        self.take_log()
        self.rows.check_rest()
        self._reset_flags, self._pending_reset = flags, None
        to_host = self.usart.to_host
        self._start(self.cpu.sram())
        self.usart.to_host = to_host

    # What happens to the board

    def supply_v(self):
        """The supply in V."""
        return self._supply_v

    def supply(self, volts):
        """The supply changes. Below the brown-out level the processor is held in reset, until it is back."""
        self._supply_v = volts
        if volts < self.flash.brown_out_v:
            self._reset("brown-out", BROWN_OUT)
            self._stall(DIP_S)
            self._supply_v = 3.3
        self.rcc.check()

    def stop_hse(self):
        """The ST-LINK's 8 MHz stop."""
        self._hse = False
        if self.rcc.stop_hse():
            self.cpu.enter(NMI)
        else:
            self._wait_for_watchdog()

    def derail(self, stack_ends=False):
        """Lets the program go where nothing is, which is a fault; with `stack_ends`, without room on the stack."""
        self._derailed = True
        self.cpu.go(NOWHERE, {"sp": SRAM} if stack_ends else {})

    def panic(self):
        """Lets the program panic, at the first place in the image where it could."""
        function = next(place for name, place in self.image.symbols.items() if name.endswith(PANIC))
        self.cpu.go(function, dict.fromkeys(("r0", "r1", "r2"), self.image.panic_place()))

    def take_log(self):
        """Takes the log out of the board's memory."""
        self.logged += self.rtt.read()

    # What Unicorn asks

    def read_peripheral(self, _uc, offset, size, _):
        return self._bus.read(offset, size)

    def write_peripheral(self, _uc, offset, size, value, _):
        self._bus.write(offset, size, value)

    def read_bit(self, _uc, offset, _size, _):
        return self._bus.read_bit(offset)

    def write_bit(self, _uc, offset, _size, value, _):
        self._bus.write_bit(offset, value)

    def read_core(self, _uc, offset, _size, _):
        return self.core.read(offset)

    def write_core(self, _uc, offset, _size, value, _):
        self.core.write(offset, value)

    def write_flash(self, _uc, _access, address, size, value, _):
        if not FLASH <= address < FLASH + FLASH_BYTES:
            return False
        self.flash.program(address, size, value)
        return True

    # Time

    def _interrupt_pending(self):
        asks = self.core.asked >> DMA1_STREAM6 & 1 or self.usart.dma.interrupt(SENT)
        return self.core.enabled >> DMA1_STREAM6 & 1 and asks

    def _clocks_changed(self, clocks):
        self.note(f"runs at {clocks.hclk / 1e6:g} MHz, APB1 at {clocks.pclk1 / 1e6:g} MHz")

    def _wait(self, cycle):
        """A register is polled: time passes until `cycle`, or until the next byte on the line."""
        self.usart.advance()
        if self._interrupt_pending():
            return
        event = self.usart.next_event()
        if event is not None:
            cycle = min(cycle, event)
            self.time.wake_at(event)
        event = self.passes.next_event()
        if event is not None:
            cycle = min(cycle, event)
        self.time.now = max(self.time.now, int(cycle) + 1)

    def _stall(self, seconds):
        """The processor stands still; the rest of the world does not."""
        self.usart.advance()
        self.time.now += self.time.cycles(seconds)
        self.usart.advance()
        self.time.due = self.time.now

    def _look(self):
        """The program looks at the time, as it does in its main loop."""
        self.flash.finish()
        self.advance()
        self.rows.check_rest()
        if self.flash.stale:
            self.rules.breach("cache-stale")
        if not self.flash.caches_on():
            self.rules.breach("caches-off")
        if self.flash.unlocked():
            self.rules.breach("flash-left-open")

    def _idle(self):
        """The program only looks at the time: it passes until something happens, or it is time for a glance."""
        self._idles = True
        self._wait(self._next_glance)

    def _busy(self):
        self._idles, self.timer.looks = False, 0

    def run_until(self, over):
        """Runs until `over()` returns true; it is asked at each glance."""
        while True:
            if self._attend() and over():
                return
            try:
                self.cpu.run()
            except Fault as fault:
                self._die(fault)

    def run_for(self, seconds):
        """Runs for so many seconds of the board."""
        end = self.time.seconds() + seconds
        self.run_until(lambda: self.time.seconds() >= end)

    def _die(self, fault):
        """The program faults: its handler runs. A fault in there is a lock-up."""
        if not self._derailed:
            self.rules.breach("fault", str(fault))
        if self.cpu.handles == HARD_FAULT:
            self._wait_for_watchdog()
        else:
            self._derailed = False
            self.cpu.enter(HARD_FAULT)

    def _wait_for_watchdog(self):
        """The processor stands still for good: only the watchdog helps."""
        if not self.watchdog.runs:
            raise Fault("the processor stands still, and the watchdog does not run")
        self._stall(max(0.0, self.watchdog.expires_s() - self.time.seconds()) + 1e-3)

    def _attend(self):
        """Does what is due; returns whether it was time for a glance at the host's end."""
        time = self.time
        self.usart.advance()
        self.advance()
        if self._pending_reset:
            self._reset(*self._pending_reset)
        elif time.seconds() > self.watchdog.expires_s():
            self._reset("watchdog", BY_WATCHDOG)
        glance = time.now >= self._next_glance
        if glance:
            self.glance(self._idles)
            self._next_glance = time.now + time.cycles(GLANCE_S)
            self.usart.advance()
        time.due = self._next_glance
        event = self.usart.next_event()
        if event is not None:
            time.wake_at(event)
        if self._interrupt_pending():
            if self.cpu.may_interrupt():
                self._busy()
                self.flash.finish()
                self.interrupts += 1
                self.core.asked &= ~(1 << DMA1_STREAM6)
                self.cpu.enter(FIRST_INTERRUPT + DMA1_STREAM6)
                self._patience = 1
            else:
                # Interrupts are off, or one is running. The longer it lasts, the rarer it is looked at.
                self._patience = min(2 * self._patience, LONGEST_PATIENCE)
                time.wake_at(time.now + self._patience)
        return glance

    # Pins

    def _check_function(self, port, pins, function, name):
        for pin in pins:
            if self.ports[port].function(pin) != function:
                self.rules.breach("pin-function", f"P{port}{pin} is not {name}")

    def _before_byte(self):
        self._busy()
        if not self._pins_checked:
            self._pins_checked = True
            self._check_function("A", (TX, RX), USART_FUNCTION, "USART2")
