#!/usr/bin/env python3
"""omentum dvrk and omentum retract --world dds in two processes.

    two_processes.py PROGRAM SCENE CASE [CLIENT]

fast_dds       the program CLIENT, fast_dds_client.cpp, on another implementation of DDS homes an arm and moves it
rust           the same by rust/client.rs on RustDDS, over an interface with multicast
defras         the same of a run with all that the loop can do, on a scene of the repository
lock_step      actions, exposure and beliefs are those of a run within one process, to the last digit
real_time      a run by the wall clock exposes the ROI; the robot prints its periods
udp            the client of python/examples without DDS grasps and pulls, and says where no robot answers
no_twin        a run whose twin cannot be made ends before the arms are homed
interrupt      Ctrl-C ends the run at once, with its own exit code, and leaves a robot whose arms stand
kill_robot     kill -9 of the robot ends the run with a sentence
kill_client    kill -9 of the run leaves a robot that says so, stops the arms, serves, and ends well
"""
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time

PROGRAM, SCENE, CASE = sys.argv[1:4]
DOMAIN = os.environ.get("OM_TEST_DOMAIN", str(100 + os.getpid() % 100))  # of tools/run_tests.py
os.environ.pop("CYCLONEDDS_URI", None)
TMP = pathlib.Path(tempfile.mkdtemp(prefix="omentum_dds_"))
# of the truth, which the robot does not show, and of clocks
OTHER = {"state_hash", "times_world_above_force_threshold", "true_attached_share", "dice"}


def fail(why):
    sys.exit(f"two_processes.py {CASE}: {why}")


def begin(log, *args):
    return subprocess.Popen([PROGRAM, *args], stdout=open(TMP / log, "w"), stderr=subprocess.STDOUT)


def text(log):
    return (TMP / log).read_text(encoding="utf-8")


def wait_for(log, words, seconds=30):
    end = time.time() + seconds
    while words not in text(log):
        if time.time() > end:
            fail(f'no "{words}" in {log}:\n{text(log)}')
        time.sleep(0.02)


def is_other(key):
    return key in OTHER or "world" in key or key.endswith("_ms") or key.startswith("wall_") or "ms_" in key


def differences(a, b, path=""):
    if isinstance(a, dict):
        keys = {k for k in set(a) | set(b) if not is_other(k)}
        return [d for k in sorted(keys) for d in differences(a.get(k), b.get(k), f"{path}/{k}")]
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        return [d for i, (p, q) in enumerate(zip(a, b)) for d in differences(p, q, f"{path}/{i}")]
    return [] if a == b else [f"{path}: {str(a)[:60]} and {str(b)[:60]}"]


def lock_step(*options):
    robot = begin("robot", "dvrk", SCENE, "--domain", DOMAIN, "--lock-step")
    wait_for("robot", "PSM1 and PSM2")
    far = begin("far", "retract", SCENE, "--world", "dds", "--domain", DOMAIN, "-q", "-o", str(TMP / "far_run"), *options)
    near = begin("near", "retract", SCENE, "-q", "-o", str(TMP / "near_run"), *options)
    codes = near.wait(), far.wait()
    robot.send_signal(signal.SIGINT)
    if robot.wait() != 0:
        fail(f"the robot ends with {robot.returncode}:\n{text('robot')}")
    if codes[0] != codes[1] or codes[0] not in (0, 1):
        fail(f"exit codes {codes}:\n{text('near')}\n{text('far')}")
    runs = [json.loads((TMP / f"{run}_run/run.json").read_text(encoding="utf-8")) for run in ("near", "far")]
    if len(runs[0]["actions"]) < 3 or len(runs[0]["samples"]) < 10:
        fail("the run is too short to say anything")
    found = differences(*runs)
    if found:
        fail(f"{len(found)} differences, the first: " + "; ".join(found[:5]))
    print(f"{len(runs[0]['actions'])} actions, {len(runs[0]['samples'])} samples are the same")


