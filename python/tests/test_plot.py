"""Pictures by matplotlib, and objects for PyVista: what is drawn is what the arrays say; without the package the error says how to get it."""
# PARTS 2
import subprocess
import sys
import types

import numpy as np
import pytest

import omentum as om


@pytest.fixture
def plt():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    yield pyplot
    pyplot.close("all")


@pytest.fixture
def lifted(box):
    """A block lifted at its end for a step."""
    tissue = om.Tissue(box, element="linear")
    tip = np.array([0.04, 0.01, 0.01])
    tissue.grasp(tip, radius=0.012)
    tissue.move(tip + [0, 0, 0.002])
    tissue.step()
    return tissue


def faces_of(ax):
    """Corners of the triangles drawn, mm (n x 3 x 3)."""
    drawn = [one for one in ax.collections if type(one).__name__ == "Poly3DCollection"]
    return np.concatenate([np.array([face[:3] for face in one._faces]) for one in drawn])


def test_tissue_is_drawn_where_it_is(plt, lifted):
    ax = lifted.plot("von_mises")
    surface, vert = lifted.mesh.boundary()
    assert np.sort(faces_of(ax).reshape(-1, 3), axis=0) == pytest.approx(np.sort(1e3 * lifted.x[vert][surface.tri].reshape(-1, 3), axis=0))
    values = ax.collections[0].get_array()  # means of the elements around: within the values of the elements
    stress = lifted.measure()
    assert len(values) == len(surface.tri) and stress.min() <= values.min() and values.max() <= stress.max() and values.max() > 2 * values.min()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["attached", "grasped"]
    assert ax.get_xlabel() == "x, mm" and ax.get_xlim()[1] - ax.get_xlim()[0] == pytest.approx(ax.get_zlim()[1] - ax.get_zlim()[0])
    with pytest.raises(ValueError, match="three"):
        lifted.plot(ax=plt.figure().add_subplot())


def test_of_triangles_of_a_field_that_is_known(box):
    """Values that are the height of an element are near the height of each triangle."""
    from omentum.plot import of_triangles
    fine = box.refined()
    surface, vert = fine.boundary()
    values = of_triangles(fine, vert, surface.tri, fine.x[fine.tet].mean(axis=1)[:, 0])
    assert np.abs(values - surface.x[surface.tri].mean(axis=1)[:, 0]).max() < 0.004  # an edge has 5 mm


def test_forces_are_bars(plt, lifted):
    forces = lifted.forces()
    ax = forces.plot()
    names = [text.get_text() for text in ax.get_xticklabels()]
    assert names == ["grasp 0", "pull 0", "attachment", "weight"] and ax.get_ylabel() == "force, N"
    heights = np.array([bar.get_height() for bar in ax.patches]).reshape(3, 4)
    assert heights[:, 0] == pytest.approx(forces.grasp[0]) and heights[2, 3] == pytest.approx(forces.weight[2]) and forces.weight[2] < 0


def test_a_recording_is_drawn_over_time_and_at_a_step(plt, lifted, tmp_path):
    pytest.importorskip("h5py")
    mesh = lifted.mesh
    with om.Recorder(tmp_path / "run.vtkhdf", mesh, point={"pull": 3}, cell={"part": 1}) as recorder:
        for i in range(3):
            recorder.add(0.1 * (i + 1), mesh.x + [0, 0, 0.001 * i], pull=np.full((len(mesh.x), 3), [3.0 * i, 4.0 * i, 0]), part=np.arange(len(mesh.tet)))
    recording = om.Recording.load(tmp_path)  # the folder of a run
    times, far = recording.plot().get_lines()[0].get_data()
    assert times == pytest.approx([0.1, 0.2, 0.3]) and far == pytest.approx([0, 1, 2])
    assert recording.plot("pull").get_lines()[0].get_ydata() == pytest.approx([0, 5, 10])  # norms
    ax = recording.plot("part", step=2)
    assert faces_of(ax)[..., 2].max() == pytest.approx(22) and ax.get_title() == "0.3 s"
    with pytest.raises(om.FileFailed, match="not a recording"):
        (tmp_path / "a.vtkhdf").write_text("no")
        om.Recording.load(tmp_path / "a.vtkhdf")
    with pytest.raises(FileNotFoundError, match="omentum retract -o"):
        om.Recording.load(tmp_path / "b.vtkhdf")


