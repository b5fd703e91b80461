"""BC and GAIL of the package imitation learn from our demonstrations, in a virtual environment of its own: it pins Gymnasium 0.29.

The environment is made here, from PyPI: some GB and minutes, the first time.
"""
import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON = ROOT / "build" / "python_imitation"
PROGRAM = os.environ.get("OMENTUM_PROGRAM")
ENVIRONMENT = {**{k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}, "OM_PYTHON": str(PYTHON)}


def has_imitation():
    try:
        return subprocess.run([PYTHON / "bin" / "python3", "-c", "import imitation, h5py"], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


@pytest.fixture(scope="module")
def demos(tmp_path_factory):
    """35 demonstrations of reach, of one length."""
    if not PROGRAM:
        pytest.skip("OMENTUM_PROGRAM does not name the program omentum")
    if not has_imitation():
        subprocess.run([ROOT / "tools" / "python_env.sh", ROOT / "python" / "requirements_imitation.txt", PYTHON], check=True)
    if not has_imitation():
        pytest.skip("package imitation 1.0.1 cannot be installed in build/python_imitation: PyPI is not reachable")
    path = tmp_path_factory.mktemp("imitation") / "demos.hdf5"
    subprocess.run([PROGRAM, "rl", "demo", "-t", "reach", "-s", "fixed_horizon=1", "-n", "35", "-q", "-o", path], check=True, env=ENVIRONMENT)
    return path


def run(*arguments):
    """Scores by method, as the example prints them."""
    done = subprocess.run([ROOT / "tools" / "python_run.sh", "-W", "ignore", ROOT / "python" / "examples" / "gail_imitation.py", *arguments],
                          capture_output=True, text=True, check=False, env=ENVIRONMENT)
    print(done.stdout)
    assert done.returncode == 0, done.stderr[-3000:]
    return {method: float(score) for method, score in re.findall(r"^(BC|GAIL): \w+ ([0-9.]+)", done.stdout, re.M)}


def test_cloning_reaches(demos):
    """A policy without training reaches the one goal at which it begins, of 27."""
    assert run("reach", demos, "--steps", "0", "--clone-epochs", "1")["BC"] < 0.3
    assert run("reach", demos, "--steps", "0", "--clone-epochs", "50")["BC"] > 0.9


def test_gail_reaches(demos):
    """From random weights, by the discriminator's reward alone."""
    assert run("reach", demos, "--steps", "80000")["GAIL"] > 0.9
