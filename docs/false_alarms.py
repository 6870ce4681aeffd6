"""Measures how often each warning is given: python3 docs/false_alarms.py (numpy, and `taxel` on the path)

Sound logs are of two sensors: a mat that `taxel synth` simulates, and a velostat mat with physics of its own, without creep
and with creep that ends within seconds. Faulty logs are the same kinds with a fault each, or with two that different warnings
tell. It prints a line for each warning: how many sound logs it is given for, and how many faulty ones, with Wilson intervals
of 95 %.

python3 docs/false_alarms.py 10 takes ten logs of each kind instead of 20.
"""

import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np

ROOT = pathlib.Path(__file__).parents[1]
LOGS = int(sys.argv[1]) if len(sys.argv) > 1 else 20
RATE_HZ, LINES = 10, 3000
GRID, PITCH_MM = 8, 8.0
DRIFT, OUTLIERS = "drift-at-rest", "outliers"
WORSE, USELESS = "worse-than-baseline", "no-gain-over-mean"
FOLDS, OTHERS = "random-folds-of-a-log", "other-contacts"


def taxel(*arguments):
    done = subprocess.run(["taxel", *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"taxel {arguments}: {done.stderr}")
    return done.stdout


def touches(draw):
    """Force in N and place in mm of a finger that presses, slides a little, and pauses."""
    force, place = np.zeros(LINES), np.zeros((LINES, 2))
    at = 20
    while at < LINES:
        line = np.arange(at, min(LINES, at + draw.integers(10, 25)))
        along = (line - at) / 24
        force[line] = draw.uniform(2, 15) * np.minimum(1, 6 * along) * np.minimum(1, 6 * (along[-1] - along))
        place[line] = draw.uniform(6, GRID * PITCH_MM - 6, 2) + np.outer(along, draw.uniform(-8, 8, 2))
        at += len(line) + draw.integers(5, 30)
    return force, place


def velostat(seed, creep):
    """Counts of a 10-bit converter: cells in a divider with a fixed resistor, pressed by a round finger under a soft cover."""
    sensor, draw = np.random.default_rng(1), np.random.default_rng(seed)
    force, place = touches(draw)
    centres = (np.arange(GRID) + 0.5) * PITCH_MM
    x, y = np.tile(centres, GRID), np.repeat(centres, GRID)
    sensitivity, rest = np.exp(sensor.normal(0, 0.25, (2, GRID * GRID))) * [[0.05], [0.15]]
    radius = 7 + 1.5 * np.cbrt(force)[:, None]
    distance2 = (x - place[:, :1]) ** 2 + (y - place[:, 1:]) ** 2
    pressure = force[:, None] * np.maximum(0, 1 - distance2 / (1.6 * radius) ** 2) ** 2
    strain = pressure.copy()
    for size, seconds in ((0.15, 0.3), (0.1, 1.5)) if creep else ():
        slow, kept = np.zeros(GRID * GRID), math.exp(-1 / (RATE_HZ * seconds))
        for line in range(LINES):
            slow = kept * slow + (1 - kept) * pressure[line]
            strain[line] += size * (slow - pressure[line])
    conductance = rest + sensitivity * strain / (1 + 0.03 * strain)
    conductance = conductance + 0.01 * conductance.reshape(LINES, GRID, GRID).mean(2).repeat(GRID, 1)
    counts = 1023 * conductance / (1 + conductance) + draw.normal(0, 0.8, conductance.shape)
    names = [f"adc_{cell}" for cell in range(GRID * GRID)]
    return names, np.clip(np.rint(counts), 0, 1023), force, place


def simulated(seed, folder):
    """A mat by `synth`, in ohm."""
    file = folder / "synth.csv"
    taxel("synth", ROOT / "scenes/mat.toml", "-n", LINES, "--frame-rate", RATE_HZ, "--seed", seed, "-q", "-o", file)
    with open(file) as text:
        names, *lines = csv.reader(text)
    values = np.array([[float(field or "nan") for field in line] for line in lines])
    return names[2:-3], values[:, 2:-3], values[:, -1], values[:, -3:-1]


def log(kind, seed, folder):
    return simulated(seed, folder) if kind == "taxel" else velostat(seed, kind == "creep")


def write(file, log, more=(), lines=slice(None)):
    """Writes `lines` of a log whose places are empty while little touches, with `more` outputs by name; returns options."""
    names, readings, force, place = log
    measured = force + np.random.default_rng(7).normal(0, 0.005, LINES)
    rows = [["time_s", *names, "x_mm", "y_mm", "force_n", *dict(more)]]
    for line in np.arange(LINES)[lines]:
        at = [f"{value:.2f}" for value in place[line]] if force[line] > 0.2 else ["", ""]
        others = [f"{values[line]:.4f}" for values in dict(more).values()]
        rows.append([line / RATE_HZ, *(f"{it:.6g}" for it in readings[line]), *at, f"{measured[line]:.3f}", *others])
    with open(file, "w") as out:
        csv.writer(out).writerows(rows)
    return [file, "--inputs", f"{names[0][0]}*", "--outputs", ",".join(["x_mm", "y_mm", "force_n", *dict(more)]), "--no-refine"]


def warned(*arguments):
    """Warnings of a command: texts by name, and RMSE by decoder and output."""
    result = json.loads(taxel(*arguments, "--json", "-q"))
    errors = {it["decoder"]: {of["group"]: of["rmse"] for of in it["errors"]} for it in result.get("decoders", [])}
    return {it["name"]: it["text"] for it in result["verdict"]["warnings"]}, errors


def drifting(log, draw):
    """The log with gains that drift by 4 to 12 %, each a bit differently: straight, levelling off, or to and fro."""
    names, readings, *rest = log
    time = np.linspace(0, 1, LINES)[:, None]
    curve = [time, 1 - np.exp(-4 * time), np.sin(3 * time)][draw.integers(3)]
    size = draw.uniform(0.04, 0.12) * draw.choice([-1, 1])
    return names, readings * (1 + size * curve * draw.normal(1, 0.3, readings.shape[1])), *rest


def garbled(readings, draw):
    """Readings of which one to three are far from all others."""
    readings = readings.copy()
    for line in draw.choice(LINES * 4 // 5, draw.integers(1, 4), replace=False):
        readings[line, draw.integers(readings.shape[1])] = readings.max() * draw.uniform(10, 1000)
    return readings


def unrelated(draw):
    """Output that nothing tells: it changes within seconds."""
    values = draw.normal(0, 1, LINES)
    for line in range(1, LINES):
        values[line] = 0.98 * values[line - 1] + 0.2 * values[line]
    return values


def of_log(kind, seed, folder):
    """What a sound log of this kind and faulty ones are warned of: (warning, whether it is due, whether it is given)."""
    draw, found = np.random.default_rng(seed), []
    sound, later = log(kind, seed, folder), log(kind, seed + 1000, folder)
    names, readings, force, place = sound

    def told_of(warning, due, told, outputs=None):
        text = told.get(warning, ":").split(":")[0].split(", ")
        found.append((warning, due, warning in told if outputs is None else any(it in text for it in outputs)))

    def run(file, *options):
        return warned("run", *file, *options, "-o", folder / "out")

    # Many later lines tell whether a simpler decoder is better indeed.
    write(folder / "later.csv", later)
    whole, first = write(folder / "log.csv", sound), write(folder / "first.csv", sound, lines=slice(LINES * 4 // 5))
    for is_due, options in ((False, []), (True, ["--features", "1", "--features-kind", "plain"])):
        told, _ = run(whole, *options)
        _, truth = run(first, *options, "--test", folder / "later.csv")
        least = {it: min(truth[by][it] for by in ("linear", "centroid") if by in truth) for it in truth["network"]}
        shares = {it: truth["network"][it] / least[it] for it in least}
        told_of(WORSE, is_due, told, [it for it, share in shares.items() if (share > 1.2 if is_due else share < 1)])
        if not is_due:
            for warning in (DRIFT, OUTLIERS, USELESS):
                told_of(warning, False, told)

    told_of(DRIFT, True, run(write(folder / "drift.csv", drifting(sound, draw)))[0])
    broken = (names, garbled(readings, draw), force, place)
    told, _ = run(write(folder / "broken.csv", broken, {"unrelated": unrelated(draw)}))
    told_of(OUTLIERS, True, told)
    told_of(USELESS, True, told, ["unrelated"])

    heading, *lines = (folder / "log.csv").read_text().splitlines(keepends=True)
    (folder / "shuffled.csv").write_text(heading + "".join(draw.permutation(lines)))
    for due, file in ((True, "log.csv"), (False, "shuffled.csv")):
        options = ["--folds", 5, "--reading-model", "full", "--centres", 8, "-o", folder / "folds.bin"]
        told_of(FOLDS, due, warned("train", folder / file, *whole[1:], *options)[0])
    return found


def of_scene(seed, folder):
    """The same of a scene whose contacts are judged beside others that are like them, and others that are much wider."""
    scene = (ROOT / "scenes/press.toml").read_text().replace("[2.0, 5.0]", "[2.0, 3.0]")
    for name, radius in (("alike", "[2.0, 3.0]"), ("wide", "[5.0, 7.0]")):
        scene += f'[[others]]\nname = "{name}"\nkind = "press"\ndent_radius_mm = {radius}\n'
        scene += "dent_depth_mm = [0.0, 1.0]\nshear_ratio = [0.0, 0.5]\n"
    (folder / "scene.toml").write_text(scene)
    told, _ = warned("run", folder / "scene.toml", "-n", 2000, "--no-refine", "--centres", 32, "--seed", seed, "-o", folder)
    text = told.get(OTHERS, "")
    return [(OTHERS, False, "alike (" in text), (OTHERS, True, "wide (" in text)]


def of_case(case):
    kind, seed = case
    with tempfile.TemporaryDirectory() as folder:
        return of_scene(seed, pathlib.Path(folder)) if kind == "scene" else of_log(kind, seed, pathlib.Path(folder))


def interval(count, of):
    """Count of so many, and Wilson's interval of 95 % for its share in per cent."""
    if of == 0:
        return "–"
    share, z2 = count / of, 1.96**2
    middle, half = share + z2 / 2 / of, 1.96 * math.sqrt(share * (1 - share) / of + z2 / 4 / of**2)
    low, high = (100 * max(0, middle + sign * half) / (1 + z2 / of) for sign in (-1, 1))
    return f"{count} of {of} ({low:.0f}–{high:.0f} %)"


def main():
    cases = [(kind, seed) for seed in range(1, LOGS + 1) for kind in ("taxel", "velostat", "creep")]
    cases += [("scene", seed) for seed in range(1, 3 * LOGS + 1)]
    counts = {}
    with ThreadPoolExecutor(2) as pool:
        for done, found in enumerate(pool.map(of_case, cases), 1):
            for warning, due, given in found:
                count = counts.setdefault(warning, {False: [0, 0], True: [0, 0]})[due]
                count[0], count[1] = count[0] + given, count[1] + 1
            print(f"{done} of {len(cases)}", {it: list(of.values()) for it, of in counts.items()}, file=sys.stderr)
    print("| warning | false alarms | hits |\n|---|--:|--:|")
    for warning, count in counts.items():
        print(f"| {warning} | {interval(*count[False])} | {interval(*count[True])} |")


if __name__ == "__main__":
    main()
