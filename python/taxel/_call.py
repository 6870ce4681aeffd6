"""Calls of commands, and the files that they read."""

from __future__ import annotations

import json
import re
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taxel import _native


#: Folders of files and names of tables of one call, which only this module knows.
WORK = re.compile(r"\S*taxel-\w+/|data\.table: ")


#: Path, names of columns, and lines.
Table = tuple[str, list[str], np.ndarray]


#: What commands say in words of the command line, and what it is in Python.
WORDS = (
    (re.compile(r"data\.table"), "the data"),
    (re.compile(r" \(--(?:grid|rest|time)\b[^()]*\)"), ""),
    (re.compile(r"--no-refine"), "refine=False"),
    (re.compile(r"--seed"), "random_state"),
    (re.compile(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)"), lambda found: found[1].replace("-", "_")),
)
#: Remarks on what Python does by itself.
OWN = re.compile(r"lines are few for|drift is not checked|^note: the best \w+, |is the \w+ that was tried")


class TaxelWarning(UserWarning):
    """A note or a warning of a command."""


#: Kinds of warnings that were given within scikit-learn.
_given: set[str] = set()


def warn(text: str) -> None:
    """Warns the caller of the module; scikit-learn, which fits many models, gets each kind of warning once."""
    level, frame = 1, sys._getframe(0)
    while frame.f_back and str(frame.f_globals.get("__name__")).startswith("taxel."):
        level, frame = level + 1, frame.f_back
    kind = re.sub(r"[-+.\w]*\d[-+.\w]*", "", text)
    if str(frame.f_globals.get("__name__")).partition(".")[0] in ("sklearn", "joblib"):
        if kind in _given:
            return
        _given.add(kind)
    warnings.warn(in_python(text), TaxelWarning, stacklevel=level)


def in_python(text: str) -> str:
    """Text of a command with options replaced by names of Python."""
    text = WORK.sub("", text)
    for pattern, word in WORDS:
        text = pattern.sub(word, text)
    return text


def call(
    arguments: Sequence[object], *, tables: Sequence[Table] = (), threads: int = 0
) -> dict[str, Any]:
    """Result of a command of `taxel`, as with `--json`. Its remarks become warnings."""
    try:
        text, remarks = _native.call([str(argument) for argument in arguments], list(tables), threads)
    except (ValueError, RuntimeError) as error:
        said = in_python(str(error)).split("\n\nFor more information")[0]
        raise type(error)(said) from None
    for remark in remarks:
        if not OWN.search(remark):
            warn(remark)
    return json.loads(text) if text else {}


def option(name: str, value: object) -> list[object]:
    """Option of a command: absent for None and False, without a value for True, with commas between several values."""
    if value is None or value is False:
        return []
    if value is True:
        return [name]
    if isinstance(value, (list, tuple, np.ndarray)):
        return [f"{name}={','.join(str(it) for it in value)}"]
    return [f"{name}={value}"]


@contextmanager
def folder() -> Iterator[Path]:
    """Folder for the files of one call."""
    with tempfile.TemporaryDirectory(prefix="taxel-") as path:
        yield Path(path)


def two_dimensional(values: ArrayLike, what: str) -> np.ndarray:
    """Numbers as lines of float64, contiguous in memory."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim == 1 and what == "y":
        array = array[:, np.newaxis]
    if array.ndim != 2:
        raise ValueError(f"{what} has {array.ndim} dimensions: give lines × columns")
    return array


def table(path: str, columns: dict[str, np.ndarray]) -> Table:
    """Table that a command reads if `path` is among its arguments."""
    return path, list(columns), np.ascontiguousarray(np.column_stack(list(columns.values())), dtype=np.float64)
