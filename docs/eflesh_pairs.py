"""Pairs the readings and the truth of eFlesh's recordings by time, for docs/gallery.md: `python eflesh_pairs.py eFlesh`."""

import sys
from pathlib import Path

import pandas as pd

RECORDINGS = {
    "normal-a": "normal_force/20250401_014340_probe",
    "normal-b": "normal_force/20250401_015037_probe",
    "shear": "shear_force/20250416_200533_probe",
    "spatial": "spatial_resolution/20250316_155729_probe",
}
TRUTH = {"b.c2": "x_mm", "b.c3": "y_mm", "b.c5": "weight_g"}


def table(path, before=""):
    """A file without a header, whose columns are called c1, c2, …; −1 stands for a missing value."""
    values = pd.read_csv(path, header=None).replace(-1, None).astype(float)
    return values.set_axis([f"{before}c{column + 1}" for column in values], axis="columns")


for name, folder in RECORDINGS.items():
    folder = Path(sys.argv[1], "characterization/datasets", folder)
    sensor = table(folder / "sensor_post_baselines.csv")
    states = table(folder / "states.csv", "b.").drop_duplicates("b.c1")
    nearest = {"left_on": "c1", "right_on": "b.c1", "direction": "nearest", "tolerance": 0.02}
    pairs = pd.merge_asof(sensor, states, **nearest).dropna(subset="b.c1").rename(columns=TRUTH)
    pairs.to_csv(f"{name}.csv", index=False)
    print(f"{name}: {len(pairs)} of {len(sensor)} lines")
