"""Joins readings and truth from two files, each with its own clock: python3 docs/join.py readings.csv scale.csv log.csv

It needs pandas. It finds by how much one clock is ahead: where the touch that the readings show is most like the force.
Both files need the time in a column TIME, the second the force in a column TRUTH: change these names to yours.
"""

import sys

import numpy as np
import pandas as pd

TIME, TRUTH, STEP_S = "time_s", "force_n", 0.01

if len(sys.argv) != 4:
    sys.exit(__doc__)
board, scale = pd.read_csv(sys.argv[1]), pd.read_csv(sys.argv[2]).dropna(subset=TRUTH)
readings = board.drop(columns=TIME)
touch = (readings / readings.median() - 1).abs().sum(axis="columns")


def signal(log, values):
    """Values on an even grid of times, about their mean."""
    grid = np.arange(log[TIME].iloc[0], log[TIME].iloc[-1], STEP_S)
    values = np.interp(grid, log[TIME], values)
    return values - values.mean()


touches, forces = signal(board, touch), signal(scale, scale[TRUTH])
size = len(touches) + len(forces)
alike = np.fft.irfft(np.fft.rfft(touches, size) * np.fft.rfft(forces, size).conj(), size)
steps = int(alike.argmax())
steps -= size if steps >= len(touches) else 0
ahead_s = board[TIME].iloc[0] - scale[TIME].iloc[0] + steps * STEP_S

outside = {"left": np.nan, "right": np.nan}
joined = board.copy()
for name in scale.columns.drop(TIME):
    joined[name] = np.interp(board[TIME], scale[TIME] + ahead_s, scale[name], **outside)
joined = joined.dropna(subset=TRUTH)
joined.to_csv(sys.argv[3], index=False)
print(f"{len(joined)} lines; the clock of {sys.argv[1]} is {ahead_s:.3f} s ahead")
