"""Structs of C with Python values: the base class of the types in _capi.py, and conversions of arguments."""
from __future__ import annotations

import ctypes
import difflib
import functools
import importlib
import inspect
import pathlib
import re
import sys
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

_NUMBERS = {
    ctypes.c_double: np.float64, ctypes.c_float: np.float32, ctypes.c_int: np.int32, ctypes.c_uint: np.uint32,
    ctypes.c_bool: np.bool_, ctypes.c_ubyte: np.uint8, ctypes.c_byte: np.int8, ctypes.c_int64: np.int64,
    ctypes.c_uint64: np.uint64, ctypes.c_int16: np.int16, ctypes.c_uint16: np.uint16,
}


if TYPE_CHECKING:  # what a field gives and what it takes
    Member = TypeVar("Member", bound=IntEnum)

    class Numbers:
        """A NumPy view of the struct's memory; takes anything of its shape."""

        def __get__(self, struct: Any, kind: Any = None) -> np.ndarray: ...
        def __set__(self, struct: Any, values: Any) -> None: ...

    class Choice(Generic[Member]):
        """A member of an enum; takes its name in any case, too."""

        def __get__(self, struct: Any, kind: Any = None) -> Member: ...
        def __set__(self, struct: Any, value: Member | str | int) -> None: ...


class Struct(ctypes.Structure):
    """A struct of C. A field that does not exist raises AttributeError with the nearest name, also when it is set."""

    _names: tuple[str, ...] = ()
    _offsets: tuple[int, ...] = ()

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._names and not name.startswith("_"):
            raise AttributeError(unknown(type(self).__name__, "field", name, self._names))
        super().__setattr__(name, value)

    def __repr__(self) -> str:
        def short(value: Any) -> str:
            if isinstance(value, np.ndarray) and value.size > 9:
                return f"<{'x'.join(map(str, value.shape))} {value.dtype}>"
            return repr(value.tolist()) if isinstance(value, np.ndarray) else repr(value)

        shown = (f"{n}={short(v)}" for n in self._names if not isinstance(v := getattr(self, n), ctypes.Array))
        return f"{type(self).__name__}({', '.join(shown)})"

    def as_dict(self) -> dict[str, Any]:
        """All fields as Python values: arrays are copied, structs become dictionaries. Pointers are left out."""
        out: dict[str, Any] = {}
        for name in self._names:
            value = getattr(self, name)
            if isinstance(value, Struct):
                out[name] = value.as_dict()
            elif isinstance(value, np.ndarray):
                out[name] = value.copy()
            elif isinstance(value, (bool, int, float, str, IntEnum)):
                out[name] = value
        return out

    def assign(self, values: dict[str, Any], also: tuple[str, ...] = ()) -> None:
        """Set several fields; the value of a field that is a struct may be a dictionary. A name that does not exist raises
        AttributeError with the nearest one, also of the arguments of the function that calls, and of its words `also`."""
        for name, value in values.items():
            if name not in self._names:
                code = sys._getframe(1).f_code
                own = code.co_varnames[:code.co_argcount + code.co_kwonlyargcount]
                words = [w for w in (*self._names, *own, *also) if w not in ("self", "cls", "cookie")]
                raise AttributeError(unknown(type(self).__name__, "field", name, words))
            if isinstance(value, dict) and isinstance(inner := getattr(self, name, None), Struct):
                inner.assign(value)
                continue
            try:
                setattr(self, name, value)
            except TypeError as error:  # of ctypes, which does not name the field
                raise TypeError(f"{name}={value!r}: {error}") from None


def unknown(owner: str, what: str, name: str, names: Any) -> str:
    """The sentence about a name that does not exist: with the nearest one, or where none is near with those there are."""
    names = list(dict.fromkeys(names))
    near = difflib.get_close_matches(name, names, 1, 0.55)  # "layot" is no "law"
    return f"{owner} has no {what} '{name}'; " + (f"did you mean '{near[0]}'?" if near else f"it has {', '.join(names)}")


