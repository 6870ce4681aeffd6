"""Devices on a serial line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from taxel import _native
from taxel._call import call, folder
from taxel._replay import Replay

if TYPE_CHECKING:
    from taxel._model import Model

#: Flags of a device's estimate (docs/link.md).
CONTACT, CLAMPED, NOVEL = 16, 64, 128


def list_ports() -> list[str]:
    """Serial ports of this computer, USB ports first."""
    return _native.ports()


@dataclass(frozen=True)
class Reading:
    """Data that a device sent for one scan.

    `readings` (rows × columns, Ω) and `outputs` (in the model's units) are empty if they were not requested. `status` has a
    number for each row; `flags` are those of docs/link.md. `time_us` is the start of the scan since the device's start,
    `age_ms` the time since the data arrived, and `lost` the number of scans that were lost or not read.
    """

    frame: int
    time_us: int
    age_ms: float
    lost: int
    readings: np.ndarray
    outputs: np.ndarray
    status: np.ndarray
    flags: int
    std: np.ndarray
    novelty: float | None


class Link:
    """Connection to a device, read in the background: an iterator over what it sends, and a context manager.

    If `port` is None, the only USB port is used. `protocol` "flexitac" and "csv" read other sensors: FlexiTac's firmware,
    and lines of numbers; they need `shape` (rows, columns). "recording" plays the recording (.mcap) at the path `port` in a
    loop. These protocols have neither `zero` nor `upload`. `send` is "readings", "estimates" or "both"; None requests
    estimates from a device that has a model, and readings from others. At most `buffer` readings are kept until they are
    read; older ones are dropped and counted.
    """

    def __init__(
        self,
        port: str | None = None,
        *,
        protocol: str = "taxel",
        baud: int | None = None,
        shape: tuple[int, int] | None = None,
        period_us: int | None = None,
        send: str | None = None,
        confidence: bool = False,
        buffer: int = 1024,
    ):
        self.port = port or only_port()
        if protocol not in ("taxel", "flexitac", "csv", "recording"):
            raise ValueError(f'protocol={protocol!r}: give "taxel", "flexitac", "csv" or "recording"')
        if protocol in ("flexitac", "csv") and (shape is None or min(shape) < 1):
            raise ValueError(f"shape={shape}: protocol {protocol!r} does not report rows and columns; give them, such as shape=(16, 32)")
        if buffer < 1 or (baud is not None and baud < 1):
            raise ValueError(f"buffer={buffer}, baud={baud}: give whole numbers, 1 or above")
        usual_baud = 2_000_000 if protocol == "flexitac" else 921_600
        self._options = (protocol, baud or usual_baud, shape or (0, 0), period_us, send, confidence, buffer)
        self._line: Any = Replay(self.port, send) if protocol == "recording" else _native.Line(self.port, *self._options)
        self._has_read = False

    def __repr__(self) -> str:
        if self._line is None:
            return f"<Link to {self.port}, closed>"
        model = "no model" if self.model_crc is None else f"model {self.model_crc:08x}"
        return f"<Link to {self.port}: {self.board}, firmware {self.firmware}, {model}>"

    @property
    def board(self) -> str:
        """Name of the device's board."""
        return self._opened().identity[0]

    @property
    def firmware(self) -> str:
        """Version of its firmware."""
        return self._opened().identity[1]

    @property
    def model_crc(self) -> int | None:
        """CRC-32 of the active model, or None."""
        return self._opened().identity[2]

    def read(self, timeout_ms: float = 2000) -> Reading:
        """The oldest reading that was not read yet. Raises `TimeoutError` if none arrives."""
        found = self._opened().next(timeout_ms / 1000)
        if found is None:
            raise TimeoutError(
                f"{self.port}: nothing came within {timeout_ms:g} ms: is the device powered, and does it scan?"
            )
        return self._reading(found)

    def read_latest(self, max_age_ms: float = 500) -> Reading | None:
        """The newest reading; older ones are dropped. None if it is older than `max_age_ms`. The first call waits
        that long for a reading."""
        found = self._opened().newest(max_age_ms)
        if found is None and not self._has_read:
            found = self._opened().next(max_age_ms / 1000)
        return None if found is None else self._reading(found)

    def __iter__(self) -> Iterator[Reading]:
        while self._line is not None:
            yield self.read()

    def zero(self, n: int = 30) -> np.ndarray:
        """Captures the untouched sensor over `n` scans as the device's baseline, and returns it (Ω)."""
        with folder() as work:
            rest = work / "rest.csv"
            self._apart(["baseline", "-n", n, "-o", rest])
            return np.loadtxt(rest, delimiter=",", skiprows=1, ndmin=1)

    def upload(self, model: Model | str | Path) -> None:
        """Uploads a model to the device; if it is refused, the previous model stays active."""
        with folder() as work:
            path = model
            if hasattr(model, "save"):
                path = work / "model.bin"
                model.save(path)
            self._apart(["upload", path])

    def record(self, path: str | Path, seconds: float, model: Model | str | Path | None = None) -> None:
        """Records for so many seconds to `path` (.mcap): readings, and the estimates if `model`, which must be active on the
        device, is given. docs/live.md describes recordings."""
        period_us = self._options[3] or 10_000
        frames = max(1, round(seconds * 1e6 / period_us))
        with folder() as work:
            blob = model
            if hasattr(model, "save"):
                blob = work / "model.bin"
                model.save(blob)
            given = [] if blob is None else [blob]
            self._apart(["record", *given, "-n", frames, "--period-us", period_us, "-o", path])

    def close(self) -> None:
        """Stops reading: the device returns to its own configuration, and the port is free."""
        if self._line is not None:
            self._line.close()
            self._line = None

    def __enter__(self) -> Link:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _opened(self) -> Any:
        if self._line is None:
            raise RuntimeError("the link is closed")
        return self._line

    def _apart(self, action: list[object]) -> None:
        """Closes the port while a command uses it, and opens it again."""
        if self._options[0] != "taxel":
            raise RuntimeError(f'a sensor of protocol "{self._options[0]}" only sends readings')
        self._opened().close()
        try:
            call(["link", self.port, "--baud", self._options[1], *action])
        finally:
            self._line = _native.Line(self.port, *self._options)

    def _reading(self, found: Any) -> Reading:
        (frame, time_us, age_ms, lost), (readings, outputs, status, flags), (std, novelty) = found
        rows, columns, _ = self._opened().shape
        if readings.size == rows * columns:
            readings = readings.reshape(rows, columns)
        self._has_read = True
        return Reading(frame, time_us, age_ms, lost, readings, outputs, status, flags, std, novelty)


def only_port() -> str:
    """The USB port, if there is exactly one."""
    port = _native.only_usb_port()
    if port is None:
        ports = list_ports()
        known = f"there are {', '.join(ports)}" if ports else "this computer has no serial port"
        raise ValueError(f"port: no device was found: name its port; {known}")
    return port
