#!/usr/bin/env python3
"""Pool the three draws of a hash: a published figure, with its three numbers and their spread.

    tools/draws.py STUDY PART HASH [TABLE]     TABLE: doc/draws.csv

Prints "91.7 % (275 of 300; draws 96, 89, 90 of 100; standard deviation 3.8 points) of HASH". Exit code 1: not three draws, or
draws of other cases; the line says so. Of two lines of a draw the later one counts.
"""
import csv
import pathlib
import re
import statistics
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
NDRAW = 3


def pool(rows, study, part, digest):
    """(exit code, line)."""
    draws = {}
    for row in rows:
        if (row["study"], row["part"], row["hash"]) == (study, part, digest):
            draws[int(row["draw"])] = row
    if sorted(draws) != list(range(1, NDRAW + 1)):
        return 1, f"{study} {part} {digest} has draws {sorted(draws) or 'none'}; a figure pools 1, 2 and 3"
    rows = [draws[k] for k in sorted(draws)]
    if len({row["cases"] for row in rows}) > 1 or any("quick" in row["cases"] for row in rows):
        return 1, "the draws are of other cases: " + ", ".join(row["cases"] for row in rows)
    found = [re.match(r"(\d+) of (\d+) ", row["result"]) for row in rows]
    if not all(found):
        return 1, "a result is not 'N of M ...'"
    good, count = [int(f[1]) for f in found], [int(f[2]) for f in found]
    share = [100 * g / n for g, n in zip(good, count)]
    return 0, (f"{100 * sum(good) / sum(count):.1f} % ({sum(good)} of {sum(count)}; draws "
               f"{', '.join(str(g) for g in good)} of {count[0]}; standard deviation {statistics.stdev(share):.1f} points) of {digest}")


def main(argv):
    if len(argv) not in (3, 4):
        print(__doc__, file=sys.stderr)
        return 2
    path = pathlib.Path(argv[3]) if len(argv) == 4 else ROOT / "doc/draws.csv"
    with open(path, newline="", encoding="utf-8") as file:
        code, line = pool(list(csv.DictReader(file)), *argv[:3])
    print(line)
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
