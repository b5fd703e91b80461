#!/usr/bin/env python3
"""Make _capi.py, the ctypes declarations of the C interface, from the public headers.

    tools/python_binding.py              write python/omentum/_capi.py, which a checkout's package loads; git ignores it
    tools/python_binding.py FILE...      write each of these files; the build calls this (python/CMakeLists.txt)
    tools/python_binding.py --layout     print a C program that prints the size of every struct and the offset
                                         of every field; the tests compare them with those of ctypes

The C compiler (CC, or cc) expands the macros of omentum.h, without system headers. The declarations that are left
are simple C: enums, structs, types of functions, prototypes. The parser refuses anything else with its line, so that a
new kind of declaration is noticed.
"""
import ast
import keyword
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = ROOT / "python" / "omentum" / "_capi.py"
SYSTEM_HEADERS = ("math", "stdarg", "stdbool", "stddef", "stdint", "stdio")

SCALARS = {
    "void": None, "char": "c_char", "unsigned char": "c_ubyte", "signed char": "c_byte", "int": "c_int",
    "unsigned": "c_uint", "unsigned int": "c_uint", "float": "c_float", "double": "c_double", "bool": "c_bool",
    "size_t": "c_size_t", "int8_t": "c_int8", "uint8_t": "c_uint8", "int16_t": "c_int16", "uint16_t": "c_uint16",
    "int32_t": "c_int32", "uint32_t": "c_uint32", "int64_t": "c_int64", "uint64_t": "c_uint64", "FILE": "void",
}
VIEWS = {"OmVec3", "OmQuat", "OmMat3"}  # fields of these types are NumPy views, see _convert.py
PYTHON_TYPE = {"c_float": "float", "c_double": "float", "c_bool": "bool", "c_char_p": "bytes | None"}


def fail(why):
    sys.exit(f"python_binding: {why}")


# ---- reading ------------------------------------------------------------------------------------------


def preprocess(*options):
    """The text of omentum.h after the preprocessor, with empty system headers."""
    with tempfile.TemporaryDirectory() as folder:
        for name in SYSTEM_HEADERS:
            pathlib.Path(folder, name + ".h").touch()
        command = [os.environ.get("CC", "cc"), "-E", "-P", "-nostdinc", f"-I{folder}", f"-I{ROOT / 'include'}",
                   "-D__attribute__(x)=", "-x", "c", *options, "-"]
        done = subprocess.run(command, input='#include "omentum/omentum.h"\n', text=True, capture_output=True, check=False)
    if done.returncode:
        fail(f"{' '.join(command)} failed:\n{done.stderr}")
    return done.stdout


def tokenize(text):
    pattern = r"\s+|([A-Za-z_]\w*|0[xX][0-9a-fA-F]+\w*|[0-9][\w.]*(?:[eE][-+]?\d+)?|\.\.\.|<<|>>|\"(?:\\.|[^\"])*\"|'(?:\\.|[^'])'|.)"
    return [t for t in re.findall(pattern, text) if t]


