#!/usr/bin/env python3
"""The shell examples of README.md and doc/examples.md run as printed, in their order, beside the files of the checkout;
exit code 0 each. A page of `omentum view` is fetched, then a signal ends the program.

    test_readme.py PROGRAM            examples that take seconds; the wrapper; the label map of the examples
    test_readme.py PROGRAM --all      all of them: minutes
"""
import gzip
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
QUICK = ("model", "plan", "update")  # verbs; the others simulate an operation or train


def examples():
    """Commands of the blocks that name no language, without their comments; each once."""
    pages = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "doc/examples.md"))
    blocks = [block for page in pages for block in re.findall(r"^```(\w*)\n(.*?)^```$", page, re.S | re.M)]
    lines = [line.partition("# ")[0].strip() for language, block in blocks if not language for line in block.splitlines()]
    return list(dict.fromkeys(line for line in lines if line and not line.startswith("make ")))


def checkout(folder, program):
    """A folder like a checkout in which `make demo` has ended, with the program that is tested."""
    for name in ("asp", "samples", "scenes", "weights"):
        (folder / name).symlink_to(ROOT / name)
    shutil.copy(ROOT / "omentum", folder)
    (folder / "build/release/bin").mkdir(parents=True)
    (folder / "build/release/bin/omentum").symlink_to(program)


def look(command, folder):
    """The page of a program that ends by a signal."""
    program = subprocess.Popen(["bash", "-c", "exec " + command], cwd=folder, stdout=subprocess.PIPE, text=True)
    said = next(line for line in program.stdout if "http:" in line)
    with urllib.request.urlopen(re.search(r"http:\S+", said)[0]) as page:
        assert b"omentum" in page.read(), command
    program.send_signal(signal.SIGINT)
    assert program.wait(timeout=20) in (0, 130), f"{command}: exit code {program.returncode}"
    return said


def run(command, folder):
    if command.split()[1] == "view":
        return look(command, folder)
    process = subprocess.Popen(["bash", "-c", command], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True)
    said = []
    for line in process.stdout:
        said.append(line)
        if "yes or no" in line:  # `retract --supervise --approve` waits for a person
            process.stdin.write("yes\n")
            process.stdin.flush()
    process.stdin.close()
    assert process.wait() == 0, f"{command}: exit code {process.returncode}\n{''.join(said)[-3000:]}"
    return "".join(said)


def test_examples(program, is_all):
    commands = examples()
    assert len(commands) >= 12 and all(c.startswith("./omentum ") for c in commands), commands
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        checkout(folder, program)
        ran = [(c, run(c, folder)) for c in commands if is_all or c.split()[1] in QUICK]
        assert len(ran) >= 4
        for command, said in ran:
            output = re.search(r" -o (\S+)", command)
            assert output or said.strip(), f"{command}: nothing was written, nothing printed"
            assert not output or (folder / output[1]).exists(), f"{command}: {output[1]} is missing"


def test_wrapper():
    """It runs the program of its checkout from any folder, also through a link, and says what to run without one."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copy(ROOT / "omentum", folder)
        done = subprocess.run([folder / "omentum", "help"], capture_output=True, text=True, check=False)
        assert done.returncode == 3 and "run `make build`" in done.stderr and not done.stdout, done
        (folder / "build/release/bin").mkdir(parents=True)
        fake = folder / "build/release/bin/omentum"
        fake.write_text('#!/bin/bash\nprintf "%s|" "$@"\nexit 7\n')
        fake.chmod(0o755)
        (folder / "elsewhere").mkdir()
        (folder / "elsewhere/link").symlink_to("../omentum")
        done = subprocess.run(["./link", "a b", "-o", ""], cwd=folder / "elsewhere", capture_output=True, text=True, check=False)
        assert done.returncode == 7 and done.stdout == "a b|-o||", done


def test_label_map():
    """The committed label map is the one that its script writes."""
    with tempfile.TemporaryDirectory() as name:
        shutil.copy(ROOT / "samples/data/make_labels.py", name)
        subprocess.run([sys.executable, "-B", pathlib.Path(name, "make_labels.py")], check=True)
        made, kept = (p.read_bytes() for p in (pathlib.Path(name, "ct_labels.seg.nrrd"), ROOT / "samples/data/ct_labels.seg.nrrd"))
        (head, voxels), (head_kept, voxels_kept) = (b.split(b"\n\n", 1) for b in (made, kept))
        assert head == head_kept and gzip.decompress(voxels) == gzip.decompress(voxels_kept)


def main():
    seconds = int(os.environ.get("OM_TEST_CPU_S", "0"))
    if seconds:  # processor time of each program, as in run_case.py
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    test_wrapper()
    test_label_map()
    test_examples(pathlib.Path(sys.argv[1]).resolve(), "--all" in sys.argv[2:])


if __name__ == "__main__":
    main()
