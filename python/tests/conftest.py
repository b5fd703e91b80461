"""What several files of tests use.

A test with the mark `slow` runs with OM_TEST_SLOW alone (python_NAME_all in CTest); its file has a quick one that fails where this one
would. OM_TEST_PART=2/3: the second, fifth, eighth ... of the tests of a file; CTest uses it where the file has a line `# PARTS 3`. Both
are as in C (test_common.h).
"""
import os

import numpy as np
import pytest

import omentum as om


@pytest.fixture(scope="session")
def is_slow():
    """Whether sizes are full, as in the tests with the mark."""
    return bool(os.environ.get("OM_TEST_SLOW"))


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: of full size, with OM_TEST_SLOW alone")


def pytest_collection_modifyitems(config, items):
    kept = [item for item in items if os.environ.get("OM_TEST_SLOW") or not item.get_closest_marker("slow")]
    part, number = map(int, os.environ.get("OM_TEST_PART", "1/1").split("/"))
    kept = kept[part - 1::number]
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = kept


@pytest.fixture
def box():
    """A block of 40 x 20 x 20 mm, held at x = 0."""
    mesh = om.TetMesh.box((0.04, 0.02, 0.02), (4, 2, 2))
    mesh.sets["attachment"] = np.flatnonzero(mesh.x[:, 0] < 1e-9)
    return mesh


@pytest.fixture(scope="session")
def ellipsoid():
    """Labels: 1 is an ellipsoid with half axes of 36, 28 and 20 mm; 5 is a small cube in a corner."""
    i, j, k = np.meshgrid(*[np.arange(44) - 21.5] * 3, indexing="ij")
    labels = ((i / 18) ** 2 + (j / 14) ** 2 + (k / 10) ** 2 < 1).astype(np.uint8)
    labels[:3, :3, :3] = 5
    return om.Volume(labels, spacing=0.002)


@pytest.fixture
def alive():
    """Blocks of the library that live after the test, less those before."""
    import gc
    gc.collect()
    before = om.lib.om_alloc_alive()

    def count():
        gc.collect()
        return om.lib.om_alloc_alive() - before

    return count


def pytest_sessionfinish(session, exitstatus):
    """Exit 77, which CTest reports as skipped, where every test was skipped."""
    stats = session.config.pluginmanager.get_plugin("terminalreporter").stats
    if exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED) and stats.get("skipped") and not stats.get("passed"):
        session.exitstatus = 77