class Headers:
    """Everything that the headers declare, in their order."""

    def __init__(self, text):
        self.tokens, self.at = tokenize(text), 0
        self.enums = {}       # name -> [(constant, value)]
        self.structs = {}     # name -> [(field, type)], of complete structs
        self.opaque = set()   # structs that only the library knows
        self.aliases = {}     # name of a typedef -> type
        self.functions = {}   # name -> (type of the result, [type], is_variadic)
        self.constants = {}   # of enums, by name
        self.loose = {}       # constants of enums without a name
        while self.at < len(self.tokens):
            self.declaration()
        self.opaque -= set(self.structs)

    def peek(self, ahead=0):
        return self.tokens[self.at + ahead] if self.at + ahead < len(self.tokens) else ""

    def take(self, wanted=None):
        token = self.peek()
        if wanted is not None and token != wanted:
            fail(f"'{wanted}' expected before: {' '.join(self.tokens[self.at:self.at + 12])}")
        self.at += 1
        return token

    def declaration(self):
        if self.peek() == ";":
            self.take()
        elif self.peek() == "static":
            self.skip_function()
        elif self.peek() == "typedef":
            self.take()
            base = self.specifier()
            for name, kind in self.declarators(base):
                if kind != name and kind not in ("struct " + name, "enum " + name):
                    self.aliases[name] = kind
        elif self.peek() in ("enum", "struct") and ("{" in (self.peek(1), self.peek(2)) or self.peek(2) == ";"):
            self.specifier()
            self.take(";")
        else:
            self.prototype()

    def skip_function(self):
        while self.take() != "{":
            pass
        depth = 1
        while depth:
            depth += {"{": 1, "}": -1}.get(self.take(), 0)

    def specifier(self, owner=""):
        """A type without stars: the name of a scalar, an enum or a struct."""
        words = []
        while True:
            token = self.peek()
            if token == "const":
                self.take()
            elif token == "enum":
                return self.enum()
            elif token == "struct":
                return self.struct(owner)
            elif token in ("unsigned", "signed") or (token in ("char", "int") and words):
                words.append(self.take())
            elif not words:
                words.append(self.take())
            else:
                break
        while self.peek() == "const":
            self.take()
        return " ".join(words)

    def enum(self):
        self.take("enum")
        name = self.take() if self.peek() != "{" else ""
        if self.peek() != "{":
            return name
        self.take("{")
        value, members = -1, []
        while self.peek() != "}":
            constant = self.take()
            value = self.expression((",", "}")) if self.peek() == "=" and self.take() else value + 1
            members.append((constant, value))
            self.constants[constant] = value
            if self.peek() == ",":
                self.take()
        self.take("}")
        if name:
            self.enums[name] = members
        else:
            self.loose.update(members)
        return name

    def struct(self, owner):
        self.take("struct")
        name = self.take() if self.peek() != "{" else ""
        if self.peek() != "{":
            self.opaque.add(name)
            return name
        name = name or f"{owner}_item"
        self.take("{")
        fields = []
        while self.peek() != "}":
            fields += self.declarators(self.specifier(name))
        self.take("}")
        self.structs[name] = [(field, kind) for field, kind in fields]
        return name

    def expression(self, ends):
        words = []
        while self.peek() not in ends:
            token = self.take()
            words.append(str(self.constants.get(token, re.sub(r"(?<=\d)[uUlL]+$", "", token))))
        return int(eval(compile(ast.parse(" ".join(words), mode="eval"), "headers", "eval"), {"__builtins__": {}}))

    def declarators(self, base):
        """All names of one declaration, with their types."""
        found = []
        while True:
            found.append(self.declarator(base))
            if self.take() == ";":
                return found

    def declarator(self, base):
        kind = base
        while self.peek() in ("*", "const"):
            if self.take() == "*":
                kind = ("*", kind)
        if self.peek() == "(" and self.peek(1) == "*":
            self.take("(")
            self.take("*")
            name = self.take()
            self.take(")")
            parameters, is_variadic = self.parameters()
            return name, ("function", kind, parameters, is_variadic)
        name = self.take() if re.match(r"[A-Za-z_]", self.peek()) else ""
        sizes = []
        while self.peek() == "[":
            self.take("[")
            sizes.append(self.expression(("]",)) if self.peek() != "]" else 0)
            self.take("]")
        for size in reversed(sizes):
            kind = ("[", kind, size)
        return name, kind

    def parameters(self):
        self.take("(")
        found, is_variadic = [], False
        while self.peek() != ")":
            if self.peek() == "...":
                self.take()
                is_variadic = True
            else:
                _, kind = self.declarator(self.specifier())
                found.append(("*", kind[1]) if kind[0] == "[" else kind)
            if self.peek() == ",":
                self.take()
        self.take(")")
        return ([] if found == ["void"] else found), is_variadic

    def prototype(self):
        base = self.specifier()
        result = base
        while self.peek() in ("*", "const"):
            if self.take() == "*":
                result = ("*", result)
        name = self.take()
        parameters, is_variadic = self.parameters()
        self.take(";")
        self.functions[name] = (result, parameters, is_variadic)

    # ---- writing --------------------------------------------------------------------------------------

    def base(self, name):
        """A type's name without its typedefs."""
        while isinstance(name, str) and name in self.aliases and isinstance(self.aliases[name], str):
            name = self.aliases[name]
        return name

    def ctype(self, kind):
        """The ctypes expression of a type."""
        if isinstance(kind, str):
            if isinstance(self.aliases.get(kind), tuple):
                return kind  # a function type with a name
            kind = self.base(kind)
            if kind in self.enums:
                return "c_int"
            if kind in self.structs:
                return kind
            if kind in SCALARS:
                return "None" if SCALARS[kind] is None else SCALARS[kind]
            fail(f"no such type: {kind}")
        if kind[0] == "[":
            return f"{self.ctype(kind[1])} * {kind[2]}" if kind[1][0] != "[" else f"({self.ctype(kind[1])}) * {kind[2]}"
        if kind[0] == "function":
            return f"CFUNCTYPE({', '.join([self.result(kind[1])] + [self.ctype(p) for p in kind[2]])})"
        target = kind[1]
        if isinstance(target, str):
            name = self.base(target)
            if name == "char":
                return "c_char_p"
            if name in self.structs:
                return f"POINTER({name})"
            if isinstance(self.aliases.get(target), tuple):
                return f"POINTER({target})"
            return "c_void_p"  # an array of numbers, or an object that the library alone knows
        if target[0] == "function":
            return self.ctype(target)
        return f"POINTER({self.ctype(target)})"

    def result(self, kind):
        return self.ctype(kind)

    def hint(self, kind):
        """The Python type of a field, for type checkers."""
        if isinstance(kind, tuple):
            if kind[0] == "[" and isinstance(kind[1], str):
                name = self.base(kind[1])
                if name == "char":
                    return "str"
                if name in SCALARS:
                    return "Numbers"
            if kind == ("*", "char"):
                return "bytes | None"
            return "Any"
        name = self.base(kind)
        if name in self.enums:
            return f"Choice[{name}]"
        if name in VIEWS:
            return "Numbers"
        if name in self.structs:
            return name
        if isinstance(self.aliases.get(kind), tuple):
            return "Any"
        return PYTHON_TYPE.get(SCALARS[name], "int")


