"""What the subjects share: timing Python's side, and reading what criterion measured on Rust's."""

import json
import os
import statistics
import subprocess
import time
from pathlib import Path
from typing import Callable, NamedTuple

ROOT = Path(__file__).resolve().parent.parent


class Row(NamedTuple):
    """One line of the table: the same work on both sides."""

    work: str
    reference: str
    reference_s: float
    taxel_s: float


def median_s(work: Callable[[], object], repeats: int = 9) -> float:
    """The median time of `work` in seconds, after one call that is not timed."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def bench(name: str) -> None:
    """Runs one of the benches of the package `benchmarks`; its log goes to stderr."""
    command = ["cargo", "bench", "--quiet", "--package", "benchmarks", "--bench", name]
    subprocess.run(command, cwd=ROOT, check=True, stdout=2)


def criterion_s(benchmark: str) -> float:
    """Criterion's median for a benchmark called `group/name`, in seconds."""
    estimates = target_folder() / "criterion" / benchmark / "new" / "estimates.json"
    return json.loads(estimates.read_text())["median"]["point_estimate"] * 1e-9


def target_folder() -> Path:
    """Where cargo puts what it builds."""
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
