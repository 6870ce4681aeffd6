"""A recording that is played like a device."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from taxel._recording import read_recording


class Replay:
    """A recording that is played in a loop at its own speed, with the methods of `_native.Line`. Its outputs are the
    estimates, or the true outputs if nothing was decoded. `send` "readings" or "estimates" leaves the others out."""

    def __init__(self, path: str, send: str | None):
        found = read_recording(path)
        if len(found) == 0:
            raise ValueError(f"{path}: the recording has no frames")
        outputs = found.outputs if found.estimates is None else found.estimates
        self._count = len(found)
        none = np.empty((self._count, 0), np.float32)
        self._readings = none if send == "estimates" else found.readings
        self._outputs = none if send == "readings" else outputs
        self._period_s = float(np.median(np.diff(found.time_s))) if len(found) > 1 else 0.01
        self._start_s = time.monotonic()
        self._taken = -1
        # Names are such as `r1c2_ohm`.
        rows = len({name.partition("c")[0] for name in found.reading_names})
        self.identity = (path, "", None)
        self.shape = (rows, found.readings.shape[1] // rows, outputs.shape[1] // rows)

    def next(self, within_s: float) -> Any:
        """The next frame, at its time."""
        wait_s = self._start_s + (self._taken + 1) * self._period_s - time.monotonic()
        time.sleep(min(max(wait_s, 0), within_s))
        if wait_s > within_s:
            return None
        self._taken += 1
        return self._frame(self._taken)

    def newest(self, most_age_ms: float) -> Any:
        """The newest frame, even if earlier ones were not read."""
        self._taken = int((time.monotonic() - self._start_s) / self._period_s)
        found = self._frame(self._taken)
        return found if found[0][2] <= most_age_ms else None

    def close(self) -> None:
        """Does nothing, because nothing is open."""

    def _frame(self, count: int) -> Any:
        came_s = count * self._period_s
        age_ms = (time.monotonic() - self._start_s - came_s) * 1e3
        number = count % self._count
        status, none = np.zeros(self.shape[0], np.uint8), np.empty(0, np.float32)
        arrays = self._readings[number].astype(np.float32), self._outputs[number].astype(np.float32)
        return (count, round(came_s * 1e6), age_ms, 0), (*arrays, status, 0), (none, None)
