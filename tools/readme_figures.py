#!/usr/bin/env python3
"""Copy figures of doc/figures.md into the table of README.md.

    readme_figures.py            write README.md
    readme_figures.py --check    exit code 1 if its table is out of date

A figure of doc/figures.md is a section:

    ### What is measured

    <!-- measured: 1dcd819 by: omentum_bench fem code: src/fem src/solve -->
    <!-- readme -->

    - **omentum**: 3 ms
    - **compared with**: another program: 5 ms
    - **command**: `make bench`

Sections with <!-- readme --> become rows of README.md, between <!-- figures: begin ... --> and <!-- figures: end -->;
<!-- readme: Another title --> gives a row a title of its own. "compared with" may be missing.
"""
import pathlib
import re
import sys

BEGIN, END = "<!-- figures: begin", "<!-- figures: end -->"
NOTE = f"{BEGIN}; tools/readme_figures.py copies them from doc/figures.md -->"
README = re.compile(r"<!-- readme(?:: (.*?))? -->")
MAX_ROW = 199  # characters; tools/check_tree.py refuses longer lines


class FiguresError(Exception):
    """The sentence for the person who edits the pages."""


def items(section):
    """The list of a section as a dictionary; an item may be broken into several lines."""
    found = {}
    for match in re.finditer(r"^- \*\*(.+?)\*\*: (.+(?:\n  .+)*)", section, flags=re.M):
        found[match[1]] = re.sub(r"\s*\n\s*", " ", match[2]).strip()
    return found


def rows(text):
    """Rows (what, omentum, compared with) of the sections with <!-- readme -->."""
    found = []
    for section in re.split(r"^### ", text, flags=re.M)[1:]:
        mark = README.search(section)
        if mark:
            title, values = mark[1] or section.split("\n", 1)[0].strip(), items(section)
            if "omentum" not in values:
                raise FiguresError(f'doc/figures.md: "{title}" has no item **omentum**')
            found.append((title, values["omentum"], values.get("compared with", "")))
    if not found:
        raise FiguresError("doc/figures.md: no section has <!-- readme -->")
    return found


def table(text):
    """The block of README.md for the text of doc/figures.md."""
    lines = [NOTE, "", "| what | omentum | compared with |", "|---|---|---|"]
    for row in rows(text):
        line = f"| {' | '.join(row)} |"
        if "|" in "".join(row) or len(line) > MAX_ROW:
            raise FiguresError(f'doc/figures.md: the row "{row[0]}" of README.md has {len(line)} characters, the limit is '
                               f"{MAX_ROW}, or a |")
        lines.append(line)
    return "\n".join(lines + ["", END])


def replace(readme, block):
    """README.md with the block between its two markers."""
    begin, end = readme.find(BEGIN), readme.find(END)
    if begin < 0 or end < begin:
        raise FiguresError(f'README.md: no "{BEGIN} ... -->" with "{END}" after it')
    return readme[:begin] + block + readme[end + len(END):]


def main(argv, root=pathlib.Path(__file__).resolve().parents[1]):
    if argv not in ([], ["--check"]):
        print(__doc__.split("\n\n")[1], file=sys.stderr)
        return 2
    path = root / "README.md"
    readme = path.read_text(encoding="utf-8")
    try:
        new = replace(readme, table((root / "doc/figures.md").read_text(encoding="utf-8")))
    except FiguresError as error:
        print(error, file=sys.stderr)
        return 1
    if argv and new != readme:
        print("README.md: its figures are not those of doc/figures.md: run tools/readme_figures.py", file=sys.stderr)
        return 1
    if new != readme:
        path.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
