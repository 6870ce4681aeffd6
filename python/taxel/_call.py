"""Calls of commands, and the files that they read."""

from __future__ import annotations

import json
import re
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taxel import _native


#: Folders of files and names of tables of one call, which nobody but this module knows.
WORK = re.compile(r"\S*taxel-\w+/|data\.table: ")


#: Path, names of columns, and lines.
Table = tuple[str, list[str], np.ndarray]


class TaxelWarning(UserWarning):
    """A note or a warning of a command."""


def call(arguments: Sequence[object], *, tables: Sequence[Table] = (), warn: bool = True) -> dict[str, Any]:
    """Result of a command of `taxel`, as its `--json` has it. Its remarks become warnings."""
    try:
        text, remarks = _native.call([str(argument) for argument in arguments], list(tables))
    except (ValueError, RuntimeError) as error:
        said = WORK.sub("", str(error)).split("\n\nFor more information")[0]
        raise type(error)(said) from None
    for remark in remarks if warn else []:
        warnings.warn(WORK.sub("", remark).replace("data.table", "the data"), TaxelWarning, stacklevel=3)
    return json.loads(text) if text else {}


def option(name: str, value: object) -> list[object]:
    """An option of a command: none for None and False, alone for True, with commas for several values."""
    if value is None or value is False:
        return []
    if value is True:
        return [name]
    if isinstance(value, (list, tuple, np.ndarray)):
        return [f"{name}={','.join(str(it) for it in value)}"]
    return [f"{name}={value}"]


@contextmanager
def folder() -> Iterator[Path]:
    """A folder for files of one call."""
    with tempfile.TemporaryDirectory(prefix="taxel-") as path:
        yield Path(path)


def two_dimensional(values: ArrayLike, what: str) -> np.ndarray:
    """Numbers as lines of float64, one after the other in memory."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim == 1 and what == "y":
        array = array[:, np.newaxis]
    if array.ndim != 2:
        raise ValueError(f"{what} has {array.ndim} dimensions: give lines × columns")
    return array


def table(path: str, columns: dict[str, np.ndarray]) -> Table:
    """A table that a command reads where `path` is among its arguments."""
    return path, list(columns), np.ascontiguousarray(np.column_stack(list(columns.values())), dtype=np.float64)
