"""Patient models: from a label map to a mesh with attachments and a region of interest."""
from __future__ import annotations

import contextlib
import ctypes
import os
import pathlib
import tempfile
from typing import Any

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import length, meters_per, need, python_words, with_lengths
from ._lib import Handle, Progress, ProgressFunction, copied, lib, path_of, refuse_volume, warn_user
from .mesh import Surface, TetMesh
from .volume import Volume, without_dicom


class Patient:
    """A patient model. Made by build_patient or Patient.load; constant; can be pickled.

    mesh: the deformable tissue (TetMesh) with the set "attachment"; organ: the surface that it rests on, or None;
    roi_point, roi_normal: the region of interest, m and unit (nroi x 3); up: unit direction away from the covered side;
    report: the measures of the build (OmModelReport), or None.
    """

    def __init__(self, handle: Handle, report: c.OmModelReport | None) -> None:
        raw = handle.address
        self._handle = handle
        self.report = report
        self.name: str = raw.name
        self.mesh = TetMesh._copy(raw.mesh)
        self.organ = Surface._copy(raw.organ) if raw.organ.nvert else None
        self.roi_point = copied(raw.roi_point, np.float64, (raw.nroi, 3))
        self.roi_normal = copied(raw.roi_normal, np.float64, (raw.nroi, 3))
        self.roi_center: np.ndarray = raw.roi_center.copy()
        self.roi_radius: float = raw.roi_radius
        self.up: np.ndarray = raw.up.copy()

    @property
    def materials(self) -> list[dict[str, Any]]:
        """name, label (-1: every other label), young (Pa), poisson, density (kg/m^3) of each material."""
        raw = self._handle.address
        return [raw.material[i].as_dict() for i in range(raw.nmaterial)]

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Patient:
        """Read the folder of a patient model, or its patient.yaml."""
        refuse_volume(path, "a patient model")
        place = pathlib.Path(path)
        raw = c.OmPatient()
        lib.om_patient_load(path_of(place / "patient.yaml" if place.is_dir() else place), ctypes.byref(raw))
        return cls(_own(raw), None)

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write patient.yaml, tissue.vtu, organ.ply, and the report of a model that was built in this process."""
        report = ctypes.byref(self.report) if self.report is not None else None
        lib.om_patient_save(ctypes.byref(self._handle.address), report, path_of(folder))

    def plot(self, ax: Any = None) -> Any:
        """Draw tissue, attachments, organ and region of interest with matplotlib; the axes are returned."""
        ax = _plot.axes_3d(ax)
        surface, _ = self.mesh.boundary()
        drawn = [surface.x]
        _plot.triangles(ax, surface.x, surface.tri, _plot.FAT, 0.35 if self.organ else 1.0)
        if self.organ:
            _plot.triangles(ax, self.organ.x, self.organ.tri, _plot.FLESH, 0.6)
            drawn.append(self.organ.x)
        _plot.dots(ax, self.mesh.x[self.mesh.sets.get("attachment", [])], "attachment", _plot.BLUE)
        _plot.dots(ax, self.roi_point, "region of interest", _plot.RED)
        if len(self.roi_point) or len(self.mesh.sets.get("attachment", [])):
            ax.legend(loc="upper right")
        _plot.fit(ax, *(1e3 * x for x in drawn))
        return ax

    def to_pyvista(self) -> Any:
        """A pyvista.MultiBlock: "tissue", and "organ" and "roi" where there are any."""
        pyvista = need("pyvista", "to_pyvista()")
        blocks = pyvista.MultiBlock()
        blocks["tissue"] = self.mesh.to_pyvista()
        if self.organ:
            blocks["organ"] = self.organ.to_pyvista()
        if len(self.roi_point):
            blocks["roi"] = pyvista.PolyData(self.roi_point)
            blocks["roi"].point_data["normal"] = self.roi_normal
        return blocks

    def __reduce__(self) -> Any:
        with tempfile.TemporaryDirectory(prefix="omentum-") as folder:
            place = pathlib.Path(folder, "patient")
            lib.om_patient_save(ctypes.byref(self._handle.address), None, path_of(place))
            files = {p.name: p.read_bytes() for p in place.iterdir() if p.is_file()}
        return _unpickle, (files,)

    def __repr__(self) -> str:
        organ = f", organ of {len(self.organ.tri)} triangles" if self.organ else ""
        return f"Patient({self.name!r}, {self.mesh!r}{organ})"


def _own(raw: Any) -> Handle:
    return Handle(raw, lambda patient: lib.om_patient_done(ctypes.byref(patient)))


def _unpickle(files: dict[str, bytes]) -> Patient:
    with tempfile.TemporaryDirectory(prefix="omentum-") as folder:
        for name, data in files.items():
            pathlib.Path(folder, name).write_bytes(data)
        return Patient.load(folder)


def build_patient(source: Volume | Any | str | os.PathLike[str], edge: float | str, label: int | str | list[int | str] | None = None,
                  attach: str | list[str] | None = None, sheet: dict[str, Any] | None = None, over: dict[str, Any] | None = None,
                  name: str | None = None, progress: bool | ProgressFunction | None = None, **options: Any) -> Patient:
    """Build a patient model from a label map or a file.

    source: a Volume, or an array (nx, ny, nz) with `spacing` or `affine`, and `unit`, as of Volume; or a file: NIfTI, NRRD, a
    volume mesh, a closed surface (`unit` where the file states none); a DICOM series, where dcm2niix is installed.
    edge: mean edge of the mesh, m, or words: "8 mm".
    label: labels that are meshed together, by number or by the name in the file; None: the one label above 0.
    sheet: fields of OmSheetDef for a sheet of fat over the organ: {"thickness": 0.008, "side": "lateral"}, m.
    over: fields of OmOverDef for labelled tissue over a labelled organ: {"label": [2, 3], "roi": 3}; 3 is to be exposed.
    attach: attachments in words, "border:medial 25 %"; of a sheet, or of tissue over an organ.
    options: other fields of OmModelDef, such as keep_all, close_radius, smooth, threshold (0.5 for a label map that was
    interpolated); has_bending_test=False saves 0.5 to 1 s.
    """
    is_file = isinstance(source, (str, bytes, os.PathLike))
    if is_file and "unit" in options:  # of a surface or a mesh that states none
        options["unit"] = meters_per(options["unit"])
    places = {k: options.pop(k) for k in ("spacing", "affine", *([] if is_file else ["unit"])) if k in options}
    if not isinstance(source, Volume) and not is_file:
        if not places:
            raise TypeError('an array needs the sides of its voxels: spacing=(0.7, 0.7, 1), unit="mm", or affine=image.affine, unit="mm"')
        source = Volume(source, **places)
    elif places:
        raise TypeError(f"{', '.join(places)}: for an array only; a Volume or a file has its own")
    if attach is not None and not sheet and not over:
        raise ValueError('attach: belongs to a sheet of fat, sheet={"thickness": "8 mm", "side": "lateral"}, or to labelled tissue over an organ, '
                         'over={"label": 2, "roi": 3}; an organ alone is held in the simulation: tissue = Tissue(patient), '
                         "tissue.set_attachment(tissue.x[:, 2] < tissue.x[:, 2].min() + 0.005)")
    path = b"the volume" if isinstance(source, Volume) else path_of(source)
    definition = lib.om_model_default_def(path, length(edge, "edge"))
    if name is not None or isinstance(source, Volume):
        definition.name = name or "volume"
    for item in [] if label is None else [label] if isinstance(label, str) or np.ndim(label) == 0 else label:  # type: ignore[union-attr]
        if isinstance(item, (float, np.floating)) and item == round(item):  # of a map of floats
            item = int(item)
        if not isinstance(item, (int, np.integer, str)):
            raise TypeError(f"label={item!r}: a whole number, or a name of the file, or a list of these")
        if isinstance(item, str) or abs(item) >= 2**31:  # larger numbers are given as names
            definition.label_name[definition.nlabel_name].value = str(item).encode()
            definition.nlabel_name += 1
        else:
            definition.label[definition.nlabel] = item
            definition.nlabel += 1
    definition.sheet.assign(with_lengths(sheet or {}, "sheet"))
    below = with_lengths(over or {}, "over")
    for item in np.atleast_1d(below.pop("label", [])):
        definition.over.label[definition.over.nlabel] = item
        definition.over.nlabel += 1
    definition.over.assign(below)
    holder = definition.over if over else definition.sheet
    for words in [] if attach is None else [attach] if isinstance(attach, str) else attach:
        lib.om_model_parse_attach(words.encode(), ctypes.byref(holder.attach[holder.nattach]))
        holder.nattach += 1
    definition.assign(options, also=("spacing", "affine", "unit"))
    raw, report = c.OmPatient(), c.OmModelReport()
    handle = _own(raw)  # before the call: Ctrl-C may come when it has succeeded
    volume = ctypes.byref(source._as_c()) if isinstance(source, Volume) else None
    with contextlib.ExitStack() as stack:
        if volume is None:
            file = stack.enter_context(without_dicom(os.fsdecode(path)))
            if file != path:
                definition.input = file.decode()
        listener = stack.enter_context(Progress(progress))
        lib.om_model_build_volume(ctypes.byref(definition), volume, listener.pointer, ctypes.byref(raw), ctypes.byref(report))
    if report.warning:
        warn_user(python_words(report.warning))
    return Patient(handle, report)
