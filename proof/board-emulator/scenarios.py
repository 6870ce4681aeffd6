"""What the emulated board must do.

Each scenario gets a function that makes a bench with options of `Board`, and the files of the command line. It raises
`Failed` where the board does something else than it should.
"""

import csv
import json
import math
import pathlib
import re
import signal

from bench import ERASE_PATIENCE_S, IDENTIFY, RESTART, begin, expect
from machine.line import Terminal

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Flash that was never erased: the slots hold rubbish at first.
SLOT_A, SLOT_B, RUBBISH = 0x40000, 0x60000, bytes(place % 251 for place in range(0x20000))
#: First bytes of answers, by their variant.
IDENTITY, UPLOAD, RESTARTING, REFUSED = 0, 7, 8, 9
#: Fastest clock of the watchdog in Hz, and the longest time in s to erase a slot (DS10693).
FASTEST_LSI_HZ, SLOWEST_ERASE_S = 47_000, 4.0
#: Shortest time in s between two scans, longer than any between two edges at the rows' register within one.
PAUSE_S = 2e-3
#: Pin that selects a fourth converter.
FOURTH_SELECT = "C", 5


def session(make, files):
    """A whole session with `host-sim`: identify, upload, check, baseline."""
    bench = make()
    bench.board.flash.fill(SLOT_B, RUBBISH)
    bench.run_for(0.02)
    said = bench.host_sim("identify")
    expect("nucleo-f446re" in said and "none: upload one" in said, "it does not tell who it is")
    said = bench.host_sim("upload", files.model)
    expect("slot 1, generation 1" in said, "the model is not in force")
    # Erasing takes 2 s at most with 32 bits at once, and a word 16 us.
    most_s = 2.0 + 1.02 * 16e-6 * files.model.stat().st_size / 4
    expect(bench.board.flash.busy_s <= most_s, f"erasing and writing take {bench.board.flash.busy_s:.2f} s")
    said = bench.host_sim("check", "press", "--model", files.model, "-n", files.frames)
    expect(f"{files.frames} of {files.frames} bit-identical" in said, "it does not decode as the host")
    bench.host_sim("baseline", "-n", 10, "-o", files.directory / "baseline.csv")
    check_baseline(bench, files.directory / "baseline.csv", 8 * 18)
    check_scan_time(bench, files.model)
    # A model that is flashed into slot A now is not used, and the log says so (xtask reads it).
    bench.board.flash.fill(SLOT_A, files.model.read_bytes())
    bench.ask(RESTART)
    bench.run_for(0.1)
    expect("slot 1, generation 1" in bench.host_sim("identify"), "the model is not in force any more")
    expect(bench.board.untouched(*FOURTH_SELECT), "the pin of a fourth converter is not as after a reset")
    bench.finish(resets=["program"])


def wide(make, files):
    """An image for 16 rows and 32 columns: two row registers, four converters."""
    bench = make(image=files.wide_image, shape=(16, 32))
    bench.run_for(0.1)
    said = bench.host_sim("identify")
    expect("16 rows, 32 columns" in said and ", 0 samples failed" in said, "it does not read all columns")
    bench.host_sim("baseline", "-n", 3, "-o", files.directory / "baseline.csv")
    check_baseline(bench, files.directory / "baseline.csv", 16 * 32)
    bench.finish()


def sparse(make, files):
    """Models of some readings: three columns, and cells that are not all between their wires, in no order."""
    for name, inputs in (("columns", "r*c3_ohm,r*c9_ohm,r*c15_ohm"),
                         ("staggered", "r6c17_ohm,r1c5_ohm,r3c2_ohm,r3c17_ohm,r2c11_ohm")):
        model, frames = files.directory / f"{name}.bin", files.directory / "press.csv"
        bench = make()
        bench.program("synth", "press", "-n", 400, "-o", frames)
        bench.program("train", frames, "--inputs", inputs, "--outputs", "*_dz_mm", "--no-refine", "--centres", 4,
                      "-o", model)
        bench.run_for(0.02)
        bench.host_sim("upload", model)
        bench.host_sim("baseline", "--model", model, "-n", 10, "-o", files.directory / "baseline.csv")
        check_baseline(bench, files.directory / "baseline.csv", 24 if name == "columns" else 5)
        check_scan_time(bench, model)
        bench.finish()


def check_baseline(bench, file, readings):
    """So many readings at rest, in a file, against the resistances at the wires."""
    with open(file, newline="") as lines:
        (line,) = csv.DictReader(lines)
    errors = []
    for name, text in line.items():
        place = re.fullmatch(r"r(\d+)c(\d+)_ohm", name)
        if place:
            row, column = (int(number) - 1 for number in place.groups())
            errors.append(float(text or "nan") / bench.ohm[row][column] - 1)
    rms = math.sqrt(sum(error * error for error in errors) / len(errors))
    largest = max(map(abs, errors))
    bench.board.note(f"baseline: {len(errors)} readings, RMS error {100 * rms:.4f} %, largest {100 * largest:.4f} %")
    expect(len(errors) == readings and rms <= 0.0003, f"the baseline is {100 * rms:.3f} % off (RMS)")


