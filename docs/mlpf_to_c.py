# %% [markdown]
# From real presses to C, in twenty lines: the fingertip of docs/gallery.md.
# Cells as Jupyter (jupytext), VS Code and Spyder take them; or `python docs/mlpf_to_c.py mlpf.csv`.
# It needs `pip install taxel pandas matplotlib`.

# %%
import sys

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import taxel

presses = pd.read_csv(sys.argv[1] if sys.argv[1:] else "mlpf.csv")  # 12 channels, then force in N and place in mm
channels, truth = presses.filter(like="ch"), presses[["fx_n", "fy_n", "fz_n", "x_mm", "y_mm"]]
places = (presses.x_mm.round() + 7 * presses.y_mm.round()) % 5  # presses at one place share a fold
known = places != 4

# %%
model = taxel.Model(centres=64, format="fixed16")
model.fit(channels[known], truth[known], groups=places[known])
estimate = model.predict(channels[~known])
rmse = np.sqrt(np.mean((estimate - truth[~known]) ** 2, axis=0))
model.export_c("fingertip-c", "fingertip")  # fingertip.h, fingertip.c, and a library for Arduino, PlatformIO, CMake, Zephyr

# %%
figure, panels = plt.subplots(1, 5, figsize=(13, 2.9), layout="constrained")
for panel, name, true, told in zip(panels, truth, truth[~known].to_numpy().T, estimate.T):
    quantity, unit = name.split("_")
    panel.plot(true, told, ".", markersize=2, alpha=0.3)
    panel.axline((true.min(), true.min()), slope=1, color="grey", linewidth=0.8)
    panel.set(title=f"{quantity}: {rmse[name]:.2f} {unit.upper() if unit == 'n' else unit}", xlabel="true", box_aspect=1)
panels[0].set_ylabel("decoded")
figure.suptitle("Presses at places that the model has never seen: RMSE")
figure.savefig("mlpf.png", dpi=110)
