"""Runs scenarios on the emulated board; `cargo xtask board` starts this.

Exit status: 0 all scenarios passed, 1 one failed, 2 wrong usage.
"""

import argparse
import pathlib
import signal
import sys
import time

from bench import Bench, Failed
from faults import FAULTS
from machine.rules import Fault
from scenarios import SCENARIOS, serve


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--image", type=pathlib.Path, required=True, help="the board's image (ELF)")
    parser.add_argument("--wide-image", type=pathlib.Path, required=True,
                        help="the same with room for 16 rows, for the scenario `wide`")
    parser.add_argument("--scans", required=True,
                        help="its scans as computed, in us: mean and longest with one sample a reading, and with twelve")
    parser.add_argument("--seconds", type=float, default=1.0, help="seconds for which `stream` counts estimates (1)")
    parser.add_argument("scenarios", nargs="*", metavar="scenario",
                        help=f"all, or some of: {', '.join(SCENARIOS)}; or serve")
    parser.add_argument("--bare", action="store_true", help="`serve` has nothing at its pins, unless a fault needs a circuit")
    parser.add_argument("--ohm", type=float, help="all resistances of `serve` (others from 44 to 68 ohm)")
    parser.add_argument("--fault", choices=FAULTS, help="a fault of `serve`")
    parser.add_argument("--taxel", type=pathlib.Path, required=True, help="the program taxel")
    parser.add_argument("--model", type=pathlib.Path, required=True, help="a model of the scene `press`")
    parser.add_argument("--directory", type=pathlib.Path, required=True, help="folder for logs and tables")
    parser.add_argument("--frames", type=int, default=30, help="frames that `check` decodes (30)")
    files = parser.parse_args()
    # Python's own handling would be lost where Unicorn calls Python.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    known = {**SCENARIOS, "serve": serve}
    unknown = [name for name in files.scenarios if name not in known]
    if unknown:
        parser.error(f"there is no scenario {unknown[0]}, but {', '.join(known)}")
    failed = [name for name in files.scenarios or SCENARIOS if not run(name, known[name], files)]
    return 1 if failed else 0


def run(name, scenario, files):
    """Runs a scenario; returns whether it passed."""
    print(f"-- {name}: {' '.join(scenario.__doc__.split())}", flush=True)
    start, made = time.monotonic(), []

    def log(*words):
        print("  ", *words, flush=True)

    def make(image=files.image, **options):
        made.append(Bench(image, files.taxel, log, **options))
        return made[-1]

    try:
        scenario(make, files)
        cause = None
    except (Failed, Fault) as failure:
        cause = failure
    seconds = time.monotonic() - start
    for bench in made:
        bench.board.take_log()
        (files.directory / f"{name}.defmt").write_bytes(bench.board.logged)
        print(f"   {bench.board.time.seconds():.3f} s of the board, {bench.board.interrupts} interrupts, in "
              f"{seconds:.1f} s")
    print(f"ok      {name}" if cause is None else f"FAILED  {name}: {cause}", flush=True)
    return cause is None


if __name__ == "__main__":
    sys.exit(main())
