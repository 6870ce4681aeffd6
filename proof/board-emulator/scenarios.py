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
import struct

from bench import ERASE_PATIENCE_S, IDENTIFY, KEEP_CONFIGURATION, RESTART, begin, expect, request
from faults import FAULTS, OF_CIRCUIT
from machine.flash import FACTORY_OPTIONS, LEVEL_3_OPTIONS, PROGRAM_S, SECTORS
from machine.line import Terminal, packets, taken, varint

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Sectors of the flash, by what they hold (docs/board.md).
JOURNAL, SLOT_A, SLOT_B = (1, 2), 6, 7
#: What flash holds that was never erased.
RUBBISH = bytes(place % 251 for place in range(0x20000))
#: First bytes of answers, by their variant.
IDENTITY, UPLOAD, RESTARTING, REFUSED, KEPT = b"\x00", b"\x07", b"\x08", b"\x09", b"\x0b"
COUNTERS, BASELINE, ESTIMATE, HEALTH = b"\x01", b"\x03", b"\x05", b"\x06"
#: Requests for the counters, for a baseline of some frames, and for the brown-out level.
STATISTICS, CAPTURE, SET_BROWN_OUT = b"\x01", b"\x04", b"\x10"
#: That of an upload which is on trial.
ON_TRIAL = b"\x07\x02"
#: Slowest and fastest clock of the watchdog in Hz, and the longest time in s to erase a slot (DS10693).
SLOWEST_LSI_HZ, FASTEST_LSI_HZ, SLOWEST_ERASE_S = 17_000, 47_000, 4.0
#: Gain-bandwidth product of the slowest op-amps in Hz that settle while the board waits (docs/board.md).
SLOWEST_OP_AMP_HZ = 6.5e6
#: By how much the internal oscillator may be off from -10 to 85 degrees, as a share (DS10693).
LARGEST_HSI_ERROR = 0.04
#: Supplies in V: a weak one, and ones that are too low for changing flash, and for running.
WEAK_V, LOW_V, TOO_LOW_V = 3.0, 2.9, 2.6
#: Time in s after which a scan that does not end is given up (firmware/src/app/sensor.rs).
LONGEST_SCAN_S = 2.0
#: Writes of settings between two restarts, and such writes behind which both pages have been erased (docs/link.md).
WRITES, MANY_WRITES = 100, 290
#: Bytes that a device keeps while it is busy (docs/link.md).
ROOM = 1000


def session(make, files):
    """A whole session with `taxel`: identify, upload, check, baseline."""
    bench = make()
    fill(bench, SLOT_B, RUBBISH)
    bench.run_for(0.02)
    said = bench.taxel("identify")
    expect("nucleo-f446re" in said and "none: upload one" in said, "it does not tell who it is")
    said = bench.taxel("upload", files.model)
    expect("slot 1, generation 1" in said, "the model is not in force")
    # Erasing a slot and a page takes 2.5 s at most with 32 bits at once, and a word 100 us.
    most_s, busy_s = 2.5 + 1.02 * PROGRAM_S * files.model.stat().st_size / 4, bench.board.store.busy_s
    expect(busy_s <= most_s, f"erasing and writing take {busy_s:.2f} s")
    said = bench.taxel("check", "press", "--model", files.model, "-n", files.frames)
    expect(f"{files.frames} of {files.frames} bit-identical" in said, "it does not decode as the host")
    filtered = bench.taxel("check", "press", "--model", files.model, "-n", 10, "--filter-ms", 5, "--period-ms", 1)
    expect("10 of 10 bit-identical" in filtered, "it does not filter as the host")
    bench.taxel("baseline", "-n", 10, "-o", files.directory / "baseline.csv")
    check_baseline(bench, files.directory / "baseline.csv", 8 * 18)
    check_scan_time(bench, files.model)
    # A model that is flashed into slot A now is not used, and the log says so (xtask reads it).
    fill(bench, SLOT_A, files.model.read_bytes())
    bench.ask(RESTART, RESTARTING)
    bench.run_for(0.1)
    expect("slot 1, generation 1" in bench.taxel("identify"), "the model is not in force any more")
    bench.finish(resets=["program"], erased=[JOURNAL[1], SLOT_B])


