"""Makes the log of a mat of another kind than mat.py's: python3 docs/mats.py KIND [--day 2] > out/KIND.csv

- `coarse`: 10 x 10 cells, whose pitch is larger than the dent;
- `hysteresis`: 16 x 16 cells that lag behind the load, and share their column's supply;
- `uneven`: 8 x 8 cells, whose gains differ by 30 %; six are dead;
- `fine`: 32 x 32 cells under a small dent, with noise that all cells share.

Five minutes at 25 frames a second, in counts of a 12-bit converter. Presses rise from nothing to 2 to 20 N, slide by
some millimetres and end. x_mm and y_mm are empty while nothing touches. On day 2 the same mat has other rest levels,
gains that have changed by 3 %, a dent that is wider by a tenth, and other presses. The same bytes each time.
"""

import argparse
import math
import random
from collections import namedtuple

Kind = namedtuple("Kind", "side pitch_mm dent_mm gain_spread dead play_N sag shared_noise")
KINDS = {
    "coarse": Kind(10, 10.0, 4.0, 0.05, 0, 0.0, 0.0, 0.0),
    "hysteresis": Kind(16, 6.0, 7.0, 0.10, 0, 0.25, 0.03, 0.0),
    "uneven": Kind(8, 8.0, 8.0, 0.30, 6, 0.0, 0.0, 0.0),
    "fine": Kind(32, 2.5, 4.0, 0.05, 10, 0.0, 0.0, 1.5),
}
RATE_HZ, SECONDS = 25, 300
NOISE, FULL = 2.0, 4095


class Mat:
    """Cells as they are on one day."""

    def __init__(self, kind, day):
        made = random.Random(1)  # the same mat on each day
        cells = range(kind.side**2)
        self.kind = kind
        self.draw = random.Random(1 + day)
        self.rest = [made.uniform(350, 650) for _ in cells]
        self.gain = [100 * math.exp(made.gauss(0, kind.gain_spread)) for _ in cells]
        self.dead = set(made.sample(cells, kind.dead))
        self.dent_mm = kind.dent_mm
        if day > 1:
            self.rest = [rest * self.draw.gauss(1, 0.03) for rest in self.rest]
            self.gain = [gain * self.draw.gauss(1, 0.03) for gain in self.gain]
            self.dent_mm *= 1.1
        self.drift = [self.draw.gauss(0.01, 0.005) for _ in cells]
        self.felt = [0.0 for _ in cells]

    def presses(self):
        """Start, length (s), x, y (mm), peak force (N) and slide along x and y (mm) of each press."""
        extent = (self.kind.side - 1) * self.kind.pitch_mm
        time = 1.0
        while time < SECONDS:
            length = self.draw.uniform(1.0, 2.0)
            place = [self.draw.uniform(0.06, 0.94) * extent for _ in "xy"]
            yield time, length, *place, self.draw.uniform(2, 20), *(self.draw.gauss(0, 2) for _ in "xy")
            time += length + self.draw.uniform(0.3, 1.2)

    def load(self, cell, pressure):
        """Load that a cell feels: it lags behind `pressure` by some play, and creeps back."""
        play = self.kind.play_N
        self.felt[cell] = min(max(0.98 * self.felt[cell], pressure - play), pressure + play)
        return self.felt[cell]

    def frame(self, time, force, x, y):
        """Counts of all cells."""
        side, pitch = self.kind.side, self.kind.pitch_mm
        # Soft material: a stronger press makes a wider dent.
        width2 = 2 * (self.dent_mm * (1 + 0.01 * force)) ** 2
        across, along = ([math.exp(-((k * pitch - at) ** 2) / width2) for k in range(side)] for at in (x, y))
        loads = [self.load(cell, force * along[cell // side] * across[cell % side]) for cell in range(side**2)]
        felt = [load / (1 + 0.04 * load) for load in loads]
        supply = [1 / (1 + self.kind.sag * sum(felt[column::side])) for column in range(side)]
        shared = self.draw.gauss(0, self.kind.shared_noise)
        for cell in range(side**2):
            rest = self.rest[cell] * (1 + self.drift[cell] * time / SECONDS)
            value = rest + self.gain[cell] * felt[cell] * supply[cell % side] + shared + self.draw.gauss(0, NOISE)
            yield 0 if cell in self.dead else min(FULL, max(0, round(value)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--day", type=int, default=1)
    given = parser.parse_args()
    mat = Mat(KINDS[given.kind], given.day)
    print("time_s", *(f"adc_{cell}" for cell in range(mat.kind.side**2)), "x_mm", "y_mm", "force_N", sep=",")
    coming = list(mat.presses())
    for line in range(RATE_HZ * SECONDS):
        time = line / RATE_HZ
        if len(coming) > 1 and sum(coming[0][:2]) < time:
            coming.pop(0)
        start, length, x, y, peak, right, up = coming[0]
        part = (time - start) / length
        force = peak * math.sin(math.pi * part) ** 2 if 0 <= part <= 1 else 0.0
        x, y = x + right * (part - 0.5), y + up * (part - 0.5)
        place = f"{x:.2f},{y:.2f}" if force > 0.05 else ","
        print(f"{time:.2f}", *mat.frame(time, force, x, y), place, f"{force + mat.draw.gauss(0, 0.02):.3f}", sep=",")


if __name__ == "__main__":
    main()
