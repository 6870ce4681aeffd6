"""Computes whether the op-amps of docs/board.md are stable, and how fast they settle: python3 stability.py (numpy)

For R_f = 10 kΩ beside 47 pF, and cells of 1 kΩ: python3 stability.py 10e3 47e-12 1e3

Small signals: an op-amp is an integrator of 10 MHz behind an output resistance, whose 65° of phase margin as a follower
with 60 pF (data sheet of the MCP6024) tell a second pole. From 150 Ω on the output alone takes more than that: such a
part would miss its data sheet, and is the worst case here.
"""

import functools
import sys

import numpy as np

ROWS, COLUMNS, BIAS_V, SWITCH_OHM = 8, 18, 0.2, 0.26
#: Feedback resistor, what docs/circuit.py has across it, and a cell of the sensor.
FEEDBACK_OHM, FEEDBACK_F, CELL_OHM = map(float, sys.argv[1:4] or (560, 220e-12, 55))
GAIN_HZ, SHEET_DEGREES, SHEET_F = 10e6, 65.0, 60e-12
CELL = f"{CELL_OHM:g} Ω"
#: Output resistances in Ω, and capacitances in F of an op-amp's input, of its load (a 74HC4053 and wires), and of the
#: wire of a row or column.
OUTPUT_OHM, INPUT_F, LOAD_F, WIRE_F = (50, 100, 200, 300), 6.5e-12, 30e-12, (100e-12, 300e-12)
#: What docs/circuit.py has at the divider of V_b, whose resistance in Ω is that of 15.5 kΩ and 1 kΩ in parallel.
BIAS_F, BIAS_OHM = 1e-6, 939.0
HZ = np.logspace(4, 8, 8000)


def margin(output_ohm, load_f, second_s, feedback=None):
    """Phase margin in degrees of an op-amp; `feedback`: impedances from its output to − and from − to ground."""
    admittance, share = 2j * np.pi * HZ * load_f, 1.0
    if feedback:
        admittance, share = admittance + 1 / sum(feedback), feedback[1] / sum(feedback)
    loop = GAIN_HZ / (1j * HZ) / (1 + 1j * HZ * second_s) / (1 + output_ohm * admittance) * share
    return 180 + np.degrees(np.unwrap(np.angle(loop))[np.argmax(np.abs(loop) < 1)])


@functools.cache
def second_pole(output_ohm):
    """Inverse in s of the second pole with which an op-amp has the margin of its data sheet."""
    lags = np.linspace(0, 5e-8, 201)
    return max((lag for lag in lags if margin(output_ohm, SHEET_F, lag) >= SHEET_DEGREES), default=0.0)


def column(output_ohm, wire_f, feedback_f, ohm):
    """Phase margin of a column's op-amp, with `ohm` from its wire to all rows together."""
    s = 2j * np.pi * HZ
    feedback = 1 / (1 / FEEDBACK_OHM + s * feedback_f), 1 / (1 / ohm + s * (INPUT_F + wire_f))
    return margin(output_ohm, LOAD_F, second_pole(output_ohm), feedback)


