"""Times the same work in Taxel and in numpy or scikit-learn, and prints times and ratios.

    python proof/compare/compare.py                # every subject
    python proof/compare/compare.py synthesis      # one

Times and `ratio` are of medians, `fastest` is the ratio of the fastest runs. Progress goes to stderr, the
table to stdout.
"""

import argparse
import importlib

# A module each, with a function `rows()`.
SUBJECTS = ["synthesis", "csv_reading", "training", "decode"]


def in_words(seconds: float) -> str:
    """A duration with three digits and a fitting unit."""
    for unit, factor in [("s", 1), ("ms", 1e3), ("µs", 1e6)]:
        if seconds * factor >= 1:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("subjects", nargs="*", metavar="SUBJECT", help=", ".join(SUBJECTS))
    chosen = parser.parse_args().subjects or SUBJECTS
    for name in chosen:
        if name not in SUBJECTS:
            parser.error(f"subject {name!r} is unknown; choose from {', '.join(SUBJECTS)}")
    rows = [row for name in chosen for row in importlib.import_module(name).rows()]
    work = max(len(row.work) for row in rows)
    reference = max(len(row.reference) for row in rows)
    titles = f"{'takes':>8}  {'Taxel':>8}  {'ratio':>6}  {'fastest':>7}"
    print(f"{'work':{work}}  {'reference':{reference}}  {titles}")
    for row in rows:
        times = f"{in_words(row.reference_s.median):>8}  {in_words(row.taxel_s.median):>8}"
        ratio = row.reference_s.median / row.taxel_s.median
        fastest = row.reference_s.fastest / row.taxel_s.fastest
        print(f"{row.work:{work}}  {row.reference:{reference}}  {times}  {ratio:6.1f}  {fastest:7.1f}")


if __name__ == "__main__":
    main()