def fill(bench, sector, content):
    """Puts `content` at the start of a sector, as a programmer outside does."""
    start, length = SECTORS[sector]
    bench.board.flash.fill(start, content[:length])


def wide(make, files):
    """An image for 16 rows and 18 columns, with a decoder for the rows."""
    # Twice the resistance, as op-amps are as slow as their column conducts.
    bench = make(image=files.wide_image, shape=(16, 18), ohm=(88.0, 136.0))
    bench.run_for(0.1)
    said = bench.taxel("identify")
    expect("16 rows, 18 columns" in said and ", 0 samples failed" in said, "it does not read all rows")
    bench.taxel("baseline", "-n", 3, "-o", files.directory / "baseline.csv")
    check_baseline(bench, files.directory / "baseline.csv", 16 * 18)
    bench.finish(erased=[JOURNAL[1]])


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
        bench.taxel("upload", model)
        bench.taxel("baseline", "--model", model, "-n", 10, "-o", files.directory / "baseline.csv")
        check_baseline(bench, files.directory / "baseline.csv", 24 if name == "columns" else 5)
        check_scan_time(bench, model)
        bench.finish(erased=[JOURNAL[1], SLOT_B])


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
    check_errors(bench, errors, readings)


def check_errors(bench, errors, readings):
    """Errors of so many readings, as shares."""
    rms = math.sqrt(sum(error * error for error in errors) / len(errors))
    largest = max(map(abs, errors))
    bench.board.note(f"baseline: {len(errors)} readings, RMS error {100 * rms:.4f} %, largest {100 * largest:.4f} %")
    # A count is a larger share of a smaller current.
    most = 0.0003 * max(map(max, bench.ohm)) / 68
    expect(len(errors) == readings and rms <= most, f"the baseline is {100 * rms:.3f} % off (RMS)")


def check_scan_time(bench, model):
    """The times of scans against what `taxel inspect` computes for the model."""
    computed = json.loads(bench.program("inspect", model, "--json"))["scan"]
    check_scans(bench, 0.36, computed["mean_us"], computed["longest_us"])


def slow_erase(make, files):
    """The slowest erase, with the watchdog at its fastest, while the sensor is scanned; and what a host sends meanwhile."""
    bench = make(lsi_hz=FASTEST_LSI_HZ, erase_s=SLOWEST_ERASE_S)
    bench.run_for(0.05)
    # Behind the one that erases, requests of as many bytes as a device must keep.
    more = ROOM // len(request(IDENTIFY)) - 1
    requests = request(begin(files.model.read_bytes())) + more * request(IDENTIFY)
    seconds = bench.ask(IDENTIFY, IDENTITY, ERASE_PATIENCE_S, before=requests)[1]
    expect(seconds > SLOWEST_ERASE_S, f"the erase takes {seconds:.2f} s")
    found = ask_statistics(bench)["requests"]
    expect(found == more + 3, f"{found} requests arrived of {more + 3}")
    bench.run_for(0.1)
    bench.finish(erased=[JOURNAL[1], SLOT_B])


def slow_erase_bare(make, files):
    """The same on a board without converters, whose watchdog was not fed for a while."""
    bench = make(lsi_hz=FASTEST_LSI_HZ, erase_s=SLOWEST_ERASE_S, sensor=False)
    bench.run_for(0.03)
    bench.scan_every(10.0)
    bench.run_for(2.0)
    seconds = bench.ask(begin(files.model.read_bytes()), UPLOAD, ERASE_PATIENCE_S)[1]
    expect(seconds > SLOWEST_ERASE_S, f"the erase takes {seconds:.2f} s")
    bench.run_for(0.1)
    bench.finish(erased=[JOURNAL[1], SLOT_B])


def patience(make, files):
    """A sensor that answers, once a second: the watchdog, at its fastest, never resets the board."""
    bench = make(lsi_hz=FASTEST_LSI_HZ)
    bench.run_for(0.03)
    bench.scan_every(1.0)
    bench.run_for(6.0)
    bench.ask(IDENTIFY, IDENTITY)
    bench.finish()


