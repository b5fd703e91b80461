"""Calibration: parameters of a model in Python, or of a problem in files, from observations."""
from __future__ import annotations

import ctypes
import os
import threading
from dataclasses import dataclass, field
from typing import Any, Callable

import numpy as np

from . import _capi as c
from ._lib import Handle, Progress, ProgressFunction, copied, create, forget_message, lib, make_error, path_of, view


@dataclass
class Parameter:
    """A parameter: bounds, first guess (SI), is_log: search on a logarithmic scale."""

    name: str
    low: float
    high: float
    start: float
    is_log: bool = False


@dataclass
class CalibrationResult:
    """outcome: OK (calibrated), NOT_CONVERGED (budget), UNSAT (the model cannot fit). best: SI, by name. cost: m.

    error: at the best, m (nerror). trace: cost of every evaluation. profiles: by name, the cost along each parameter and the
    interval lo to hi that the data allow (OmCalibrationProfile as a dictionary), is_determined.
    """

    outcome: c.OmStatus
    best: dict[str, float]
    cost: float
    cost_start: float
    error: np.ndarray
    trace: np.ndarray
    profiles: dict[str, dict[str, Any]]
    message: str
    summary: dict[str, Any] = field(repr=False)


def calibrate(model: Callable[[np.ndarray], Any], parameters: list[Parameter], nerror: int, *, noise: float = 0.0,
              out_dir: str | os.PathLike[str] | None = None, strict: bool = True, nworker: int = 1,
              progress: bool | ProgressFunction | None = None, **fields: Any) -> CalibrationResult:
    """Find the parameters of a model in Python.

    model: a function of the parameters (n) that returns nerror distances between model and observation, m, each >= 0; None
    where no model has these parameters. noise: cost of a perfect model, m. nworker: threads that call the model; more than 1
    helps only where it leaves the GIL. fields of OmCalibrationDef: norm, population, max_generations, seed, ...
    strict: a search that ended at its budget, or a model that cannot fit, raises NotConverged or NoSolution.
    """
    raised: list[BaseException] = []
    guard = threading.Lock()

    def evaluate(_ctx: Any, address: int, _nworker: int, out: int) -> int:
        try:
            if raised:
                return int(c.OmStatus.CANCELLED)
            values = model(copied(address, np.float64, (len(parameters),)))
            if values is None:
                return int(c.OmStatus.UNSAT)
            values = np.asarray(values, dtype=np.float64)
            if values.shape != (nerror,):
                raise ValueError(f"the model returned the shape {values.shape}: ({nerror},) is needed")
            view(None, out, np.float64, (nerror,), writable=True)[...] = values
            return 0
        except BaseException as error:
            with guard:
                raised.append(error)
            return lib.om_error(int(c.OmStatus.CANCELLED), b"%s", f"the model failed: {error!r}".encode())

    function = c.OmCalibrationFn(evaluate)
    definition = lib.om_calibration_default_def(function, None, nerror)
    for p in parameters:
        lib.om_calibration_add_param(ctypes.byref(definition), p.name.encode(), p.low, p.high, p.start, p.is_log)
    definition.noise, definition.nworker = noise, nworker
    definition.assign(fields)
    return _run(definition, out_dir, strict, progress, raised)


def calibrate_file(path: str | os.PathLike[str], observations: str | os.PathLike[str] | None = None, *,
                   out_dir: str | os.PathLike[str] | None = None, strict: bool = True,
                   progress: bool | ProgressFunction | None = None, **fields: Any) -> CalibrationResult:
    """Run the calibration that a file describes, as `omentum calibrate`. observations: a file in place of the named one."""
    given = path_of(observations) if observations is not None else None
    problem = Handle(create(lib.om_calibration_problem_load, path_of(path), given), lib.om_calibration_problem_destroy)
    definition = lib.om_calibration_problem_search(problem.address)
    definition.assign(fields)
    definition._keep = problem
    return _run(definition, out_dir, strict, progress, [])


_WHY = {
    int(c.OmStatus.NOT_CONVERGED): "the search ended at its number of evaluations, with a cost of {cost:.3g} m",
    int(c.OmStatus.UNSAT): "the model cannot fit the observations: its cost is {cost:.3g} m, the noise {noise:.3g} m",
}


def _run(definition: Any, out_dir: Any, strict: bool, progress: Any, raised: list[BaseException]) -> CalibrationResult:
    if out_dir is not None:
        definition.out_dir = path_of(out_dir)
    raw = c.OmCalibrationResult()
    try:
        try:
            with Progress(progress) as listener:
                forget_message()
                status = lib.om_calibration_run(ctypes.byref(definition), listener.pointer, ctypes.byref(raw))
        except Exception:
            if raised:
                raise raised[0] from None
            raise
        names = [definition.param[i].name for i in range(raw.nparam)]
        profiles = {n: raw.profile[i].as_dict() for i, n in enumerate(names)} if raw.has_profile else {}
        result = CalibrationResult(
            c.OmStatus(status), dict(zip(names, raw.best.tolist())), raw.cost, raw.cost_start,
            copied(raw.error, np.float64, (raw.nerror,)), copied(raw.trace, np.float64, (raw.neval,)), profiles,
            _WHY.get(status, "").format(cost=raw.cost, noise=definition.noise), raw.as_dict())
    finally:
        lib.om_calibration_result_done(ctypes.byref(raw))
    if status > 0 and strict:
        lib.om_error(status, b"%s", result.message.encode())
        error = make_error(status)
        error.result = result  # type: ignore[attr-defined]
        raise error
    return result
