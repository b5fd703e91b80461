"""The package is typed (py.typed): mypy finds no error, and sees what a caller does wrong."""
import pathlib
import subprocess
import sys

import pytest

pytest.importorskip("mypy")
ROOT = pathlib.Path(__file__).resolve().parents[2]


def mypy(*arguments):
    done = subprocess.run([sys.executable, "-m", "mypy", "--ignore-missing-imports", "--cache-dir=/dev/null", *arguments], capture_output=True,
                          text=True, check=False, cwd=ROOT / "python")
    return done.returncode, done.stdout


def test_the_package_has_no_error_of_types():
    code, said = mypy("omentum")
    assert code == 0, said


def test_a_caller_is_told(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("import omentum as om\nmesh = om.TetMesh.box((1, 1, 1), (2, 2, 2))\ntissue = om.Tissue(mesh, young=[3000])\n"
                       "force: str = tissue.forces()\n")
    code, said = mypy(str(program))
    assert code == 1 and "young" in said and ":4:" in said
