"""`python -m taxel` is the command `taxel`."""

import sys

from taxel._cli import main

sys.exit(main())
