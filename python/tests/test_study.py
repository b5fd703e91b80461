"""A study of chapter 3, made by the C program and from Python: the same figures."""
import csv
import importlib.util
import os
import pathlib
import subprocess

import pytest

PROGRAM = os.environ.get("OMENTUM_PROGRAM")
EXAMPLE = pathlib.Path(__file__).resolve().parents[1] / "examples" / "press_lesions.py"


@pytest.mark.skipif(not PROGRAM, reason="OMENTUM_PROGRAM does not name the program omentum")
def test_the_contact_study_from_python(tmp_path, capsys):
    """Forces to 1e-3 and errors to 1e-3 mm: the study's files have nine digits, and 150 steps follow each other."""
    environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
    subprocess.run([PROGRAM, "study", "contact", "--resolutions", "623", "--lesions-used", "1", "--truth", "1000", "-q", "-o",
                    tmp_path / "study"], check=True, capture_output=True, env=environment)
    spec = importlib.util.spec_from_file_location("press_lesions", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main(tmp_path / "study")
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows] == list(example.METHODS)
    with open(tmp_path / "study/runs.csv", newline="") as file:
        force = {r["method"]: float(r["force_end_n"]) for r in csv.DictReader(file)}
    with open(tmp_path / "study/errors.csv", newline="") as file:
        error = {(r["method"], r["depth_mm"]): float(r["error_mm"]) for r in csv.DictReader(file)}
    for method, _, _, end, *errors in rows:
        assert float(end) == pytest.approx(force[method], rel=1e-3)
        assert len(errors) == 5
        for one in errors:
            depth, value = one.split(":")
            assert float(value) == pytest.approx(error[method, depth], abs=1e-3)