def member_names(members):
    """Names of an enum's constants without OM_ and the words that all of them share."""
    words = [name.split("_")[1:] for name, _ in members]
    counted = [w for w in words if not re.fullmatch(r"N[A-Z]+", w[-1]) or len(w) > 1] or words
    shared = 0
    while len(counted) > 1 and all(len(w) > shared + 1 and w[shared] == counted[0][shared] for w in counted):
        shared += 1
    names = ["_".join(w[shared:] if w in counted else w) for w in words]
    return [n if re.match(r"[A-Z]", n) else "_".join(w) for n, w in zip(names, words)]


def python_name(field):
    """A field whose name is a word of Python gets an underscore: in_."""
    return field + "_" if keyword.iskeyword(field) else field


def struct_texts():
    """The C text of each struct, as the header has it: field by field with unit and shape."""
    texts = {}
    for path in sorted((ROOT / "include" / "omentum").glob("*.h")):
        lines = path.read_text(encoding="utf-8").split("\n")
        for end, line in enumerate(lines):
            name = re.fullmatch(r"\} (Om\w+);(\s*//.*)?", line)
            if not name:
                continue
            begin = end
            while begin and not re.match(r"(typedef\s+)?(struct|enum)\b", lines[begin]):
                begin -= 1
            if "struct" in lines[begin]:
                texts[name.group(1)] = "\n".join(lines[begin:end + 1])
    return texts


def enum_fields(headers, fields, text):
    """Enum by field: of fields that are enums, and of ints whose comment begins with an enum, as `int law;  // OmLaw of ..., -1: none`."""
    told = dict(re.findall(r"^\s*int (\w+);\s*// (Om\w+) of ", text, re.M))
    of = {field: headers.base(kind) if isinstance(kind, str) else "" for field, kind in fields}
    of = {field: told.get(field, kind) if kind == "int" else kind for field, kind in of.items()}
    return {field: kind for field, kind in of.items() if kind in headers.enums}


def number_macros():
    """Macros whose value is a number or a text."""
    found = {}
    for line in preprocess("-dM").splitlines():
        match = re.match(r"#define (OM_\w+) (.+)$", line)
        if match and re.fullmatch(r"[\w.+\-*/() \"<]+", match.group(2)):
            found[match.group(1)] = match.group(2).strip()
    values = {}

    def value(name):
        if name not in values:
            text = re.sub(r"\((u?int\d+_t|int|double|size_t)\)", "", found[name])
            text = re.sub(r"\b(0[xX][0-9a-fA-F]+|\d+)[uUlL]+\b", r"\1", text)
            text = re.sub(r"\bOM_\w+\b", lambda m: repr(value(m.group(0))), text)
            values[name] = ast.literal_eval(text) if text[0] == '"' else eval(text, {"__builtins__": {}})
        return values[name]

    out = {}
    for name in sorted(found):
        try:
            out[name] = value(name)
        except (KeyError, SyntaxError, NameError, TypeError, ValueError):
            continue  # not a constant
    return {n: v for n, v in out.items() if isinstance(v, (int, float, str))}


