"""The loaded library: errors as exceptions, ownership of C objects, views of their memory, progress and Ctrl-C.

Ownership. A Handle owns one object of C and destroys it when nothing refers to it any more. Wrappers hold the handle; so
does every NumPy view of the object's memory. close() makes the wrapper unusable at once (Closed is raised), and the memory
is freed with the last view: a view never reads freed memory.

Threads. A call leaves the GIL. Objects that a step changes refuse a second thread while a call runs (InUse). A child of
os.fork may use the mechanics; networks and cameras need threads of other libraries that do not survive a fork, so they
are refused there (Unavailable).
"""
from __future__ import annotations

import _thread as _thread_module
import ctypes
import os
import pathlib
import signal
import sys
import threading
import time
import warnings
from typing import Any, Callable

import numpy as np

from . import _capi as c
from ._convert import functions_of, python_words

HERE = pathlib.Path(__file__).resolve().parent
BUILT = pathlib.Path(c.__file__).resolve().parent  # what the build made: HERE, but for an editable install


# ---- errors -------------------------------------------------------------------------------------------


class Error(Exception):
    """A call that failed. The text is the sentence of the library; `status` is the number of C."""

    status: c.OmStatus | None = None


class Invalid(Error, ValueError):
    """An argument or an input that cannot be used; nothing was changed."""

    status = c.OmStatus.INVALID


class NoMemory(Error, MemoryError):
    """Out of memory; nothing was changed."""

    status = c.OmStatus.NO_MEMORY


class FileFailed(Error, OSError):
    """Reading or writing failed."""

    status = c.OmStatus.IO


class Unavailable(Error):
    """This object, build or process cannot do it."""

    status = c.OmStatus.UNAVAILABLE


class Cancelled(Error):
    """A progress function returned False."""

    status = c.OmStatus.CANCELLED


class NotConverged(Error):
    """The computation ended without reaching its tolerance. `result` holds what it reached."""

    status = c.OmStatus.NOT_CONVERGED
    result: Any = None


class NotPositiveDefinite(NotConverged):
    """A matrix that must be positive definite is not."""

    status = c.OmStatus.NOT_SPD


class NoSolution(NotConverged):
    """It is proven that no solution exists."""

    status = c.OmStatus.UNSAT


class TimeLimit(NotConverged):
    """The time limit was reached. `result` is the best result so far."""

    status = c.OmStatus.TIMEOUT


class Closed(Error, ValueError):
    """The object was closed."""


class InUse(Error, RuntimeError):
    """Another thread is using the object."""


_KINDS = {kind.status: kind for kind in (Invalid, NoMemory, FileFailed, Unavailable, Cancelled, NotConverged,
                                         NotPositiveDefinite, NoSolution, TimeLimit)}
_thread = threading.local()  # `raised`: the exception of a Python function that C called on this thread


def _take_raised() -> BaseException | None:
    raised = getattr(_thread, "raised", None)
    _thread.raised = None
    return raised


def keep_raised(error: BaseException) -> None:
    """Keep an exception of a Python function that C called; the call that returns next on this thread raises it."""
    _thread.raised = error


def status_of(error: BaseException, where: str) -> int:
    """The status of C for an exception in a Python function that C called.

    An Error of the library becomes its own status and sentence, which C may handle: a goal out of reach is tried elsewhere.
    Any other exception ends the call of C, and is raised by it.
    """
    status = c.OmStatus.CANCELLED if isinstance(error, KeyboardInterrupt) else c.OmStatus.IO
    if isinstance(error, Error) and error.status is not None:
        status = error.status
    else:
        keep_raised(error)
    return lib.om_error(int(status), b"%s", str(error if isinstance(error, Error) else f"{where}: {error!r}").encode())


def _check(status: int, function: Any, arguments: Any) -> int:
    """Raise an error (a negative status), or the exception of a Python function on the way."""
    if status < 0 or getattr(_thread, "raised", None) is not None:
        raised = _take_raised()
        if raised is not None:
            raise raised
        if status == c.OmStatus.CANCELLED and lib.om_stop_take():
            interrupted()
        raise make_error(status)
    return status


def interrupted() -> None:
    """Ctrl-C has ended a call: run the handler of the signal, which was put off, and raise what it raises."""
    _thread_module.interrupt_main()
    for _ in range(100):  # the handler runs between two of these
        pass
    raise KeyboardInterrupt


# Whether the signal of Ctrl-C has come, as a function that C may ask: it takes the GIL and runs nothing in Python, so the
# handler cannot raise inside of it, where an exception would be lost.
_ASK = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p)
_ask_python = _ASK(ctypes.pythonapi.PyOS_InterruptOccurred)


