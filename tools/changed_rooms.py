#!/usr/bin/env python3
"""Which rooms does a change touch, and which stand directly above them?

    tools/changed_rooms.py COMMIT [ROOT]

prints one line `touched: ...` and one `above: ...` of the difference between COMMIT and the work tree (files that git does not
know count, too). A room is touched by its folders in src/ and test/, its headers in include/ and its fuzz targets; `cli`,
`study`, `python` and `sample` stand for src/cli, studies/, python/ and samples/. A room is above if one of its sources includes a
header of a touched room. Shared files of the build and of the tests touch every room: they print `touched: all`.
Exit code 1: git does not know the commit.
"""
import pathlib
import re
import subprocess
import sys

from check_tree import Tree

FOLDERS = {"studies": "study", "python": "python", "samples": "sample"}
EVERYTHING = re.compile(r"CMakeLists\.txt|CMakePresets\.json|cmake/.*|test/[^/]*|include/omentum/vec\.h")


def room_of(path):
    """The room of a file of the checkout; None for documents and tools, "all" for what every room uses."""
    part = pathlib.PurePath(path).parts
    if EVERYTHING.fullmatch(path):
        return "all"
    if part[0] == "include":
        return Tree.header_room(part[-1])
    if part[0] in ("src", "test") and len(part) > 2:
        return part[1]
    if part[0] == "fuzz" and len(part) > 1:
        found = re.match(r"fuzz_([a-z]+)_", part[-1])
        return found.group(1) if found else None
    return FOLDERS.get(part[0])


def changed(root, commit):
    """Names of the files that differ, or None if git does not know the commit."""
    known = subprocess.run(["git", "diff", "--name-only", commit], cwd=root, capture_output=True, text=True, check=False)
    if known.returncode != 0:
        return None
    new = subprocess.run(["git", "ls-files", "--others", "--exclude-standard"], cwd=root, capture_output=True, text=True, check=True)
    return known.stdout.split("\n") + new.stdout.split("\n")


def users(root):
    """Room -> the rooms whose headers its sources include."""
    uses = {}
    for folder in ("src", "studies"):
        for path in sorted((root / folder).rglob("*.[ch]")):
            room = "study" if folder == "studies" else path.relative_to(root / "src").parts[0]
            for name in re.findall(r'^\s*#\s*include\s+"omentum/(\w+\.h)"', path.read_text(encoding="utf-8"), re.M):
                uses.setdefault(room, set()).add(Tree.header_room(name))
    return uses


def main():
    root = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).resolve().parents[1])
    files = changed(root, sys.argv[1])
    if files is None:
        print(f"changed_rooms: git does not know the commit {sys.argv[1]}", file=sys.stderr)
        return 1
    touched = {room_of(name) for name in files if name} - {None}
    if "all" in touched:
        print("touched: all\nabove:")
        return 0
    above = {room for room, used in users(root).items() if used & touched} - touched
    print("touched:", *sorted(touched))
    print("above:", *sorted(above))
    return 0


if __name__ == "__main__":
    sys.exit(main())
