"""A teleoperated motion of the simulated dVRK: recorded, made a demonstration, learnt from; each file against what the client sent."""
import json
import os
import pathlib
import signal
import socket
import subprocess
import time

import numpy as np
import pytest

SMALL = pathlib.Path(__file__).resolve().parents[2] / "test/cli/small.yaml"
DOMAIN = int(os.environ.get("OM_TEST_DOMAIN", 100 + os.getpid() % 100))  # of tools/run_tests.py
UDP = 41000 + os.getpid() % 2000
LIFT = np.array([(-0.05, 0.004, 0.04), (-0.046, 0.001, 0.022), (-0.02, 0.002, 0.075), (0, 0, 0.095)])  # m, in the frame of the task
TICK = 0.04  # s
ABOVE = 0.03  # m, of the task's frame above the world's: the tissue of the scene is not touched


def teleoperate():
    """Home, go to the lift's begin, then goals every 40 ms: 1 s along each line, 0.6 s for the jaw before the second. Times, goals."""
    sent = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.settimeout(5)

        def ask(**operation):
            link.sendto(json.dumps({"arm": "PSM1", **operation}).encode(), ("127.0.0.1", UDP))
            answer = json.loads(link.recv(65536))
            assert not answer["refused"], answer["refused"]
            return answer

        def servo(k, u):
            goal = LIFT[k] + u * (LIFT[min(k + 1, 3)] - LIFT[k]) + [0, 0, ABOVE]
            sent.append((ask(servo_cp=[*goal, *turn])["time"], *goal))
            time.sleep(TICK)

        ask(state_command="home")
        turn = ask()["PSM1"]["setpoint_cp"][3:]
        ask(move_cp=[*LIFT[0] + [0, 0, ABOVE], *turn])
        while ask()["PSM1"]["is_busy"]:
            time.sleep(0.02)
        for k in range(3):
            if k == 1:
                closed = ask(jaw=0.0)["time"]
                for _ in range(15):
                    servo(1, 0)
            for i in range(25):
                servo(k, i / 25)
        for _ in range(5):
            servo(3, 0)
    return np.array(sent), closed


def distance_to_lift(points):
    """Of each point to the broken line, m."""
    best = np.full(len(points), np.inf)
    for a, b in zip(LIFT, LIFT[1:]):
        u = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - a - u[:, None] * (b - a), axis=1))
    return best


def test_teleoperation_becomes_demonstrations(tmp_path):
    h5py, highlevel = pytest.importorskip("h5py"), pytest.importorskip("rosbags.highlevel")
    scene = tmp_path / "coarse.yaml"
    scene.write_text(SMALL.read_text(encoding="utf-8").replace("cells: [6, 6, 1]", "cells: [2, 2, 1]").replace("cells: [9, 9, 1]", "cells: [4, 4, 1]"))
    file, program = tmp_path / "run.mcap", os.environ.get("OMENTUM_PROGRAM")
    if not program:
        pytest.skip("needs the program: OMENTUM_PROGRAM")
    serve = [program, "dvrk", scene, "--domain", str(DOMAIN), "--rate", f"{1 / TICK:g}", "--udp", str(UDP), "--record", file]
    process = subprocess.Popen(serve, stdout=subprocess.DEVNULL)
    try:
        end = time.time() + 20
        while not file.exists() and time.time() < end:
            time.sleep(0.05)
        sent, closed = teleoperate()
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
    finally:
        process.kill()  # a robot that is left behind answers other tests
    # the recording: a goal is where the tip is after the tick that took it
    with highlevel.AnyReader([file]) as reader:
        messages = [(stamp, c.topic, reader.deserialize(raw, c.msgtype)) for c, stamp, raw in reader.messages() if c.topic in ("/PSM1/measured_cp", "/PSM1/jaw/measured_js")]
    poses = [(stamp, m.pose.position) for stamp, topic, m in messages if topic == "/PSM1/measured_cp"]
    at = np.array([stamp - poses[0][0] for stamp, _ in poses]) * 1e-9 + TICK  # s of the field: the first tick ends there
    tip = np.array([(p.x, p.y, p.z) for _, p in poses])
    for now, *goal in sent[np.append(np.diff(sent[:, 0]) > TICK / 2, True)]:  # of two goals in a tick the last
        k = np.argmin(abs(at - now - TICK))
        assert abs(at[k] - now - TICK) < 1e-6 and np.linalg.norm(tip[k] - goal) < 1e-4  # m, ten times the noise
    jaws = np.array([(stamp - poses[0][0], m.position[0]) for stamp, topic, m in messages if topic != "/PSM1/measured_cp"]) * [1e-9, 1] + [TICK, 0]
    assert (jaws[jaws[:, 0] < closed + TICK / 2, 1] > 0.69).all() and abs(jaws[-1, 1]) < 0.02  # rad
    # the demonstration
    frame = tmp_path / "task.json"
    frame.write_text(json.dumps({"frames": [{"name": "task", "position_mm": [0, 0, 1e3 * ABOVE], "quaternion_xyzw": [0, 0, 0, 1]}]}))
    demos, move = tmp_path / "robot.hdf5", 0.002
    task = ["-t", "retract", "-s", "gripper=1", "-s", f"move_mm={1e3 * move:g}"]
    make = [program, "rl", "demo", *task, "--from", file, "--frames", frame, "--deviation", "4", "-o", demos]
    subprocess.run([*make, "--begin", str(sent[0, 0]), "--end", str(sent[-1, 0])], check=True, stdout=subprocess.DEVNULL)
    with h5py.File(demos) as data:
        demo = data["data/demo_0"]
        state, action, score = demo["obs/state"][:, :3].astype(float), demo["actions"][:].astype(int), demo.attrs["score"]
    low, high = np.array([-0.085, -0.055, 0.002]), np.array([0.025, 0.055, 0.11])  # m, the workspace of doc/rl.md
    place = low + (state + 1) / 2 * (high - low)
    assert np.linalg.norm(place[0] - LIFT[0]) < 1e-4 and distance_to_lift(place).max() < 3**0.5 * move
    assert np.linalg.norm(place[-1] - LIFT[-1]) < 3**0.5 * move and score == 1
    # replayed: the moves of the file, one after another, are the places of the file
    moves = move * np.array([0, -1, 1])[action[:, :3]]
    assert np.allclose(place[0] + np.cumsum(moves, axis=0)[:-1], place[1:], atol=1e-6)
    jaw = np.flatnonzero(np.diff(action[:, 3]))
    assert list(action[[0, -1], 3]) == [0, 1] and len(jaw) == 1 and np.linalg.norm(place[jaw[0] + 1] - LIFT[1]) < 3**0.5 * move
    # a step for each move of the longest axis, one for the jaw, and 10 at p_T
    assert abs(len(action) - 11 - sum(abs(np.diff(LIFT, axis=0)).max(axis=1) / move)) <= 4
    learn = ["-m", "gail", "--clone-epochs", "1", "-n", "64", "--environments", "2", "--horizon", "32", "--batch", "64"]  # both methods
    subprocess.run([program, "rl", "train", *task, *learn, "-d", demos, "-q", "-o", tmp_path / "gail"], check=True, stdout=subprocess.DEVNULL)
    assert (tmp_path / "gail/policy.safetensors").stat().st_size > 10000
