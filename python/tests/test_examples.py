"""The Python of README.md and doc/python.md runs as it stands there, on a label map written here."""
import pathlib
import re

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def blocks(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.S)


@pytest.mark.parametrize("page", ["README.md", "doc/python.md"])
def test_from_a_ct_to_lifted_fat(page, ellipsoid, tmp_path, monkeypatch):
    values = np.where(ellipsoid.values == 1, 3, 0).astype(np.uint8)
    head = ("NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 44 44 44\n"
            "space directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (20,0,0)\nencoding: raw\n\n")
    (tmp_path / "ct_labels.nrrd").write_bytes(head.encode() + values.tobytes(order="F"))
    monkeypatch.chdir(tmp_path)
    code = blocks(page)[0]
    assert 8 <= len(code.splitlines()) <= 14
    names = {}
    exec(compile(code.replace("ct_labels.nii.gz", "ct_labels.nrrd"), page, "exec"), names)
    force = np.array(names["force"])
    assert len(force) == 100 and np.isfinite(force).all() and force[-1] > 2 * force[20] > 0


def test_both_pages_show_the_same_lines():
    assert blocks("README.md")[0] == blocks("doc/python.md")[0]
