from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str

def call(
    arguments: list[str], tables: list[tuple[str, list[str], NDArray[np.float64]]], threads: int
) -> tuple[str, list[str]]: ...
def main(arguments: list[str]) -> int: ...
def ports() -> list[str]: ...
def read_recording(path: str) -> Any: ...
def only_usb_port() -> str | None: ...

class Blob:
    def __init__(self, bytes: bytes) -> None: ...
    def to_bytes(self) -> bytes: ...
    input_names: list[str]
    output_names: list[str]
    crc: int
    shape: tuple[int, int, int]
    centres: int
    formats: list[str]
    relative_inputs: bool
    reading_model: str | None
    def decode(
        self, readings: NDArray[np.float64], baseline: NDArray[np.float64] | None = None, threads: int = 0
    ) -> NDArray[np.float64]: ...
    def assess(
        self, readings: NDArray[np.float64], baseline: NDArray[np.float64] | None = None, threads: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None: ...
    def filled(self, readings: NDArray[np.float64]) -> NDArray[np.float64]: ...
    @staticmethod
    def reciprocals(baseline: NDArray[np.float32]) -> NDArray[np.float32]: ...
    def decode_frame(
        self,
        readings: NDArray[np.float32],
        reciprocals: NDArray[np.float32],
        outputs: NDArray[np.float32],
        status: NDArray[np.uint8],
        deviations: NDArray[np.float32],
    ) -> tuple[bool, int, float]: ...

class Scene:
    def __init__(self, name_or_path: str) -> None: ...
    @staticmethod
    def of_text(name: str, text: str) -> Scene: ...
    def with_values(self, values: list[tuple[str, str]]) -> Scene: ...
    name: str
    text: str
    rows: int
    columns: int
    output_names: list[str]
    def frames(
        self, count: int, seed: int | None, training: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str], list[str]]: ...

class Line:
    def __init__(
        self,
        port: str,
        protocol: str,
        baud: int,
        shape: tuple[int, int],
        period_us: int | None,
        send: str | None,
        confidence: bool,
        buffer: int,
    ) -> None: ...
    identity: tuple[str, str, int | None]
    shape: tuple[int, int, int]
    def next(self, within_s: float) -> Any: ...
    def newest(self, most_age_ms: float) -> Any: ...
    def close(self) -> None: ...