def takes_words(function: Any) -> Any:
    """A function whose error about an argument that it does not take names the nearest one that it takes."""
    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except TypeError as error:
            found = re.search(r"got an unexpected keyword argument '(\w+)'", str(error))
            is_of_this_call = error.__traceback__ is not None and error.__traceback__.tb_next is None
            if not found or not is_of_this_call:
                raise
            words = [p.name for p in inspect.signature(function).parameters.values()
                     if p.name not in ("self", "cls") and p.kind in (p.KEYWORD_ONLY, p.POSITIONAL_OR_KEYWORD)]
            owner = function.__qualname__.replace(".__init__", "")
            raise TypeError(unknown(f"{owner}()", "argument", found[1], words)) from None

    return call


def _has_words(function: Any) -> bool:
    """Whether there are words to choose from: a call of a few arguments keeps its short traceback."""
    return len(inspect.signature(function).parameters) > 3


def suggest_words(public: dict[str, Any]) -> None:
    """Make functions, and methods of classes, among the names of a module such that suggest words."""
    for name, thing in list(public.items()):
        if isinstance(thing, type):
            for member, value in list(vars(thing).items()):
                if isinstance(value, classmethod) and _has_words(value.__func__):
                    setattr(thing, member, classmethod(takes_words(value.__func__)))
                elif inspect.isfunction(value) and (member == "__init__" or not member.startswith("_")) and _has_words(value):
                    setattr(thing, member, takes_words(value))
        elif inspect.isfunction(thing) and _has_words(thing):
            public[name] = takes_words(thing)


def need(package: str, what: str) -> Any:
    """The module of an optional package; without it an error that names the command which installs it."""
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as error:
        if error.name != package.split(".")[0]:
            raise
        install = {"stable_baselines3": "stable-baselines3"}.get(error.name, error.name)
        raise ModuleNotFoundError(f"{what} needs {install}, which this Python does not have: pip install {install}", name=error.name) from None


def find_enum(kind: type[IntEnum], value: Any) -> int:
    """A member of an enum, by itself, its number, or its name in any case: "neo-hookean", "NEO_HOOKEAN"."""
    if isinstance(value, str):
        name = value.upper().replace("-", "_").replace(" ", "_")
        names = {m.name: m for m in kind}
        ends = [n for n in names if n.endswith("_" + name)]  # "quadratic" of ELEMENT_QUADRATIC
        if name not in names and len(ends) == 1:
            name = ends[0]
        if name not in names:
            raise ValueError(unknown(kind.__name__, "member", value, [n.lower() for n in names]))
        return int(names[name])
    return int(value)


def _view(raw: Any, dtype: Any, shape: tuple[int, ...]) -> np.ndarray:
    return np.frombuffer(raw, dtype=dtype).reshape(shape)


def _view_property(field: Any, name: str, dtype: Any, shape: tuple[int, ...], is_turned: bool) -> property:
    def get(self: Any) -> np.ndarray:
        array = _view(field.__get__(self, type(self)), dtype, shape)
        return array.T if is_turned else array

    def put(self: Any, value: Any) -> None:
        try:
            array = np.asarray(value, dtype=dtype)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{name}={value!r}: {error}") from None
        if array.shape != shape:
            wanted = "three numbers (x, y, z) are needed" if shape == (3,) else f"shape {shape} is needed"
            raise ValueError(f"{type(self).__name__}.{name}={value!r}: {wanted}")
        get(self)[...] = array

    return property(get, put)


def _text_property(field: Any, name: str, size: int) -> property:
    def get(self: Any) -> str:
        return field.__get__(self, type(self)).decode("utf-8", "replace")

    def put(self: Any, value: Any) -> None:
        data = value.encode() if isinstance(value, str) else bytes(value)
        if len(data) >= size:
            raise ValueError(f"{type(self).__name__}.{name} holds at most {size - 1} bytes, the text has {len(data)}")
        field.__set__(self, data)

    return property(get, put)


