"""Results of commands on scenes and models."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taxel._call import call, folder, option, table, two_dimensional
from taxel._columns import names_of
from taxel._model import Model
from taxel._scene import Scene


def source(subject: Scene | str | Path, work: Path) -> object:
    """A subject as an argument of a command."""
    if isinstance(subject, (str, Path)):
        return subject
    if not isinstance(subject, Scene):
        raise TypeError(f"a {type(subject).__name__}: give a Scene, its name, or a file's path")
    path = work / f"{subject.name}.toml"
    path.write_text(subject.to_toml(), encoding="utf-8")
    return path


class Trade:
    """Decoders of a subject, by error and time (docs/trade.md).

    `points` has a dict for each, as in `trade --json`; `front` are the points of the Pareto front; `chosen` is the point
    that the bounds select, or None; `model` is its model.
   
  """

    def __init__(self, result: dict[str, Any], page: str, svg: str, blob: bytes | None):
        self.result, self.page_html, self.svg = result, page, svg
        self.points: list[dict[str, Any]] = result["points"]
        self.front = [point for point in self.points if point["on_front"]]
        chosen = result.get("chosen")
        self.chosen = None if chosen is None else self.points[chosen]
        self.model = None if blob is None else Model.of_bytes(blob)

    def to_pandas(self) -> Any:
        """The points as a DataFrame."""
        import pandas

        return pandas.json_normalize(self.points)

    def __repr__(self) -> str:
        return f"Trade({len(self.points)} points, {len(self.front)} on the front)"

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self))}</p>{self.svg}"


def trade(
    subject: Scene | str | Path,
    *,
    frame_rate: float | None = None,
    max_error: float | None = None,
    max_latency_ms: float | None = None,
    max_cycles: int | None = None,
    max_flash: int | None = None,
    centres: ArrayLike | None = None,
    refine: bool = True,
    seed: int | None = None,
    **options: Any,
) -> Trade:
    """Trains and evaluates decoders of a scene or a data file, and chooses one within the bounds. Other options are those
    of `taxel trade`, with underscores: `average=[1, 4]`, `readout="spi"`."""
    with folder() as work:
        out = work / "out"
        arguments: list[object] = ["trade", source(subject, work), "-o", out]
        arguments += option("--frame-rate", frame_rate) + option("--max-error", max_error)
        arguments += option("--max-latency-ms", max_latency_ms) + option("--max-cycles", max_cycles)
        arguments += option("--max-flash", max_flash) + option("--centres", centres)
        arguments += option("--no-refine", not refine) + option("--seed", seed)
        for name, value in options.items():
            arguments += option("--" + name.replace("_", "-"), value)
        result = call(arguments)
        (made,) = out.iterdir()
        blob = made / "chosen.bin"
        return Trade(
            result,
            (made / "trade.html").read_text(encoding="utf-8"),
            (made / "figures" / "error-by-time.svg").read_text(encoding="utf-8"),
            blob.read_bytes() if blob.exists() else None,
        )


class Limit:
    """Least possible error of any decoder of a sensor, by group of outputs (docs/what-the-sensor-knows.md).

    `result` is that of `limit --json`.
   
  """

    def __init__(self, result: dict[str, Any]):
        self.result = result

    def __repr__(self) -> str:
        return f"Limit({self.result.get('subject') or self.result.get('scene')})"


def limit(scene: Scene | str | Path, *, frames: int | None = None, seed: int | None = None) -> Limit:
    """Least possible error of any decoder of a scene."""
    with folder() as work:
        arguments = ["limit", source(scene, work)]
        return Limit(call([*arguments, *option("--frames", frames), *option("--seed", seed)]))


def evaluate(model: Model | str | Path, X: ArrayLike, y: ArrayLike, *, baseline: ArrayLike | None = None) -> dict[str, Any]:
    """Errors of a model, or of the blob at a path, on readings `X` and true outputs `y`, as in `eval --json`."""
    if isinstance(model, (str, Path)):
        model = Model.load(model)
    if not isinstance(model, Model):
        raise TypeError(f"a {type(model).__name__}: give a Model, or the path of its blob")
    names_x = names_of(X, "X") or list(model.blob_.input_names)
    names_y = names_of(y, "y") or list(model.blob_.output_names)
    X, y = two_dimensional(X, "X"), two_dimensional(y, "y")
    if X.shape[1] != len(names_x) or y.shape[1] != len(names_y):
        raise ValueError(f"X and y have {X.shape[1]} and {y.shape[1]} columns: give {len(names_x)} and {len(names_y)}")
    if len(X) != len(y):
        raise ValueError(f"X has {len(X)} lines and y {len(y)}")
    with folder() as work:
        blob = work / "model.bin"
        blob.write_bytes(model.to_bytes())
        tables = [table("data.table", dict(zip(names_x, X.T)) | dict(zip(names_y, y.T)))]
        arguments: list[object] = ["eval", blob, "data.table"]
        if baseline is not None:
            rest = np.atleast_2d(np.asarray(baseline, np.float64))
            tables.append(table("rest.table", dict(zip(names_x, rest.T))))
            arguments += ["--baseline", "rest.table"]
        return call(arguments, tables=tables)