HEAD = '''"""The C interface as ctypes types: made by tools/python_binding.py from include/omentum, do not edit.

Structs have the text of the C header as their docstring. Fields of type OmVec3, OmQuat, OmMat3 and arrays of numbers are
NumPy views of the struct's memory, texts are str, enums are IntEnum. Arrays are passed as addresses (ndarray.ctypes.data).
"""
# ruff: noqa
from __future__ import annotations

from ctypes import (CFUNCTYPE, POINTER, c_bool, c_byte, c_char, c_char_p, c_double, c_float, c_int, c_int8, c_int16, c_int32,
                    c_int64, c_size_t, c_ubyte, c_uint, c_uint8, c_uint16, c_uint32, c_uint64, c_void_p)
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from ._convert import Struct, complete

if TYPE_CHECKING:
    from ._convert import Choice, Numbers
'''


def write_enums(headers, out):
    out.append("\n# ---- constants\n")
    for name, value in number_macros().items():
        out.append(f"{name} = {value!r}")
    for name, value in headers.loose.items():
        out.append(f"{name} = {value}")
    for enum, members in headers.enums.items():
        out.append(f"\n\nclass {enum}(IntEnum):")
        out += [f"    {short} = {value}" for short, (_, value) in zip(member_names(members), members)]


def write_structs(headers, out):
    texts = struct_texts()
    out.append("\n\n# ---- structs\n")
    structs = {name: [(python_name(field), kind) for field, kind in fields] for name, fields in headers.structs.items()}
    for name, fields in structs.items():
        out.append(f"\nclass {name}(Struct):")
        if name in texts:
            text = texts[name].replace("\\", "\\\\").replace('"""', "'''")
            out.append(f'    """{text}"""')
        chosen = enum_fields(headers, fields, texts.get(name, ""))
        out += [f"    {field}: Choice[{chosen[field]}]" if field in chosen else f"    {field}: {headers.hint(kind)}" for field, kind in fields]
        out.append("")
    out.append("\n# ---- types of functions\n")
    for name, kind in headers.aliases.items():
        if isinstance(kind, tuple):
            out.append(f"{name} = {headers.ctype(kind)}")
    out.append("\n# ---- fields\n")
    for name, fields in structs.items():
        body = ", ".join(f'("{field}", {headers.ctype(kind)})' for field, kind in fields)
        enums = ", ".join(f'"{field}": {kind}' for field, kind in enum_fields(headers, fields, texts.get(name, "")).items())
        out.append(f"complete({name}, [{body}], {{{enums}}})")


def write_functions(headers, out):
    out.append("\n# ---- functions: name, type of the result, types of the arguments\n")
    out.append("PROTOTYPES: dict[str, tuple[Any, list[Any]]] = {")
    statuses = []
    for name, (result, parameters, is_variadic) in sorted(headers.functions.items()):
        if is_variadic:
            continue  # called through om_error_text alone, see _lib.py
        out.append(f'    "{name}": ({headers.result(result)}, [{", ".join(headers.ctype(p) for p in parameters)}]),')
        if result == "OmStatus":
            statuses.append(name)
    out.append("}\n\n# functions whose result is an OmStatus\nSTATUS = frozenset([")
    out += [f'    "{name}",' for name in statuses]
    out.append("])")


def make(headers):
    out = [HEAD]
    write_enums(headers, out)
    write_structs(headers, out)
    write_functions(headers, out)
    return "\n".join(out) + "\n"


def layout(headers):
    """A C program that prints each struct: its name, its size, and name and offset of each field."""
    out = ["#include <omentum/omentum.h>", "#include <stddef.h>", "#include <stdio.h>", "int main(void) {"]
    for name, fields in headers.structs.items():
        if name.endswith("_item"):
            continue
        typed = f"struct {name}" if name == "OmWorld" else name
        out.append(f'    printf("{name} %zu", sizeof({typed}));')
        out += [f'    printf(" {field} %zu", offsetof({typed}, {field}));' for field, _ in fields]
        out.append('    puts("");')
    return "\n".join(out + ["    return 0;", "}"])


def write(path, text):
    """Write by a temporary name: two builds may write the same file at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


def main():
    headers = Headers(preprocess())
    if sys.argv[1:] == ["--layout"]:
        print(layout(headers))
        return
    if any(name.startswith("-") for name in sys.argv[1:]):
        fail(f"no such option: {' '.join(sys.argv[1:])}")
    text = make(headers)
    for path in [pathlib.Path(name) for name in sys.argv[1:]] or [TARGET]:
        write(path, text)
    print(f"_capi.py: {len(headers.functions)} functions, {len(headers.structs)} structs, {len(headers.enums)} enums")


if __name__ == "__main__":
    main()