def listen_to_interrupts(is_on: bool = True) -> None:
    """Let Ctrl-C end long calls of C on this thread, which is the main one."""
    if threading.current_thread() is threading.main_thread():
        lib.om_stop_set(_ask_python if is_on else _ASK(), None)


def make_error(status: int) -> Error:
    text = lib.om_error_message().decode("utf-8", "replace") or lib.om_status_text(status).decode()
    return _KINDS[c.OmStatus(status)](python_words(text))


def forget_message() -> None:
    """Empty the message of this thread before a call that may end with an outcome, since not each outcome sets one."""
    lib.om_error(0, b"%s", b"")


def message_of(status: int) -> str:
    """The sentence about an outcome; "" if the status is OK."""
    return (lib.om_error_message() or lib.om_status_text(status)).decode("utf-8", "replace") if status else ""


def outcome(status: int, result: Any, strict: bool) -> Any:
    """What a finished computation returns: its result, or with `strict` an exception that holds the result."""
    if status > 0 and strict:
        error = make_error(status)
        error.result = result  # type: ignore[attr-defined]
        raise error
    return result


# ---- loading ------------------------------------------------------------------------------------------


def _candidates() -> list[str]:
    named = os.environ.get("OMENTUM_LIBRARY")
    if named:
        return [named]
    soname = "libomentum.so." + ".".join(c.OM_VERSION.split(".")[:2])
    inside = sorted(str(p) for p in (BUILT / "lib").glob("libomentum.so*"))
    return [*inside[:1], soname]


