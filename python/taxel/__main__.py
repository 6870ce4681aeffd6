"""`python -m taxel` is the command `host-sim`."""

import sys

from taxel._cli import main

sys.exit(main())
