"""Records a log of presses by hand: python3 docs/presses.py presses.csv PORT log.csv [ROWSxCOLUMNS]

presses.csv has a line for each press and a column for each output; an empty field means nothing. The presses are
asked for in random order: `taxel run` holds the last ones out, which then resemble the others.
"""

import csv
import random
import subprocess
import sys

presses_file, port, log_file, shape = (*sys.argv[1:], "8x18")[:4]
rows, columns = map(int, shape.split("x"))
readings = [f"r{row}c{column}_ohm" for row in range(1, rows + 1) for column in range(1, columns + 1)]
record = ["taxel", "link", port, "record", "--frames", "50", "--output", "-", "--quiet"]

with open(presses_file, newline="") as file:
    presses = list(csv.DictReader(file))
random.Random(1).shuffle(presses)
with open(log_file, "w", newline="") as file:
    log = csv.DictWriter(file, [*readings, *presses[0]], extrasaction="ignore")
    log.writeheader()
    for number, press in enumerate(presses, 1):
        truth = ", ".join(f"{name} {value}" for name, value in press.items() if value)
        input(f"{number} of {len(presses)}: {truth}. Press, wait two seconds, then Enter ")
        frames = subprocess.run(record, check=True, stdout=subprocess.PIPE, text=True).stdout
        log.writerows(frame | press for frame in csv.DictReader(frames.splitlines()))
        file.flush()
