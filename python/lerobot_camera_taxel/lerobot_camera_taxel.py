"""A Taxel sensor as a camera of LeRobot, of type `taxel`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import taxel
from lerobot.cameras import Camera, CameraConfig
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError


@CameraConfig.register_subclass("taxel")
@dataclass(kw_only=True)
class TaxelCameraConfig(CameraConfig):
    """What the picture shows, and of which device.

    `port`, `protocol`, `shape` and `baud` are those of `taxel.Link`; `fps` is the rate of a Taxel device. `show` is "outputs", of
    the device's model, or "readings". Outputs are `axes` of each place: one is grey, three are red, green and blue. Values
    from `black` to `white` are 0 to 255: mm and Ω, or the units of the model or the sensor. `NaN` is 0. A row of the sensor is
    above the next one, and a place is many pixels of `height` × `width`, as videos need them.
    """

    port: str | None = None
    protocol: str = "taxel"
    shape: tuple[int, int] | None = None
    baud: int | None = None
    show: str = "outputs"
    axes: int = 3
    black: float = -1.0
    white: float = 1.0
    width: int = 96
    height: int = 128

    def __post_init__(self) -> None:
        if self.show not in ("outputs", "readings"):
            raise ValueError(f'show={self.show!r}: give "outputs" or "readings"')
        if self.axes not in (1, 3):
            raise ValueError(f"axes={self.axes}: a picture shows 1 or 3 outputs of a place")
        if self.black == self.white:
            raise ValueError(f"black={self.black}, white={self.white}: give two values")
        if self.fps is not None and self.fps < 1:
            raise ValueError(f"fps={self.fps}: give frames per second from 1 on, or none")


class TaxelCamera(Camera):
    """Pictures of a sensor: height × width × 3, of bytes."""

    def __init__(self, config: TaxelCameraConfig):
        super().__init__(config)
        self.config = config
        self._link: taxel.Link | None = None
        self._last_frame: int | None = None

    @property
    def is_connected(self) -> bool:
        return self._link is not None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Every serial port of this computer: nobody is asked what it is."""
        return [{"type": "taxel", "id": port} for port in taxel.list_ports()]

    def connect(self, warmup: bool = True) -> None:
        """Listens to the device. With `warmup` a device that sends nothing, or no outputs, is refused."""
        if self._link is not None:
            raise DeviceAlreadyConnectedError(f"{self._link} is connected")
        config = self.config
        self._link = taxel.Link(
            config.port,
            protocol=config.protocol,
            shape=config.shape,
            baud=config.baud,
            period_us=config.fps and round(1e6 / config.fps),
            send="readings" if config.show == "readings" else "estimates",
        )
        self._last_frame = None
        if warmup:
            try:
                self.read()
            except BaseException:
                self.disconnect()
                raise

    def disconnect(self) -> None:
        """Frees the port."""
        self._connected().close()
        self._link = None

    def read(self) -> np.ndarray:
        """The next frame that was not read yet, or the newest of them. `TimeoutError` after two seconds."""
        return self.async_read(2000)

    def async_read(self, timeout_ms: float = 200) -> np.ndarray:
        """The newest frame; one that was read before is not read again. `TimeoutError` if none comes."""
        reading = self._connected().read_latest(timeout_ms)
        if reading is None or reading.frame == self._last_frame:
            reading = self._connected().read(timeout_ms)
        self._last_frame = reading.frame
        return self._picture(reading)

    def read_latest(self, max_age_ms: float = 500) -> np.ndarray:
        """The newest frame, also if it was read before. `TimeoutError` if it is older."""
        reading = self._connected().read_latest(max_age_ms)
        if reading is None:
            raise TimeoutError(f"{self._link}: no frame came within {max_age_ms:g} ms")
        return self._picture(reading)

    def _connected(self) -> taxel.Link:
        if self._link is None:
            raise DeviceNotConnectedError("the camera of Taxel is not connected: connect() it first")
        return self._link

    def _picture(self, reading: taxel.Reading) -> np.ndarray:
        config = self.config
        if config.show == "readings":
            values = reading.readings[:, :, None]
        else:
            rows = len(reading.status)
            if reading.outputs.size == 0 or reading.outputs.size % (rows * config.axes) != 0:
                raise ValueError(
                    f"{self._link} has {reading.outputs.size} outputs in {rows} rows, which are not {config.axes} of each place: "
                    'upload a model, give axes, or show="readings"'
                )
            values = reading.outputs.reshape(rows, -1, config.axes)
        share = np.nan_to_num((values - config.black) / (config.white - config.black)).clip(0, 1)
        pixels = np.uint8(255 * share + 0.5)
        rows = np.arange(config.height) * pixels.shape[0] // config.height
        places = np.arange(config.width) * pixels.shape[1] // config.width
        return np.repeat(pixels[rows[:, None], places], 3 // pixels.shape[2], axis=2)
