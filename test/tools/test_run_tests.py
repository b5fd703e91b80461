#!/usr/bin/env python3
"""tools/run_tests.py and tools/ctest_files.py: what CMake wrote is read, and no failure, skip or slow test is lost."""
import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
import ctest_files  # noqa: E402
import run_tests  # noqa: E402

SKIPS = "[ RUN      ] other\nskip: PyTorch is not importable\n[  SKIPPED ] other\n[  SKIPPED ] 1 test(s), listed below:\n[  SKIPPED ] other\n"


class Build:
    """A build folder with tests written as CMake writes them."""

    def __init__(self, folder):
        self.folder, self.text = pathlib.Path(folder), ""

    def add(self, name, command, labels="", more=""):
        self.text += f'add_test([=[{name}]=] "bash" "-c" "{command}")\n'
        self.text += f'set_tests_properties([=[{name}]=] PROPERTIES  {more} LABELS "{labels}" SKIP_RETURN_CODE "77" _BACKTRACE_TRIPLES "x;1;add_test")\n'

    def run(self, *options):
        """Exit code, lines of --results, what was printed."""
        (self.folder / "CTestTestfile.cmake").write_text(self.text)
        results, out = self.folder / "results", io.StringIO()
        with contextlib.redirect_stdout(out):
            code = run_tests.main([str(self.folder), "--results", str(results), *options])
        return code, results.read_text().splitlines() if results.exists() else [], out.getvalue()


def check(what, got, expected):
    if got != expected:
        sys.exit(f"test_run_tests: {what}: {got!r}, expected {expected!r}")


def new():
    folder = tempfile.mkdtemp(dir=ROOT)
    return Build(folder)


def reading():
    b = new()
    sub = b.folder / "sub"
    sub.mkdir()
    (sub / "CTestTestfile.cmake").write_text('add_test([=[inner]=] "/bin/echo" "a \\"quoted\\" word")\n')
    (b.folder / "program").write_text("")
    (b.folder / "CTestTestfile.cmake").write_text(
        f'add_test([=[outer]=] "{b.folder}/program" "x")\n'
        'set_tests_properties([=[outer]=] PROPERTIES  ENVIRONMENT "A=1;B=x=y" LABELS "memory;room_fem" TIMEOUT "60" '
        'WORKING_DIRECTORY "/tmp")\nsubdirs("sub")\n')
    outer, inner = ctest_files.read(b.folder)
    check("environment", outer.environment, {"A": "1", "B": "x=y"})
    check("labels", outer.labels, {"memory", "room_fem"})
    check("folder and time", (outer.folder, outer.timeout), ("/tmp", 60.0))
    check("quotes", (inner.command[1], inner.folder), ('a "quoted" word', str(sub)))
    check("targets", ctest_files.targets(outer, b.folder), ["program"])


def counting():
    b = new()
    b.add("good", "true")
    b.add("partly", f"printf '{SKIPS}'".replace("\n", "\\\\n"))
    b.add("gone", "exit 77")
    check("all good", b.run()[:2], (0, ["skip partly: other: PyTorch is not importable", "skip gone", "count 2 0 2"]))
    b.add("bad", "echo why; exit 3")
    b.add("killed", "kill -9 \\$\\$")
    b.add("late", "sleep 20", more='TIMEOUT "0.2"')
    b.text += 'add_test([=[lost]=] "/nowhere/program")\n'
    code, lines, out = b.run("--jobs", "1")
    check("a failure", code, 1)
    check("counts", lines[-1], "count 2 4 2")
    for line in ("fail bad: exit code 3", "fail killed: ended by signal 9", "fail late: took more than 0 s",
                 "fail lost: cannot be started: No such file or directory"):
        check(line, line in lines, True)
    check("the output of a failure is shown", "    | why" in out, True)
    check("no test", new().run()[:2], (2, ["fail tests: no test was run", "count 0 1 0"]))


