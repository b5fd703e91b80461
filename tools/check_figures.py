#!/usr/bin/env python3
"""Which figures of the documents are older than the code that they measure.

    check_figures.py [--all] [FILE ...]     (default: README.md, pages below doc/, weights/README.md)

A figure names the commit it was measured at, the command, and the code it depends on, in a comment of HTML:

    <!-- measured: 1dcd819 by: omentum_bench fem code: src/fem src/solve -->

A marker may be broken into several lines. It covers everything after it, up to the next marker or heading. At the end of a table row it covers that row
alone. `by:` has the whole command; `code:` has files or folders of the checkout, separated by spaces. Where the command
was run again at a later commit, and computed the same bytes (the hash of a benchmark), this is said by

    <!-- measured: 1dcd819 same: 9e54953 by: omentum_bench fem code: src/fem src/solve -->

and changes count from there: times were measured at the first commit, results hold at the second. A block whose
numbers are settings, limits or references, not measurements, is covered by

    <!-- not measured -->

and a block that tools/readme_figures.py copies from doc/figures.md, where the markers are, by <!-- figures: ... -->.

The list has, for each marker, the commits that changed its code since; --all also lists figures whose code did not
change. Then follow the blocks with figures but without a marker. A block is a paragraph, an item of a list or a row of a
table. It has figures if there is a number in it, and its section is about measurements (by its heading, SECTION, or from
a paragraph on that begins with such a word, BEGIN) or a time stands in it (TIME).

Exit code 0, also if figures are old or unmarked: what to measure again is for a person to decide. 1: a marker is
malformed, names a path that does not exist, or a commit that is not in the history. Without git, and in a shallow
clone, ages are not known; this is said, and the rest is checked.
"""
import pathlib
import re
import subprocess
import sys

COMMENT = re.compile(r"<!--\s*(.*?)\s*-->", re.S)
MARKER = re.compile(r"measured: ([0-9a-f]{7,40})(?: same: ([0-9a-f]{7,40}))? by: (\S.*?) code: (\S.*)")
NOT_MEASURED, COPIED = "not measured", "figures:"
SECTION = re.compile(r"measured|tested|checked|speed|how good|what it costs|what is measured", re.I)
BEGIN = re.compile(r"(\*\*)?(Measured|Speed|How good)\b")
ITEM = re.compile(r"([-*]|\d+\.) ")
TIME = re.compile(r"\d (ms|us|seconds|minutes|hours)\b|\d min\b|times (faster|slower|as long)")


class Block:
    """A paragraph, an item of a list, or a row of a table, with the marker that covers it."""

    def __init__(self, path, line, text, marker, is_about):
        self.path, self.line, self.text, self.marker, self.is_about = path, line, text, marker, is_about

    def has_figures(self):
        return bool(re.search(r"\d", self.text)) and (self.is_about or bool(TIME.search(self.text)))

    def title(self):
        text = COMMENT.sub("", self.text).strip().strip("|").split(" | ")[0]
        return re.sub(r"\s+", " ", text).strip()[:70]


class Marker:
    def __init__(self, path, line, commit, same, command, code):
        self.path, self.line, self.commit, self.same, self.command = path, line, commit, same, command
        self.code, self.blocks = code.split(), []


