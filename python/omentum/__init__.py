"""Patient-specific simulation of soft tissue for autonomous surgery.

    import omentum as om
    patient = om.build_patient("ct_labels.nii.gz", edge=0.004, label=1)
    tissue = om.Tissue(patient)
    tissue.grasp(tissue.x[0])

All lengths are metres, forces newtons, times seconds, angles radians. Arrays of vectors are (n x 3). Positions and
pictures of a simulation are NumPy views of its memory.
"""
try:
    from ._capi import OM_VERSION as __version__
except ModuleNotFoundError as _missing:
    if _missing.name != "omentum._capi":
        raise
    raise ImportError("this checkout of omentum is not built, so python/omentum/_capi.py is missing: run `make build` in it, or "
                      "tools/python_binding.py for this file alone") from None
from . import _capi as capi
from ._convert import suggest_words as _suggest_words
from ._lib import (Cancelled, Closed, Error, FileFailed, InUse, Invalid, NoMemory, NoSolution, NotConverged,
                   NotPositiveDefinite, TimeLimit, Unavailable, data_path, lib)
from .calibrate import CalibrationResult, Parameter, calibrate, calibrate_file
from .camera import Camera, SenseScene
from .contact import Contact, ContactReport, Skin
from .ct import CT_LABELS, label_ct, make_ct
from .check import check_engine
from .engine import Engine, EngineStep
from .law import Law, check_law, smooth_log, smooth_power
from .learned import BanetData, BanetNet, BanetSample, UmeshData, UmeshNet, make_banet_sample
from .match import Acquisition, Estimate, Matcher, adopt, load_acquisition, save_acquisition
from .mesh import Surface, SurfaceRepair, TetMesh
from .patient import Patient, build_patient
from .plan import Action, Plan, Planner, Situation
from .preplan import Preplan, preplan
from .press import Press, PressReport, Probe
from .recording import Recorder, Recording
from .report import Chart, Picture, Report
from .retract import Listener, Loop, RetractResult, retract
from .rl import RlStep, RlTask, RlVec, rl_tasks
from .scan import Scan
from .scene import Body, Scene, Site
from .tissue import Embedding, StepReport, Tissue, register_engine
from .view import RunView, View, view
from .volume import Volume, load_png, save_png
from .world import COLOR, DEPTH, IMAGE, VISIBILITY, Arm, Observation, RecordedWorld, ReplayedWorld, RobotWorld, SimulatedWorld, World

for _kind in (Cancelled, Closed, Error, FileFailed, InUse, Invalid, NoMemory, NoSolution, NotConverged, NotPositiveDefinite,
              TimeLimit, Unavailable):
    _kind.__module__ = "omentum"  # the name that tracebacks show

_suggest_words(globals())  # an argument that a function does not take: its error names the nearest one that it takes

__all__ = [name for name in dir() if not name.startswith("_")]