def test_a_run_and_a_chart(plt):
    time = np.arange(4.0)
    samples = {"time": time, "force": time**2, "force_world": np.full(4, np.nan), "visibility": time / 4}
    ax = om.RetractResult("exposed", True, "", samples, [], [], {}).plot()
    other = ax.figure.axes[1]
    assert len(ax.get_lines()) == 1 and ax.get_lines()[0].get_ydata() == pytest.approx(time**2) and other.get_lines()[0].get_ydata()[-1] == 75
    ax = om.Chart("a", {"b": (time, time)}, "time, s", "force, N", limits={"most": 2.0}).plot()
    assert ax.get_xlabel() == "time, s" and ax.get_lines()[1].get_ydata()[0] == 2


def test_a_volume_and_a_scan(plt):
    values = np.zeros((4, 3, 2), np.uint8)
    values[3, 0, 1] = 7
    ax = om.Volume(values, spacing=(2, 3, 4), unit="mm").plot(axis=2)
    drawn = ax.images[0]
    assert drawn.get_array()[0, 3] == 7 and drawn.get_extent() == pytest.approx([0, 8, 0, 9])  # i to the right, j upwards
    with pytest.raises(IndexError, match="slice 5 of 2"):
        om.Volume(values, spacing=0.002).plot(index=5)
    ax = om.Scan([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]], tri=[[0, 1, 2]]).plot()
    assert faces_of(ax).reshape(3, 3).max(axis=0) == pytest.approx([10, 10, 0])


def stand_in():
    """A module in the place of PyVista that keeps what it is given."""
    class Grid:
        def __init__(self, *arguments, **named):
            self.arguments, self.named, self.point_data, self.cell_data = arguments, named, {}, {}

    class Blocks(dict):
        pass

    return types.SimpleNamespace(UnstructuredGrid=Grid, PolyData=Grid, ImageData=Grid, StructuredGrid=Grid, MultiBlock=Blocks,
                                 CellType=types.SimpleNamespace(TETRA=10))


def test_what_pyvista_is_given(monkeypatch, lifted):
    """test_slow_pyvista.py has PyVista itself."""
    monkeypatch.setitem(sys.modules, "pyvista", stand_in())
    grid = lifted.to_pyvista("von_mises")
    assert grid.arguments[1] == pytest.approx(lifted.x) and grid.cell_data["von_mises"] == pytest.approx(lifted.measure())
    assert grid.point_data["displacement"] == pytest.approx(lifted.x - lifted.mesh.x)
    assert np.array_equal(np.flatnonzero(grid.point_data["attached"]), lifted.mesh.sets["attachment"]) and 0 in grid.point_data["held_by"]
    values = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    image = om.Volume(values, spacing=(0.01, 0.02, 0.03)).to_pyvista()
    assert image.named["spacing"] == (0.01, 0.02, 0.03) and image.point_data["values"][1] == values[1, 0, 0]  # x runs fastest
    turned = om.Volume(values, affine=[[0, 0.01, 0, 0.5], [0.02, 0, 0, 0], [0, 0, 0.03, 0], [0, 0, 0, 1]]).to_pyvista()
    assert [a[1, 2, 3] for a in turned.arguments] == pytest.approx([0.52, 0.02, 0.09])
    scan = om.Scan(np.eye(3), tri=[[0, 1, 2]]).to_pyvista()
    assert scan.arguments[1].tolist() == [3, 0, 1, 2]


HIDDEN = """
import sys
class Hide:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("matplotlib", "pyvista", "h5py", "meshio", "gymnasium", "stable_baselines3"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hide())
import omentum as om
def gym(): import omentum.gym
def sb3(): import omentum.sb3
box = om.TetMesh.box((1, 1, 1), (1, 1, 1))
for call in (box.plot, box.to_pyvista, lambda: om.Recording.load(om.__file__), box.to_meshio, gym, sb3):
    try:
        call()
    except ImportError as error:
        print(error)
"""


def test_without_a_package_the_error_names_the_command():
    """In a process where none of them can be found."""
    done = subprocess.run([sys.executable, "-B", "-c", HIDDEN], capture_output=True, text=True, check=True)
    named = [line.split("pip install ")[1] for line in done.stdout.splitlines()]
    assert named == ["matplotlib", "pyvista", "h5py", "meshio", "gymnasium", "stable-baselines3"], done.stderr
