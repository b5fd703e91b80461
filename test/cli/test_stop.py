#!/usr/bin/env python3
"""SIGTERM ends every verb within 2 s on an idle machine: exit code 130, a sentence that says what is kept, finished work kept.

    test_stop.py PROGRAM [VERB, "resume" or "waiting"]

Each verb begins on a small input with one worker. When it has computed for a while it gets the signal. The time until its
end is processor time, so that other work on the machine does not count. Verbs that continue are called again, until the
result is there, and give the same bytes as an uninterrupted run.
"""
import os
import pathlib
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
MOST = 2.0  # s of processor time from the signal to the end
DEADLINE = 120  # s of wall time, for deadlocks

SCENE = """name: small
tissue: {source: sheet, element: linear, cells: [8, 8, 1], world_cells: [12, 12, 1]}
attachments: {kind: box, lo_mm: [10, -100, -1], hi_mm: [100, 100, 1]}
roi: {random: false, center_mm: [-40, -30, 0]}
endoscope: {distance_mm: 200, elevation_deg: 45, fov_deg: 60, width: 80, height: 60}
task: {force_threshold: 3, grasp_radius_mm: 11, speed_mm_s: 50}
"""
STRIP = """name: strip
tissue: {source: sheet, element: linear, size_mm: [60, 30, 10], cells: [6, 3, 1], world_cells: [9, 5, 2], young: 3000, poisson: 0.3, rayleigh_stiffness: 0}
attachments: {kind: box, lo_mm: [-31, -16, -1], hi_mm: [-20, 16, 1]}
roi: {random: false, center_mm: [0, 0, 5], radius_mm: 3}
"""
LIFT = """title: A strip lifted at its end
scene: strip.yaml
observations: seen.csv
parameters: [{name: tissue.young, min: 500, max: 50000, start: 2000, log: true}]
paths: [{name: end, kind: lift, point_mm: [30, 0, 10], direction: [0, 0, 1], grasp_radius_mm: 12, speed_mm_s: 10, time_step_s: 0.1, settle_s: 0.5}]
search: {noise_mm: 0.5, force_mm_per_n: 50, generations: 40, population: 20, tolerance: 0.02}
"""
SEEN = "experiment,level_mm,landmark,x_mm,y_mm,z_mm\nend,rest,middle,5,0,5\nend,10,middle,5.1,0,9\nend,20,force,0,0,0.05\n"

INPUTS = {"small.yaml": SCENE, "fine.yaml": SCENE.replace("[8, 8, 1]", "[30, 30, 3]").replace("[12, 12, 1]", "[48, 48, 5]"),
          "middle.yaml": SCENE.replace("speed_mm_s: 50", "speed_mm_s: 200, max_actions: 1")
          .replace("[8, 8, 1]", "[20, 20, 2]").replace("[12, 12, 1]", "[28, 28, 3]"),
          "coarse.yaml": SCENE.replace("task: {", "task: {grid: 3, ").replace("[8, 8, 1]", "[6, 6, 1]"),
          "strip.yaml": STRIP, "lift.yaml": LIFT, "seen.csv": SEEN, "endless.lp": "p(1). p(X+1) :- p(X).\n",
          "keys": "3m f\n" * 100000}

KEYS = {"rl play": "keys"}  # the standard input of a verb: a file of INPUTS

KEPT = "the same command continues"
RECORD = "the record so far is in"
NOTHING = "nothing was written"
EARLY = "no file is half written"  # said before a verb has progress
TRIES = 5

SAMPLES = "umesh generate --elements 200 --points 4x4x4 -n 16 --shard 16 -q -o data"

# What a verb needs from others before, a command a line; folders data and made.
BEFORE = {"replay": "retract middle.yaml --record -q -o data",
          "umesh train": SAMPLES.replace("16", "8"),
          "umesh eval": f"{SAMPLES}\numesh train -d data -o made --levels 1 --epochs 1 --validation 2 -q",
          "banet train": "banet generate -n 2 --shard 2 --seed 905 --way exact --pictures 0 -q -o data",
          "banet eval": "banet generate -n 1 --shard 1 --seed 905 --way exact --pictures 0 -q -o data"}

