"""The Python of README.md and doc/python.md runs as printed, in the checkout."""
import pathlib
import re

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]


def blocks(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.S)


def test_from_a_ct_to_lifted_fat(monkeypatch):
    monkeypatch.chdir(ROOT)
    code = blocks("README.md")[0]
    assert code == blocks("doc/python.md")[0]
    assert 8 <= len(code.splitlines()) <= 14
    names = {}
    exec(compile(code, "README.md", "exec"), names)
    force = np.array(names["force"])
    assert len(force) == 100 and np.isfinite(force).all() and force[-1] > 2 * force[20] > 0