def _enum_property(field: Any, kind: type[IntEnum]) -> property:
    def get(self: Any) -> int:
        value = field.__get__(self, type(self))
        try:
            return kind(value)
        except ValueError:
            return value

    return property(get, lambda self, value: field.__set__(self, find_enum(kind, value)))


_SMALL = {"OmVec3": (3,), "OmQuat": (4,), "OmMat3": (3, 3)}


def functions_of(table: type[Struct]) -> dict[str, Any]:
    """The types of the functions of a struct by name, to make them from Python functions."""
    return {field[0]: field[1] for field in table._fields_}


def complete(cls: Any, fields: list[tuple[str, Any]], enums: dict[str, type[IntEnum]]) -> None:
    """Give a struct its fields, and Python values to those that ctypes leaves as bytes, numbers or structs."""
    cls._fields_ = fields
    cls._names = tuple(name for name, _ in fields)
    cls._offsets = tuple(cls.__dict__[name].offset for name, _ in fields)
    for name, kind in fields:
        field = cls.__dict__[name]
        if name in enums:
            setattr(cls, name, _enum_property(field, enums[name]))
        elif kind.__name__ in _SMALL:
            setattr(cls, name, _view_property(field, name, np.float64, _SMALL[kind.__name__], kind.__name__ == "OmMat3"))
        elif issubclass(kind, ctypes.Array):
            shape, item = [], kind
            while issubclass(item, ctypes.Array):
                shape.append(item._length_)
                item = item._type_
            if item is ctypes.c_char and len(shape) == 1:
                setattr(cls, name, _text_property(field, name, shape[0]))
            elif item in _NUMBERS:
                setattr(cls, name, _view_property(field, name, _NUMBERS[item], tuple(shape), False))
            elif item.__name__ == "OmVec3":
                setattr(cls, name, _view_property(field, name, np.float64, (*shape, 3), False))


# ---- arguments ----------------------------------------------------------------------------------------


def array_of(value: Any, dtype: Any, shape: tuple[int | None, ...], name: str) -> np.ndarray:
    """A contiguous array of this type and shape (None: any extent), copied only where it must be."""
    array = np.ascontiguousarray(value, dtype=dtype)
    if array.ndim != len(shape) or any(want is not None and have != want for have, want in zip(array.shape, shape)):
        wanted = " x ".join("n" if s is None else str(s) for s in shape)
        raise ValueError(f"{name} has shape {array.shape}: {wanted} is needed")
    return array


def index_array(value: Any, name: str, nvert: int | None = None) -> np.ndarray:
    """Vertex numbers: integers as they are, a mask of booleans, one for each of the `nvert` vertices, as the places where it is true."""
    array = np.atleast_1d(np.asarray(value))
    if array.size == 0:
        return np.zeros(0, dtype=np.int32)
    if array.dtype == np.bool_:
        if nvert is not None and array.shape != (nvert,):
            raise ValueError(f"{name}: a mask of {array.size} for {nvert} vertices: make it of the body's own `x`; quadratic elements have "
                             "more vertices than the mesh that was given")
        array = np.flatnonzero(array)
    if not np.issubdtype(array.dtype, np.integer) or array.ndim != 1:
        raise ValueError(f"{name} is a list of vertex numbers, or a mask of booleans")
    return np.ascontiguousarray(array, dtype=np.int32)


_UNITS = {
    "length": ("m", {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}),
    "stress": ("Pa", {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}),
    "density": ("kg/m^3", {"kg/m^3": 1.0, "g/cm^3": 1e3}),
    "time": ("s", {"s": 1.0, "ms": 1e-3}),
}


