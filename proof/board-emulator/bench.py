"""A bench: an emulated board, and `taxel` beside it."""

import mmap
import os
import pathlib
import random
import re
import subprocess
import tempfile

from machine.board import Board
from machine.cpu import native
from machine.line import Host, HostClock, Terminal, framed, packets, taken, varint

#: Requests, as far as they have no fields, and the variant of an answer (docs/link.md).
IDENTIFY, CONFIGURATION, CONFIGURE = b"\x00", b"\x02", b"\x03"
CONFIGURED = b"\x02"
RESTART, KEEP_CONFIGURATION = b"\x07", b"\x0c\x00"
#: Where the version of the link's protocol stands.
PACKET = pathlib.Path(__file__).resolve().parents[2] / "firmware/src/link/packet.rs"
#: Longest time in s of the board within which it answers most requests, and one that erases flash.
PATIENCE_S, ERASE_PATIENCE_S = 0.5, 6.0


class Failed(Exception):
    """The board did something else than it should."""


def expect(condition, text):
    """Fails with `text` unless `condition` is true."""
    if not condition:
        raise Failed(text)


class Bench:
    """A board that runs `image`, with a sensor of `shape`: rows, columns; `ohm` is the range of its resistances. `options` are those of `Board`.

    The resistances at its wires are known: `ohm`.
    """

    def __init__(self, image, taxel, log, shape=(8, 18), ohm=(44.0, 68.0), **options):
        draw, (rows, columns) = random.Random(7), shape
        self.ohm = [[draw.uniform(*ohm) for _ in range(columns)] for _ in range(rows)]
        self.board = Board(image, self.ohm, log=log, **options)
        self._taxel, self._log, self._number = taxel, log, 0

    def run_for(self, seconds):
        """Lets the board run for so many seconds of its own time."""
        self.board.run_for(seconds)

    def taxel(self, *arguments, status=0):
        """Runs `taxel link` with the board's serial port and `arguments` to its end, with this exit status, and returns
        what it says. Its clock is the board's, so it does not matter how busy the computer is.
        """
        terminal = Terminal(self.board)
        command = [self._taxel, "link", terminal.path, *map(str, arguments)]
        self._log("$ taxel link", *arguments)
        with tempfile.TemporaryDirectory() as directory, open(pathlib.Path(directory) / "clock", "w+b") as file:
            os.ftruncate(file.fileno(), mmap.PAGESIZE)
            clock = HostClock.from_buffer(mmap.mmap(file.fileno(), mmap.PAGESIZE))
            # Before it starts: a clock that jumped later would end its waits.
            clock.now_us = int(self.board.time.seconds() * 1e6)
            library = native("host_clock.c", directory)
            environment = {**os.environ, "LD_PRELOAD": str(library), "BOARD_CLOCK": file.name}
            host = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                    env=environment)
            terminal.host = Host(clock, host)
            try:
                self.board.run_until(terminal.host.ended)
            finally:
                host.kill()
                said = host.communicate()[0]
                terminal.close()
        self._log(said.rstrip())
        expect(host.returncode == status, f"taxel link {arguments[0]} ended with {host.returncode}")
        return said

    def program(self, *arguments):
        """Runs another command of `taxel`, and returns what it says."""
        self._log("$ taxel", *arguments)
        command = [self._taxel, *map(str, arguments)]
        ended = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        expect(ended.returncode == 0, f"taxel {arguments[0]} ended with {ended.returncode}: {ended.stderr}")
        return ended.stdout

    def ask(self, message, expected, patience_s=PATIENCE_S, before=b""):
        """Sends a request of the link to the board, behind other bytes. Returns its answer, which must begin with what is
        expected, and how long that took in s."""
        board = self.board
        # Numbers that take one byte.
        self._number = self._number % 126 + 1
        start, number, answers, resets = board.time.seconds(), self._number, [], len(board.resets)
        line = board.usart.to_host
        board.usart.from_host.extend(before + request(message, number))

        def over():
            whole = line.rfind(0) + 1
            answers.extend(body for found, body in packets(line[:whole]) if found == number)
            del line[:whole]
            return answers or len(board.resets) > resets or board.time.seconds() > start + patience_s

        board.run_until(over)
        resets = ", ".join(board.resets[resets:]) or "none"
        silent = f"request {message.hex(' ')} is not answered; resets by: {resets}; it stands in {board.where()}"
        expect(answers, silent)
        expect(answers[0].startswith(expected), f"request {message.hex(' ')} is answered by {answers[0].hex(' ')}")
        return answers[0], board.time.seconds() - start

    def scan_every(self, seconds, settling_s=None, samples=None):
        """Configures the time from one scan to the next, the settling, and the samples of a reading; nothing else."""
        answer, _ = self.ask(CONFIGURATION, CONFIGURED)
        # The first fields, whatever follows them.
        _, rest = taken(answer[1:])
        settling_us, rest = taken(rest)
        before, rest = taken(rest)
        if settling_s is not None:
            settling_us = self.board.settling_us = round(settling_s * 1e6)
        self.ask(CONFIGURE + varint(round(seconds * 1e6)) + varint(settling_us)
                 + varint(samples or before) + rest, CONFIGURED)

    def period_us(self):
        """The time from one scan to the next that is in force."""
        return taken(self.ask(CONFIGURATION, CONFIGURED)[0][1:])[0]

    def finish(self, resets=(), erased=()):
        """Ends the scenario: no rule may be broken, and the resets and the sectors that were erased must be these."""
        board = self.board
        board.rows.check_rest()
        broken = ", ".join(f"{name} ({count}×)" for name, count in board.rules.counts.items())
        expect(not broken, f"broken rules: {broken}")
        expect(board.resets == list(resets), f"resets by {board.resets}, expected {list(resets)}")
        found = {sector for sector, times in board.store.erased.items() if times}
        expect(found == set(erased), f"sectors {sorted(found)} were erased, expected {sorted(erased)}")


def protocol_version():
    """Version of the link's protocol."""
    return int(re.search(r"PROTOCOL_VERSION: u8 = (\d+);", PACKET.read_text())[1])


def request(message, number=127):
    """A request as it goes over the line, with a number of one byte; none of `Bench.ask` has 127."""
    return framed(message, number, protocol_version())


#: Number of a blob's first bytes that begin an upload.
HEAD_BYTES = 16


def begin(blob):
    """The request that begins the upload of a blob."""
    return b"\x06\x00" + varint(HEAD_BYTES) + blob[:HEAD_BYTES]
