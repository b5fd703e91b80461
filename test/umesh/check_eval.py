#!/usr/bin/env python3
"""A second reader of `omentum umesh eval -o DIR`: eval.json and what is printed against errors.csv.

    check_eval.py DIR PRINTED EXIT_CODE

One line for each disagreement and exit code 1; else a line with the mean.
"""
import csv
import json
import pathlib
import re
import statistics
import sys

folder, printed, code = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]).read_text(), int(sys.argv[3])
wrong = []
with open(folder / "errors.csv", newline="") as file:
    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
told = json.loads((folder / "eval.json").read_text())
error = [row["error_mm"] for row in rows]
presses = [row["error_mm"] for row in rows if row["press_mm"] > 0]
forces = [row["error_mm"] for row in rows if row["press_mm"] == 0]
mean, worst = statistics.fmean(error), max(error)


def near(what, found, expected, tol):
    if not abs(float(found) - expected) <= tol:
        wrong.append(f"{what}: {found}, computed {expected}")


def says(pattern, *expected):
    """Numbers of a printed line, as many digits as it has."""
    line = re.search(pattern, printed, re.M)
    if not line:
        wrong.append(f"not printed: {pattern}")
        return
    for text, value in zip(line.groups(), expected):
        near(pattern, text, value, 0.51 * 10 ** -len(text.partition(".")[2]) + 1e-6)


near("samples", told["samples"], len(rows), 0)
near("mean", told["mean_error_mm"], mean, 1e-6)
near("sd", told["sd_mm"], statistics.pstdev(error), 1e-6)
near("worst", told["worst_mm"], worst, 1e-6)
near("worst sample", told["worst_sample"], rows[error.index(worst)]["sample"], 0)
near("largest", told["largest_displacement_mm"], max(row["largest_mm"] for row in rows), 1e-3)
near("inside", told["inside"], sum(row["score"] <= 1 for row in rows), 0)
for row in rows:  # nodes that the probe moves go where it goes, and some tissue goes farther, never all less
    if row["largest_mm"] < row["press_mm"] - 1e-3:
        wrong.append(f"sample {row['sample']}: pressed {row['press_mm']} mm, moved {row['largest_mm']} mm")
says(r"^(\d+) samples, displacements up to ([\d.]+) mm", len(rows), told["largest_displacement_mm"])
says(r"^mean norm error ([\d.]+) mm \(sd ([\d.]+)\), worst sample ([\d.]+) mm \(number (\d+)\)", mean, statistics.pstdev(error),
     worst, told["worst_sample"])
says(r"^ +(\d+) under a force: ([\d.]+) mm, worst ([\d.]+)", len(forces), statistics.fmean(forces), max(forces))
says(r"^ +(\d+) moved by the probe: ([\d.]+) mm, worst ([\d.]+)", len(presses), statistics.fmean(presses), max(presses))
says(r"^refined, (\d+) are farther than 0.25 mm off", sum(e > 0.25 for e in error))
says(r"^the network alone leaves ([\d.]+) %", 100 * told["network_mean_error_mm"] / told["linear_alone_mean_error_mm"])
bars = f"the bars: mean 0.05 mm {'met' if mean <= 0.05 else 'MISSED'}, worst 0.25 mm {'met' if worst <= 0.25 else 'MISSED'}"
if bars not in printed:
    wrong.append(f"not printed: {bars}")
if code != (0 if mean <= 0.05 and worst <= 0.25 else 1):
    wrong.append(f"exit code {code}: mean {mean}, worst {worst}")
if not told["mean_error_mm"] < told["network_mean_error_mm"]:
    wrong.append("refinement brings no answer nearer")
if wrong:
    sys.exit("\n".join(wrong))
print(f"eval: every number agrees, mean {mean:.4f} mm of {len(rows)} samples")
