"""The circuit of docs/board.md whose columns the board's own converters read, described once: python3 docs/circuit.py docs

Writes circuit.net (KiCad's netlist), circuit-parts.csv (parts to order), circuit-nets.csv (what hangs on each net, which
the emulated board reads) and wiring.svg into a folder.
"""

import csv
import pathlib
import sys
import uuid

sys.dont_write_bytecode = True  # docs is a flat folder: the site copies its files
import wiring

#: Pins of the NUCLEO: of rows 1 to 8, of the multiplexers' select lines, and of two columns each.
ROW_PINS = "PB5 PB6 PB7 PB8 PB9 PB10 PB12 PB13".split()
SELECT_PIN = "PB14"
COLUMN_PINS = "PA0 PA1 PA4 PA6 PA7 PB0 PC0 PC1 PC2".split()
ROWS, COLUMNS = 8, 18

#: Pins of ST's morpho connectors (UM1724, NUCLEO-F446RE), two a line: odd and even. They agree with
#: KiCad's NUCLEO64-F411RE, and with Zephyr's boards/st/nucleo_f446re/st_morpho_connector.dtsi.
CN7 = """
PC10 PC11  PC12 PD2   VDD E5V    BOOT0 GND  NC1 NC2   NC3 IOREF  PA13 RESET  PA14 +3V3  PA15 +5V  GND GND
PB7 GND    PC13 VIN   PC14 NC4   PC15 PA0   PH0 PA1   PH1 PA4    VBAT PB0    PC2 PC1    PC3 PC0
""".split()
CN10 = """
PC9 PC8    PB8 PC6    PB9 PC5    AVDD U5V   GND NC1   PA5 PA12   PA6 PA11    PA7 PB12   PB6 NC2   PC7 GND
PA9 PB2    PA8 PB1    PB10 PB15  PB4 PB14   PB5 PB13  PB3 AGND   PA10 PC4    PA2 NC3    PA3 NC4
""".split()
TWO = ["1", "2"]


class Kind:
    """Part to order: value, order number, KiCad's footprint, names of its pins from 1 on."""

    def __init__(self, value, order, footprint, pins):
        self.value, self.order, self.footprint, self.pins = value, order, footprint, pins


def resistor(value, order):
    return Kind(value, order, "Resistor_THT:R_Axial_DIN0207_L6.3mm_D2.5mm_P10.16mm_Horizontal", TWO)


def capacitor(value, order, footprint):
    return Kind(value, order, f"Capacitor_THT:C_Disc_{footprint}", TWO)


def header(count):
    pins = [str(number + 1) for number in range(count)]
    order = f"pin header 1 × {count}, 2.54 mm"
    return Kind(f"1 × {count}", order, f"Connector_PinHeader_2.54mm:PinHeader_1x{count:02}_P2.54mm_Vertical", pins)


def socket(pins):
    return Kind("2 × 19", "SSQ-119-01-T-D", "Connector_PinSocket_2.54mm:PinSocket_2x19_P2.54mm_Vertical", pins)


#: By the chips' data sheets: TI SCDS238 (DGS), Microchip DS21685 (PDIP-14), TI SCHS122 (74HC4053; X, Y, Z are its A, B, C).
#: They agree with KiCad 6: TS3A24159DGSR, MCP6004 (whose pins are those of the MCP6024) and CD4053B.
SWITCH = Kind("TS3A24159", "TS3A24159DGSR", "Package_SO:VSSOP-10_3x3mm_P0.5mm",
              "V+ NO1 COM1 IN1 NC1 GND NC2 IN2 COM2 NO2".split())
OP_AMP = Kind("MCP6024", "MCP6024-I/P", "Package_DIP:DIP-14_W7.62mm",
              "OUTA INA- INA+ VDD INB+ INB- OUTB OUTC INC- INC+ VSS IND+ IND- OUTD".split())
MULTIPLEXER = Kind("74HC4053", "CD74HC4053E", "Package_DIP:DIP-16_W7.62mm",
                   "Y1 Y0 Z1 Z Z0 /INH VEE GND C B A X0 X1 X Y VCC".split())
R560, R15K, R499, R1K = (resistor(value + " 0.1 %", order) for value, order in (
    ("560 Ω", "YR1B560RCC"), ("15 kΩ", "YR1B15KCC"), ("499 Ω", "YR1B499RCC"), ("1 kΩ", "YR1B1K0CC")))
R10K = resistor("10 kΩ 1 %", "MFR-25FBF52-10K")
C220P = capacitor("220 pF C0G", "C315C221J5G5TA", "D3.8mm_W2.6mm_P2.50mm")
C100N = capacitor("100 nF X7R", "C320C104K5R5TA", "D5.0mm_W2.5mm_P2.50mm")
C1U = capacitor("1 µF X7R", "C330C105K5R5TA", "D7.5mm_W5.0mm_P5.00mm")
C10U = capacitor("10 µF X5R", "FG28X5R1E106MRT06", "D5.0mm_W2.5mm_P5.00mm")
TIE = Kind("net tie", "copper of the board", "NetTie:NetTie-2_SMD_Pad2.0mm", TWO)

