"""The generator of the declarations (tools/python_binding.py), and the package of a checkout that is not built."""
import ctypes
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

from omentum import capi as c

ROOT = pathlib.Path(__file__).resolve().parents[2]
GENERATOR = ROOT / "tools/python_binding.py"


@pytest.fixture
def generator(monkeypatch):
    monkeypatch.syspath_prepend(str(GENERATOR.parent))
    import python_binding
    return python_binding


def test_the_package_has_the_declarations_of_the_headers(tmp_path):
    made = tmp_path / "folder" / "_capi.py"
    subprocess.run([sys.executable, "-B", GENERATOR, made], check=True)
    assert made.read_text() == pathlib.Path(c.__file__).read_text(), "the build is older than the headers: run make build"
    assert [p.name for p in made.parent.iterdir()] == ["_capi.py"]


def test_every_function_of_the_headers_is_declared():
    named, variadic = set(), set()
    for header in sorted((ROOT / "include/omentum").glob("*.h")):
        if header.name.startswith("study"):  # omentum.h does not include the studies
            continue
        text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", header.read_text(), flags=re.S)
        text = re.sub(r"^\s*#[^\n]*(\\\n[^\n]*)*", "", text, flags=re.M)
        for prototype in re.findall(r"\bOM_API\b([^;{]*)", text):
            name = re.search(r"\b(om_\w+)\s*\(", prototype).group(1)
            (variadic if "..." in prototype else named).add(name)
    assert named == set(c.PROTOTYPES)
    assert variadic == {"om_error", "om_error_prefix", "om_facts_add", "om_log", "om_text_append"}


def test_types_of_c_become_those_of_ctypes(generator):
    headers = generator.Headers("""
        typedef enum OmKind { OM_KIND_FIRST = 3, OM_KIND_NEXT } OmKind;
        typedef struct OmThing { int n; double* x; float a[3]; } OmThing;
        typedef struct OmHidden OmHidden;
        int om_thing_step(OmHidden* thing, const OmThing* def, OmKind kind, const char* name, double dt, size_t n);
        void om_thing_say(const char* format, ...);
    """)
    assert headers.enums["OmKind"] == [("OM_KIND_FIRST", 3), ("OM_KIND_NEXT", 4)]
    result, parameters, is_variadic = headers.functions["om_thing_step"]
    assert not is_variadic and headers.result(result) == "c_int"
    assert [headers.ctype(p) for p in parameters] == ["c_void_p", "POINTER(OmThing)", "c_int", "c_char_p", "c_double", "c_size_t"]
    assert [(f, headers.ctype(k)) for f, k in headers.structs["OmThing"]] == [
        ("n", "c_int"), ("x", "c_void_p"), ("a", "c_float * 3")]
    assert headers.functions["om_thing_say"][2]
    assert c.PROTOTYPES["om_scene_load"] == (ctypes.c_int, [ctypes.c_char_p, ctypes.POINTER(c.OmScene)])


def test_an_unknown_declaration_is_refused(generator):
    with pytest.raises(SystemExit, match="expected before: { int a"):
        generator.Headers("union OmEither { int a; float b; };")


def test_a_checkout_that_is_not_built_says_what_to_run(tmp_path):
    shutil.copytree(ROOT / "python/omentum", tmp_path / "omentum", ignore=shutil.ignore_patterns("_capi.py", "__pycache__"))
    done = subprocess.run([sys.executable, "-B", "-c", "import omentum"], cwd=tmp_path, capture_output=True, text=True, check=False,
                          env={"PYTHONPATH": str(tmp_path)})
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1 and last.startswith("ImportError: ") and "run `make build`" in last
    assert "During handling" not in done.stderr