def quantity(value: Any, kind: str, name: str) -> Any:
    """A number in the unit of `kind`, or words with a unit: "3 kPa" is 3000.0, "8 mm" is 0.008.

    name: of the argument, for the message.
    """
    if not isinstance(value, str):
        return value
    unit, factors = _UNITS[kind]
    words = re.fullmatch(r"\s*([-+0-9.eE]+)\s*(\S+)\s*", value)
    try:
        return float(words[1]) * factors[words[2]]  # type: ignore[index]
    except (TypeError, KeyError, ValueError):
        few = ", ".join(factors)
        raise ValueError(f'{name}="{value}": a number in {unit}, or words such as "3 {list(factors)[1]}" (units: {few})') from None


_MOST = 0.1  # m: sides of voxels and edges, radii of tools; a larger one was meant in millimetres


def length(value: Any, name: str, most: float = _MOST) -> Any:
    """A length as of quantity(); one above `most` m is refused, with the same in metres."""
    value = quantity(value, "length", name)
    if not isinstance(value, (int, float, np.integer, np.floating)):
        raise TypeError(f'{name}={value!r}: a number in m, or words such as "8 mm", is needed')
    if value > most:
        raise ValueError(f'{name}: {value:g} m is more than {most:g} m; lengths are in metres, {value:g} mm is {1e-3 * value:g} or "{value:g} mm"')
    return value


def meters_per(unit: str) -> float:
    """Length of a unit, m."""
    factors = _UNITS["length"][1]
    if unit not in factors:
        raise ValueError(f'unit="{unit}": one of {", ".join(factors)}')
    return factors[unit]


_LENGTHS = ("thickness", "bridge", "gap", "half_length", "half_width", "corner", "wrap", "tumour_radius", "tumour_height", "reach")


def with_lengths(values: Any, name: str) -> dict[str, Any]:
    """The fields of a sheet, or of tissue over an organ, with lengths in words as numbers: {"thickness": "8 mm"}."""
    if not isinstance(values, dict):
        raise TypeError(f'{name}={values!r}: a dictionary is needed, such as sheet={{"thickness": "8 mm", "side": "lateral"}}')
    return {k: quantity(v, "length", f"{name}: {k}") if k in _LENGTHS else v for k, v in values.items()}


# Options of the program in messages of the library, and what they are called here.
_OPTIONS = [(re.compile(pattern), words) for pattern, words in (
    (r"--label NAME or N|--label N or NAME", 'label="NAME" or label=N'), (r"--label all", "all_labels=True"), (r"--label (-?\d+|N)", r"label=\1"),
    (r"--window LO,HI", "has_window=True, window_lo=LO, window_hi=HI"), (r"--threshold ([\d.]+)", r"threshold=\1"),
    (r"\(--volume N\)", "(entry=N of Volume.load, volume=N of build_patient)"), (r"--volume N", "entry=N"),
    (r"--list shows the labels|--list shows them", "Volume.load(path).labels() lists them"), (r"--unit ([a-z]+)", r'unit="\1"'), (r"--unit\b", 'unit="mm"'),
    (r"--space\b", 'space="LPS"'), (r"--all-parts or --part N keeps", "keep_all=True keeps"), (r"--keep-holes leaves", "keep_holes=True leaves"),
    (r"--keep-cracks\b", "keep_cracks=True"), (r"\(--max-volume,", "(max_bytes of Volume.load, max_volume_size of build_patient,"))]
_MISSING = re.compile(r"(.+?): (?:cannot open: No such file or directory|no such file)$")


def python_words(text: str) -> str:
    """A message of the library in the words of this package: arguments in place of the program's options, and for a file that is missing
    the nearest one of its folder."""
    for pattern, words in _OPTIONS:
        text = pattern.sub(words, text)
    found = _MISSING.match(text)
    if not found:
        return text
    path = pathlib.Path(found[1])
    if not path.parent.is_dir():
        return f"{text}; there is no folder {path.parent.absolute()}"
    try:
        near = difflib.get_close_matches(path.name, [p.name for p in path.parent.iterdir()], 1, 0.6)
    except OSError:
        near = []
    return f'{text}; did you mean "{near[0]}"?' if near else f"{text} in {path.parent.absolute()}"
