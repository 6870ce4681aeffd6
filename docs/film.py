"""Makes a moving picture (SVG) of a log and its estimates: python3 film.py rest.csv log.csv estimate.csv film.svg

The log is `taxel synth`'s, of a scene whose outputs are the compression of the paper's 6 x 8 upper electrodes; the estimate is
what `taxel decode` makes of it; rest is the log of the untouched sensor. Three maps play in real time: readings (how far below rest), decoded, and true.
"""

import csv
import sys

ROWS, COLUMNS, ELECTRODES = 8, 18, 6
CELL, GAP, TOP = [16, 44], 28, 42
WIDTH = COLUMNS * CELL[0]


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def column(lines, name):
    return [float(line[name]) for line in lines]


def cells(lines, columns, name, value):
    """Values over time of each cell, by row and column (from 1)."""
    return {
        (row, at): value(column(lines, name.format(row, at)))
        for row in range(1, ROWS + 1)
        for at in range(1, columns + 1)
    }


def panel(left, heading, cells, columns, full, colour, seconds):
    width = WIDTH / columns
    parts = [f'<text x="{left}" y="28">{heading}</text>']
    for (row, at), series in cells.items():
        shown = ["%.2g" % min(1.0, max(0.0, value / full)) for value in series]
        x, y = left + (at - 1) * width, TOP + (ROWS - row) * 34
        rect = f'<rect x="{x:g}" y="{y}" width="{width - 1:g}" height="33"'
        parts.append(f'{rect} class="face"/>')
        parts.append(
            f'{rect} fill="{colour}" fill-opacity="{shown[0]}"><animate attributeName="fill-opacity" '
            f'calcMode="discrete" dur="{seconds:g}s" repeatCount="indefinite" values="{";".join(shown)}"/></rect>'
        )
    return parts


def main(rest_path, log_path, estimate_path, picture_path):
    log, estimate = table(log_path), table(estimate_path)
    times = column(log, "time_s")
    seconds = (times[-1] - times[0]) * len(times) / (len(times) - 1)
    plain = lambda series: series
    rest = cells(table(rest_path), COLUMNS, "r{}c{}_ohm", lambda series: sum(series) / len(series))
    ohm = cells(log, COLUMNS, "r{}c{}_ohm", plain)
    readings = {cell: [1.0 - value / rest[cell] for value in series] for cell, series in ohm.items()}
    decoded = cells(estimate, ELECTRODES, "r{}e{}_dz_mm", plain)
    true = cells(log, ELECTRODES, "r{}e{}_dz_mm", plain)
    most = lambda cells: max(max(series) for series in cells.values())
    full = most(true)
    step = WIDTH + GAP
    parts = panel(0, f"readings, 0 to {100 * most(readings):.0f} % below rest", readings, COLUMNS, most(readings), "#d9730d", seconds)
    parts += panel(step, f"decoded, 0 to {full:.1f} mm", decoded, ELECTRODES, full, "#1f6fc4", seconds)
    parts += panel(2 * step, "true", true, ELECTRODES, full, "#1f6fc4", seconds)
    style = (
        "text{font:15px system-ui,sans-serif;fill:#333}.face{fill:#8884}"
        "@media(prefers-color-scheme:dark){text{fill:#ddd}}"
    )
    size = f"0 0 {3 * WIDTH + 2 * GAP} {TOP + ROWS * 34}"
    with open(picture_path, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{size}" role="img"><style>{style}</style>\n')
        file.write("\n".join(parts) + "\n</svg>\n")


if len(sys.argv) != 5:
    sys.exit(__doc__)
main(*sys.argv[1:])
