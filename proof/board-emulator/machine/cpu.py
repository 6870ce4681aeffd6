"""The Cortex-M4 on Unicorn: memory, time, and interrupts with their exception frames."""

import ctypes
import pathlib
import struct
import subprocess
import tempfile

import unicorn
from unicorn import arm_const as arm
from unicorn.unicorn_py3.unicorn import uclib

from .rules import Fault

FLASH, FLASH_BYTES = 0x0800_0000, 512 << 10
SRAM, SRAM_BYTES = 0x2000_0000, 128 << 10
SYSTEM_MEMORY, FLASH_SIZE_KIB = 0x1FFF_7000, 0x1FFF_7A22
#: Where the factory's counts at 3.3 V are, and what they are: the reference, and the temperature at 30 and 110 °C.
FACTORY_COUNTS, FACTORY = 0x1FFF_7A2A, (1501, 959, 1207)
PERIPHERALS, PERIPHERAL_BYTES = 0x4000_0000, 0x8_0000
BIT_BAND = 0x4200_0000
CORE, CORE_BYTES = 0xE000_0000, 0x10_0000

#: Addresses from here on mean: return from an exception.
EXCEPTION_RETURN = 0xFFFF_FF00
#: Unicorn's number for a return from an exception, in handler mode.
EXCEPTION_EXIT = 8
#: Cycles that stacking, or its reverse, takes.
ENTRY_CYCLES = 12

#: Registers in the order of an exception's frame. PC is read from where Unicorn stopped.
FRAME = (arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12,
         arm.UC_ARM_REG_LR, arm.UC_ARM_REG_PC, arm.UC_ARM_REG_XPSR)
FLOATS = (*(arm.UC_ARM_REG_S0 + index for index in range(16)), arm.UC_ARM_REG_FPSCR)
FRAME_BYTES, FRAME_WITH_FLOATS_BYTES = 0x20, 0x68
#: Bit of CONTROL: floats are in use. Bit of a stacked XPSR: the frame was moved to a multiple of eight.
FPCA, MOVED = 1 << 2, 1 << 9
IT_BITS = 0x0600_FC00


class Batch:
    """Registers that are read or written together, which is a hundred times faster than one by one in Python."""

    def __init__(self, registers):
        count = len(registers)
        self._registers, self._count = (ctypes.c_int * count)(*registers), count
        self.values = (ctypes.c_uint32 * count)()
        size = ctypes.sizeof(ctypes.c_uint32)
        start = ctypes.addressof(self.values)
        self._places = (ctypes.c_void_p * count)(*(start + size * index for index in range(count)))

    def read(self, uc):
        """Reads the registers into `values`."""
        uclib.uc_reg_read_batch(uc._uch, self._registers, self._places, self._count)

    def write(self, uc):
        """Writes `values` to the registers."""
        uclib.uc_reg_write_batch(uc._uch, self._registers, self._places, self._count)


CONTEXT = Batch((arm.UC_ARM_REG_SP, arm.UC_ARM_REG_CONTROL, *FRAME, *FLOATS))
WITHOUT_FLOATS = Batch((arm.UC_ARM_REG_CONTROL, arm.UC_ARM_REG_SP, *FRAME))
WITH_FLOATS = Batch((arm.UC_ARM_REG_CONTROL, arm.UC_ARM_REG_SP, *FRAME, *FLOATS))
HANDLER = Batch((arm.UC_ARM_REG_SP, arm.UC_ARM_REG_CONTROL, arm.UC_ARM_REG_LR))
MASKS = Batch((arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_XPSR))


def native(name, directory):
    """Path of a library made of the C file `name`, compiled into `directory`."""
    source = pathlib.Path(__file__).with_name(name)
    library = pathlib.Path(directory) / source.with_suffix(".so").name
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", library, source], check=True)
    return library


def blocks():
    """The library made of `blocks.c`."""
    with tempfile.TemporaryDirectory() as directory:
        return ctypes.CDLL(str(native("blocks.c", directory)))


