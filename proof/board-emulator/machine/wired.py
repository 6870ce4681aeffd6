"""Which row and which columns are at the NUCLEO's pins, traced through the nets of docs/circuit-nets.csv."""

import csv
import pathlib

NETS = pathlib.Path(__file__).parents[3] / "docs" / "circuit-nets.csv"


def traced():
    """Rows by pin of port B, the pin of the select lines, and by pin the columns when that is low and high."""
    net, pins = {}, {}
    with NETS.open(encoding="utf8", newline="") as file:
        for name, part, _, pin in csv.reader(file):
            net[part, pin] = name
            pins.setdefault(name, []).append((part, pin))

    def at(name, *wanted):
        """The one part that has a pin of a wanted name on a net, and that pin's name."""
        found = [(part, pin) for part, pin in pins[name] if pin in wanted]
        if len(found) != 1:
            raise ValueError(f"{NETS.name}: net {name} has {len(found)} of {', '.join(wanted)}")
        return found[0]

    def column(output):
        """The column whose wire is at − of the op-amp with this output."""
        part, pin = at(output, "OUTA", "OUTB", "OUTC", "OUTD")
        wire = net[part, f"IN{pin[-1]}-"]
        return next(int(number) - 1 for part, number in pins[wire] if part == "J2")

    rows, columns, selects = {}, {}, set()
    for (connector, pin), name in net.items():
        if not connector.startswith("CN") or pin[0] != "P":
            continue
        port, number = pin[1], int(pin[2:])
        for part, of_chip in pins[name]:
            if of_chip in ("IN1", "IN2"):
                if port != "B" or net[part, f"NO{of_chip[-1]}"] != "GND_ROWS":
                    raise ValueError(f"{NETS.name}: {pin} at {part} {of_chip} does not pull a row to ground")
                _, row = next(it for it in pins[net[part, f"COM{of_chip[-1]}"]] if it[0] == "J1")
                rows[number] = int(row) - 1
            elif of_chip in ("X", "Y", "Z"):
                columns[port, number] = [column(net[part, of_chip + half]) for half in "01"]
                selects.add(net[part, {"X": "A", "Y": "B", "Z": "C"}[of_chip]])
    if len(selects) != 1:
        raise ValueError(f"{NETS.name}: the multiplexers have {len(selects)} select lines")
    _, select = at(selects.pop(), *(f"PB{number}" for number in range(16)))
    return rows, int(select[2:]), columns


ROWS, SELECT, COLUMNS = traced()