def silent_sensor(make, files):
    """Converters that no trigger reaches: the scan is given up, the host is told which part stalls, and the watchdog, at its
    fastest, resets the board."""
    bench = silent(make, FASTEST_LSI_HZ, 5.4)
    bench.run_for(0.2)
    said = bench.taxel("record", "-n", 1, "-o", files.directory / "silent.csv", status=1)
    expect("part of its readout that stalls: numbers" in said, "the host is not told what stalls")
    bench.ask(IDENTIFY, IDENTITY)
    bench.finish(resets=["watchdog"])


def silent_sensor_slow(make, files):
    """The same with the watchdog at its slowest: 15 s, in which no row stands driven."""
    bench = silent(make, SLOWEST_LSI_HZ, 14.9)
    bench.run_for(0.3)
    bench.finish(resets=["watchdog"])


def silent(make, lsi_hz, seconds):
    """A board whose sensor has been silent for so long, without a reset so far."""
    bench = make(lsi_hz=lsi_hz, sensor=False)
    bench.run_for(LONGEST_SCAN_S + seconds)
    expect(not bench.board.resets, "it is reset too early")
    return bench


def no_clock(make, files):
    """A board without the ST-LINK's 8 MHz: it runs from its own oscillator, however fast that is."""
    for error in (-LARGEST_HSI_ERROR, LARGEST_HSI_ERROR, 0.0):
        bench = make(hse=False, hsi_error=error)
        bench.run_for(0.15)
        said = bench.taxel("identify")
        expect("nucleo-f446re" in said, "it does not tell who it is")
        bench.finish()


def clock_stops(make, files):
    """The ST-LINK's 8 MHz stop while a row is driven: the board restarts at once, from its own oscillator."""
    bench = make()
    bench.run_for(0.02)
    until_driven(bench)
    bench.board.stop_hse()
    bench.run_for(0.15)
    expect(bench.board.rcc.clocks.hclk <= 168e6, f"it runs at {bench.board.rcc.clocks.hclk / 1e6:g} MHz")
    bench.ask(IDENTIFY, IDENTITY)
    bench.finish(resets=["program"])


def fault_restarts(make, files):
    """The program goes astray while a row is driven, and again with its stack at its end: it restarts at once."""
    bench = make()
    bench.run_for(0.02)
    for _ in range(2):
        until_driven(bench)
        bench.board.derail()
        bench.run_for(0.02)
        bench.ask(IDENTIFY, IDENTITY)
    until_driven(bench)
    bench.board.derail(stack_ends=True)
    bench.run_for(0.02)
    bench.finish(resets=["program"] * 3)


def panic_restarts(make, files):
    """A panic while a row is driven: the board restarts at once, and its log tells the place (xtask reads it)."""
    bench = make()
    bench.run_for(0.02)
    until_driven(bench)
    bench.board.panic()
    bench.run_for(0.02)
    bench.ask(IDENTIFY, IDENTITY)
    bench.finish(resets=["program"])


def until_driven(bench):
    """Runs until a row is driven."""
    bench.board.run_until(lambda: bench.board.rows.outputs)


def brown_out(make, files):
    """A chip as it comes: the brown-out level is set when a host asks for it, and not written again."""
    bench = make(options=FACTORY_OPTIONS)
    bench.run_for(0.6)
    store = bench.board.store
    expect(store.options == FACTORY_OPTIONS, f"the option bytes are {store.options:#010x}")
    bench.board.supply(LOW_V)
    bench.ask(SET_BROWN_OUT, REFUSED)
    bench.board.supply(WEAK_V)
    for _ in range(2):
        bench.ask(SET_BROWN_OUT, RESTARTING, ERASE_PATIENCE_S)
        bench.run_for(0.05)
    expect(store.options == LEVEL_3_OPTIONS, f"the option bytes are {store.options:#010x}")
    until_driven(bench)
    bench.board.supply(TOO_LOW_V)
    bench.run_for(0.05)
    expect(store.options_written == 1, f"the option bytes were written {store.options_written} times")
    bench.finish(resets=["program", "program", "brown-out"])


