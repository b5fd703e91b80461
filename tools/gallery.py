#!/usr/bin/env python3
"""Make the pictures of doc/gallery.md again, from the commands that the page prints.

    gallery.py [--take] [NAME ...]     all pictures, or those with these names; `make gallery`
                                       --take: run no command, take the pictures from what lies in out/

Each picture of the page has a block of commands behind its heading, and a comment that says which file of theirs it is:

    <!-- picture: images/gallery/NAME.png from: PATH [#K ...] [width: PIXELS] -->

PATH is a picture, a pattern (the last file of that pattern), or a page: then #K is its K-th embedded picture, #-K the
K-th from the end. Several stand side by side. Of a page `NAME.svg` is the K-th drawing, and of a notebook #K is the picture of its K-th picture output.
Pictures of a browser are made by `make pictures`. PNG files are shrunk to the width (default 480 pixels each).
"""
import base64
import glob
import json
import pathlib
import re
import subprocess
import sys

import picture_row

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "doc/gallery.md"
ENTRY = re.compile(r"<!-- picture: images/gallery/(\S+) from: (\S+)((?: #-?\d+)*)(?: width: (\d+))? -->")
MOST = 150000  # bytes of a picture


def entries(text):
    """(name, path, numbers, width, commands) of each picture made here."""
    for section in re.split(r"^## ", text, flags=re.M)[1:]:
        commands = re.search(r"```\n(.*?)```", section, flags=re.S)
        for name, path, numbers, width in ENTRY.findall(section):
            yield name, path, [int(n[1:]) for n in numbers.split()], int(width or 480), commands.group(1) if commands else ""


def embedded(path):
    """The pictures of a page or a notebook, as bytes."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        outputs = [o.get("data", {}) for c in json.loads(text)["cells"] for o in c.get("outputs", [])]
        return [base64.b64decode("".join(d["image/png"])) for d in outputs if "image/png" in d]
    return [base64.b64decode(part) for part in re.findall(r"data:image/png;base64,([A-Za-z0-9+/=]+)", text)]


def drawing(path, number):
    """A drawing of a page as a file of its own: on white, with those rules of the page's style that drawings use."""
    page = path.read_text(encoding="utf-8")
    found = re.findall(r"<svg.*?</svg>", page, flags=re.S)[number - 1]
    style = re.sub(r"@media[^{]*\{(?:[^{}]*\{[^{}]*\})*[^{}]*\}", "", re.search(r"<style>(.*?)</style>", page, flags=re.S).group(1))
    rules = [rule for rule in re.findall(r"[^{}]+\{[^{}]*\}", style) if re.match(r"\s*(svg |\.c\d|:root)", rule)]
    x, y, width, height = (float(v) for v in re.search(r'viewBox="([^"]*)"', found).group(1).split())
    box = f"{x - 10:g} {y - 10:g} {width + 20:g} {height + 20:g}"
    label = re.search(r'aria-label="([^"]*)"', found)
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" width="{width + 20:g}" role="img" aria-label="{label.group(1) if label else ""}">\n'
            f"<style>text{{font-family:system-ui,sans-serif}}{''.join(rule.strip() for rule in rules)}</style>\n"
            f'<rect x="{x - 10:g}" y="{y - 10:g}" width="100%" height="100%" fill="#fff"/>' + re.sub(r"^<svg[^>]*>", "", found) + "\n")


def take(name, path, numbers, width):
    """Write a picture of the gallery from a file that the commands wrote."""
    out = ROOT / "doc/images/gallery" / name
    found = sorted(glob.glob(str(ROOT / path)))
    if not found:
        sys.exit(f"{name}: there is no {path}")
    source = pathlib.Path(found[-1])
    out.parent.mkdir(exist_ok=True)
    if out.suffix == ".svg":
        out.write_text(drawing(source, numbers[0]), encoding="utf-8")
    else:
        parts = [source]
        if numbers:
            all_of_it, parts = embedded(source), []
            for number in numbers:
                parts.append(ROOT / f"out/gallery/.{name}.{number}.png")
                parts[-1].parent.mkdir(parents=True, exist_ok=True)
                parts[-1].write_bytes(all_of_it[number - (number > 0)])
        picture_row.side_by_side(out, width, parts)
        for part in parts if numbers else []:
            part.unlink()
    size = out.stat().st_size
    print(f"{out.relative_to(ROOT)}: {size} bytes")
    if size > MOST:
        sys.exit(f"{name}: the limit is {MOST} bytes: make it narrower")


def main():
    words = sys.argv[1:]
    names, is_run = [w for w in words if not w.startswith("-")], "--take" not in words
    done = set()
    for name, path, numbers, width, commands in entries(PAGE.read_text(encoding="utf-8")):
        if names and name not in names:
            continue
        if is_run and commands not in done:
            print(commands, end="", flush=True)
            code = subprocess.run(["bash", "-c", commands], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode
            if code not in (0, 1):  # 1: done, with a negative outcome
                sys.exit(f"{name}: its commands ended with {code}")
            done.add(commands)
        take(name, path, numbers, width)


if __name__ == "__main__":
    main()
