"""The host's end of the serial line: a pseudo-terminal, and packets of the link (docs/link.md)."""

import os
import pty
import select
import struct
import tty
import zlib


class Terminal:
    """A pseudo-terminal whose other end, `path`, is the board's serial port."""

    def __init__(self, board):
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._board = board
        board.glance = self._pass_on

    def _pass_on(self, idle):
        """Passes bytes on in both directions; waits a moment for the host while the board idles."""
        usart = self._board.usart
        if usart.to_host:
            try:
                del usart.to_host[:os.write(self._master, usart.to_host)]
            except BlockingIOError:
                usart.to_host.clear()  # nobody reads
        if idle:
            select.select([self._master], [], [], 0.2e-3)
        try:
            usart.from_host.extend(os.read(self._master, 4096))
        except BlockingIOError:
            pass

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


def framed(message, number, version):
    """A request as it goes over the line: version, number, message, CRC-32; COBS; a zero."""
    packet = bytes([version]) + varint(number) + message
    packet += struct.pack("<I", zlib.crc32(packet))
    pieces = packet.split(b"\0")
    if any(len(piece) >= 254 for piece in pieces):
        raise ValueError("only short requests are sent from here")
    return b"".join(bytes([len(piece) + 1]) + piece for piece in pieces) + b"\0"


def packets(line):
    """Whole packets among the bytes from a device: number and message."""
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
            # Numbers here are below 128: one byte.
            yield body[1], body[2:]
