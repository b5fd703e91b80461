"""The snippets of doc/from_other_tools.md run, in the order of the page; the pairs of Python and C give the same numbers."""
import contextlib
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


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The folder in which the page ran, the names of its Python, and its C."""
    if not PROGRAM:
        pytest.skip("OMENTUM_PROGRAM does not name the program omentum")
    folder = tmp_path_factory.mktemp("page")
    om.TetMesh.box((0.06, 0.05, 0.03), (12, 10, 6)).save(folder / "block.msh", unit=0.001)
    shutil.copy(ROOT / "scenes" / "calibrate" / "press.csv", folder)
    names, c = {}, []
    environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
    environment["PATH"] = f"{pathlib.Path(PROGRAM).parent}:{environment['PATH']}"
    here = os.getcwd()
    os.chdir(folder)
    try:
        for number, (kind, code) in enumerate(BLOCK.findall(PAGE.read_text(encoding="utf-8"))):
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
    return folder, names, c


def test_every_task_has_a_pair():
    text = PAGE.read_text(encoding="utf-8")
    tasks = text.split("\n## ")[1:]
    assert len(tasks) >= 13
    for task in tasks:
        kinds = {kind for kind, _ in BLOCK.findall(task)}
        assert "python" in kinds and kinds & {"c", "yaml", "sh"}, task.splitlines()[0]
        assert "| there | |" in task and re.search(r"\| (SOFA|LapGym|MuJoCo|FEBio) \|", task)


def test_what_the_python_of_the_page_computes(page):
    _, names, _ = page
    assert 0 < names["sag"] < 0.005 and 0.01 < np.linalg.norm(names["force"]) < 5
    assert names["contact"].force[2] > 0.01 and names["contact"].ncontact > 3
    assert names["result"].is_exposed and len(names["depth"]) == 240 and (names["ids"] == 0).any()
    assert names["step"].observation.shape == (4, 12) and names["image"].std() > 10
    assert len(names["patient"].roi_point) == 200 and names["fat"].attached.any()


def test_the_calibrations_of_the_page_find_the_answer(page):
    """In Python: the answer is 4200 Pa. By files: the world of the scene has 5,000 Pa and a finer, softer mesh, so a
    quarter less fits best."""
    folder, names, _ = page
    assert names["stiffness"].best["young"] == pytest.approx(4200, rel=0.02)
    found = re.search(r"young: *([0-9.e+]+)", (folder / "stiffness" / "calibrated.yaml").read_text())
    assert float(found[1]) == pytest.approx(5000, rel=0.35)


def test_files_of_the_page_are_the_same_by_both_ways(page):
    """Shell and Python build the same patient and run the same operation; the shell has trained a policy."""
    folder, names, _ = page
    assert (folder / "policy" / "policy.safetensors").stat().st_size > 10000
    same = om.Patient.load(folder / "fat")
    assert same.mesh.x == pytest.approx(names["patient"].mesh.x, abs=1e-7) and np.array_equal(same.mesh.tet, names["patient"].mesh.tet)
    first, again = ((folder / name / "audit.jsonl").read_text().splitlines() for name in ("small", "small_again"))
    assert len(first) == len(again) > 3


def test_c_gives_the_numbers_of_python(page):
    folder, names, c = page
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