def choosing():
    b = new()
    b.add("test_fem_a", "echo $OM_TEST_CASES > fem", "memory;room_fem")
    b.add("test_nn_b", "echo whole$OM_TEST_CASES > nn", "memory;room_nn")
    b.add("test_nn_c", "touch plain", "room_nn")
    b.add("test_fem_d", "touch slow", "slow;room_fem")
    b.add("test_fem_e", "touch other", "room_fem")
    check("whole", b.run("--not-label", "slow", "--whole", "parser|room_nn")[1], ["count 3 0 0"])
    check("memory alone", (b.folder / "fem").read_text(), "memory\n")
    check("whole has all cases", (b.folder / "nn").read_text(), "whole\n")
    check("which ran", [(b.folder / name).exists() for name in ("plain", "slow", "other")], [True, False, False])
    check("by label", b.run("--label", "slow")[1], ["count 1 0 0"])
    check("by name", b.run("--name", "^test_fem")[1], ["count 3 0 0"])


def limits():
    b = new()
    b.add("long", "for ((i = 0; i < 150000; ++i)); do :; done")
    b.add("short", "true")
    allowed = b.folder / "allowed"

    def run(text):
        allowed.write_text(text)
        return b.run("--limit", "0.05", "--allowed", str(allowed))

    code, lines, _ = run("# none\n")
    check("over the limit", (code, lines[0].startswith("fail long: took "), lines[-1]), (1, True, "count 1 1 0"))
    check("allowed", run("long: it counts\n")[0], 0)
    b.text = b.text[b.text.index("add_test([=[short"):]
    check("a test that is gone", run("long: it counts\n")[1][0], f"fail tests: {allowed}:1: there is no test long")
    check("no reason", run("short\n")[1][0], f"fail tests: {allowed}:1: expected 'NAME: reason'")
    check("eleven", run("short: x\n" * 11)[1][0], f"fail tests: {allowed}: 11 tests may take longer, at most 10 are allowed")


def domains():
    b = new()
    for name, other in (("left", "right"), ("right", "left")):  # each waits until both run
        b.add(name, f"echo $OM_TEST_DOMAIN > {name}; for ((i = 0; i < 500; ++i)); do [ -e {other} ] && exit 0; sleep 0.01; done; exit 1")
    check("both at once", b.run("--jobs", "2")[0], 0)
    left, right = (int((b.folder / name).read_text()) for name in ("left", "right"))
    check("three domains each", abs(left - right) >= 3 and min(left, right) >= 100 and max(left, right) <= 230, True)


def times():
    b = new()
    b.add("one", "for ((i = 0; i < 60000; ++i)); do :; done")
    b.run("--times", str(b.folder / "times.json"))
    seconds = json.loads((b.folder / "times.json").read_text())["one"]["processor"]
    check("the processor time of children counts", seconds > 0.01, True)


def ending():
    b = new()
    b.add("long", f"echo \\$\\$ > {b.folder}/begun.new; mv {b.folder}/begun.new {b.folder}/begun; sleep 30; true")
    (b.folder / "CTestTestfile.cmake").write_text(b.text)
    runner = subprocess.Popen([sys.executable, "-B", run_tests.__file__, str(b.folder)], stdout=subprocess.DEVNULL)
    while not (b.folder / "begun").exists():
        time.sleep(0.01)
    runner.terminate()
    check("exit code of SIGTERM", runner.wait(5), 143)
    stat = pathlib.Path(f"/proc/{(b.folder / 'begun').read_text().strip()}/stat")
    until = time.monotonic() + 5
    while stat.exists() and " Z " not in stat.read_text() and time.monotonic() < until:
        time.sleep(0.01)
    check("no test is left behind", time.monotonic() < until, True)


with tempfile.TemporaryDirectory() as ROOT:
    os.environ.pop("OM_TEST_CASES", None)
    os.environ.pop("OM_TEST_DOMAIN", None)
    for case in (reading, counting, choosing, limits, domains, times, ending):
        case()
print("test_run_tests: passed")
