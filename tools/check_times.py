#!/usr/bin/env python3
"""Write doc/check_times.md: the processor time of every quick test, as the last `make check` measured it, and of its builds.

    tools/check_times.py [--before FILE]       after `make check` from a clean checkout without a compiler cache

FILE is the JSON of an earlier check (build/times_release.json). Tests: build/times_release.json and build/times_dev.json,
which check.sh writes. Builds: the log of ninja, whose times are wall times of two compilers side by side.
"""
import argparse
import collections
import json
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]
KINDS = (("omentum_objects.dir/", "library"), ("studies/", "studies"), ("src/cli/", "program"), ("test/", "tests"),
         ("fuzz/", "fuzz replays"), ("samples/", "samples"))


def read(path):
    return json.loads(path.read_text()) if path.is_file() else {}


def builds(preset):
    """(kind, step) -> [count, seconds] of the last time that each file was made."""
    rows = collections.defaultdict(lambda: [0, 0.0])
    last = {}
    for line in (ROOT / "build" / preset / ".ninja_log").read_text().split("\n")[1:]:
        part = line.split("\t")
        if len(part) > 3:
            last[part[3]] = (int(part[1]) - int(part[0])) / 1000
    for name, seconds in last.items():
        kind = next((kind for start, kind in KINDS if start in name), "library")
        row = rows[kind, "compile" if name.endswith(".o") else "link"]
        row[0] += 1
        row[1] += seconds
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=pathlib.Path)
    args = parser.parse_args()
    commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    release, dev = read(ROOT / "build/times_release.json"), read(ROOT / "build/times_dev.json")
    before = read(args.before) if args.before else {}
    total = [sum(row["processor"] for row in table.values()) for table in (release, dev, before)]
    lines = ["# Times of the check", "",
             f"Written by `tools/check_times.py` after `make check` of {commit}: not edited by hand. Seconds of processor time on the",
             "two-core reference machine, which other work may share; a second run differs by up to a fifth.", "",
             "| tests | release | sanitizers |" + (" release, before |" if before else ""),
             "|---|---|---|" + ("---|" if before else ""),
             f"| all | {total[0]:.0f} ({len(release)}) | {total[1]:.0f} ({len(dev)}) |" + (f" {total[2]:.0f} ({len(before)}) |" if before else ""), "",
             "Under the sanitizers run the parsers, `base` and the cases of failing allocations of every room (`tools/check.sh`).", "",
             "| build | files | release, s | sanitizers, s |", "|---|---|---|---|"]
    tables = [builds("release"), builds("dev")]
    for key in sorted(set(tables[0]) | set(tables[1])):
        cells = [f"{table[key][1]:.0f}" if key in table else "-" for table in tables]
        lines.append(f"| {key[1]}: {key[0]} | {max(table[key][0] if key in table else 0 for table in tables)} | {cells[0]} | {cells[1]} |")
    lines += ["", "Times of builds are wall times of each step, two steps side by side.", "",
              "| test | release | sanitizers |" + (" release, before |" if before else ""), "|---|---|---|" + ("---|" if before else "")]
    for name in sorted(set(release) | set(dev), key=lambda name: (-release.get(name, {}).get("processor", 0), name)):
        cells = [f"{table[name]['processor']:.2f}" if name in table else "-" for table in ([release, dev] + ([before] if before else []))]
        lines.append(f"| `{name}` | " + " | ".join(cells) + " |")
    gone = sorted(set(before) - set(release))
    if gone:
        lines += ["", "Quick before, now with another name or the label slow: " + ", ".join(f"`{name}`" for name in gone) + "."]
        lines[-1] = "\n".join(wrap(lines[-1]))
    (ROOT / "doc/check_times.md").write_text("\n".join(lines) + "\n")
    return 0


def wrap(text, width=118):
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append("")
        lines[-1] += (" " if lines[-1] else "") + word
    return lines


if __name__ == "__main__":
    main()
