"""Rules: what silicon does not forgive. `rules.txt` has them all."""

import collections
import pathlib


class Fault(Exception):
    """The emulator met something that it does not model."""


def catalogue():
    """Texts of all rules by name."""
    lines = (pathlib.Path(__file__).parent.parent / "rules.txt").read_text().splitlines()
    fields = (line.split("|") for line in lines if line and not line.startswith("#"))
    return {name.strip(): text.strip() for name, text, _ in fields}


class Rules:
    """Counts breaches of rules, and keeps the first instance of each."""

    def __init__(self, where, log):
        self._texts, self._where, self._log = catalogue(), where, log
        self.counts = collections.Counter()
        #: Rules that do not hold here.
        self.waived = set()

    def breach(self, name, detail=""):
        """Records a breach of the rule `name`."""
        if name in self.waived:
            return
        if not self.counts[name]:
            self._log(f"BREACH {name}: {self._texts[name]} {detail} ({self._where()})")
        self.counts[name] += 1
