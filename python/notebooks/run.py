#!/usr/bin/env python3
"""Run notebooks without Jupyter.

    run.py NOTEBOOK...            run, and compare the results with those in the file; exit code 1 if they differ
    run.py --write NOTEBOOK...    run, and write the results into the file

The code cells run in order in one namespace, as Jupyter runs them: what is printed, and the value of the last expression of a
cell, become outputs. Words are compared exactly, numbers to 1 %, or to 2 units of their last digit: another compiler rounds
differently. Of a picture the size is compared, of a drawing the words.
"""
import ast
import base64
import contextlib
import io
import json
import pathlib
import re
import struct
import sys
import traceback

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
RELATIVE = 0.01


def run_cell(source, names, label):
    """The outputs of a cell, as nbformat 4 has them."""
    tree = ast.parse(source, label)
    last = ast.Expression(tree.body.pop().value) if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(tree, label, "exec"), names)
        value = eval(compile(last, label, "eval"), names) if last else None
    outputs = []
    if out.getvalue():
        outputs.append({"name": "stdout", "output_type": "stream", "text": lines(out.getvalue())})
    if value is not None:
        outputs.append({"data": show(value), "metadata": {}, "output_type": "display_data"})
    return outputs


def show(value):
    """A value as Jupyter shows it: a PNG, a drawing, or text."""
    data = {"text/plain": lines(repr(value))}
    if hasattr(value, "_repr_png_"):
        data["image/png"] = base64.b64encode(value._repr_png_()).decode() + "\n"
    if hasattr(value, "_repr_svg_"):
        data["image/svg+xml"] = lines(value._repr_svg_())
    return data


def lines(text):
    return text.splitlines(keepends=True)


def run(notebook, name):
    """All outputs, a list for each code cell. An exception names its cell."""
    names, results = {"__name__": "__main__"}, []
    for number, cell in enumerate(notebook["cells"]):
        if cell["cell_type"] == "code":
            results.append(run_cell("".join(cell["source"]), names, f"{name}, cell {number}"))
    return results


def flat(outputs):
    """(kind, text) of each output; consecutive prints are one."""
    found = []
    for output in outputs:
        if output["output_type"] == "stream":
            text = "".join(output["text"])
            if found and found[-1][0] == "print":
                text = found.pop()[1] + text
            found.append(("print", text))
            continue
        data = output["data"]
        if "image/png" in data:
            head = base64.b64decode("".join(data["image/png"]))[:24]
            found.append(("picture", "%d x %d" % struct.unpack(">2I", head[16:24])))
        elif "image/svg+xml" in data:
            words = re.findall(r"<text[^>]*>([^<]*)</text>", "".join(data["image/svg+xml"]))
            found.append(("drawing", "\n".join(w for w in words if not NUMBER.fullmatch(w))))
        else:
            found.append(("value", "".join(data["text/plain"])))
    return found


def is_close(a, b):
    x, y = float(a), float(b)
    unit = max(10.0 ** -len(t.partition(".")[2]) if "." in t else 0.0 for t in (a, b)) if "e" not in (a + b).lower() else 0.0
    return abs(x - y) <= max(RELATIVE * max(abs(x), abs(y)), 2.001 * unit)


def compare(old, new):
    """Differences between the outputs of a cell, as sentences."""
    old, new = flat(old), flat(new)
    if [kind for kind, _ in old] != [kind for kind, _ in new]:
        return [f"the file has {[k for k, _ in old]}, the run {[k for k, _ in new]}"]
    found = []
    for (kind, was), (_, now) in zip(old, new):
        if [w.split() for w in NUMBER.split(was)] != [w.split() for w in NUMBER.split(now)]:
            found.append(f"{kind}: the file has\n{was}\nthe run\n{now}")
            continue
        found += [f"{kind}: the file has {a}, the run {b}" for a, b in zip(NUMBER.findall(was), NUMBER.findall(now)) if not is_close(a, b)]
    return found


def check(path, write=False):
    """Run a notebook; the differences, or with `write` none."""
    notebook = json.loads(path.read_text(encoding="utf-8"))
    results, found, at = run(notebook, path.name), [], 0
    for number, cell in enumerate(notebook["cells"]):
        if cell["cell_type"] == "code":
            if write:
                cell["outputs"], cell["execution_count"] = results[at], at + 1
            else:
                found += [f"{path.name}, cell {number}: {one}" for one in compare(cell["outputs"], results[at])]
            at += 1
    if write:
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return found


def main():
    write = "--write" in sys.argv[1:]
    paths = [pathlib.Path(a) for a in sys.argv[1:] if a != "--write"]
    if not paths:
        sys.exit(__doc__)
    found = []
    for path in paths:
        try:
            found += check(path, write)
        except Exception:
            found.append(traceback.format_exc())
    print("\n".join(found) if found else f"{len(paths)} notebooks {'written' if write else 'as in their files'}")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