def check_scan_time(bench, model):
    """The mean time of scans, and of those with idle samples, against what `host-sim inspect` computes for the model."""
    computed = json.loads(bench.program("inspect", model, "--json"))["scan"]
    board, edges = bench.board, []
    listeners = board.ports["C"].listeners
    for pin, listener in [(pin, it) for pin, it in listeners.items() if getattr(it, "__self__", None) is board.register]:
        listeners[pin] = lambda high, listener=listener: (edges.append(board.time.seconds()), listener(high))
    bench.run_for(0.36)
    scans, start = [], edges[0]
    for last, edge in zip(edges, edges[1:]):
        if edge - last > PAUSE_S:
            scans.append((last - start) * 1e6)
            start = edge
    scans = scans[1:33]
    for name, found in (("mean_us", sum(scans) / len(scans)), ("longest_us", max(scans))):
        off = computed[name] / found - 1
        board.note(f"scan of {computed['rows']} x {computed['columns']}, {name}: {found:.0f}, computed {computed[name]} "
                   f"({100 * off:+.1f} %)")
        expect(len(scans) == 32 and abs(off) <= 0.03, f"a scan takes {found:.0f} us, computed {computed[name]} us")


def slow_erase(make, files):
    """The slowest erase, with the watchdog at its fastest, while the sensor is scanned."""
    bench = make(lsi_hz=FASTEST_LSI_HZ, erase_s=SLOWEST_ERASE_S)
    bench.run_for(0.05)
    answer, seconds = bench.ask(begin(files.model.read_bytes()), ERASE_PATIENCE_S)
    expect(answer[0] == UPLOAD and seconds > SLOWEST_ERASE_S, f"begin is answered by {answer.hex(' ')}")
    bench.run_for(0.1)
    bench.finish()


def slow_erase_bare(make, files):
    """The same on a board without converters, whose watchdog was not fed for a while."""
    bench = make(lsi_hz=FASTEST_LSI_HZ, erase_s=SLOWEST_ERASE_S, sensor=False)
    bench.run_for(0.03)
    bench.scan_every(10.0)
    bench.run_for(2.0)
    answer, seconds = bench.ask(begin(files.model.read_bytes()), ERASE_PATIENCE_S)
    expect(answer[0] == UPLOAD and seconds > SLOWEST_ERASE_S, f"begin is answered by {answer.hex(' ')}")
    bench.run_for(0.1)
    bench.finish()


def patience(make, files):
    """A sensor that answers, once a second: the watchdog, at its fastest, never resets the board."""
    bench = make(lsi_hz=FASTEST_LSI_HZ)
    bench.run_for(0.03)
    bench.scan_every(1.0)
    bench.run_for(6.0)
    answer, _ = bench.ask(IDENTIFY)
    expect(answer[0] == IDENTITY, f"identify is answered by {answer.hex(' ')}")
    bench.finish()


def silent_sensor(make, files):
    """A sensor that is silent: the watchdog, at its fastest, resets the board."""
    bench = make(lsi_hz=FASTEST_LSI_HZ, sensor=False)
    bench.run_for(0.03)
    bench.scan_every(2.0)
    bench.run_for(5.4)
    expect(not bench.board.resets, "it is reset too early")
    bench.run_for(0.1)
    answer, _ = bench.ask(IDENTIFY)
    expect(answer[0] == IDENTITY, f"identify is answered by {answer.hex(' ')}")
    bench.finish(resets=["watchdog"])


def no_clock(make, files):
    """A board without the ST-LINK's 8 MHz: it runs from its own oscillator."""
    bench = make(hse=False)
    bench.run_for(0.15)
    said = bench.host_sim("identify")
    expect("nucleo-f446re" in said, "it does not tell who it is")
    bench.finish()


def log_abandoned(make, files):
    """A debugger that goes away in mid-session: its channel blocks, and is full."""
    bench = make()
    bench.run_for(0.02)
    bench.board.rtt.abandon(room=8)
    for _ in range(4):
        # Too large: it is logged, refused, and erases nothing.
        answer, _ = bench.ask(begin(files.model.read_bytes(), 1 << 20))
        expect(answer[0] == REFUSED, f"begin is answered by {answer.hex(' ')}")
    bench.finish()


def restart(make, files):
    """A restart that the host asks for; and the clocks, which no request shows."""
    bench = make()
    bench.run_for(0.02)
    expect(bench.board.timer.period() == 1 << 32, "the clock in us ends early")
    expect(bench.board.core.counts_cycles(), "the counter of cycles is off")
    answer, _ = bench.ask(RESTART)
    expect(answer[0] == RESTARTING, f"restart is answered by {answer.hex(' ')}")
    bench.run_for(0.02)
    answer, _ = bench.ask(IDENTIFY)
    expect(answer[0] == IDENTITY, f"identify is answered by {answer.hex(' ')}")
    bench.finish(resets=["program"])


def provision(make, files):
    """A key that is set once: it outlasts a restart, and no other one takes its place."""
    bench = make()
    bench.run_for(0.02)
    key = files.directory / "device.key"
    key.write_bytes(bytes(range(32)))
    said = bench.host_sim("provision", "--key", key)
    expect("set: upload a model with --key" in said, "it has no key")
    bench.ask(RESTART)
    bench.run_for(0.1)
    said = bench.host_sim("identify")
    expect("set: upload a model with --key" in said, "it has lost its key")
    bench.finish(resets=["program"])


def serve(make, files):
    """A board for you: its serial port stays open until Ctrl-C."""
    bench = make()
    terminal = Terminal(bench.board)
    bench.board.note(f"host-sim link {terminal.path} identify")
    stopped = []
    signal.signal(signal.SIGINT, lambda *_: stopped.append(True))
    bench.board.run_until(lambda: stopped)
    bench.finish()


SCENARIOS = {
    scenario.__name__.replace("_", "-"): scenario
    for scenario in (session, sparse, wide, slow_erase, slow_erase_bare, patience, silent_sensor, no_clock, log_abandoned,
                     restart, provision)
}