def both(*options, seconds="60"):
    robot = begin("robot", "dvrk", SCENE, "--domain", DOMAIN, "--time", seconds, "--rate", "50", "--pictures", "10", *options)
    wait_for("robot", "PSM1 and PSM2")
    run = begin("run", "retract", SCENE, "--world", "dds", "--domain", DOMAIN, "-q", "-o", str(TMP / "run_dir"))
    wait_for("robot", "PSM2: home: ENABLED, homed")
    time.sleep(0.3)
    return robot, run


def kill_robot():
    for _ in range(4):
        robot, run = both()
        robot.kill()
        start = time.time()
        code = run.wait(20)
        robot.wait()
        if code not in (0, 1):  # on a busy machine the run may end for another reason, at the same moment
            break
    if code != 3 or "motion has stopped" not in text("run"):
        fail(f"exit code {code}:\n{text('run')}")
    if time.time() - start > 5:
        fail(f"the run needs {time.time() - start:.1f} s to end")


def kill_client():
    port = 20000 + os.getpid() % 20000
    robot, run = both("--udp", str(port))
    run.kill()
    run.wait()
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.settimeout(5)

    def ask(**operation):
        link.sendto(json.dumps({"arm": "PSM1", **operation}).encode(), ("127.0.0.1", port))
        answer = json.loads(link.recv(65536))
        if answer["refused"]:
            fail(answer["refused"])
        return answer["PSM1"]

    goal = ask()["measured_js"]
    goal[3] = -4.2 if goal[3] > 0 else 4.2  # the roll: 6 s
    ask(move_jp=goal)
    end = time.time() + 10
    while "no client reads the arms any more" not in text("robot"):
        if not ask()["is_busy"] or time.time() > end:
            fail(f"no move until the robot says that no client reads:\n{text('robot')}")
        time.sleep(0.05)
    there = ask()
    time.sleep(0.5)
    then = ask()
    if then["setpoint_cp"] != there["setpoint_cp"] or then["measured_js"] != there["measured_js"]:
        fail(f"the arm moves on: {there['measured_js']}, then {then['measured_js']}")
    robot.send_signal(signal.SIGINT)
    if robot.wait(10) != 0 or "late" not in text("robot"):
        fail(f"exit code {robot.returncode}:\n{text('robot')}")


def interrupt():
    for _ in range(4):
        robot, run = both()
        run.send_signal(signal.SIGINT)
        start = time.time()
        if run.wait(20) == 130:
            break
        robot.kill()  # on a busy machine the run may end for another reason, at the same moment
        robot.wait()
    if run.returncode != 130 or "cancelled" not in text("run"):
        fail(f"exit code {run.returncode}:\n{text('run')}")
    if time.time() - start > 5:
        fail(f"the run needs {time.time() - start:.1f} s to end")
    wait_for("robot", "they stop where they are")
    robot.send_signal(signal.SIGINT)
    if robot.wait(10) != 0:
        fail(f"exit code {robot.returncode}:\n{text('robot')}")


def skip(why):
    print("skip:", why)
    sys.exit(77)


def fast_dds():
    if not os.path.exists(sys.argv[4]):
        skip("Debian's fastddsgen and libfastrtps-dev are not installed (tools/packages_ci.txt)")
    foreign_client()


def rust():
    if not os.path.exists(sys.argv[4]):
        skip("the client is not built (test/dds/rust/Cargo.toml)")
    names = sorted(f.parent.name for f in pathlib.Path("/sys/class/net").glob("*/flags")  # up, multicast, no loopback
                   if int(f.read_text(encoding="utf-8"), 16) & 0x1009 == 0x1001 and (f.parent / "operstate").read_text(encoding="utf-8").strip() == "up")
    if not names:
        skip("no interface has multicast")
    foreign_client("--network", names[0])


def foreign_client(*options):
    robot = begin("robot", "dvrk", SCENE, "--domain", DOMAIN, "--time", "60", "--pictures", "5", *options)
    wait_for("robot", "PSM1 and PSM2")
    said = subprocess.run([sys.argv[4], DOMAIN], stdout=subprocess.PIPE, text=True, timeout=90, check=False)
    if said.returncode != 0 or "PSM1 went from" not in said.stdout or "PSM1: home: ENABLED" not in text("robot"):
        fail(f"exit code {said.returncode}: {said.stdout}\n{text('robot')}")
    robot.send_signal(signal.SIGINT)
    if robot.wait(10) != 0:
        fail(f"exit code {robot.returncode}:\n{text('robot')}")
    print(said.stdout)


