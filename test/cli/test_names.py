#!/usr/bin/env python3
"""Names of any bytes: what the program writes can be read again by others, whatever a file, a set or a model is called.

    test_names.py PROGRAM [1|2]     all names, or half of them
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

try:
    import yaml
except ImportError:  # PyYAML is no package of the project; where it is, it reads patient.yaml
    yaml = None

HOSTILE = [b"Gef\xe4\xdf", b"a\x1b[31mred", b"\xff\xfe", b"\xc0\xaf", b"\xed\xa0\x80", b"tab\there", b"\x7f\xc2\x85",
           b'quote"back\\slash', b"<b>&amp;", "肝臓 ä 🫀".encode(), b"'%s%n", b"- a: {b"]
MESH = b"""$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
%d
%s$EndPhysicalNames
$Nodes
5
1 0 0 0
2 10 0 0
3 0 10 0
4 0 0 10
5 8 8 8.5
$EndNodes
$Elements
%d
%s$EndElements
"""


def make_mesh(names):
    """Two tetrahedra; every name is the name of both, and of a vertex."""
    sets, elements = [], []
    for k, name in enumerate(names):
        sets += [b'0 %d "%s"' % (k + 1, name), b'3 %d "%s"' % (k + 101, name)]
        elements.append(b"15 2 %d %d 1" % (k + 1, k + 1))
    elements += [b"4 2 101 1 1 2 3 4", b"4 2 %d 1 2 5 3 4" % (100 + len(names))]
    return MESH % (len(sets), b"".join(line + b"\n" for line in sets), len(elements),
                   b"".join(b"%d %s\n" % (k + 1, line) for k, line in enumerate(elements)))


def check_readable(folder, wrong, what):
    """report.json is JSON and UTF-8, patient.yaml is YAML, and both have no control characters."""
    for name in ("report.json", "patient.yaml", "report.html"):
        data = (folder / name).read_bytes()
        try:
            text = data.decode("utf-8")
            if any(ord(c) < 32 and c not in "\n\t\r" or 0x7f <= ord(c) < 0xa0 for c in text):
                wrong.append(f"{what}: {name} has control characters")
            if name == "report.json":
                json.loads(text)
            elif name == "patient.yaml" and yaml:
                yaml.safe_load(text)
        except (UnicodeDecodeError, ValueError) as error:
            wrong.append(f"{what}: {name}: {error}")
        except Exception as error:  # yaml's own
            wrong.append(f"{what}: {name}: {error}")


def main():
    program = os.fsencode(os.path.abspath(sys.argv[1]))
    wrong = []
    folder = pathlib.Path(tempfile.mkdtemp())

    def run(*words):
        result = subprocess.run([program, *words], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=120,
                                check=False)
        for stream in (result.stdout, result.stderr):
            try:
                text = stream.decode()
                if "\x1b" in text:
                    wrong.append(f"{words}: an escape sequence reaches the terminal")
            except UnicodeDecodeError as error:
                wrong.append(f"{words}: {error}")
        return result

    # a file whose name is made of half of the names, with sets of those names
    parts = [int(part) - 1 for part in sys.argv[2:]] or [0, 1]
    for k in parts:
        names = HOSTILE[k::2]
        path = os.path.join(os.fsencode(folder), b"_".join(names).replace(b"/", b"_") + b".msh")
        with open(path, "wb") as file:
            file.write(make_mesh([name.replace(b'"', b"") for name in names]))
        out = folder / f"model{k}"
        result = run(b"model", path, b"-o", os.fsencode(out), b"-q")
        if result.returncode != 0:
            wrong.append(f"{names}: {result.returncode} {result.stderr}")
            continue
        check_readable(out, wrong, names)
        # the program reads its own model again, under its sets' names
        again = run(b"update", os.fsencode(out / "patient.yaml"), b"none.yaml", b"-q", b"-o", b"none")
        if b"no region of interest" not in again.stderr:  # said after patient.yaml and the mesh are read
            wrong.append(f"{names}: its own model is refused: {again.stderr}")
    for k, name in enumerate(HOSTILE):
        if k % 2 not in parts:
            continue
        # a material of that name: taken if it is plain, refused in one sentence otherwise
        result = run(b"model", path, b"-o", os.fsencode(folder / f"material{k}"), b"-q", b"--material",
                     b"young=3000,name=" + name.replace(b",", b"").replace(b"/", b""))
        if result.returncode == 0:
            check_readable(folder / f"material{k}", wrong, name)
        elif b"material" not in result.stderr or len(result.stderr.splitlines()) != 1:
            wrong.append(f"{name} as a material: {result.stderr}")
        # in a message
        result = run(b"model", name, b"-o", b"none")
        if result.returncode not in (2, 3) or not result.stderr:
            wrong.append(f"{name} as an input: {result.returncode} {result.stderr}")
        run(b"plan", name)
    shutil.rmtree(folder)
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
