"""Pictures by matplotlib, where it is installed, and objects of PyVista: what the methods plot() and to_pyvista() draw.

plot() returns the axes of matplotlib, in millimetres, newtons and seconds; `matplotlib.pyplot.show()` shows the window, a
notebook shows them by itself. `ax=` draws into axes of your own.
"""
from __future__ import annotations

from typing import Any

import numpy as np

from ._convert import need

FLESH, FAT, RED, BLUE = "#c9786c", "#e3b94f", "#c0392b", "#0072b2"  # organ, fat, what matters, attachments
_LIGHT = np.array([0.4, -0.5, 0.77])


def pyplot() -> Any:
    """matplotlib.pyplot, or the error that names the command which installs it."""
    return need("matplotlib.pyplot", "plot()")


def axes_3d(ax: Any) -> Any:
    """Axes with three dimensions: those given, or of a new figure."""
    plt = pyplot()
    if ax is None:
        ax = plt.figure().add_subplot(projection="3d")
    elif not hasattr(ax, "get_zlim"):
        raise ValueError('ax has two dimensions: plt.figure().add_subplot(projection="3d") has three')
    for axis, name in zip("xyz", ("x, mm", "y, mm", "z, mm")):
        getattr(ax, f"set_{axis}label")(name)
    return ax


def axes_2d(ax: Any, x_label: str, y_label: str) -> Any:
    """Axes with two dimensions and their labels."""
    if ax is None:
        ax = pyplot().figure().add_subplot()
    ax.set_xlabel(x_label)
    ax.set_ylabel(y_label)
    return ax


def fit(ax: Any, *points: Any) -> None:
    """The same scale on all three axes, around points, mm."""
    all_points = np.concatenate([np.reshape(p, (-1, 3)) for p in points])
    if not len(all_points):
        return
    low, high = all_points.min(axis=0), all_points.max(axis=0)
    middle, half = (low + high) / 2, max(1e-9, (high - low).max() / 2)
    ax.set_xlim(middle[0] - half, middle[0] + half)
    ax.set_ylim(middle[1] - half, middle[1] + half)
    ax.set_zlim(middle[2] - half, middle[2] + half)
    ax.set_box_aspect((1, 1, 1))


def triangles(ax: Any, x: np.ndarray, tri: np.ndarray, color: Any = FLESH, alpha: float = 1.0, values: Any = None,
              name: str | None = None) -> Any:
    """Shaded triangles, x in m; values: one for each triangle, which colour it by a scale of that name."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    corners = 1e3 * np.asarray(x)[tri]
    if values is None:
        from matplotlib.colors import to_rgb
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normal, axis=1)
        facing = np.abs(normal @ (_LIGHT / np.linalg.norm(_LIGHT))) / np.where(size > 0, size, 1)  # a triangle without area is not seen
        shade = (0.45 + 0.55 * facing)[:, None] * np.array(to_rgb(color))
        drawn = Poly3DCollection(corners, facecolors=shade, alpha=alpha)
    else:
        drawn = Poly3DCollection(corners, alpha=alpha)
        drawn.set_array(np.asarray(values, float))
        drawn.set_cmap("viridis")
        ax.figure.colorbar(drawn, ax=ax, label=name, shrink=0.6)
    ax.add_collection3d(drawn)
    return drawn


def dots(ax: Any, x: np.ndarray, label: str, color: str) -> None:
    """Points, m, with a name in the legend; nothing where there are none."""
    if len(x):
        ax.scatter(*(1e3 * np.asarray(x).T), s=8, c=color, label=label, depthshade=False)


def of_triangles(mesh: Any, vert: np.ndarray, tri: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values of elements as values of the triangles of the boundary: means over the elements at each vertex, then over the corners.

    vert: vertex of the mesh of each vertex of the boundary.
    """
    total, count = np.zeros(len(mesh.x)), np.zeros(len(mesh.x))
    for corner in range(4):
        np.add.at(total, mesh.tet[:, corner], values)
        np.add.at(count, mesh.tet[:, corner], 1)
    mean = total / np.maximum(count, 1)
    return mean[vert][tri].mean(axis=1)


_MEASURES = {"von_mises": "von Mises stress, Pa", "principal_stretch": "largest stretch", "volume_ratio": "volume ratio",
             "energy_density": "energy density, J/m$^3$"}


def deformed(ax: Any, mesh: Any, x: np.ndarray, attached: Any, held_by: Any, measure: str | None, values: Any, color: Any) -> Any:
    """Tissue in its present shape, with attachments and grasped vertices."""
    ax = axes_3d(ax)
    surface, vert = mesh.boundary()
    at = np.asarray(x)[vert]
    painted = None if values is None else of_triangles(mesh, vert, surface.tri, values)
    triangles(ax, at, surface.tri, color, 1.0 if painted is not None else 0.85, painted, _MEASURES.get(measure or "", measure))
    dots(ax, np.asarray(x)[np.asarray(attached)], "attached", BLUE)
    dots(ax, np.asarray(x)[np.asarray(held_by) >= 0], "grasped", RED)
    if np.any(attached) or np.any(np.asarray(held_by) >= 0):
        ax.legend(loc="upper right")  # "best" looks at each triangle
    fit(ax, 1e3 * at)
    return ax


def forces(ax: Any, total: Any) -> Any:
    """Resultants, N: a group of bars x, y, z for each force that is not zero."""
    ax = axes_2d(ax, "", "force, N")
    rows: dict[str, np.ndarray] = {}
    for name in total._names:
        value = np.asarray(getattr(total, name), float)
        for i, one in enumerate(np.atleast_2d(value)):
            if np.any(one != 0):
                rows[f"{name} {i}" if value.ndim == 2 else name] = one
    for k, axis in enumerate("xyz"):
        ax.bar(np.arange(len(rows)) + 0.27 * (k - 1), [one[k] for one in rows.values()], 0.25, label=axis)
    ax.set_xticks(np.arange(len(rows)), list(rows))
    ax.axhline(0, color="black", linewidth=0.8)
    ax.legend()
    return ax


def run(ax: Any, samples: dict[str, np.ndarray], title: str) -> Any:
    """Force and visible share of a retraction over time."""
    ax = axes_2d(ax, "time, s", "force, N")
    ax.plot(samples["time"], samples["force"], color=RED, label="force of the twin")
    if np.isfinite(samples["force_world"]).any():
        ax.plot(samples["time"], samples["force_world"], color=RED, linestyle=":", label="force in the world")
    other = ax.twinx()
    other.plot(samples["time"], 100 * samples["visibility"], color=BLUE, label="visible")
    other.set_ylabel("region of interest visible, %")
    other.set_ylim(0, 105)
    lines = [*ax.get_lines(), *other.get_lines()]
    ax.legend(lines, [line.get_label() for line in lines], loc="upper left")
    ax.set_title(title)
    return ax


def deformed_grid(body: Any, grid: Any, measures: Any) -> Any:
    """The grid of PyVista of a body's present shape with what it carries: attached, held_by, displacement (m), and measures of elements."""
    for name in measures:
        grid.cell_data[name] = body.measure(name)
    grid.point_data["attached"] = np.asarray(body.attached).astype(np.uint8)
    grid.point_data["held_by"] = np.asarray(body.held_by).astype(np.int8)
    grid.point_data["displacement"] = np.asarray(body.x) - body.mesh.x
    return grid


__all__: list[str] = []