#: What is ordered besides the parts of the circuit: number, what, order number, for what.
BESIDES = [
    (1, "board", "NUCLEO-F446RE", "on CN7 and CN10"),
    (1, "USB cable", "type A to Mini-B", "board"),
    (4, "adapter", "VSSOP-10 to DIP", "row switches, if wired by hand"),
]

#: Parts in order: reference, kind, for what.
parts = []
#: Pins by net: reference, number, name.
nets = {}


def place(reference, kind, purpose, of_pins, is_open=False):
    """Places a part, with a net for each name of a pin; with `is_open`, other pins stay open."""
    names = set(kind.pins)
    assert of_pins.keys() <= names and (is_open or of_pins.keys() == names), f"{reference}: {of_pins.keys() ^ names}"
    parts.append((reference, kind, purpose))
    for number, name in enumerate(kind.pins, 1):
        if name in of_pins:
            nets.setdefault(of_pins[name], []).append((reference, number, name))


def two(reference, kind, purpose, one, other):
    """Places a part of two pins."""
    place(reference, kind, purpose, {"1": one, "2": other})


def supplied(chip, kind, purpose, of_pins, bypass):
    """Places a chip, and its capacitor between 3.3 V and ground."""
    place(chip, kind, purpose, of_pins)
    two(bypass, C100N, "supply of each chip", "+3V3", "GND")