def array(output_ohm, followers, active, ohm=CELL_OHM, wire_f=WIRE_F[1]):
    """The whole array with a row active, or none: x' = A·x + b, of the op-amps' inner voltages and of all nodes."""
    amps, outputs, rows = COLUMNS + followers, COLUMNS, 2 * COLUMNS
    nodes = rows + ROWS + followers
    conductance, capacity = np.zeros((nodes, nodes)), np.diag(np.full(nodes, LOAD_F))

    def join(matrix, i, j, value):
        matrix[[i, j], [i, j]] += value
        matrix[[i, j], [j, i]] -= value

    for k in range(COLUMNS):
        capacity[k, k] = INPUT_F + wire_f
        join(capacity, k, outputs + k, FEEDBACK_F)
        join(conductance, k, outputs + k, 1 / FEEDBACK_OHM)
        for row in range(ROWS):
            join(conductance, k, rows + row, 1 / ohm)
    for row in range(ROWS):
        capacity[rows + row, rows + row] = wire_f
        if row == active:
            conductance[rows + row, rows + row] += 1 / SWITCH_OHM
        else:
            join(conductance, rows + row, rows + ROWS + row * followers // ROWS, 1 / SWITCH_OHM)
    driven = np.r_[outputs:outputs + COLUMNS, rows + ROWS:nodes]
    sensed = np.r_[0:COLUMNS, rows + ROWS:nodes]
    conductance[driven, driven] += 1 / output_ohm
    drive, sense = np.zeros((nodes, amps)), np.zeros((amps, nodes))
    drive[driven, range(amps)], sense[range(amps), sensed] = 1 / output_ohm, 1.0
    w = 2 * np.pi * GAIN_HZ
    inverse = np.linalg.inv(capacity)
    matrix = np.block([[np.zeros((amps, amps)), -w * sense], [inverse @ drive, -inverse @ conductance]])
    return matrix, np.r_[np.full(amps, w * BIAS_V), np.zeros(nodes)], slice(amps + outputs, amps + outputs + COLUMNS)


def settling_percent(output_ohm, followers, before, seconds=20e-6):
    """Mean error in % of the currents that is left when row 2 is active for so long, and was `before`."""
    (was, source, _), (matrix, _, outputs) = (array(output_ohm, followers, row) for row in (before, 1))
    start, end = -np.linalg.solve(was, source), -np.linalg.solve(matrix, source)
    values, vectors = np.linalg.eig(matrix)
    left = (vectors @ (np.exp(values * seconds) * np.linalg.solve(vectors, start - end))).real[outputs]
    return 100 * np.mean(left / (end[outputs] - BIAS_V))


def damping(output_ohm, followers, ohm):
    """Smallest damping ratio of the whole array at rest."""
    values = np.linalg.eigvals(array(output_ohm, followers, None, ohm)[0])
    return min(-values.real / abs(values))


def main():
    ends = " | ".join(f"{ohm:>11} Ω" for ohm in OUTPUT_OHM)
    print("Phase margin of a column's op-amp, with 100 and 300 pF of wire, by its output resistance\n")
    print(f"| feedback | column | {ends} |")
    for feedback_f in (0.0, 100e-12, FEEDBACK_F, 1e-9):
        for name, ohm in (("open", 1e9), (CELL, CELL_OHM), (f"8 × {CELL}", CELL_OHM / ROWS)):
            cells = (" ".join(f"{column(out, wire, feedback_f, ohm):5.0f}°" for wire in WIRE_F) for out in OUTPUT_OHM)
            print(f"| {feedback_f * 1e12:5.0f} pF | {name:8} | {' | '.join(cells)} |")
    print(f"\nWith {FEEDBACK_F * 1e12:.0f} pF, 20 µs after a change: error of the current from idle, and from row to row; "
          "damping of the array\n")
    print(f"| followers | what | {ends} |")
    for followers in (1, 2, 4, 8):
        for name, before in (("idle", None), ("row", 0)):
            cells = (f"{settling_percent(out, followers, before):+11.4f} %" for out in OUTPUT_OHM)
            print(f"| {followers} | from {name} | {' | '.join(cells)} |")
        for name, ohm in ((CELL, CELL_OHM), ("no sensor", 1e9)):
            print(f"| {followers} | {name} | {' | '.join(f'{damping(out, followers, ohm):13.2f}' for out in OUTPUT_OHM)} |")
    print(f"\nA pulse of 16 pC at the divider of V_b (5 pF to an edge of 3.3 V), after 20 µs in counts at {CELL}\n")
    for farad in (20e-12, 2.2e-9, 10e-9, 100e-9, BIAS_F):
        volts = 16e-12 / farad * np.exp(-20e-6 / (BIAS_OHM * farad))
        print(f"| {farad * 1e9:6.2f} nF | {volts * (1 + FEEDBACK_OHM / CELL_OHM) / 3.3 * 4096:.3f} |")


main()
