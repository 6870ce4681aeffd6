"""The log that the program leaves in memory for a debugger (SEGGER RTT)."""

import struct

MAGIC = b"SEGGER RTT"
CHANNEL = 24
BUFFER, SIZE, WRITE, READ, FLAGS = range(4, 24, 4)
BLOCK_IF_FULL = 2


class Rtt:
    """The first channel towards the debugger."""

    def __init__(self, cpu, address):
        self._cpu, self._address = cpu, address

    def _word(self, field):
        return struct.unpack("<I", self._cpu.uc.mem_read(self._address + CHANNEL + field, 4))[0]

    def _set(self, field, value):
        self._cpu.uc.mem_write(self._address + CHANNEL + field, struct.pack("<I", value))

    def read(self):
        """Takes what the program wrote since the last call."""
        if self._cpu.uc.mem_read(self._address, len(MAGIC)) != MAGIC:
            return b""
        size, write, read = (self._word(field) for field in (SIZE, WRITE, READ))
        ring = bytes(self._cpu.uc.mem_read(self._word(BUFFER), size))
        self._set(READ, write)
        return ring[read:write] if write >= read else ring[read:] + ring[:write]

    def abandon(self, room):
        """Leaves the channel as a debugger does that goes away in mid-session: blocking, with `room` bytes left."""
        self._set(FLAGS, BLOCK_IF_FULL)
        self._set(READ, (self._word(WRITE) + 1 + room) % self._word(SIZE))
