"""The Python of README.md and doc/python.md runs as printed, in the checkout."""
# PARTS 2
import pathlib
import re

import numpy as np

import omentum as om

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


def test_from_a_segmentation_to_a_lifted_organ(monkeypatch):
    """Lifted slowly, the organ is in balance: tool and attachments bear its weight."""
    monkeypatch.chdir(ROOT)
    code = blocks("doc/python.md")[1]
    assert "set_attachment" in code
    names = {"np": np, "om": om}
    code = code.replace('label="kidney_left"', 'label="kidney_left", has_bending_test=False').replace("0, 2, 0.02", "0, 0.6, 0.02")  # cheaper
    exec(compile(code.split("tissue.plot")[0], "python.md", "exec"), names)
    force, f = np.array(names["force"]), names["tissue"].forces()
    assert len(force) == 30 and (np.diff(force[1:]) > 0).all()  # the tool starts from rest
    assert np.linalg.norm(f.grasp[0] + f.attachment + f.weight) < 0.02 * force[-1]
