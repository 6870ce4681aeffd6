"""Decoder of single frames, as on a device."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from taxel import _native
from taxel._columns import matrix, untouched

if TYPE_CHECKING:
    from taxel._model import Model

#: How the decoding of a row ended, by its number.
STATUS = ("decoded", "missing reading", "overflow", "at rest")


@dataclass(frozen=True)
class Estimate:
    """Result of decoding a frame.

    `outputs` are in the units of the model's outputs, row after row, NaN for a row that could not be decoded. `status` is a
    number for each row (`taxel._decoder.STATUS`). `clamped` is whether a reading lies far outside the training range, and
    `filled` the number of missing readings that were filled from the others. `std` and `novelty` are None without a full
    reading model.
    """

    outputs: np.ndarray
    status: np.ndarray
    clamped: bool
    filled: int
    std: np.ndarray | None
    novelty: float | None


class Decoder:
    """Decodes frames as a device does, bit for bit.

    `blob` is a path, the bytes of a blob, or a `Model`. `baseline` is needed for a model with relative inputs: readings
    of the untouched sensor in Ω, one line or several.
   
  """

    def __init__(self, blob: str | Path | bytes | Model, *, baseline: ArrayLike | None = None):
        if hasattr(blob, "to_bytes"):
            blob = blob.to_bytes()
        self._blob = _native.Blob(blob if isinstance(blob, bytes) else Path(blob).read_bytes())
        rows, inputs, outputs = self._blob.shape
        self._sizes = (rows, rows * inputs, rows * outputs)
        self._baseline = None
        self._reciprocals = np.empty(0, np.float32)
        if self._blob.relative_inputs:
            self._baseline = untouched(baseline, self._blob.input_names)
            self._reciprocals = _native.Blob.reciprocals(self._baseline.astype(np.float32))

    def __repr__(self) -> str:
        return f"<Decoder of {len(self.input_names)} readings to {len(self.output_names)} outputs>"

    @property
    def input_names(self) -> list[str]:
        return self._blob.input_names

    @property
    def output_names(self) -> list[str]:
        return self._blob.output_names

    def decode(self, frame: ArrayLike, out: np.ndarray | None = None) -> Estimate:
        """Decodes one frame of readings, row after row. `out` (float32, one for each output) receives the outputs."""
        rows, inputs, outputs = self._sizes
        readings = np.array(frame, np.float32).reshape(-1)
        if readings.size != inputs:
            raise ValueError(
                f"a frame has {inputs} readings, and this one {readings.size}; decode_many takes several frames"
            )
        values = np.empty(outputs, np.float32) if out is None else out
        if values.dtype != np.float32 or values.shape != (outputs,) or not values.flags.c_contiguous:
            raise ValueError(f"out: give a contiguous array of {outputs} float32")
        status = np.empty(rows, np.uint8)
        std = np.empty(outputs if self._blob.reading_model == "full" else 0, np.float32)
        clamped, filled, novelty = self._blob.decode_frame(readings, self._reciprocals, values, status, std)
        if self._blob.reading_model != "full":
            return Estimate(values, status, clamped, filled, None, None)
        return Estimate(values, status, clamped, filled, std, novelty)

    def decode_many(self, frames: ArrayLike, out: np.ndarray | None = None) -> np.ndarray:
        """Decodes frames (frames × readings, or frames × rows × columns) to outputs (frames × outputs), bit for bit as one
        by one. Columns of a DataFrame are chosen by name."""
        if np.ndim(frames) > 2:
            frames = np.reshape(frames, (len(frames), -1))  # type: ignore[arg-type]
        values = self._blob.decode(matrix(frames, self._blob.input_names, "frames"), self._baseline)
        if out is None:
            return values
        out[...] = values
        return out
