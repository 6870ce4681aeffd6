"""A Taxel sensor as a camera of LeRobot: a picture of rows × places, of the compression of each electrode.

    pip install taxel
    python lerobot_taxel.py [PORT]      # without LeRobot: prints the deepest electrode ten times a second

In LeRobot, put it beside your robot's cameras: `cameras={"fingertip": TaxelCamera("/dev/ttyACM0")}`. The device needs a model whose
outputs are Δx, Δy, Δz of each electrode, as `run press` makes one.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import taxel

#: Compression in mm that is white in the picture.
FULL_SCALE_MM = 1.0


class TaxelCamera:
    """Has the methods of lerobot.cameras.Camera: connect, read, async_read, read_latest, disconnect."""

    def __init__(self, port: str | None = None, axes: int = 3):
        self.port, self.axes = port, axes
        self.fps, self.height, self.width = 100, 8, 6
        self._link: taxel.Link | None = None

    @property
    def is_connected(self) -> bool:
        return self._link is not None

    def connect(self, warmup: bool = True) -> None:
        self._link = taxel.Link(self.port, send="estimates")
        if self._link.model_crc is None:
            raise ValueError("the device has no model: taxel link PORT upload model.bin")
        if warmup:
            self.async_read(2000)

    def disconnect(self) -> None:
        if self._link is not None:
            self._link.close()
            self._link = None

    def deformation_mm(self, reading: taxel.Reading) -> np.ndarray:
        """Δx, Δy, Δz of every electrode: rows × places × axes. A row that could not be decoded is NaN."""
        return reading.outputs.reshape(len(reading.status), -1, self.axes)

    def picture(self, reading: taxel.Reading) -> np.ndarray:
        """Height × width × 3, of bytes: compression, the same in all three colours."""
        share = np.nan_to_num(self.deformation_mm(reading)[:, :, -1]) / FULL_SCALE_MM
        self.height, self.width = share.shape
        return np.repeat(np.uint8(255 * share.clip(0, 1))[:, :, None], 3, axis=2)

    def read(self) -> np.ndarray:
        """The next frame."""
        return self.picture(self._link.read())

    def async_read(self, timeout_ms: float = 200) -> np.ndarray:
        """The newest frame; the first one is waited for."""
        reading = self._link.read_latest(timeout_ms)
        if reading is None:
            raise TimeoutError(f"no frame within {timeout_ms} ms")
        return self.picture(reading)

    read_latest = async_read


if __name__ == "__main__":
    camera = TaxelCamera(sys.argv[1] if len(sys.argv) > 1 else None)
    camera.connect()
    try:
        while True:
            picture = camera.async_read(1000)
            print(f"deepest: {picture.max() / 255 * FULL_SCALE_MM:.2f} mm")
            time.sleep(0.1)
    finally:
        camera.disconnect()
