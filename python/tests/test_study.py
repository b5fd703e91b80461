"""The example of the contact study of chapter 3: its figures on a block, and those of the C program."""
import csv
import importlib.util
import json
import os
import pathlib
import subprocess

import pytest

import omentum as om

PROGRAM = os.environ.get("OMENTUM_PROGRAM")
EXAMPLE = pathlib.Path(__file__).resolve().parents[1] / "examples" / "press_lesions.py"


def run_example(folder, capsys):
    """The example, and the rows it prints."""
    spec = importlib.util.spec_from_file_location("press_lesions", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main(folder)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows] == list(example.METHODS)
    return rows


def test_a_block_under_the_probe(tmp_path, capsys):
    """A folder as the study writes it; the lesion is 20 mm under the probe, and its place at rest counts as the truth: an error is its
    displacement, in mm."""
    centre, depths = [0.08, 0.07, 0.05], [0.010, 0.020, 0.030]
    (tmp_path / "meshes").mkdir()
    for number, cells in (("000500", (6, 5, 3)), ("026220", (12, 10, 6))):
        mesh = om.TetMesh.box((0.16, 0.14, 0.07), cells)
        mesh.sets["attachment"] = (mesh.x[:, 2] < 1e-9).nonzero()[0]
        mesh.save(tmp_path / "meshes" / f"{number}-0.vtu")
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "penalty-000500-01.json").touch()
    truth = [{"depth": depth, "measured": centre} for depth in depths]
    lesion = {"center": centre, "normal": [0, 0, 1], "touch": [0.08, 0.07, 0.07], "truth": truth}
    (tmp_path / "study.json").write_text(json.dumps({"lesions": [lesion]}))
    force = {}
    for method, ntet, number, end, *errors in run_example(tmp_path, capsys):
        assert (ntet, number) == ("500", "1")
        moved = {int(depth): float(mm) for depth, mm in (one.split(":") for one in errors)}
        print(method, end, moved)
        assert list(moved) == [10, 20, 30] and 0 < moved[10] < moved[20] < moved[30] < 30
        force[method] = float(end)
    assert force["penalty"] == pytest.approx(force["multipliers"], rel=0.01)  # 0.4 %: penetration of 0.05 mm
    assert force["prescribed"] > 1.1 * force["multipliers"] > 0  # nothing slides


@pytest.mark.slow
@pytest.mark.skipif(not PROGRAM, reason="OMENTUM_PROGRAM does not name the program omentum")
def test_the_contact_study_from_python(tmp_path, capsys):
    """Forces to 1e-3 and errors to 1e-3 mm: the study's files have nine digits, and 150 steps follow each other."""
    environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
    subprocess.run([PROGRAM, "study", "contact", "--resolutions", "623", "--lesions-used", "1", "--truth", "1000", "-q", "-o",
                    tmp_path / "study"], check=True, capture_output=True, env=environment)
    rows = run_example(tmp_path / "study", capsys)
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