def describe():
    """Places all parts."""
    of_board = {pin: f"ROW_{row}_ON" for row, pin in enumerate(ROW_PINS, 1)} | {SELECT_PIN: "SELECT"}
    of_board |= {pin: f"CONVERTER_{at}" for at, pin in enumerate(COLUMN_PINS, 1)}
    of_board |= {"+3V3": "+3V3", "GND": "GND", "AGND": "GND"}
    for reference, pins in (("CN7", CN7), ("CN10", CN10)):
        place(reference, socket(pins), "board", {pin: net for pin, net in of_board.items() if pin in pins}, is_open=True)
    place("J1", header(ROWS), "row-wires", {str(row): f"ROW_{row}" for row in range(1, ROWS + 1)})
    place("J2", header(COLUMNS), "column-wires", {str(k): f"COLUMN_{k}" for k in range(1, COLUMNS + 1)})
    # The current of all columns, 65 mA, goes to a ground of its own, which meets the other at the board's pin alone.
    two("NT1", TIE, "the two grounds, at CN7 pin 20", "GND", "GND_ROWS")
    two("C40", C10U, "3.3 V, at CN7 pin 16", "+3V3", "GND_ROWS")
    # Rows: two switches a chip, whose idle rows have a follower.
    for chip in range(1, ROWS // 2 + 1):
        of_pins = {"V+": "+3V3", "GND": "GND"}
        for half in (1, 2):
            row = 2 * chip - 2 + half
            of_pins |= {f"IN{half}": f"ROW_{row}_ON", f"COM{half}": f"ROW_{row}", f"NO{half}": "GND_ROWS",
                        f"NC{half}": f"V_IDLE_{chip}"}
            two(f"R{20 + row}", R10K, "rows off until the program starts", f"ROW_{row}_ON", "GND")
        supplied(f"U{chip}", SWITCH, "rows", of_pins, f"C{20 + chip}")
    # Op-amps, four a chip: output, −, +. One of them is not used.
    amps = [(f"OUT_{k}", f"COLUMN_{k}", "V_B") for k in range(1, COLUMNS + 1)]
    amps += [("V_B", "V_B", "V_B_NODE"), ("UNUSED", "UNUSED", "V_B")]
    amps += [(f"V_IDLE_{pair}", f"V_IDLE_{pair}", "V_B_NODE") for pair in range(1, ROWS // 2 + 1)]
    for chip in range(len(amps) // 4):
        of_pins = {"VDD": "+3V3", "VSS": "GND"}
        for letter, (output, minus, plus) in zip("ABCD", amps[4 * chip:]):
            of_pins |= {f"OUT{letter}": output, f"IN{letter}-": minus, f"IN{letter}+": plus}
        supplied(f"U{5 + chip}", OP_AMP, "18 columns, five followers, one unused", of_pins, f"C{25 + chip}")
    for k in range(1, COLUMNS + 1):
        two(f"R{k}", R560, "feedback", f"COLUMN_{k}", f"OUT_{k}")
        two(f"C{k}", C220P, "across each feedback resistor", f"COLUMN_{k}", f"OUT_{k}")
    # Multiplexers: two columns to a converter.
    for chip in range(3):
        of_pins = {"VCC": "+3V3", "GND": "GND", "VEE": "GND", "/INH": "GND"} | dict.fromkeys("ABC", "SELECT")
        for at, letter in enumerate("XYZ", 3 * chip + 1):
            of_pins |= {letter: f"CONVERTER_{at}", f"{letter}0": f"OUT_{2 * at - 1}", f"{letter}1": f"OUT_{2 * at}"}
        supplied(f"U{11 + chip}", MULTIPLEXER, "two columns to a converter each; not 74HCT", of_pins, f"C{31 + chip}")
    two("R29", R10K, "select", "SELECT", "GND")
    # V_b = 3.3 V · 1/16.499.
    two("R31", R15K, "V_b = 0.200 V", "+3V3", "V_B_UPPER")
    two("R32", R499, "V_b = 0.200 V", "V_B_UPPER", "V_B_NODE")
    two("R33", R1K, "V_b = 0.200 V", "V_B_NODE", "GND")
    two("C41", C1U, "V_b, at the divider", "V_B_NODE", "GND")
    alone = [net for net, pins in nets.items() if len(pins) < 2]
    assert not alone, f"nets with a single pin: {alone}"


def netlist():
    """KiCad's netlist, to import into a board."""
    lines = ['(export (version "E")', '  (design (source "docs/circuit.py") (date "") (tool "docs/circuit.py"))',
             "  (components"]
    for reference, kind, _ in parts:
        stamp = uuid.uuid5(uuid.NAMESPACE_URL, f"taxel/{reference}")
        lines.append(f'    (comp (ref "{reference}") (value "{kind.value}") (footprint "{kind.footprint}")\n'
                     f'      (libsource (lib "taxel") (part "{kind.value}") (description "{kind.order}"))\n'
                     f'      (sheetpath (names "/") (tstamps "/")) (tstamps "{stamp}"))')
    lines += ["  )", "  (libparts)", "  (libraries)", "  (nets"]
    for code, (net, pins) in enumerate(nets.items(), 1):
        lines.append(f'    (net (code "{code}") (name "{net}")')
        lines += [f'      (node (ref "{reference}") (pin "{number}") (pinfunction "{name}") (pintype "passive"))'
                  for reference, number, name in pins]
        lines[-1] += ")"
    return "\n".join(lines) + "\n  )\n)\n"


def write_table(path, *rows):
    with path.open("w", encoding="utf8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def bill():
    """Rows of the bill of parts: those of one value and purpose together."""
    groups = {}
    for reference, kind, purpose in parts:
        groups.setdefault((kind.value, kind.order, purpose), []).append(reference)
    for (value, order, purpose), references in groups.items():
        yield " ".join(references), len(references), value, order, purpose
    for number, value, order, purpose in BESIDES:
        yield "", number, value, order, purpose


def own_converters():
    """Draws how pins drive the rows, and how the board's own converters read the columns by nine double-throw switches."""
    wiring.box(0, 30, 130, 470, "NUCLEO-", "F446RE")
    wiring.line("row", (130, 60), (480, 60))
    wiring.text(136, 54, f"{ROW_PINS[0]}–{', '.join(ROW_PINS[5:])}: to IN 1 … {ROWS}", kind="small")
    wiring.dot(370, 60)
    wiring.line("row", (370, 60), (370, 76))
    wiring.resistor(370, 98, "10 kΩ each", upright=True)
    wiring.line("wire", (370, 120), (370, 132))
    wiring.ground(370, 132)
    of_chips = "X0 … Z0: odd columns", "X1 … Z1: even ones", "V_EE, /INH: ground"
    wiring.box(440, 285, 170, 130, "3 × 74HC4053", *of_chips)
    lines = [f"{', '.join(COLUMN_PINS[3 * chip:3 * chip + 3])}: X, Y, Z of U{11 + chip}, "
             f"columns {6 * chip + 1}–{6 * chip + 6}" for chip in range(3)]
    for at, words in enumerate([*lines, f"{SELECT_PIN}: A, B, C of each; 10 kΩ to ground"]):
        y = 305 + 30 * at
        wiring.line("wire", (130, y), (440, y))
        wiring.text(136, y - 5, words, kind="small")


def main(folder):
    describe()
    (folder / "circuit.net").write_text(netlist(), encoding="utf8")
    write_table(folder / "circuit-parts.csv", ("references", "number", "value", "order_as", "for"), *bill())
    rows = [(net, *pin) for net, pins in nets.items() for pin in pins]
    write_table(folder / "circuit-nets.csv", ("net", "reference", "pin", "pin_name"), *rows)
    wiring.draw(folder / "wiring.svg", own_converters)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
