"""Makes the log of a mat with 16 x 16 cells, for docs/gallery.md: python3 docs/mat.py > out/mat.csv

Ten minutes at 25 frames a second, in counts of a 12-bit converter. Presses of 1 to 2 seconds at random places, of 2 to
20 N, with pauses between them. x_mm and y_mm are empty while nothing touches. One cell is dead, the others' gains drift
by about 3 % in ten minutes, and noise is 2 counts. The same bytes each time.

With --bound it prints the Cramér-Rao bound instead: the least RMSE of any unbiased decoder of single frames, in the last
two minutes. It is of a decoder that knows all of the mat but the place and the force of a touch.
"""

import math
import random
import sys

ROWS, COLUMNS, PITCH_MM = 16, 16, 4.0
RATE_HZ, SECONDS = 25, 600
DEAD = 37
NOISE, FORCE_NOISE_N = 2.0, 0.02

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


def touches():
    """Time (s), force (N), x and y (mm) of each line; force is 0 while nothing touches."""
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
        yield time, force, x, y


def level(cell, time, force, x, y):
    """Counts of a cell without noise."""
    m, k = divmod(cell, COLUMNS)
    distance2 = (k * PITCH_MM - x) ** 2 + (m * PITCH_MM - y) ** 2
    pressure = force * math.exp(-distance2 / (2 * 5.0**2))
    return rest[cell] * (1 + drift[cell] * time / SECONDS) * (1 + 0.25 * pressure / (1 + 0.05 * pressure))


def log():
    names = ["time_s", *(f"adc_{cell}" for cell in cells), "x_mm", "y_mm", "force_N"]
    print(",".join(names))
    for time, force, x, y in touches():
        counts = []
        for cell in cells:
            value = level(cell, time, force, x, y) + draw.gauss(0, NOISE)
            counts.append(0 if cell == DEAD else min(4095, max(0, round(value))))
        measured = force + draw.gauss(0, FORCE_NOISE_N)
        place = f"{x:.2f},{y:.2f}" if force > 0.05 else ","
        print(f"{time:.2f}", *counts, place, f"{measured:.3f}", sep=",")


def variances(time, *touch):
    """Least variances of force, x and y of one frame: the diagonal of the inverse of its information."""
    step = 1e-4
    information = [[0.0] * 3 for _ in touch]
    for cell in cells:
        slopes = []
        for at in range(3):
            less, more = ([t + sign * step * (i == at) for i, t in enumerate(touch)] for sign in (-1, 1))
            slopes.append((level(cell, time, *more) - level(cell, time, *less)) / (2 * step))
        for i in range(3):
            for j in range(3):
                # Rounding to whole counts is noise, too.
                information[i][j] += (cell != DEAD) * slopes[i] * slopes[j] / (NOISE**2 + 1 / 12)
    (a, b, c), (_, d, e), (_, _, f) = information
    minors = [d * f - e * e, a * f - c * c, a * d - b * b]
    determinant = a * minors[0] - b * (b * f - c * e) + c * (b * e - c * d)
    return [minor / determinant for minor in minors]


def bound():
    held_out = list(touches())[RATE_HZ * SECONDS * 4 // 5 :]
    least = [variances(*touch) for touch in held_out if touch[1] > 0]
    force, x, y = (sum(of_frames) / len(least) for of_frames in zip(*least))
    print(f"bound: {math.sqrt(x):.5f} mm, {math.sqrt(y):.5f} mm, {math.sqrt(force + FORCE_NOISE_N**2):.5f} N")


if __name__ == "__main__":
    sys.exit(bound() if sys.argv[1:] == ["--bound"] else log())
