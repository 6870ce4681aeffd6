"""Recordings of a sensor."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taxel import _native
from taxel._scene import Frames


@dataclass(frozen=True, repr=False)
class Recording(Frames):
    """Frames of a recording, which `taxel view` and `taxel link record` write.

    `outputs` are the true outputs, without columns if these are not known. `estimates` (frames × outputs) were decoded during
    the recording, or are None; their columns are `estimate_names`. `time_s` is the time of the device's clock.
    """

    estimates: np.ndarray | None
    estimate_names: list[str]
    time_s: np.ndarray


def read_recording(path: str | Path) -> Recording:
    """Reads a recording (.mcap). A recording that was cut off is read up to there; `taxel view` repairs it."""
    readings, (estimates, truth), time_s, (reading_names, output_names) = _native.read_recording(str(path))
    known = [] if truth is None else output_names
    outputs = np.empty((len(readings), 0), np.float32) if truth is None else truth
    return Recording(readings, outputs, reading_names, known, estimates, output_names, time_s)
