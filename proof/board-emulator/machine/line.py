"""The host's end of the serial line: a pseudo-terminal, and packets of the link (docs/link.md)."""

import ctypes
import fcntl
import os
import pty
import select
import struct
import termios
import time
import tty
import zlib

from .rules import Fault


class HostClock(ctypes.Structure):
    """What a host loaded with `host_clock.c` and the board share: the board's time, and whether and until when the host
    waits for it."""

    _fields_ = [("now_us", ctypes.c_int64), ("until_us", ctypes.c_int64), ("waits", ctypes.c_int64)]


#: How a host waits.
SLEEPS, READS = 1, 2
#: Looks at the host, while it computes, until there is a pause in s between them; and the longest it may compute.
QUICK_LOOKS, LOOK_S, LONGEST_S = 100, 50e-6, 300.0
#: Longest time in s that a reader with a clock of its own is waited for.
LATE_READER_S = 5.0


class Host:
    """A program at the other end of the line whose clock is the board's, as `clock` has it."""

    def __init__(self, clock, process):
        self._clock, self._process = clock, process

    def ended(self):
        """Whether the program has ended."""
        return self._process.poll() is not None

    def tell(self, seconds):
        """Tells the board's time."""
        self._clock.now_us = int(seconds * 1e6)

    def waits(self, unread):
        """Whether it waits for the board: sleeps, or waits for bytes while none are `unread`, until a time to come."""
        waits, unread = self._clock.waits, unread()
        return (waits == SLEEPS or waits == READS and not unread) and self._clock.now_us < self._clock.until_us


class Terminal:
    """A pseudo-terminal whose other end, `path`, is the board's serial port."""

    def __init__(self, board):
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._board = board
        #: Whether somebody reads at the other end, as far as is known.
        self._is_read = True
        #: The program at the other end, if it lives by the board's clock; else by its own.
        self.host = None
        board.glance = self._pass_on

    def _pass_on(self, idle):
        """Passes bytes on in both directions. A host that lives by the board's clock first ends what it does; for
        another one an idle board waits a moment."""
        usart = self._board.usart
        # A host whose clock is the board's is woken for whole packets alone: waking it takes longest of all.
        count = len(usart.to_host) if self.host is None else usart.to_host.rfind(0) + 1
        if count:
            try:
                del usart.to_host[:os.write(self._master, usart.to_host[:count])]
                self._is_read = True
            except BlockingIOError:
                # A reader on a busy computer may be late; without one, what is sent is lost.
                if self.host is None:
                    ready = self._is_read and select.select([], [self._master], [], LATE_READER_S)[1]
                    if not ready:
                        usart.to_host.clear()
                        self._is_read = False
        if self.host is not None:
            self._let_host_compute()
        elif idle:
            select.select([self._master], [], [], 0.2e-3)
        self._take()

    def _take(self):
        """Takes what the host has sent."""
        try:
            taken_now = os.read(self._master, 4096)
        except BlockingIOError:
            return
        self._board.usart.from_host.extend(taken_now)

    def _let_host_compute(self):
        """Waits until the host has read all and waits for more, or has ended: whatever it does takes no time."""
        self.host.tell(self._board.time.seconds())
        start, looks = time.monotonic(), 0
        while not self.host.waits(self._unread) and not self.host.ended():
            self._take()
            looks += 1
            if looks < QUICK_LOOKS:
                os.sched_yield()
            else:
                time.sleep(LOOK_S)
            if time.monotonic() > start + LONGEST_S:
                raise Fault("taxel neither waits for the board nor ends")

    def _unread(self):
        """Number of bytes that the host has not read."""
        return struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4)))[0]

    def close(self):
        """Unplugs the board."""
        self._board.glance = lambda idle: None
        os.close(self._master)
        os.close(self._slave)


def varint(value):
    """`value` with seven bits a byte, lowest first."""
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*encoded, value])


def taken(message):
    """A number that was encoded so, and what follows it."""
    value = 0
    for place, byte in enumerate(message):
        value |= (byte & 0x7F) << 7 * place
        if byte < 0x80:
            return value, message[place + 1:]
    raise ValueError("a number without an end")


def framed(message, number, version):
    """A request as it goes over the line: version, number, message, CRC-32; COBS; a zero."""
    packet = bytes([version]) + varint(number) + message
    packet += struct.pack("<I", zlib.crc32(packet))
    pieces = packet.split(b"\0")
    if any(len(piece) >= 254 for piece in pieces):
        raise ValueError("only short requests are sent from here")
    return b"".join(bytes([len(piece) + 1]) + piece for piece in pieces) + b"\0"


def packets(line):
    """Whole packets among the bytes of a line: number and message."""
    for frame in bytes(line).split(b"\0")[:-1]:
        packet, place = bytearray(), 0
        while place < len(frame):
            code = frame[place]
            packet += frame[place + 1:place + code]
            place += code
            if code < 255 and place < len(frame):
                packet.append(0)
        body, crc = bytes(packet[:-4]), packet[-4:]
        if len(body) > 2 and zlib.crc32(body) == int.from_bytes(crc, "little"):
            yield taken(body[1:])