class _Library(ctypes.CDLL):
    """libomentum with the types of all functions of _capi."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        for function, (result, arguments) in c.PROTOTYPES.items():
            try:
                entry = getattr(self, function)
            except AttributeError:
                raise ImportError(f"{name} has no {function}: it is not the library of this package") from None
            entry.restype, entry.argtypes = result, arguments
            if function in c.STATUS and function not in ("om_error", "om_error_prefix"):
                entry.errcheck = _check
        self.om_error.argtypes = [ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p]  # variadic: always used with "%s"
        self.om_error.restype = ctypes.c_int


def _load() -> Any:
    tried = []
    for name in _candidates():
        try:
            library = _Library(name)
        except OSError as error:
            tried.append(f"{name}: {error}")
            continue
        version = library.om_version().decode()
        if version != c.OM_VERSION:
            raise ImportError(f"{name} is omentum {version}; this package needs {c.OM_VERSION}")
        return library
    raise ImportError("libomentum is not found. Install omentum, or set OMENTUM_LIBRARY to the file libomentum.so.\n  "
                      + "\n  ".join(tried))


lib = _load()
listen_to_interrupts()


def data_path(name: str) -> pathlib.Path:
    """A file that comes with omentum, such as "scenes/sheet.yaml" or "weights/banet.safetensors"."""
    places = [os.environ.get("OMENTUM_DATA"), BUILT / "share", pathlib.Path(sys.prefix) / "share" / "omentum",
              HERE.parent.parent, "/usr/local/share/omentum", "/usr/share/omentum"]
    for place in places:
        if place and (path := pathlib.Path(place) / name).exists():
            return path
    raise FileFailed(f"{name} does not come with this installation of omentum; OMENTUM_DATA may name its folder")


# HDF5 serves one thread of a process at a time: recordings and samples of networks take turns.
hdf5 = threading.RLock()


# ---- forks --------------------------------------------------------------------------------------------

_is_forked = False


def _mark_fork() -> None:
    global _is_forked
    _is_forked = True


os.register_at_fork(after_in_child=_mark_fork)


def refuse_fork(what: str) -> None:
    """Raise in a child of os.fork."""
    if _is_forked:
        raise Unavailable(f"{what} cannot be used in a child of os.fork: start the process with the method 'spawn'")


# ---- ownership ----------------------------------------------------------------------------------------


class Handle:
    """Owns one object of C, and keeps alive what it borrows.

    The garbage collector finalises the objects of a cycle in any order. A handle that others still use therefore destroys its
    object with the last of them.
    """

    __slots__ = ("__weakref__", "_destroy", "_is_dead", "_users", "address", "keep")

    def __init__(self, address: Any, destroy: Any, *keep: Any) -> None:
        self.address = address
        self._destroy = destroy
        self._is_dead = False
        self._users: set[int] = set()  # of handles that keep this one
        self.keep = keep
        for one in keep:
            if isinstance(one, Handle):
                one._users.add(id(self))

    def __del__(self) -> None:
        self._is_dead = True
        self._release()

    def _release(self) -> None:
        if not self._is_dead or self._users:
            return
        if self.address is not None:
            self._destroy(self.address)
            self.address = None
        keep, self.keep = self.keep, ()
        for one in keep:
            if isinstance(one, Handle):
                one._users.discard(id(self))
                one._release()


class Owner:
    """Base of objects that hold C objects. `with` closes them; afterwards every use raises Closed."""

    _handle: Handle | None = None

    @property
    def _c(self) -> Any:
        handle = self._handle
        if handle is None:
            if "_handle" not in vars(self):
                raise RuntimeError(f"{type(self).__name__}.__init__ did not call super().__init__()")
            raise Closed(f"this {type(self).__name__} is closed")
        return handle.address

    def close(self) -> None:
        """Give up the object. Its memory is freed when the last NumPy view of it is gone."""
        self._handle = None

    @property
    def is_closed(self) -> bool:
        return self._handle is None

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


class Busy:
    """Refuses a second thread: `with self._busy:` around calls that change the object."""

    __slots__ = ("_lock", "_name")

    def __init__(self, name: str) -> None:
        self._lock = threading.Lock()
        self._name = name

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise InUse(f"this {self._name} is in use by another thread, or by the call that is running")

    def __exit__(self, *_: Any) -> None:
        self._lock.release()


def create(function: Any, *arguments: Any) -> Any:
    """Call om_..._create(arguments, &object) and return the object."""
    out = function.argtypes[-1]._type_()
    function(*arguments, ctypes.byref(out))
    return out.value if isinstance(out, ctypes.c_void_p) else out


def view(handle: Any, address: int | None, dtype: Any, shape: tuple[int, ...], writable: bool = False) -> np.ndarray:
    """An array on memory of C. It keeps `handle` alive, so that the memory is not freed below it."""
    dtype = np.dtype(dtype)
    size = int(np.prod(shape)) * dtype.itemsize
    if not address or size == 0:
        return np.zeros(shape, dtype=dtype)
    memory = (ctypes.c_ubyte * size).from_address(address)
    memory._keep = handle  # type: ignore[attr-defined]
    array = np.frombuffer(memory, dtype=dtype).reshape(shape)
    array.flags.writeable = writable
    return array


def copied(address: int | None, dtype: Any, shape: tuple[int, ...]) -> np.ndarray:
    """A copy of memory of C."""
    return view(None, address, dtype, shape).copy()


def text_of(append: Callable[[Any], Any]) -> str:
    """The text that a C function appends to an OmText."""
    text = c.OmText()
    try:
        append(ctypes.byref(text))
        return ctypes.string_at(text.str or b"", text.len).decode("utf-8", "replace") if text.len else ""
    finally:
        lib.om_text_done(ctypes.byref(text))


# ---- progress and Ctrl-C --------------------------------------------------------------------------------

ProgressFunction = Callable[[str, float, float], Any]
_REPORT = functions_of(c.OmProgress)["report"]


class Interrupts:
    """Ctrl-C during a call of C: Python would raise KeyboardInterrupt inside a function that C called, where it is lost.

    Within `with` SIGINT sets `is_set`; at the end the former handler is called, which raises KeyboardInterrupt. Python
    runs handlers in the main thread alone: elsewhere nothing is changed.
    """

    def __init__(self, ends_calls: bool = True) -> None:
        """ends_calls: whether the call that runs is stopped, too; else it comes to its end first."""
        self.is_set, self._ends_calls = False, ends_calls
        self._former: Any = None

    def __enter__(self) -> Interrupts:
        if not self._ends_calls:
            listen_to_interrupts(False)
        if threading.current_thread() is threading.main_thread() and callable(signal.getsignal(signal.SIGINT)):
            self._former = signal.signal(signal.SIGINT, self._note)
        return self

    def _note(self, *_: Any) -> None:
        self.is_set = True

    def __exit__(self, *_: Any) -> None:
        former, self._former = self._former, None
        if not self._ends_calls:
            listen_to_interrupts()
        if former is not None:
            signal.signal(signal.SIGINT, former)
            if self.is_set:
                former(signal.SIGINT, None)


class Progress:
    """The progress argument of a long call: None, True (a bar), or a function of (stage, done, total).

    The total is 0 where it is not known. The function may return False to cancel. An exception in it ends the call cleanly and is raised by it. So does Ctrl-C,
    also without a function.
    """

    def __init__(self, progress: bool | ProgressFunction | None) -> None:
        self._listener = _bar() if progress is True else progress or None
        self._raised: BaseException | None = None
        self._interrupts = Interrupts()
        self._struct = c.OmProgress(report=_REPORT(self._report), ctx=None)
        self.pointer = ctypes.byref(self._struct)

    def _report(self, _ctx: Any, stage: bytes | None, done: float, total: float) -> bool:
        try:
            if self._raised is not None or self._interrupts.is_set:
                return False
            if self._listener is None:
                return True
            return self._listener((stage or b"").decode("utf-8", "replace"), done, total) is not False
        except BaseException as error:
            self._raised = error
            return False

    def __enter__(self) -> Progress:
        self._interrupts.__enter__()
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if isinstance(self._listener, _Bar):
            self._listener.done()
        self._interrupts.__exit__()
        if self._raised is not None:
            raise self._raised from None


class _Bar:
    """A bar of tqdm, or a line on standard error every two seconds."""

    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            tqdm = None
        self._tqdm: Any = tqdm
        self._bar: Any = None
        self._stage, self._last = "", 0.0

    def __call__(self, stage: str, done: float, total: float) -> bool:
        if self._tqdm is None:
            if stage != self._stage or time.monotonic() - self._last > 2:
                self._stage, self._last = stage, time.monotonic()
                share = f"{int(min(100, 100 * done / total))} %" if total else f"{done:g} so far"  # 100 at the end alone
                print(f"{stage}: {share}", file=sys.stderr)
            return True
        if stage != self._stage or self._bar is None:
            self.done()
            self._stage, self._bar = stage, self._tqdm(desc=stage, total=total or None, leave=False)
        self._bar.update((min(done, total) if total else done) - self._bar.n)
        return True

    def done(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def _bar() -> ProgressFunction:
    return _Bar()


def warn_user(text: str) -> None:
    """Warn at the line outside of this package that led here."""
    level, frame = 2, sys._getframe(1)  # 1 is this line
    while frame.f_back is not None and pathlib.Path(frame.f_code.co_filename).parent == HERE:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, stacklevel=level)


# ---- small values ---------------------------------------------------------------------------------------


def vec3(value: Any, name: str = "a vector") -> Any:
    """Three numbers as OmVec3."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape != (3,):
        raise ValueError(f"{name} has three components, not the shape {array.shape}")
    return c.OmVec3(*array.tolist())