class Cpu:
    """The processor with its memories. A new one is made at each reset.

    `devices` answers the accesses to registers, with functions `read_peripheral`, `write_peripheral`, `read_core`,
    `write_core`, and `write_flash`.
    """

    library = None

    def __init__(self, time, devices, flash, sram=bytes(SRAM_BYTES)):
        self.time = time
        #: Bytes of the frame of the handler that runs, and its number; 0 if none does.
        self._frame_bytes, self.handles = 0, 0
        Cpu.library = Cpu.library or blocks()
        uc = self.uc = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        uc.mem_map(FLASH, FLASH_BYTES, unicorn.UC_PROT_READ | unicorn.UC_PROT_EXEC)
        uc.mem_write(FLASH, bytes(flash))
        uc.mem_map(SRAM, SRAM_BYTES)
        uc.mem_write(SRAM, sram)
        uc.mem_map(SYSTEM_MEMORY, 0x1000, unicorn.UC_PROT_READ)
        uc.mem_write(FLASH_SIZE_KIB, struct.pack("<H", FLASH_BYTES >> 10))
        uc.mem_write(FACTORY_COUNTS, struct.pack("<3H", *FACTORY))
        uc.mmio_map(PERIPHERALS, PERIPHERAL_BYTES, devices.read_peripheral, None, devices.write_peripheral, None)
        uc.mmio_map(BIT_BAND, 32 * PERIPHERAL_BYTES, devices.read_bit, None, devices.write_bit, None)
        uc.mmio_map(CORE, CORE_BYTES, devices.read_core, None, devices.write_core, None)
        uc.hook_add(unicorn.UC_HOOK_MEM_WRITE_PROT, devices.write_flash)
        uc.hook_add(unicorn.UC_HOOK_INTR, self._interrupted)
        self._let_time_pass()
        self.exception = None
        stack, self.pc = struct.unpack("<II", flash[:8])
        uc.reg_write(arm.UC_ARM_REG_SP, stack)

    def _let_time_pass(self):
        """Hooks `blocks.c` in, without a call of Python for each block."""
        self.time.stop = ctypes.cast(uclib.uc_emu_stop, ctypes.c_void_p).value
        function = ctypes.cast(self.library.on_block, ctypes.c_void_p)
        user = ctypes.cast(ctypes.pointer(self.time), ctypes.c_void_p)
        hook = ctypes.c_size_t()
        status = uclib.uc_hook_add(self.uc._uch, ctypes.byref(hook), unicorn.UC_HOOK_BLOCK, function, user,
                                   ctypes.c_uint64(1), ctypes.c_uint64(0))
        if status:
            raise Fault(f"Unicorn takes no hook: {status}")

    def _interrupted(self, uc, number, _):
        self.exception = number
        uc.emu_stop()

    def stop(self):
        """Stops after the present instruction."""
        self.uc.emu_stop()

    def go(self, address, registers):
        """Goes on at `address`, with these values in registers."""
        self.pc = address & ~1
        for name, value in registers.items():
            self.uc.reg_write(getattr(arm, f"UC_ARM_REG_{name.upper()}"), value)

    def sram(self):
        """What RAM holds."""
        return bytes(self.uc.mem_read(SRAM, SRAM_BYTES))

    def where(self):
        """Address of the instruction that is executed."""
        return self.uc.reg_read(arm.UC_ARM_REG_PC)

    def run(self):
        """Runs until something is due. Raises [Fault] where the processor would take a fault's exception."""
        self.exception, self.time.fresh = None, 1
        try:
            self.uc.emu_start(self.pc | 1, 0)
        except unicorn.UcError as error:
            if self.where() < EXCEPTION_RETURN - 1:
                raise Fault(f"{error} at {self.where():#x}") from error
        self.pc = self.where()
        if self.exception == EXCEPTION_EXIT or self.pc >= EXCEPTION_RETURN:
            self._leave()
        elif self.exception is not None:
            raise Fault(f"exception {self.exception} at {self.pc:#x}")

    def may_interrupt(self):
        """Whether an interrupt could be taken now: none is running, none is masked, no IT block is cut."""
        if self._frame_bytes:
            return False
        MASKS.read(self.uc)
        return not MASKS.values[0] & 1 and not MASKS.values[1] & IT_BITS

    def enter(self, vector):
        """Takes interrupt or exception number `vector`: stacks the registers and jumps to its handler."""
        self.handles = vector
        CONTEXT.read(self.uc)
        before, control, *words = CONTEXT.values
        self._frame_bytes = FRAME_WITH_FLOATS_BYTES if control & FPCA else FRAME_BYTES
        unaligned = before - self._frame_bytes
        frame = unaligned & ~7
        words[6] = self.pc
        words[7] = words[7] & ~MOVED | (MOVED if unaligned & 4 else 0)
        # The word behind the floats is reserved.
        stacked = struct.pack("<25I", *words)
        try:
            self.uc.mem_write(frame, stacked if control & FPCA else stacked[:FRAME_BYTES])
        except unicorn.UcError:
            # The stack has left RAM: the handler runs, but cannot return.
            pass
        HANDLER.values[:] = frame, control & ~FPCA, 0xFFFF_FFE9 if control & FPCA else 0xFFFF_FFF9
        HANDLER.write(self.uc)
        self.pc = struct.unpack("<I", self.uc.mem_read(FLASH + 4 * vector, 4))[0] & ~1
        self.time.now += ENTRY_CYCLES

    def _leave(self):
        """Returns from a handler: takes the registers from the stack."""
        uc = self.uc
        if not self._frame_bytes:
            raise Fault(f"return from an exception without one, at {self.pc:#x}")
        HANDLER.read(uc)
        frame, control, _ = HANDLER.values
        floats = self._frame_bytes == FRAME_WITH_FLOATS_BYTES
        batch = WITH_FLOATS if floats else WITHOUT_FLOATS
        words = list(struct.unpack("<25I", uc.mem_read(frame, 100))[:25 if floats else 8])
        self.pc = words[6]
        stack = frame + self._frame_bytes + (4 if words[7] & MOVED else 0)
        words[7] &= ~MOVED
        batch.values[:] = control & ~FPCA | (FPCA if floats else 0), stack, *words
        batch.write(uc)
        self._frame_bytes, self.handles = 0, 0
        self.time.now += ENTRY_CYCLES
