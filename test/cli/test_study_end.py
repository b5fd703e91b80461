#!/usr/bin/env python3
"""A study says how long it takes, and ends soon after SIGTERM, Ctrl-C or its time limit; what is finished is kept.

    test_study_end.py PROGRAM [STUDY...]     these studies; none: a run that its time limit ended continues
"""
import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

SOON = 2.0 + 3.0  # s: 2 s on an idle machine, and what the tests beside this one take
STUDIES = {
    "contact": ["contact", "--quick"],
    "calibration": ["calibration", "--quick"],
    "methods": ["methods", "--quick"],
    "sheet-calibration": ["sheet-calibration", "--quick"],
    "correspondence": ["correspondence", "--quick"],
    "layouts": ["attachments", "--part", "layouts", "--quick"],
    "simulated": ["attachments", "--part", "simulated", "--quick"],
    "phantoms": ["attachments", "--part", "phantoms", "--quick"],
    "learning": ["learning", "-t", "reach", "--same-task", "--no-reality", "--learners", "ppo"],
    "retraction": ["retraction", "--part", "random"],  # one pair takes minutes
    "trust": ["trust", "--quick"],
}
SMALL = ["learning", "-t", "reach", "--same-task", "--no-reality", "--learners", "ppo,clone", "--seeds", "1", "-n", "12000"]


def end_by_signal(program, name, number, folder):
    """Start a study, send the signal after its estimate; exit code 130, soon."""
    process = subprocess.Popen([program, "study", *STUDIES[name], "--workers", "1", "-o", folder / name], text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    estimate = process.stderr.readline()
    assert re.search(r"^\d+ .*: about \d.* (s|min|h) on 1 core$", estimate.strip()), f"{name}: {estimate}"
    begin = time.monotonic()
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    took = time.monotonic() - begin
    assert process.returncode == 130, f"{name}: exit {process.returncode}: {errors}"
    assert "the same command continues" in errors, f"{name}: {errors}"
    assert took < SOON, f"{name}: ended after {took:.2f} s"


def continue_after_limit(program, folder):
    """A study that its time limit ended keeps what was finished, and continues to the same figures."""
    def run(out, *more):
        return subprocess.run([program, "study", *SMALL, "-q", "--workers", "1", *more, "-o", folder / out],
                              capture_output=True, text=True, check=False)

    def figures(out):
        """study.json without times."""
        def strip(value):
            if isinstance(value, dict):
                return {k: strip(v) for k, v in value.items() if k != "seconds"}
            return [strip(v) for v in value] if isinstance(value, list) else value
        return strip(json.loads((folder / out / "study.json").read_text()))

    whole = run("whole")
    assert whole.returncode in (0, 1), whole.stderr
    begin = time.monotonic()
    stopped = run("parts", "--minutes", "0.003")
    assert stopped.returncode == 130 and "the same command continues" in stopped.stderr, stopped
    assert time.monotonic() - begin < SOON, "the time limit came late"
    demos = (folder / "parts/demos.hdf5").stat().st_mtime_ns
    rest = run("parts")
    assert rest.returncode == whole.returncode, rest.stderr
    assert (folder / "parts/demos.hdf5").stat().st_mtime_ns == demos, "a finished result was made again"
    assert figures("parts") == figures("whole")


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for k, name in enumerate(sys.argv[2:]):
            end_by_signal(sys.argv[1], name, (signal.SIGTERM, signal.SIGINT)[k % 2], folder)
        if len(sys.argv) == 2:
            continue_after_limit(sys.argv[1], folder)


main()
