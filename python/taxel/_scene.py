"""Scenes, and frames that are synthesised from them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from taxel import _native


class Scene:
    """A sensor, its contacts, and how a model is trained for it (docs/scenes.md).

    `Scene("press")` is one of the built-in ones (paper, press, contact, moving, shear); `Scene("mine.toml")` a file.
   
  """

    def __init__(self, name_or_path: str | Path):
        self._native = _native.Scene(str(name_or_path))

    @classmethod
    def from_toml(cls, text: str, name: str = "scene") -> Scene:
        """Scene from the text of a scene file."""
        return cls._of(_native.Scene.of_text(name, text))

    @classmethod
    def _of(cls, native: Any) -> Scene:
        scene = cls.__new__(cls)
        scene._native = native
        return scene

    def replace(self, **fields: Any) -> Scene:
        """This scene with other values. A field is preceded by its tables, separated by two underscores:
        `Scene("press").replace(noise__level=0.01, training__centres=32)`. A dict is a table as a whole:
        `noise={"kind": "absolute", "level_ohm": 0.5}`."""
        values = [(name.replace("__", "."), as_toml(value)) for name, value in fields.items()]
        return self._of(self._native.with_values(values))

    @property
    def name(self) -> str:
        return self._native.name

    @property
    def rows(self) -> int:
        """Number of row-wires."""
        return self._native.rows

    @property
    def columns(self) -> int:
        """Number of column-wires."""
        return self._native.columns

    @property
    def outputs(self) -> list[str]:
        """Names of the outputs, with their units."""
        return self._native.output_names

    def to_toml(self) -> str:
        """Text of the scene as a scene file."""
        return self._native.text

    def __repr__(self) -> str:
        return f"Scene({self.name!r}, {self.rows} × {self.columns} wires, {len(self.outputs)} outputs)"

    def __reduce__(self) -> Any:
        return Scene.from_toml, (self.to_toml(), self.name)


@dataclass(frozen=True, repr=False)
class Frames:
    """Frames of a sensor, and the true outputs.

    `readings` (frames × wires) in Ω, `outputs` (frames × outputs) in the units of their names.
   
  """

    readings: np.ndarray
    outputs: np.ndarray
    reading_names: list[str]
    output_names: list[str]

    def to_pandas(self) -> Any:
        """Readings and outputs as two DataFrames, with their names."""
        import pandas

        return (
            pandas.DataFrame(self.readings, columns=self.reading_names),
            pandas.DataFrame(self.outputs, columns=self.output_names),
        )

    def __len__(self) -> int:
        return len(self.readings)

    def __repr__(self) -> str:
        _, wires = self.readings.shape
        return f"<{len(self)} Frames of {wires} readings and {self.outputs.shape[1]} outputs>"


def synth(scene: Scene | str | Path, n: int, *, seed: int | None = None, stream: str = "test") -> Frames:
    """`n` frames of a scene's still contacts, with its noise. `stream="training"` gives the frames
    that `taxel train` trains on, and `stream="test"` gives new ones. Seed None is the scene's own."""
    if stream not in ("training", "test"):
        raise ValueError(f'stream={stream!r}: give "training" or "test"')
    scene = scene if isinstance(scene, Scene) else Scene(scene)
    return Frames(*scene._native.frames(n, seed, stream == "training"))


def as_toml(value: Any) -> str:
    """Text of a value in a scene file."""
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(as_toml(it) for it in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {as_toml(it)}" for key, it in value.items()) + " }"
    if isinstance(value, (bool, str)):
        return json.dumps(value)
    if isinstance(value, (int, float)):
        return repr(value)
    raise ValueError(f"{value!r}: a scene takes numbers, text, lists and dicts of these")
