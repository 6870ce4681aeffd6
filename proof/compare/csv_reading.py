"""Reading a data file: numpy's C parser against Taxel."""

import subprocess

import numpy as np

from measure import ROOT, Row, bench, by_criterion, target_folder, timed

FRAMES = 4096  # as benchmarks/benches/csv.rs


def rows() -> list[Row]:
    """The same file in both languages: `synth press`, 288 numbers a frame."""
    bench("csv")
    path = target_folder() / "compare.csv"
    arguments = ["synth", "press", "-n", str(FRAMES), "-o", str(path)]
    command = ["cargo", "run", "--quiet", "--release", "--", *arguments]
    subprocess.run(command, cwd=ROOT, check=True, stdout=2)
    megabytes = path.stat().st_size / 1e6
    parse_s = timed(lambda: np.loadtxt(path, delimiter=",", skiprows=1), repeats=3)
    path.unlink()
    return [Row(f"reading {megabytes:.0f} MB of CSV", "numpy.loadtxt", parse_s, by_criterion("csv/read"))]
