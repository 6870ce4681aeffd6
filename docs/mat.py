"""Makes the log of a mat with 16 x 16 cells, for docs/gallery.md: python3 docs/mat.py > out/mat.csv

Ten minutes at 25 frames a second, in counts of a 12-bit converter. Presses of 1 to 2 seconds at random places, of 2 to
20 N, with pauses between them. x_mm and y_mm are empty while nothing touches. One cell is dead, the others' gains drift
by about 3 % in ten minutes, and noise is 2 counts. The same bytes each time.
"""

import math
import random
import sys

ROWS, COLUMNS, PITCH_MM = 16, 16, 4.0
RATE_HZ, SECONDS = 25, 600
DEAD = 37

draw = random.Random(1)
cells = range(ROWS * COLUMNS)
rest = [draw.uniform(350, 650) for _ in cells]
drift = [draw.gauss(0.03, 0.015) for _ in cells]


def presses():
    """Start, length (s), x, y (mm) and peak force (N) of each press."""
    time = 1.0
    while time < SECONDS:
        length = draw.uniform(1.0, 2.0)
        place = [draw.uniform(4, (n - 1) * PITCH_MM - 4) for n in (COLUMNS, ROWS)]
        yield time, length, *place, draw.uniform(3, 20)
        time += length + draw.uniform(0.2, 1.0)


def main():
    names = ["time_s", *(f"adc_{cell}" for cell in cells), "x_mm", "y_mm", "force_N"]
    print(",".join(names))
    coming = list(presses())
    at = 0
    for line in range(RATE_HZ * SECONDS):
        time = line / RATE_HZ
        while at < len(coming) and coming[at][0] + coming[at][1] < time:
            at += 1
        force, x, y = 0.0, 0.0, 0.0
        if at < len(coming) and coming[at][0] <= time:
            start, length, x, y, peak = coming[at]
            force = 2 + (peak - 2) * math.sin(math.pi * (time - start) / length) ** 2
        touched = force > 0.05
        counts = []
        for cell in cells:
            m, k = divmod(cell, COLUMNS)
            distance2 = (k * PITCH_MM - x) ** 2 + (m * PITCH_MM - y) ** 2
            pressure = force * math.exp(-distance2 / (2 * 5.0**2))
            value = rest[cell] * (1 + drift[cell] * time / SECONDS) * (1 + 0.25 * pressure / (1 + 0.05 * pressure))
            value += draw.gauss(0, 2.0)
            counts.append(0 if cell == DEAD else min(4095, max(0, round(value))))
        measured = force + draw.gauss(0, 0.02)
        place = f"{x:.2f},{y:.2f}" if touched else ","
        print(f"{time:.2f}", *counts, place, f"{measured:.3f}", sep=",")


if __name__ == "__main__":
    sys.exit(main())
