"""The snippets of doc/from_other_tools.md run, in the order of the page; the pairs of Python and C give the same numbers."""
# PARTS 5
import contextlib
import functools
import io
import os
import pathlib
import re
import shutil
import subprocess

import numpy as np
import pytest

import omentum as om

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "doc" / "from_other_tools.md"
PROGRAM = os.environ.get("OMENTUM_PROGRAM")
BLOCK = re.compile(r"```(python|c|yaml|sh)\n(.*?)```", re.S)

HEAD = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "omentum/omentum.h"
static void check(OmStatus status, const char* call) {
    if (status == OM_OK) return;
    fprintf(stderr, "%s: %s\\n", call, om_error_message());
    exit(1);
}
int main(void) {
"""
TAIL = """
printf("%.12g %.12g %.12g %d %.12g\\n", om_norm(forces.pull[0]), contact.force.z, contact.penetration, contact.ncontact, where[2]);
return 0;
}
"""


def checked(code):
    """C in which every call that returns a status is checked."""
    def wrap(found):
        return f"{found[1]}check({found[2]}{found[3]}, \"{found[2]}\");" if found[2] in om.capi.STATUS else found[0]

    return re.sub(r"(?m)^(\s*)(om_\w+)(\(.*\));$", wrap, code)


GROUPS = {  # tasks that need nothing of each other, each after the first snippet; all others are "mechanics"
    "organ": ["From a segmented CT to tissue on an organ"],
    "environments": ["An environment for reinforcement learning"],
    "calibration": ["Calibrate a material"],
    "operation": ["A whole operation, without a window"],
}
CHEAPER = [  # of the quick tests; linear where only the search or the loop is tested
    ("cells: [5, 4, 3], world_cells: [8, 6, 4]", "cells: [4, 3, 2], element: linear, world_cells: [6, 5, 3]"),
    ("generations: 2}", "generations: 1, population: 5}"),
    ("planned.csv -o stiffness", "planned.csv -o stiffness || test $? = 1"),  # the coarse model cannot fit
    ("cells: [8, 8, 1], world_cells: [12, 12, 1]", "cells: [4, 4, 1], element: linear, world_cells: [7, 7, 1]"),
    ("young=young, poisson=0.45)", "young=young, poisson=0.45, element=\"linear\")"),
    ("edge=0.006", "edge=0.008, refine=False, allow_loss=True"), ("--edge 6", "--edge 8 --no-refine --allow-loss"),
    ("--steps 512", "--steps 64"),
    ("center_mm: [-20, 0, 0], radius_mm: 8}", "center_mm: [-35, 0, 0], radius_mm: 8}\nendoscope: {width: 64, height: 48}"),
]


def run_blocks(found, folder):
    """Run snippets of the page in a folder; the names of Python, and the snippets of C."""
    names, c = {}, []
    environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
    environment["PATH"] = f"{pathlib.Path(PROGRAM).parent}:{environment['PATH']}"
    here = os.getcwd()
    os.chdir(folder)
    try:
        for number, (kind, code) in enumerate(found):
            if kind == "python":
                with contextlib.redirect_stdout(io.StringIO()):
                    exec(compile(code, f"{PAGE.name}, snippet {number}", "exec"), names)
            elif kind == "c":
                c.append(code)
            elif kind == "yaml":
                (folder / re.match(r"# (\S+)\n", code)[1]).write_text(code)
            else:
                done = subprocess.run(["bash", "-e", "-c", code], env=environment, capture_output=True, text=True, check=False)
                assert done.returncode == 0, f"{code}\n{done.stderr}"
    finally:
        os.chdir(here)
    return names, c


def tasks():
    return PAGE.read_text(encoding="utf-8").split("\n## ")[1:]


def group_of(task):
    return next((name for name, titles in GROUPS.items() if task.splitlines()[0] in titles), "mechanics")


@pytest.fixture(scope="module")
def page(tmp_path_factory, is_slow):
    """A function: the folder in which the tasks of a group ran, the names of their Python, and their C. In the slow run the whole page runs,
    in its order; else each group for itself, with cheaper numbers."""
    if not PROGRAM:
        pytest.skip("OMENTUM_PROGRAM does not name the program omentum")

    @functools.cache
    def run(group):
        folder = tmp_path_factory.mktemp("page")
        om.TetMesh.box((0.06, 0.05, 0.03), (12, 10, 6) if is_slow else (6, 5, 3)).save(folder / "block.msh", unit=0.001)
        shutil.copy(ROOT / "scenes" / "calibrate" / "press.csv", folder)
        found = [BLOCK.findall(task) for task in tasks() if group is None or group_of(task) == group]
        if group not in (None, "mechanics"):
            found.insert(0, BLOCK.findall(tasks()[0])[:1])
        found = sum(found, [])
        if not is_slow:
            for line, cheaper in CHEAPER:
                found = [(kind, code.replace(line, cheaper)) for kind, code in found]
        return folder, *run_blocks(found, folder)

    return lambda group: run(None if is_slow else group)


def test_every_task_has_a_pair():
    text = PAGE.read_text(encoding="utf-8")
    assert len(tasks()) >= 13 and all(text.count(f"\n## {title}\n") == 1 for title in sum(GROUPS.values(), []))
    assert all(text.count(line) == 1 for line, _ in CHEAPER)
    for task in tasks():
        kinds = {kind for kind, _ in BLOCK.findall(task)}
        assert "python" in kinds and kinds & {"c", "yaml", "sh"}, task.splitlines()[0]
        assert "c" not in kinds or group_of(task) == "mechanics"
        assert "| there | |" in task and re.search(r"\| (SOFA|LapGym|MuJoCo|FEBio) \|", task)


def test_the_calibrations_of_the_page_find_the_answer(page):
    """In Python: the answer is 4200 Pa. By files: the world of the scene has 5,000 Pa and a finer, softer mesh, so
    less fits best."""
    folder, names, _ = page("calibration")
    assert names["stiffness"].best["young"] == pytest.approx(4200, rel=0.02)
    found = re.search(r"young: *([0-9.e+]+)", (folder / "stiffness" / "calibrated.yaml").read_text())
    assert float(found[1]) == pytest.approx(5000, rel=0.35)


def test_shell_and_python_build_the_same_patient(page):
    folder, names, _ = page("organ")
    assert len(names["patient"].roi_point) == 200 and names["fat"].attached.any()
    same = om.Patient.load(folder / "fat")
    assert same.mesh.x == pytest.approx(names["patient"].mesh.x, abs=1e-7) and np.array_equal(same.mesh.tet, names["patient"].mesh.tet)


def test_environments_and_a_policy(page):
    folder, names, _ = page("environments")
    assert names["step"].observation.shape == (4, 12) and names["image"].std() > 10
    assert (folder / "policy" / "policy.safetensors").stat().st_size > 10000


def test_shell_and_python_run_the_same_operation(page):
    folder, names, _ = page("operation")
    assert names["result"].is_exposed
    first, again = ((folder / name / "audit.jsonl").read_text().splitlines() for name in ("small", "small_again"))
    assert len(first) == len(again) > 3


def test_mechanics_of_python_and_c(page):
    """What the Python of the page computes; C gives the same numbers."""
    folder, names, c = page("mechanics")
    assert 0 < names["sag"] < 0.005 and 0.01 < np.linalg.norm(names["force"]) < 5
    assert names["contact"].force[2] > 0.01 and names["contact"].ncontact > 3
    assert len(names["depth"]) == 240 and (names["ids"] == 0).any()
    compiler = os.environ.get("CC") or "cc"
    library = pathlib.Path(os.environ["OMENTUM_LIBRARY"])
    if not shutil.which(compiler):
        pytest.skip(f"there is no compiler {compiler}")
    (folder / "page.c").write_text(HEAD + checked("\n".join(c)) + TAIL)
    built = subprocess.run([compiler, "-std=c17", "-Wall", "-Werror", "-O1", f"-I{ROOT / 'include'}", "page.c", "-o", "page", str(library),
                            f"-Wl,-rpath,{library.parent}", "-lm"], cwd=folder, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
    done = subprocess.run([folder / "page"], cwd=folder, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    pull, force, depth, ncontact, where = map(float, done.stdout.split())
    assert pull == pytest.approx(np.linalg.norm(names["force"]), rel=1e-6)
    assert force == pytest.approx(names["contact"].force[2], rel=1e-6) and ncontact == names["contact"].ncontact
    assert depth == pytest.approx(names["contact"].penetration, rel=1e-3, abs=1e-9)
    assert where == pytest.approx(names["where"][2], abs=1e-9)
    assert np.array_equal(om.load_png(folder / "block.png"), om.load_png(folder / "block_c.png"))
    sizes = [(folder / name).stat().st_size for name in ("press.vtkhdf", "press_c.vtkhdf")]
    assert min(sizes) > 10000 and abs(sizes[0] - sizes[1]) < 0.1 * max(sizes)