# verb, options, s of processor time before the signal, what the last line says, what is left in the folder
# (a pattern of names; None: nothing)
CASES = [
    ("plan", "--roi 3,3 --program endless.lp", 0.2, NOTHING, None),
    ("model", "$ROOT/samples/data/ct_labels.seg.nrrd --label kidney_left --edge 1.5 -o out", 0.2, NOTHING, None),
    ("preplan", "small.yaml -o out", 0.4, KEPT, r"out\.trials"),
    ("retract", "small.yaml -o out", 0.2, RECORD, r"out"),
    ("retract", "small.yaml --defras -o out", 0.4, KEPT, r"out\.trials"),
    ("replay", "data -o out.jsonl", 0.08, NOTHING, None),
    ("update", "fine.yaml $ROOT/test/cli/lifted/001.yaml --network none -o out", 0.1, NOTHING, None),  # a fit of 3 s
    ("layouts", "small.yaml --count 3 -o out", 0.2, RECORD, r"out"),
    ("calibrate-force", "small.yaml --count 4", 0.3, NOTHING, None),
    ("search", "small.yaml", 0.2, NOTHING, None),
    ("demo", "--quick -o out", 0.8, KEPT, r"out\.trials"),
    ("calibrate", "lift.yaml -o out", 0.3, KEPT, r"out"),
    ("umesh generate", "--elements 200 --points 4x4x4 -n 5000 --shard 5 -o out", 0.3, KEPT, r"out"),
    ("umesh train", "-d data -o out --levels 1 --epochs 5000 --validation 2", 0.2, KEPT, r"out"),
    ("umesh eval", "-d data -w made/weights.safetensors --tolerance 0.000001 -o out", 0.2, EARLY, None),
    ("umesh predict", "--press 30 --tolerance 0.000001 -o out.vtu --onnx out.onnx", 0.2, EARLY, None),
    ("banet generate", "-n 2000 --shard 1 --seed 900 --way exact --pictures 0 -o out", 0.3, KEPT, r"out"),
    ("banet train", "-d data -o out --samples 2 --validation 1 --batch 1 --channels 16,16,16,16,16 --grid 16,16,16 --images 1 --epochs 100000",
     0.3, KEPT, r"out"),
    ("banet eval", "-d data -w $ROOT/weights/banet.safetensors -o out", 0.15, NOTHING, None),
    ("rl survey", "-t retract", 0.8, EARLY, None),  # it has no progress, and no file
    ("rl train", "-t reach -n 400000 -o out", 0.3, KEPT, r"out"),
    ("rl eval", "-t retract --random -n 5000", 1.2, NOTHING, None),  # no episode has finished
    ("rl eval", "-t reach --random -n 10000 -o out.csv", 0.15, "the figures are partial", r"out\.csv"),
    ("rl demo", "-t retract -s max_step=20 -n 2000 -o out.hdf5", 0.6, KEPT, r"out\.hdf5\.part"),
    ("rl play", "-t reach --record out.hdf5", 0.3, "finished episodes are recorded", r"out\.hdf5"),
]