def defras():
    if subprocess.run([PROGRAM, "preplan", SCENE, "-q", "-o", str(TMP / "plan")], stdout=subprocess.DEVNULL, check=False).returncode > 1:
        fail("no plan before the operation")
    lock_step("--defras", "--plan", str(TMP / "plan/plan.json"))


def no_twin():
    """Its file is missing, which creating the body is the first to notice."""
    robot = begin("robot", "dvrk", SCENE, "--domain", DOMAIN, "--time", "60")
    wait_for("robot", "PSM1 and PSM2")
    scene = pathlib.Path(SCENE).read_text(encoding="utf-8")
    scene = scene.replace("tissue:\n", "tissue:\n  engine: umesh\n  weights: missing.safetensors\n")
    (TMP / "scene.yaml").write_text(scene.replace("task:\n", "task:\n  watch_force: false\n"), encoding="utf-8")
    run = begin("run", "retract", str(TMP / "scene.yaml"), "--world", "dds", "--domain", DOMAIN, "-q", "-o", str(TMP / "run_dir"))
    code = run.wait(60)
    robot.send_signal(signal.SIGINT)
    if robot.wait(10) != 0:
        fail(f"the robot ends with {robot.returncode}:\n{text('robot')}")
    if code != 3 or "missing.safetensors" not in text("run"):
        fail(f"exit code {code}:\n{text('run')}")
    if "home" in text("robot"):
        fail(f"the arms were homed:\n{text('robot')}")


def real_time():
    robot = begin("robot", "dvrk", SCENE, "--domain", DOMAIN, "--time", "100")
    wait_for("robot", "PSM1 and PSM2")
    run = begin("run", "retract", SCENE, "--world", "dds", "--domain", DOMAIN, "-q", "-o", str(TMP / "run_dir"))
    if run.wait(60) != 0:
        fail(f"exit code {run.returncode}:\n{text('run')}")
    robot.send_signal(signal.SIGINT)
    if robot.wait(10) != 0:
        fail(f"exit code {robot.returncode}:\n{text('robot')}")
    print(text("run").split("\n")[0], text("robot"), sep="\n")


def udp():
    port = str(20000 + os.getpid() % 20000)
    robot = begin("robot", "dvrk", SCENE, "--domain", DOMAIN, "--udp", port, "--time", "60")
    wait_for("robot", "PSM1 and PSM2")
    client = pathlib.Path(__file__).resolve().parents[2] / "python/examples/dvrk_udp.py"
    said = subprocess.run([sys.executable, "-B", client, port, "-40", "-40", "4"], stdout=subprocess.PIPE, text=True, timeout=60, check=False)
    tip = re.search(r"z = ([\d.]+) mm; .* it holds tissue", said.stdout)
    if said.returncode != 0 or not tip or abs(float(tip.group(1)) - 34) > 1.5:  # mm: the noise of a measured tip
        fail(f"exit code {said.returncode}: {said.stdout}\n{text('robot')}")
    robot.send_signal(signal.SIGINT)
    if robot.wait(10) != 0:
        fail(f"exit code {robot.returncode}:\n{text('robot')}")
    alone = subprocess.run([sys.executable, "-B", client, port], stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    if alone.returncode != 1 or not alone.stderr.startswith(f"no answer on port {port}"):
        fail(f"without a robot: exit code {alone.returncode}: {alone.stderr}")


{"real_time": real_time, "udp": udp, "lock_step": lock_step, "defras": defras, "interrupt": interrupt, "no_twin": no_twin, "fast_dds": fast_dds, "rust": rust, "kill_robot": kill_robot, "kill_client": kill_client}[CASE]()
subprocess.run(["rm", "-rf", str(TMP)], check=True)
