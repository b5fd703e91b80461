"""A scene in motion in a browser or a notebook: one page with everything in it, from a body or from the folder of a run."""
from __future__ import annotations

import ctypes
import html
import os
import pathlib
import tempfile
import webbrowser
from typing import TYPE_CHECKING, Any

from . import _capi as c
from ._lib import Handle, Owner, lib, path_of

if TYPE_CHECKING:
    from .scene import Body
    from .world import World


class View(Owner):
    """Frames of a body, as a page that plays them.

        view = om.View(body)
        for step in range(100):
            body.move(...)
            body.step(0.02)
            view.add(0.02 * step)
        view.save("lift.html")         # or view.open(), or the last line of a notebook's cell
    """

    def __init__(self, body: Body, world: World | None = None) -> None:
        """world: whose tools are drawn, too. The first frame is the body as it is now, at time 0."""
        definition = lib.om_view3d_default_def(ctypes.byref(body.scene), body._c)
        if world is not None:
            definition.world = world._c
        out = ctypes.c_void_p()
        lib.om_view3d_create(ctypes.byref(definition), ctypes.byref(out))
        self._page = c.OmViewPage()
        self._title = body.scene.name.encode()
        self._handle = Handle(out.value, lib.om_view3d_destroy, body._handle, world._handle if world is not None else None)
        self.nframe = 0
        lib.om_view3d_add_scene(self._c, self._messages)
        lib.om_view3d_add_points(body._c, lib.om_body_attached(body._c), c.OmViewPoints.BELIEVED, self._messages)
        self.add(0.0)

    @property
    def _messages(self) -> Any:
        return ctypes.byref(self._page.messages)

    def add(self, time: float, **numbers: float) -> None:
        """A frame of the body where it is now. numbers: fields of OmViewNow, such as force (N) and visibility (0 to 1)."""
        nan = float("nan")
        now = c.OmViewNow(visibility=nan, force=nan, force_world=nan, mu=nan, height=nan)
        now.assign({"time": time, **numbers})
        lib.om_view3d_add_frame(self._c, ctypes.byref(now), self._messages)
        self.nframe += 1

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page, one file that needs nothing else."""
        self._c  # noqa: B018 - a closed view has no page
        self._page.title = self._title
        lib.om_view_page_save(ctypes.byref(self._page), path_of(path))

    def html(self) -> str:
        """The page as text."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "view.html"
            self.save(path)
            return path.read_text(encoding="utf-8")

    def open(self) -> str:
        """Show the page in a browser. Returns the path of its file, which stays in the folder of temporary files."""
        folder = tempfile.mkdtemp(prefix="omentum-view-")
        path = os.path.join(folder, "view.html")
        self.save(path)
        webbrowser.open(pathlib.Path(path).as_uri())
        return path

    def _repr_html_(self) -> str:
        return _frame_of(self.html())

    def __del__(self) -> None:
        if hasattr(self, "_page"):
            lib.om_view_page_done(ctypes.byref(self._page))


class RunView:
    """The page of a recorded run. Shown as the last line of a notebook's cell; open() shows it in a browser."""

    def __init__(self, path: pathlib.Path) -> None:
        self.path = path

    def html(self) -> str:
        """The page as text."""
        return self.path.read_text(encoding="utf-8")

    def open(self) -> str:
        """Show the page in a browser. Returns the path of its file."""
        webbrowser.open(self.path.resolve().as_uri())
        return str(self.path)

    def _repr_html_(self) -> str:
        return _frame_of(self.html())


def _frame_of(page: str) -> str:
    return (f'<iframe srcdoc="{html.escape(page)}" sandbox="allow-scripts allow-downloads" style="width:100%;height:620px;border:0" '
            'title="A scene in three dimensions" allow="fullscreen"></iframe>')


def view(source: Body | str | os.PathLike[str]) -> View | RunView:
    """A page to look at: of a body as it is now, or of a recorded run (its folder, or its view.html)."""
    if not isinstance(source, (str, os.PathLike)):
        if not hasattr(source, "scene"):
            raise TypeError(f"a Body, or the folder of a recorded run, is needed, not {type(source).__name__}; plot() and to_pyvista() draw other things")
        return View(source)
    path = pathlib.Path(source)
    if path.is_dir():
        path = path / "view.html"
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such page; omentum retract -o DIR writes DIR/view.html")
    return RunView(path)
