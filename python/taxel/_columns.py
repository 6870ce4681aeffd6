"""Columns of tables, by name and position."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

#: What means something in the pattern of a command; `?` stands for any character.
SPECIAL = re.compile(r"[,*!]|\.\.|^[\s-]|\s$")


def names_of(columns: Any, what: str) -> list[str] | None:
    """Names of a DataFrame's columns, or of a Series."""
    names = getattr(columns, "columns", None)
    if names is None:
        name = getattr(columns, "name", None)
        return [name] if isinstance(name, str) and np.ndim(columns) == 1 else None
    if not all(isinstance(name, str) for name in names):
        return None
    for name in names:
        if not 1 <= len(name) <= 200:
            raise ValueError(f"{what} has a column {name[:20]!r}: give it a name of 1 to 200 characters")
    return list(names)


def numbered(what: str, count: int) -> list[str]:
    return [f"{what}{number}" for number in range(1, count + 1)]


def pattern(names: Sequence[str]) -> str:
    """Pattern that chooses columns of these names in a command."""
    return ",".join(SPECIAL.sub(lambda found: "?" * len(found.group()), name) for name in names)


def place(name: str, known: Sequence[str]) -> int | None:
    """Index of a model's input among the `known` names. A model may name a column after its cell: `r1c2_adc_1` is
    `adc_1`."""
    own = name if name in known else name.partition("_")[2]
    return known.index(own) if own in known else None


def matrix(values: ArrayLike, inputs: Sequence[str], what: str = "X") -> np.ndarray:
    """Readings in the order of a model's `inputs`: a DataFrame by its names, other arrays unchanged."""
    names = names_of(values, what)
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2:
        raise ValueError(f"{what} has {array.ndim} dimensions: give lines × columns")
    if names is not None:
        places = [place(name, names) for name in inputs]
        missing = [name for name, found in zip(inputs, places) if found is None]
        if missing:
            raise ValueError(f"{what} has no column {missing[0]!r}; the model takes {', '.join(inputs)}")
        return np.ascontiguousarray(array[:, places])
    if array.shape[1] != len(inputs):
        raise ValueError(f"{what} has {array.shape[1]} columns, and the model takes {len(inputs)}: {', '.join(inputs)}")
    return np.ascontiguousarray(array)


def untouched(baseline: ArrayLike | None, inputs: Sequence[str]) -> np.ndarray:
    """Baseline of a model with relative inputs: the mean of the lines of `baseline`, readings of the untouched sensor."""
    if baseline is None:
        raise ValueError("the model takes R/R₀: give baseline=, readings of the untouched sensor")
    lines = baseline if names_of(baseline, "baseline") and np.ndim(baseline) == 2 else np.atleast_2d(baseline)
    rest = matrix(lines, inputs, "baseline").mean(axis=0)
    unusable = ~(np.isfinite(rest) & (rest > 0))
    if unusable.any():
        first = int(np.flatnonzero(unusable)[0])
        raise ValueError(f"baseline of {inputs[first]} is {rest[first]}: give readings above zero")
    return np.ascontiguousarray(rest)
