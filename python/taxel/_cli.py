"""The command `taxel`."""

import signal
import sys

from taxel._native import main as _main


def main() -> int:
    # The program has its own way to end by Ctrl-C: it leaves no half-written file.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _main(["taxel", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
