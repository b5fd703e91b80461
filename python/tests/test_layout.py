"""The declarations of _capi against the C compiler, and the conversion of fields."""
import ctypes
import os
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pytest

from omentum import capi as c
from omentum._convert import Struct

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_every_struct_has_the_layout_of_the_compiler(tmp_path):
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        pytest.skip("no C compiler")
    program = subprocess.run([sys.executable, ROOT / "tools/python_binding.py", "--layout"], capture_output=True, text=True, check=True)
    source, binary = tmp_path / "layout.c", tmp_path / "layout"
    source.write_text(program.stdout)
    subprocess.run([compiler, f"-I{ROOT}/include", source, "-o", binary], check=True)
    environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
    rows = subprocess.run([binary], capture_output=True, text=True, check=True, env=environment).stdout.splitlines()
    structs = {n for n, k in vars(c).items() if isinstance(k, type) and issubclass(k, Struct) and k is not Struct}
    assert {row.split()[0] for row in rows} == {n for n in structs if not n.endswith("_item")}
    for row in rows:
        name, size, *fields = row.split()
        kind = getattr(c, name)
        assert ctypes.sizeof(kind) == int(size), name
        assert kind._offsets == tuple(int(f) for f in fields[1::2]), name


def test_every_function_of_the_headers_is_in_the_library():
    from omentum import lib
    assert len(c.PROTOTYPES) > 800
    assert all(hasattr(lib, name) for name in c.PROTOTYPES)
    assert c.STATUS <= set(c.PROTOTYPES)


def test_enums_have_the_numbers_of_c():
    assert c.OmStatus.NOT_CONVERGED == 1 and c.OmStatus.CANCELLED == -5
    assert c.OmLaw.STABLE_NEO_HOOKEAN == 4
    assert c.OmSenseTexture.STEEL == 3
    assert c.OM_OBSERVE_COLOR == 8
    assert c.OM_MAX_ARM == 2


def test_fields_are_python_values():
    scene = c.OmScene()
    scene.name = "Leber"
    scene.tissue.size = (0.1, 0.2, 0.3)
    scene.tissue.size[1] = 0.25  # a view of the struct's memory
    assert scene.name == "Leber" and scene.tissue.size.tolist() == [0.1, 0.25, 0.3]
    material = c.OmMaterial(young=3000)
    material.law = "neo-hookean"
    assert material.law is c.OmLaw.NEO_HOOKEAN and material.young == 3000
    with pytest.raises(ValueError, match="neo_hookean"):
        material.law = "neo-hokean"
    with pytest.raises(ValueError, match="63 bytes"):
        scene.name = "x" * 64
    with pytest.raises(ValueError, match="three numbers"):
        scene.tissue.size = (1, 2)
    assert material.as_dict()["young"] == 3000


def test_no_field_hides_a_method_of_structs():
    methods = {name for name in vars(Struct) if not name.startswith("_")}
    assert methods == {"as_dict", "assign"}
    structs = [k for k in vars(c).values() if isinstance(k, type) and issubclass(k, Struct)]
    assert not [(k.__name__, n) for k in structs for n in k._names if n in methods]


def test_a_field_that_does_not_exist_is_refused():
    with pytest.raises(AttributeError, match="did you mean 'young'"):
        c.OmMaterial().yung = 1


def test_matrices_have_rows_and_columns():
    grid = c.OmVoxelGrid()
    grid.axis = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    first_column = np.frombuffer(grid, dtype=np.float64, offset=c.OmVoxelGrid._offsets[1], count=3)
    assert first_column.tolist() == [1, 4, 7]  # C stores columns
    assert grid.axis[0].tolist() == [1, 2, 3]