class Figures:
    def __init__(self, root):
        self.root, self.errors, self.markers, self.blocks = pathlib.Path(root), [], [], []

    def error(self, path, line, why):
        self.errors.append(f"{path}:{line}: {why}")

    # ---- documents ----------------------------------------------------------------------------------

    def parse_marker(self, path, line, comment):
        """A Marker, NOT_MEASURED, or None for a comment of another kind or a malformed one."""
        comment = re.sub(r"\s*\n\s*", " ", comment)
        if comment == NOT_MEASURED or comment.startswith(COPIED):
            return NOT_MEASURED
        if not re.match(r"(not )?measured", comment):
            return None
        match = MARKER.fullmatch(comment)
        if not match:
            self.error(path, line, f'"{comment}" is not of the form "measured: COMMIT [same: COMMIT] by: COMMAND code: PATH ..."')
            return None
        marker = Marker(path, line, *match.groups())
        self.markers.append(marker)
        for code in marker.code:
            if not (self.root / code).exists():
                self.error(path, line, f"code: {code} does not exist")
        return marker

    @staticmethod
    def lines(text):
        """Yield (number, line); a comment that begins a line and is broken into several is one line."""
        broken, start = [], 0
        for number, line in enumerate(text.split("\n"), 1):
            if broken or line.startswith("<!--") and "-->" not in line:
                start = start if broken else number
                broken.append(line)
                if "-->" in line:
                    yield start, "\n".join(broken)
                    broken = []
            else:
                yield number, line
        yield from enumerate(broken, start)

    def read(self, path):
        marker, is_about, is_code, paragraph, start = None, False, False, [], 0

        def end_paragraph():
            if paragraph:
                self.add(Block(path, start, "\n".join(paragraph), marker, is_about))
                paragraph.clear()

        for number, line in self.lines((self.root / path).read_text(encoding="utf-8")):
            if line.startswith("```"):
                end_paragraph()
                is_code = not is_code
            elif is_code or line.startswith("    ") and not paragraph:
                continue
            elif line.startswith("#"):
                end_paragraph()
                marker, is_about = None, bool(SECTION.search(line))
            elif line.startswith("|"):
                end_paragraph()
                own = [self.parse_marker(path, number, c) for c in COMMENT.findall(line)]
                self.add(Block(path, number, line, own[-1] if own else marker, is_about))
            elif COMMENT.fullmatch(line.strip()):
                end_paragraph()
                marker = self.parse_marker(path, number, COMMENT.fullmatch(line.strip())[1]) or marker
            elif not line.strip():
                end_paragraph()
            else:
                if ITEM.match(line):
                    end_paragraph()
                if not paragraph:
                    start = number
                    is_about = is_about or bool(BEGIN.match(line))
                if re.search(r"<!--\s*(not )?measured", line):
                    self.error(path, number, "a marker stands alone on its line, or at the end of a table row")
                paragraph.append(line)
        end_paragraph()

    def add(self, block):
        self.blocks.append(block)
        if isinstance(block.marker, Marker):
            block.marker.blocks.append(block)

    def unmarked(self):
        return [b for b in self.blocks if b.marker is None and b.has_figures()]

    # ---- history ------------------------------------------------------------------------------------

    def git(self, *args):
        """Output of git, or None if it fails or is not there."""
        try:
            run = subprocess.run(["git", "-C", str(self.root), *args], capture_output=True, text=True, check=False)
        except OSError:
            return None
        return run.stdout.strip() if run.returncode == 0 else None

    def history(self):
        """Why the history cannot be used, or None."""
        top = self.git("rev-parse", "--show-toplevel")
        if top is None or pathlib.Path(top).resolve() != self.root.resolve():
            return "this is no git checkout"
        if self.git("rev-parse", "--is-shallow-repository") == "true":
            return "the clone is shallow"
        return None

    def read_log(self):
        """The commits of HEAD, newest first: {hash: (parents, "HASH subject", paths)}. One call of git for all markers."""
        self.log = {}
        for entry in (self.git("log", "--format=%x00%H %P%n%h %s", "--name-only", "--no-renames") or "").split("\0")[1:]:
            head, title, *paths = entry.strip("\n").split("\n")
            commit, *parents = head.split()
            self.log[commit] = (parents, title, [path for path in paths if path])

    def since(self, name):
        """The commits of HEAD that commit `name` does not have, newest first; None if it is not in the history."""
        found = [commit for commit in self.log if commit.startswith(name)]
        if len(found) != 1:
            return None
        before, todo = set(), found
        while todo:
            commit = todo.pop()
            if commit not in before:
                before.add(commit)
                todo += self.log[commit][0]
        return [commit for commit in self.log if commit not in before]

    def changes(self, marker):
        """The commits that changed the code of a marker since, newest first; an error if a commit is unknown."""
        for commit in (marker.commit, marker.same):
            if commit and self.since(commit) is None:
                self.error(marker.path, marker.line, f"commit {commit} is not in the history")
                return []

        def is_code(path):
            return any(path == code.rstrip("/") or path.startswith(code.rstrip("/") + "/") for code in marker.code)

        return [self.log[commit][1] for commit in self.since(marker.same or marker.commit)
                if any(is_code(path) for path in self.log[commit][2])]


def report(figures, is_all):
    """The text of the list."""
    lines, nold, why = [], 0, figures.history()
    if not why:
        figures.read_log()
    if why:
        lines.append(f"{why}: the age of figures is not known, only the form of markers was checked")
    for marker in figures.markers if not why else []:
        changes = figures.changes(marker)
        nold += bool(changes)
        if changes or is_all:
            title = marker.blocks[0].title() if marker.blocks else "covers nothing"
            lines.append(f"{marker.path}:{marker.line}: {title}")
            same = f", the same bytes at {marker.same}," if marker.same else ""
            lines.append(f"    measured at {marker.commit}{same} by: {marker.command}")
            lines.append(f"    {' '.join(marker.code)}: " + (f"{len(changes)} commits since, the last {changes[0]}"
                                                             if changes else "no change since"))
    unmarked = figures.unmarked()
    for block in unmarked:
        lines.append(f"{block.path}:{block.line}: no marker: {block.title()}")
    lines.append(f"{len(figures.markers)} markers" + (f", the code of {nold} has changed" if not why else "")
                 + f"; {len(unmarked)} blocks with figures but no marker; {len(figures.errors)} errors")
    return lines


def main(argv):
    root = pathlib.Path(__file__).resolve().parents[1]
    figures = Figures(root)
    paths = [a for a in argv if a != "--all"]
    if any(a.startswith("-") for a in paths):
        print(__doc__.split("\n\n")[1], file=sys.stderr)
        return 2
    if not paths:
        paths = ["README.md", "weights/README.md"]
        paths += sorted(str(p.relative_to(root)) for p in (root / "doc").rglob("*.md"))
    for path in paths:
        figures.read(path)
    print("\n".join(report(figures, "--all" in argv)))
    for error in figures.errors:
        print(f"error: {error}", file=sys.stderr)
    return 1 if figures.errors else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