def pose(value: Any) -> Any:
    """An OmPose from a point (3), a matrix (4 x 4), a pair (point, quaternion x y z w), or an OmPose."""
    if isinstance(value, c.OmPose):
        return value
    out = c.OmPose()
    out.q = (0, 0, 0, 1)
    if isinstance(value, tuple) and len(value) == 2:
        out.p, out.q = np.asarray(value[0], float), np.asarray(value[1], float)
        return out
    array = np.asarray(value, dtype=np.float64)
    if array.shape == (3,):
        out.p = array
    elif array.shape == (4, 4):
        turn: Any = c.OmMat3()
        np.frombuffer(turn, dtype=np.float64).reshape(3, 3)[...] = array[:3, :3].T
        out.p = array[:3, 3]
        out.q = np.frombuffer(lib.om_quat_from_mat3(turn), dtype=np.float64)
    else:
        raise ValueError(f"a pose is a point (3), a matrix (4 x 4), or (point, quaternion): not shape {array.shape}")
    return out


def pose_matrix(value: Any) -> np.ndarray:
    """The matrix (4 x 4) of an OmPose."""
    out = np.eye(4)
    out[:3, :3] = np.frombuffer(lib.om_quat_to_mat3(quat(value.q)), dtype=np.float64).reshape(3, 3).T
    out[:3, 3] = value.p
    return out


def quat(value: Any) -> Any:
    """Four numbers x y z w as OmQuat."""
    out: Any = c.OmQuat()
    np.frombuffer(out, dtype=np.float64)[...] = np.asarray(value, dtype=np.float64)
    return out


def arm_of(arm: int) -> int:
    """The number of an arm, checked: the library ignores a release of an arm that does not exist."""
    if not 0 <= arm < c.OM_MAX_ARM:
        raise Invalid(f"there is no arm {arm}: arms are 0 to {c.OM_MAX_ARM - 1}")
    return arm


def path_of(path: Any) -> bytes:
    return os.fsencode(path)


def refuse_volume(path: Any, wanted: str) -> None:
    """Raise where the path of a volume was given for another kind of file."""
    name = os.fsdecode(path)
    if name.lower().endswith((".nii", ".nii.gz", ".hdr", ".img", ".nrrd", ".nhdr")):
        raise Invalid(f'{name} is a volume, not {wanted}: build_patient("{name}", edge="6 mm") makes a patient model of its labels')
