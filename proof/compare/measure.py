"""What the subjects share: timing Python's side, and reading what criterion measured on Rust's."""

import json
import os
import statistics
import subprocess
import time
from pathlib import Path
from typing import Callable, NamedTuple

ROOT = Path(__file__).resolve().parents[2]


class Seconds(NamedTuple):
    """How long work takes: the median of its runs, and the fastest, the least disturbed by other work."""

    median: float
    fastest: float

    def over(self, count: int) -> "Seconds":
        """Of one in `count` equal parts."""
        return Seconds(self.median / count, self.fastest / count)


class Row(NamedTuple):
    """One line of the table: the same work on both sides."""

    work: str
    reference: str
    reference_s: Seconds
    taxel_s: Seconds


def timed(work: Callable[[], object], repeats: int = 9) -> Seconds:
    """The time of `work`, after one call that is not timed."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return Seconds(statistics.median(times), min(times))


def fastest_of(taken: dict[int, Seconds]) -> tuple[int, Seconds]:
    """The way with the lowest median, and that median with the fastest run of any."""
    best = min(taken, key=taken.get)
    return best, Seconds(taken[best].median, min(seconds.fastest for seconds in taken.values()))


def bench(name: str) -> None:
    """Runs one of the benches of the package `benchmarks`; its log goes to stderr."""
    command = ["cargo", "bench", "--quiet", "--package", "benchmarks", "--bench", name]
    subprocess.run(command, cwd=ROOT, check=True, stdout=2)


def by_criterion(benchmark: str) -> Seconds:
    """What criterion measured of a benchmark called `group/name`: its samples, each a mean of some runs."""
    sample = target_folder() / "criterion" / benchmark / "new" / "sample.json"
    runs = json.loads(sample.read_text())
    times = [total * 1e-9 / count for total, count in zip(runs["times"], runs["iters"])]
    return Seconds(statistics.median(times), min(times))


def target_folder() -> Path:
    """Where cargo puts what it builds."""
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
