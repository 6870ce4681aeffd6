"""Scripts of the docs."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

DOCS = Path(__file__).parents[2] / "docs"


def force(times):
    """Uneven presses of half a second each."""
    random = np.random.default_rng(1)
    starts, heights = np.cumsum(random.uniform(0.7, 2, 150)), random.uniform(1, 5, 150)
    along = (times[:, None] - starts) / 0.5
    return (heights * np.sin(np.pi * np.clip(along, 0, 1))).sum(axis=1)


@pytest.mark.parametrize("ahead_s", [2.5, -1000.237, 1.7e9])
def test_two_logs_are_joined_and_their_lag_is_found(tmp_path, ahead_s):
    random = np.random.default_rng(2)
    times = np.arange(20, 120, 0.015) + random.uniform(0, 0.003, 6667)
    readings = {
        f"r1c{column}_ohm": 60 / (1 + gain * force(times)) + random.normal(0, 0.1, len(times))
        for column, gain in enumerate((0.05, 0.1, 0.02), 1)
    }
    pd.DataFrame({"time_s": times + ahead_s, **readings}).to_csv(tmp_path / "readings.csv", index=False)
    of_scale = np.arange(5, 110, 0.0125)
    truth = force(of_scale)
    place = np.where(truth > 0.05, 3 + truth, np.nan)
    scale = pd.DataFrame({"time_s": of_scale, "x_mm": place, "force_n": truth})
    scale.loc[7::50, "force_n"] = np.nan
    scale.to_csv(tmp_path / "scale.csv", index=False)

    command = [sys.executable, DOCS / "join.py", "readings.csv", "scale.csv", "log.csv"]
    said = subprocess.run(command, cwd=tmp_path, check=True, stdout=subprocess.PIPE, text=True).stdout
    found_s = float(re.search(r"is (\S+) s ahead", said).group(1))
    assert abs(found_s - ahead_s) < 0.01
    log = pd.read_csv(tmp_path / "log.csv")
    assert list(log) == ["time_s", *readings, "x_mm", "force_n"]
    # The scale ends ten seconds before the board.
    assert 5950 < len(log) < 6050
    rest = force(log["time_s"].to_numpy() - ahead_s)
    # Within a step of the grid, the force rises by 0.3 N at most.
    assert np.abs(log["force_n"] - rest).max() < 0.5
    assert log["x_mm"].isna().any() and np.abs(log["x_mm"] - 3 - log["force_n"]).max() < 1e-6


def test_each_press_is_asked_for_and_recorded_with_its_truth(tmp_path):
    taxel = tmp_path / "taxel"
    taxel.write_text("""#!/bin/sh
for file; do :; done
printf 'r1c1_ohm,r1c2_ohm,r1c3_ohm\\n50,60,\\n51,,\\n' > "$file"
""")
    taxel.chmod(0o755)
    (tmp_path / "presses.csv").write_text("x_mm,force_n\n8,2\n,0\n")
    command = [sys.executable, DOCS / "presses.py", "presses.csv", "PORT", "log.csv", "1x2"]
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    streams = {"input": "\n\n", "stdout": subprocess.PIPE, "text": True}
    said = subprocess.run(command, cwd=tmp_path, env=environment, check=True, **streams).stdout
    assert said.count("open or shorted: r1c2_ohm\n") == 2
    first, *lines = (tmp_path / "log.csv").read_text().split()
    assert first == "r1c1_ohm,r1c2_ohm,x_mm,force_n"
    assert sorted(lines) == ["50,60,,0", "50,60,8,2", "51,,,0", "51,,8,2"]
