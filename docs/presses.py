"""Records a log of presses by hand: python3 docs/presses.py presses.csv PORT log.csv [ROWSxCOLUMNS]

presses.csv has a line for each press and a column for each output; an empty field means nothing. The presses are
asked for in random order: `taxel run` holds the last ones out, which then resemble the others.
"""

import csv
import random
import subprocess
import sys
import tempfile
from pathlib import Path

if len(sys.argv) not in (4, 5):
    sys.exit(__doc__)
presses_file, port, log_file, shape = (*sys.argv[1:], "8x18")[:4]
rows, columns = map(int, shape.split("x"))
readings = [f"r{row}c{column}_ohm" for row in range(1, rows + 1) for column in range(1, columns + 1)]


def record():
    """Some frames, as the board scans them now."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "frames.csv")
        command = ["taxel", "link", port, "record", "--frames", "50", "--quiet", "--output", path]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        with path.open(newline="") as file:
            return list(csv.DictReader(file))


with open(presses_file, newline="") as file:
    presses = list(csv.DictReader(file))
random.Random(1).shuffle(presses)
with open(log_file, "w", newline="") as file:
    log = csv.DictWriter(file, [*readings, *presses[0]], extrasaction="ignore")
    log.writeheader()
    for number, press in enumerate(presses, 1):
        truth = ", ".join(f"{name} {value}" for name, value in press.items() if value)
        input(f"{number} of {len(presses)}: {truth}. Press, wait two seconds, then Enter ")
        frames = record()
        missing = [name for name in readings if any(not frame[name] for frame in frames)]
        if missing:
            print("open or shorted:", *missing)
        log.writerows(frame | press for frame in frames)
        file.flush()