def processor_time(pid):
    """Of a process and its children, s."""
    total = 0
    try:
        pids = [pid, *pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
        for p in pids:
            field = pathlib.Path(f"/proc/{p}/stat").read_text().rsplit(")", 1)[1].split()
            total += (int(field[11]) + int(field[12])) / os.sysconf("SC_CLK_TCK")
    except OSError:
        pass  # it has ended
    return total


def start(program, verb, options, folder):
    words = shlex.split(options.replace("$ROOT", str(ROOT)))
    with open(folder / KEYS[verb] if verb in KEYS else os.devnull) as keys:
        return subprocess.Popen([program, *verb.split(), *words], cwd=folder, stdin=keys, stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True)


def stop(process, after, number):
    """Send the signal once the process has worked; exit code, processor time to the end, what it said, or None if it had ended."""
    begin = time.monotonic()
    while process.poll() is None and processor_time(process.pid) < after and time.monotonic() < begin + DEADLINE:
        time.sleep(0.01)
    before, last = processor_time(process.pid), 0.0
    process.send_signal(number)
    begin = time.monotonic()
    while process.poll() is None:
        last = max(last, processor_time(process.pid) - before)
        if time.monotonic() > begin + DEADLINE:
            process.kill()
        time.sleep(0.01)
    return process.returncode, last, process.stderr.read()


def check(program, case, number=signal.SIGTERM):
    """How long a machine prepares the work of a verb is not known: a signal that came before it began, or after its end, is
    sent again to a new run, later or earlier."""
    verb, options, after, says, leaves = case
    for _ in range(TRIES):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for file, text in INPUTS.items():
                (folder / file).write_text(text)
            for line in BEFORE.get(verb, "").splitlines():
                done = subprocess.run([program, *line.split()], cwd=folder, stdout=subprocess.DEVNULL)
                assert done.returncode in (0, 1), line  # 1: a failed operation, whose record is whole
            code, seconds, said = stop(start(program, verb, options, folder), after, number)
            left = sorted(p.name for p in folder.iterdir() if p.name not in {*INPUTS, "data", "made"})
        last = said.strip().splitlines()[-1] if said.strip() else ""
        print(f"{verb:15} {seconds:.2f} s  {last}  {left}")
        if (EARLY in last or NOTHING in last) and not left and says not in (EARLY, NOTHING):
            after *= 2
        elif code in (0, 1):
            after /= 2
        else:
            break
    where = f"omentum {verb} {options}: exit code {code} after {seconds:.2f} s\n{said}"
    assert code == 130, where
    assert seconds <= MOST, where
    assert says in last, where
    assert [re.fullmatch(leaves, n) for n in left if leaves] and len(left) == 1 if leaves else not left, f"{where}{left}"


def same_files(a, b):
    """Both folders hold the same bytes, but for their own names in the list of files."""
    names = sorted(p.relative_to(a) for p in a.rglob("*") if p.is_file() and p.name != ".omentum")
    assert names and names == sorted(p.relative_to(b) for p in b.rglob("*") if p.is_file() and p.name != ".omentum")
    for name in names:
        assert (a / name).read_bytes() == (b / name).read_bytes(), name


def check_resume(program, verb, options, after, end=""):
    """Stopped twice, then left alone: the bytes of an uninterrupted run. `end` is that of the output's name."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file, text in INPUTS.items():
            (folder / file).write_text(text)
        whole = start(program, verb, f"{options} -q -o whole{end}", folder)
        said = whole.communicate()[1]
        assert whole.returncode in (0, 1), said
        stops = 0
        while stops < 2:
            code, _, said = stop(start(program, verb, f"{options} -q -o cut{end}", folder), after, signal.SIGTERM)
            stops += 1
            if code == whole.returncode and after > 0.02:  # it ended before the signal: from the beginning, stopped earlier
                for path in folder.glob("cut*"):
                    shutil.rmtree(path) if path.is_dir() else path.unlink()
                after, stops = after / 2, 0
                continue
            if (EARLY in said or NOTHING in said) and after < 10:  # it had not begun
                after, stops = after * 1.5, stops - 1
                continue
            assert code == 130 and KEPT in said, f"{code} {said}"
        cut = start(program, verb, f"{options} -q -o cut{end}", folder)
        said = cut.communicate()[1]
        assert cut.returncode == whole.returncode, said
        if end:
            assert (folder / f"whole{end}").read_bytes() == (folder / f"cut{end}").read_bytes()
        else:
            same_files(folder / "whole", folder / "cut")
        left = sorted(p.name for p in folder.iterdir() if p.name.startswith("cut"))
        assert left == [f"cut{end}"], left


def check_waiting(program, command, words, says, number):
    """A run that waits for a person computes nothing, and still ends: its record is kept. Its input stays open."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "small.yaml").write_text(SCENE)
        process = subprocess.Popen([program, *command.split()], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True)
        process.stdin.write(words)
        process.stdin.flush()
        begin, before, still = time.monotonic(), -1.0, 0
        while still < 3:  # 1.5 s without work: it waits, and is not only kept waiting by other programs
            assert time.monotonic() < begin + DEADLINE, "the run does not wait for the person"
            now = processor_time(process.pid)
            still = still + 1 if now == before and now >= 0.1 else 0
            before = now
            time.sleep(0.5)
        assert process.poll() is None, process.stderr.read()
        process.send_signal(number)
        try:
            process.wait(DEADLINE / 4)
        except subprocess.TimeoutExpired:
            process.kill()
            raise AssertionError(f"a paused run ignores signal {number}") from None
        said = process.stderr.read()
        assert process.returncode == 130 and says in said, f"{process.returncode} {said}"


RESUMED = [("preplan", "coarse.yaml --again 1", 0.25), ("rl demo", "-t retract -s max_step=10 -n 16", 0.5, ".hdf5")]
WAITING = [("retract small.yaml --supervise -o out", "pause\n", RECORD),
           ("rl play -t reach --record out.hdf5", "3m f\n" * 60 + "2m", "60 finished episodes are recorded")]


def main():
    seconds = int(os.environ.get("OM_TEST_CPU_S", "0"))
    if seconds:  # processor time of each program, as in run_case.py
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    os.environ["OMP_NUM_THREADS"] = "1"
    program = str(pathlib.Path(sys.argv[1]).resolve())
    only = sys.argv[2:]
    for case in CASES:
        if not only or case[0] in only:
            check(program, case)
    if not only or "resume" in only:
        for case in RESUMED:
            check_resume(program, *case)
    if not only or "waiting" in only:
        for case in WAITING:
            check_waiting(program, *case, signal.SIGINT)
            check_waiting(program, *case, signal.SIGTERM)
    if not only or "preplan" in only:
        check(program, next(c for c in CASES if c[0] == "preplan"), signal.SIGINT)


if __name__ == "__main__":
    main()