def sagging_supply(make, files):
    """A supply that sags: nothing is erased or written, and below the brown-out level the board is held in reset."""
    bench = make()
    fill(bench, SLOT_A, RUBBISH)
    bench.run_for(0.05)
    bench.scan_every(0.02)
    bench.board.supply(WEAK_V)
    bench.ask(KEEP_CONFIGURATION, KEPT, ERASE_PATIENCE_S)
    bench.scan_every(0.03)
    before = bytes(bench.board.store.content)
    erased = dict(bench.board.store.erased)
    bench.board.supply(LOW_V)
    for request in (begin(files.model.read_bytes()), KEEP_CONFIGURATION):
        bench.ask(request, REFUSED, ERASE_PATIENCE_S)
    expect(bytes(bench.board.store.content) == before and bench.board.store.erased == erased, "flash was changed")
    bench.board.supply(TOO_LOW_V)
    bench.run_for(0.05)
    bench.scan_every(0.02)
    bench.ask(KEEP_CONFIGURATION, KEPT, ERASE_PATIENCE_S)
    found = set(bench.board.store.erased)
    expect(found <= set(JOURNAL), f"sectors {found} were erased")
    bench.finish(resets=["brown-out"], erased=found)


def keep(make, files):
    """A configuration is kept until both pages of settings have been erased, and outlasts each restart."""
    bench = make(lsi_hz=FASTEST_LSI_HZ)
    bench.run_for(0.05)
    slowest_s, period_us = 0.0, 0
    for number in range(MANY_WRITES):
        period_us = 1_000_000 + number
        bench.scan_every(period_us * 1e-6)
        slowest_s = max(slowest_s, bench.ask(KEEP_CONFIGURATION, KEPT, ERASE_PATIENCE_S)[1])
        if number % WRITES == WRITES - 1:
            bench.ask(RESTART, RESTARTING)
            bench.run_for(0.05)
            expect(bench.period_us() == period_us, "what was kept is not in force")
    bench.board.note(f"keep: the slowest takes {slowest_s:.3f} s")
    bench.finish(resets=["program"] * (MANY_WRITES // WRITES), erased=JOURNAL)


def burst(make, files):
    """As many bytes as a device must keep, and a request behind them, all during the longest scan: the answer does not wait."""
    bench = make()
    bench.run_for(0.02)
    bench.scan_every(2.0, 5e-3, samples=256)
    until_driven(bench)
    # Zeros are packets without content, which mean nothing.
    bench.ask(IDENTIFY, IDENTITY, before=bytes(ROOM - 20))
    expect(bench.board.rows.outputs, "the scan has ended before the answer")
    bench.finish()


def overrun(make, files):
    """A host that sends three times what a device keeps, during an erase: what is cut is counted, and the next request is answered."""
    bench = make()
    bench.run_for(0.02)
    line = bench.board.usart.from_host
    line.extend(request(begin(files.model.read_bytes())) + request(IDENTIFY) * (3 * ROOM // len(request(IDENTIFY))))
    bench.run_for(ERASE_PATIENCE_S)
    expect(ask_statistics(bench)["bad_packets"] == 1, "no damaged packet is counted")
    bench.finish(erased=[JOURNAL[1], SLOT_B])


def log_abandoned(make, files):
    """A debugger that goes away in mid-session: its channel blocks, and is full."""
    bench = make()
    bench.run_for(0.02)
    bench.board.rtt.abandon(room=8)
    for number in range(4):
        # It is logged.
        bench.scan_every(0.02 + 0.001 * number)
    bench.finish()


def restart(make, files):
    """A restart that the host asks for; the clocks, which no request shows; and op-amps as slow as the wait allows."""
    bench = make(op_amp_hz=SLOWEST_OP_AMP_HZ)
    bench.run_for(0.02)
    expect(bench.board.timer.period() == 1 << 32, "the clock in us ends early")
    expect(bench.board.core.counts_cycles(), "the counter of cycles is off")
    bench.ask(RESTART, RESTARTING)
    bench.run_for(0.02)
    bench.ask(IDENTIFY, IDENTITY)
    bench.finish(resets=["program"])


def dead_host(make, files):
    """A host that dies behind `try`: when the trial is over, the model before, here none, is in force again."""
    bench = make()
    bench.run_for(0.02)
    bench.taxel("upload", files.model, "--trial")
    expect("on trial" in bench.taxel("identify"), "the model is not on trial")
    bench.ask(b"\x06\x02" + varint(2000), ON_TRIAL)
    bench.run_for(1.9)
    expect("on trial" in bench.taxel("identify"), "the trial ended too early")
    bench.run_for(0.2)
    expect("none: upload one" in bench.taxel("identify"), "the trial has no end")
    bench.finish(erased=[JOURNAL[1], SLOT_B])


def scans(make, files):
    """Times of scans with one and twelve samples, and readings; passes that are given up."""
    bench = make()
    bench.run_for(0.02)
    computed = list(map(int, files.scans.split(",")))
    for samples, (mean_us, longest_us) in ((1, computed[:2]), (12, computed[2:4])):
        bench.scan_every(2e-3, samples=samples)
        check_scans(bench, 0.08, mean_us, longest_us)
        check_readings(bench)
    # More samples than fit into memory: several passes. And passes that are given up, since the configuration changes.
    for turn in range(8):
        bench.scan_every(3.6e-3 + 0.1e-3 * (turn % 2), samples=40)
        bench.run_for(9e-3)
    check_readings(bench)
    expect(bench.board.passes.cuts > 0, "no pass was given up")
    statistics = ask_statistics(bench)
    expect(statistics["failed_samples"] == 0, f"samples failed: {statistics}")
    expect(statistics["frames_missed"] == 0, f"frames were missed: {statistics}")
    bench.finish()


def check_readings(bench):
    """A baseline that is captured now, against the resistances at the wires."""
    answer, _ = bench.ask(CAPTURE + varint(3), BASELINE)
    _, floats = taken(answer[1:])
    ohms = struct.unpack(f"<{len(floats) // 4}f", floats)
    check_errors(bench, [ohm / expected - 1 for ohm, expected in zip(ohms, sum(bench.ohm, []))], 8 * 18)


def ask_statistics(bench):
    """The device's counters that matter here."""
    answer, _ = bench.ask(STATISTICS, COUNTERS)
    rest, counters = answer[1:], {}
    for name in ("frames_scanned", "frames_decoded", "frames_missed", "failed_samples", "requests",
                 "bad_packets", "lost_reports", "bad_loops", "longest_scan_us", "longest_decode_us"):
        counters[name], rest = taken(rest)
    return counters


def check_scans(bench, seconds, mean_us, longest_us):
    """The mean time of a round of scans from the first row or idle line to the rows' rest, against what is computed."""
    passes, starts, ends = bench.board.passes, [], []
    passes.on_start, passes.on_end = starts.append, ends.append
    bench.run_for(seconds)
    passes.on_start = passes.on_end = lambda cycle: None
    scans = [bench.board.time.ns(end - start) / 1e3 for start, end in zip(starts, ends)][:32]
    expect(len(scans) == 32, f"there are {len(scans)} scans where 32 should be")
    for name, found, computed in (("mean", sum(scans) / 32, mean_us), ("longest", max(scans), longest_us)):
        off = computed / found - 1
        bench.board.note(f"scan, {name}: {found:.1f} us, computed {computed} ({100 * off:+.1f} %)")
        expect(abs(off) <= 0.03, f"a scan takes {found:.0f} us, computed {computed} us")


def shorts(make, files):
    """Shorts of 0 to 20 ohm at ten cells: each is named, no other reading of its row is believed, and sound frames have none."""
    bench = make()
    bench.run_for(0.02)
    for place in range(10):
        row, column = place % 8, 7 * place % 18
        sound = bench.ohm[row][column]
        for ohm in (1e-3, 0.5, 5.0, 20.0):
            bench.ohm[row][column] = ohm
            bench.run_for(0.03)
            bench.board.usart.to_host.clear()
            bench.run_for(0.03)
            faults = health(bench)
            expect(faults, f"{ohm} ohm at r{row + 1}c{column + 1} are not told")
            for missing, shorted, opened, words in faults:
                is_row = [bits == ((1 << 18) - 1 if line == row else 0) for line, bits in enumerate(words)]
                expect((missing, shorted, opened) == (17, 1, 0) and all(is_row),
                       f"{ohm} ohm at r{row + 1}c{column + 1}: {missing}, {shorted}, {opened}, {words}")
        bench.ohm[row][column] = sound
        bench.run_for(0.03)
        bench.board.usart.to_host.clear()
        bench.run_for(0.03)
        expect(not health(bench), f"r{row + 1}c{column + 1} is sound, and faults are told")
    bench.finish()


def health(bench):
    """Health that the board has reported unasked: readings missing, shorted, open, and the faulty columns of each row."""
    line, found = bench.board.usart.to_host, []
    for _, message in packets(line[:line.rfind(0) + 1]):
        if message[:1] == HEALTH:
            rest, numbers = message[1:], []
            for _ in range(6):
                number, rest = taken(rest)
                numbers.append(number)
            found.append((*numbers[2:5], struct.unpack(f"<{numbers[5] // 4}I", rest)))
    return found


def stream(make, files):
    """A thousand contacts a second, twelve samples a reading: none missed, and how old they are."""
    bench, model = make(), files.directory / "contact.bin"
    bench.run_for(0.02)
    bench.program("train", "contact", "--no-refine", "--centres", 64, "--format", "fixed16", "-o", model)
    bench.taxel("upload", model)
    said = bench.taxel("check", "contact", "--model", model, "-n", files.frames)
    expect(f"{files.frames} of {files.frames} bit-identical" in said, "it does not decode as the host")
    bench.scan_every(1e-3, samples=12)
    bench.run_for(0.02)
    before, board = ask_statistics(bench), bench.board
    arrivals = board.usart.to_host = Stamped(lambda: board.timer.count())
    starts, ends = [], []
    board.passes.on_start, board.passes.on_end = starts.append, ends.append
    # What is under way at both ends does not count.
    bench.run_for(files.seconds + 3e-3)
    frames, latencies_us = [], []
    for arrival_us, packet in arrivals.packets():
        for _, message in packets(packet):
            if message[:1] == ESTIMATE:
                frame, rest = taken(message[1:])
                start_us, _ = taken(rest)
                frames.append(frame)
                latencies_us.append(arrival_us - start_us)
    count = len(arrivals)
    after = ask_statistics(bench)
    latencies_us.sort()
    middle = latencies_us[len(latencies_us) // 2]
    between_us = [board.time.ns(min(start - end for end in ends if end < start)) / 1e3 for start in starts[-100:]]
    board.note(f"{len(frames)} estimates in {files.seconds:g} s, {count / len(frames):.1f} bytes each")
    board.note(f"latency from a scan's start to its estimate's last byte: {latencies_us[0]} to {latencies_us[-1]} us, "
               f"half of them within {middle} us")
    board.note(f"between two scans: {min(between_us):.1f} us or more; decoding {after['longest_decode_us']} us at most")
    expect(frames == list(range(frames[0], frames[0] + len(frames))), "estimates are missing")
    expect(len(frames) >= 1000 * files.seconds, f"{len(frames)} estimates in {files.seconds:g} s")
    for name in ("frames_missed", "failed_samples", "lost_reports"):
        expect(after[name] == before[name], f"{name}: {after[name] - before[name]}")
    bench.finish(erased=[JOURNAL[1], SLOT_B])


def events(make, files):
    """A contact lands and lifts, while a model tracks it: a pin tells both within 5 ms."""
    bench, model, table = make(), files.directory / "tracked.bin", files.directory / "contacts.csv"
    bench.run_for(0.02)
    bench.program("train", "moving", "--track", "--no-refine", "-o", model)
    bench.program("synth", "press", "-n", 400, "--noise", 0, "-o", table)
    with table.open() as file:
        lines = [[float(line[f"r{row}c{column}_ohm"]) for row in range(1, 9) for column in range(1, 19)]
                 for line in csv.DictReader(file)]
    # Some contact is far from each cell: it is at rest.
    rest = [max(line[cell] for line in lines) for cell in range(8 * 18)]
    contact = min(lines, key=lambda line: min(ohm / rest[cell] for cell, ohm in enumerate(line)))

    def show(ohms):
        for row in range(8):
            bench.ohm[row][:] = ohms[18 * row:][:18]

    show(rest)
    bench.taxel("upload", model)
    # The line carries no estimate a millisecond.
    bench.taxel("configure", "--period-us", 1000, "--oversampling", 12, "--report-every", 50)
    bench.ask(CAPTURE + varint(20), BASELINE)
    board, starts, edges = bench.board, [], []
    port, touch = board.ports["C"], 8
    was = [port.high(touch)]

    def changed():
        if port.high(touch) != was[-1]:
            was.append(port.high(touch))
            edges.append(board.time.now)

    port.changed, board.passes.on_start = changed, starts.append
    for ohms in (contact, rest) * 4:
        bench.run_for(20.3e-3)
        changed_at, known = board.time.now, len(edges)
        show(ohms)
        bench.run_for(6e-3)
        expect(len(edges) == known + 1, f"{len(edges) - known} edges of the pin, not one")
        start = min(start for start in starts if start >= changed_at)
        cycles = edges[-1] - start
        board.note(f"{'contact' if was[-1] else 'rest'}: the pin tells it {board.time.ns(edges[-1] - changed_at) / 1e3:.0f} us "
                   f"later, {cycles} cycles or {board.time.ns(cycles) / 1e3:.0f} us behind the start of the next scan")
        expect(board.time.ns(cycles) < 5e6, "the pin is late")
    statistics = ask_statistics(bench)
    board.note(f"decoding and tracking: {statistics['longest_decode_us']} us at most")
    bench.finish(erased=[JOURNAL[1], SLOT_B])


class Stamped(bytearray):
    """Bytes of a line, with the time in us by `clock()` at which each packet ended."""

    def __init__(self, clock):
        super().__init__()
        self._clock, self._ends = clock, []

    def append(self, byte):
        super().append(byte)
        if not byte:
            # It has begun: a byte takes 11 us.
            self._ends.append((self._clock() + 11, len(self)))

    def packets(self):
        """Each packet's end and bytes."""
        start = 0
        for at_us, end in self._ends:
            yield at_us, bytes(self[start:end])
            start = end


def serve(make, files):
    """A board for you: its serial port stays open until Ctrl-C."""
    fault = FAULTS.get(files.fault, lambda board: None)
    options = {"ohm": (files.ohm, files.ohm)} if files.ohm else {}
    bench = make(bare=files.bare and fault not in OF_CIRCUIT, plant=fault, **options)
    terminal = Terminal(bench.board)
    # Both depend on the settling time and the number of samples, which a user may configure.
    bench.board.rules.waived = {"row-left", "wait-short"}
    bench.board.note(f"the image nucleo-f446re, resistances that never change: taxel link {terminal.path} identify")
    stopped = []
    signal.signal(signal.SIGINT, lambda *_: stopped.append(True))
    bench.board.run_until(lambda: stopped)
    # Whatever was asked of it.
    bench.finish(resets=bench.board.resets, erased=[sector for sector, times in bench.board.store.erased.items() if times])


SCENARIOS = {
    scenario.__name__.replace("_", "-"): scenario
    for scenario in (session, sparse, wide, slow_erase, slow_erase_bare, patience, silent_sensor, silent_sensor_slow,
                     no_clock, clock_stops, fault_restarts, panic_restarts, brown_out, sagging_supply, keep, burst, overrun,
                     log_abandoned, restart, dead_host, scans, shorts, stream, events)
}
