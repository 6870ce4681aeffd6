"""What circuit.py draws with: shapes, and the circuit around the readout."""

parts = []


def text(x, y, words, anchor="start", kind=""):
    parts.append(f'<text x="{x}" y="{y}" text-anchor="{anchor}" class="{kind}">{words}</text>')


def box(x, y, width, height, *lines):
    parts.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="4" class="box"/>')
    for at, line in enumerate(lines):
        middle = y + height / 2 + 5 + 19 * (at - (len(lines) - 1) / 2)
        text(x + width / 2, middle, line, "middle", "" if at else "strong")


def line(kind, *points):
    parts.append(f'<polyline points="{" ".join(f"{x},{y}" for x, y in points)}" class="{kind}"/>')


def dot(x, y):
    parts.append(f'<circle cx="{x}" cy="{y}" r="3.5" class="dot"/>')


def ground(x, y):
    for half, down in ((10, 0), (6, 5), (2, 10)):
        line("wire", (x - half, y + down), (x + half, y + down))


def resistor(x, y, words, upright=False):
    width, height = (14, 44) if upright else (44, 14)
    parts.append(f'<rect x="{x - width / 2}" y="{y - height / 2}" width="{width}" height="{height}" class="box"/>')
    text(x + 14 if upright else x, y + 5 if upright else y - 12, words, "start" if upright else "middle")


def capacitor(x, y, words):
    for plate in (y - 3, y + 3):
        line("wire", (x - 10, plate), (x + 10, plate))
    text(x - 14, y + 5, words, "end")


def draw(path, readout):
    """Draws a circuit, in which `readout` draws the board, what drives the rows, and what reads the columns."""
    readout()
    box(480, 30, 130, 110, "8 switches", "4 × TS3A24159", "COM to row-wire")
    line("wire", (545, 140), (545, 158))
    ground(545, 158)
    text(552, 154, "NO: active row", kind="small")
    text(562, 170, "(own ground)", kind="small")
    line("bias", (500, 140), (500, 205))
    text(494, 200, "NC: idle rows", "end", "small")
    # The sensor: rows from the left, columns to below.
    parts.append('<rect x="700" y="22" width="210" height="150" rx="4" class="rubber"/>')
    for at in range(8):
        line("row", (690, 34 + 18 * at), (900, 34 + 18 * at))
    for at in range(9):
        line("column", (716 + 22 * at, 30), (716 + 22 * at, 190))
    line("row", (610, 85), (690, 85))
    line("row", (690, 34), (690, 160))
    text(650, 79, "rows 1–8", "middle", "small")
    text(805, 14, "sensor", "middle", "strong")
    line("column", (716, 190), (892, 190))
    line("column", (804, 190), (804, 240))
    text(812, 210, "columns 1–18", kind="small")
    # A column: op-amp that holds its wire at V_b, and converter.
    line("column", (804, 240), (804, 318), (740, 318))
    dot(804, 268)
    line("column", (804, 268), (772, 268))
    resistor(750, 268, "560 Ω, 220 pF")
    line("wire", (728, 268), (668, 268), (668, 330))
    parts.append('<g transform="translate(1480 0) scale(-1 1)">')
    parts.append(f'<polygon points="740,304 740,356 786,330" class="box"/></g>')
    text(735, 324, "−", "end")
    text(735, 347, "+", "end")
    line("wire", (694, 330), (610, 330))
    dot(668, 330)
    text(806, 336, "18 of these:", kind="small")
    text(806, 352, "6 × MCP6024", kind="small")
    text(806, 368, "(5 are followers)", kind="small")
    # V_b, from a divider and two followers.
    text(210, 445, "3.3 V", "end")
    line("wire", (214, 440), (234, 440))
    resistor(256, 440, "15 kΩ")
    line("wire", (278, 440), (304, 440))
    resistor(326, 440, "499 Ω")
    line("wire", (348, 440), (440, 440), (440, 468))
    dot(390, 440)
    resistor(390, 476, "1 kΩ", upright=True)
    line("wire", (390, 440), (390, 454))
    line("wire", (390, 498), (390, 510))
    ground(390, 510)
    dot(362, 440)
    capacitor(362, 475, "1 µF")
    line("wire", (362, 440), (362, 472))
    line("wire", (362, 478), (362, 510))
    ground(362, 510)
    line("wire", (440, 440), (470, 440))
    line("wire", (440, 468), (440, 500), (470, 500))
    for y, words in ((440, "V_b of the columns: 0.200 V, to each +"), (500, "V_b of idle rows, to NC of two: four of these")):
        parts.append(f'<polygon points="470,{y - 20} 470,{y + 20} 510,{y}" class="box"/>')
        line("bias", (510, y), (532, y))
        text(538, y + 5, words, kind="small")
    text(470, 474, "followers", kind="small")
    line("bias", (740, 342), (770, 342), (770, 380))
    text(770, 396, "V_b of the columns", "middle", "small")
    style = (
        "text{font:14px system-ui,sans-serif;fill:#222}.small{font-size:12px}.strong{font-weight:600}"
        ".box{fill:#fff;stroke:#444;stroke-width:1.5}.rubber{fill:#ddd}.dot{fill:#444}"
        "polyline{fill:none;stroke-width:1.5}.wire{stroke:#444}.row{stroke:#1f6fc4}.column{stroke:#d9730d}.bias{stroke:#2a8a4a}"
        "@media(prefers-color-scheme:dark){text{fill:#ddd}.box{fill:#222;stroke:#bbb}.rubber{fill:#444}"
        ".wire{stroke:#bbb}.dot{fill:#bbb}}"
    )
    with open(path, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-2 0 924 530" role="img"><style>{style}</style>\n')
        file.write("\n".join(parts) + "\n</svg>\n")
