"""The simulated dVRK from another implementation: PyPI's cyclonedds grasps and pulls; rosbags computes the types' hashes."""
# PARTS 13
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest

import omentum as om

ROOT = pathlib.Path(__file__).resolve().parents[2]
SMALL = ROOT / "test/cli/small.yaml"
DOMAIN = int(os.environ.get("OM_TEST_DOMAIN", 100 + os.getpid() % 100))  # of tools/run_tests.py, which leaves the next two free
IGTL = 30000 + os.getpid() % 10000
UDP = IGTL + 10000


@pytest.fixture
def robot(tmp_path):
    """omentum dvrk on a small scene; its output is in a file."""
    program = os.environ.get("OMENTUM_PROGRAM")
    if not program:
        pytest.skip("needs the program: OMENTUM_PROGRAM")
    log = tmp_path / "robot"
    with open(log, "w", encoding="utf-8") as out:
        process = subprocess.Popen([program, "dvrk", SMALL, "--domain", str(DOMAIN), "--time", "60", "--rate", "25", "--igtl", str(IGTL), "--udp", str(UDP)], stdout=out, stderr=out)
    log.with_name("pid").write_text(str(process.pid))
    end = time.time() + 20
    while "PSM1" not in log.read_text() and time.time() < end:
        time.sleep(0.05)
    yield log
    if process.poll() != -signal.SIGKILL:
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 0


def client(*arguments, script="dvrk_grasp.py"):
    pytest.importorskip("cyclonedds")
    script = ROOT / "python/examples" / script
    return subprocess.Popen([sys.executable, "-B", script, str(DOMAIN), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def ask(**operation):
    """The arm's state after one operation by UDP."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.settimeout(5)
        link.bind(("127.0.0.1", UDP + 1))  # one sender
        link.sendto(json.dumps({"arm": "PSM1", **operation}).encode(), ("127.0.0.1", UDP))
        answer = json.loads(link.recv(65536))
    assert not answer["refused"]
    return answer["PSM1"]


def test_a_client_of_twenty_lines_grasps_and_pulls(robot):
    text, _ = client("-40", "-40", "4").communicate(timeout=40)
    tip = float(re.search(r"z = ([\d.]+) mm", text).group(1))
    assert "holds tissue" in text and abs(tip - 34) < 1.5  # mm: the noise of a measured tip
    assert "refused" not in robot.read_text()


def test_a_client_that_is_killed_leaves_the_robot_well(robot):
    process = client("-40", "-40", "4")
    end = time.time() + 20
    while "homed" not in robot.read_text() and time.time() < end:
        time.sleep(0.05)
    process.kill()
    process.wait()
    goal = ask()["measured_js"]
    goal[3] = -4.2 if goal[3] > 0 else 4.2  # the roll: 6 s
    ask(move_jp=goal)
    while "no client reads the arms any more" not in robot.read_text() and time.time() < end + 20:
        time.sleep(0.05)
        ask()
    assert "no client reads the arms any more" in robot.read_text()
    there = ask()
    time.sleep(0.5)
    then = ask()
    assert then["setpoint_cp"] == there["setpoint_cp"] and then["measured_js"] == there["measured_js"]
    assert abs(then["measured_js"][3] - goal[3]) > 0.1  # rad


def test_rules_of_crtk(robot):
    """State before motion, frame, scale, rate and time-out, as another implementation of DDS sees them."""
    process = client("PSM2", script="dvrk_probe.py")
    text, why = process.communicate(timeout=60)
    assert process.returncode == 0 and text.count("ok   ") == 6, text + why
    assert float(re.search(r"every ([\d.]+) ms", text).group(1)) == pytest.approx(40, abs=0.1)  # --rate 25
    assert 0.24 < float(re.search(r"stopped after ([\d.]+) rad", text).group(1)) < 0.5  # 1 rad/s for 0.25 s, and the ticks


def test_a_client_says_why_its_move_is_refused(robot):
    process = client("-40", "-40", "900")
    text, why = process.communicate(timeout=40)
    assert process.returncode == 1 and not text
    assert why.startswith("PSM1: PSM1/move_cp refused: point (-40.0, -40.0, 900.0) mm is out of the arm's reach") and why.count("\n") == 1
    assert "homed" in robot.read_text()


def test_a_client_says_that_the_robot_is_gone(robot):
    """kill -9 of the robot, once it has homed: the client ends by itself, with a sentence."""
    process = client("-40", "-40", "4")
    end = time.time() + 20
    while "homed" not in robot.read_text() and time.time() < end:
        time.sleep(0.05)
    os.kill(int(robot.with_name("pid").read_text()), signal.SIGKILL)
    text, why = process.communicate(timeout=20)
    assert process.returncode == 1 and not text
    assert re.fullmatch(r"rt/PSM1/\S+: nothing for \d+ s: the robot is gone, not started, or in another domain\n", why)


def test_the_package_drives_the_robot(robot):
    world = om.RobotWorld(SMALL, DOMAIN, stale=2)  # s, a busy machine
    world.reset()
    seen = world.observe(om.DEPTH | om.COLOR)
    assert seen.depth.shape == (240, 320) and np.median(seen.depth[seen.depth > 0]) > 0.05
    start = world.observe().arms[0].pose.copy()
    goal = start.copy()
    goal[2, 3] += 0.01
    world.move(0, goal, 0.1)
    for _ in range(30):
        world.advance(0.02)
    assert np.linalg.norm(world.observe().arms[0].pose[:3, 3] - goal[:3, 3]) < 0.001  # m: the tremor
    assert "PSM1: home: ENABLED, homed" in robot.read_text()
    far = goal.copy()
    far[2, 3] = world.site.pose_world_task[2, 3] + 2 * world.site.half_size[2] + 0.16  # m: 10 mm above the workspace
    with pytest.raises(om.Invalid, match="outside of the workspace, 150 mm around the tissue"):
        world.move(0, far, 0.1)
    world.close()


def test_slicers_stream(robot):
    """TRANSFORM as pyigtl reads it; POLYDATA is what pyigtl packs of the same numbers (its own reader of them is unfinished)."""
    pyigtl = pytest.importorskip("pyigtl")
    client = pyigtl.OpenIGTLinkClient("127.0.0.1", IGTL)
    tip = client.wait_for_message("PSM1", timeout=10)
    client.send_message(pyigtl.TransformMessage(np.eye(4), device_name="Needle"), wait=True)  # nothing is done with it
    later = client.wait_for_message("PSM1", timeout=10)
    client.stop()
    assert later.timestamp > tip.timestamp
    assert tip.matrix[2, 3] == pytest.approx(75, abs=3) and np.allclose(tip.matrix[:3, :3] @ tip.matrix[:3, :3].T, np.eye(3), atol=1e-6)
    with socket.create_connection(("127.0.0.1", IGTL), timeout=10) as link:
        file, kind = link.makefile("rb"), b""
        while kind != b"POLYDATA":
            head = file.read(58)
            kind, body = head[2:14].rstrip(b"\0"), file.read(int.from_bytes(head[42:50], "big"))
            assert int.from_bytes(head[50:58], "big") == pyigtl.messages.CRC64(body)
    n, ncell = int.from_bytes(body[:4], "big"), int.from_bytes(body[20:24], "big")
    points, cells = np.frombuffer(body, ">f", 3 * n, 40).reshape(n, 3), np.frombuffer(body, ">u4", 4 * ncell, 40 + 12 * n)
    assert n > 100 and ncell == 2 * n - 4  # closed, without handles: Euler
    assert np.ptp(points, axis=0) == pytest.approx([120, 120, 5], abs=3)
    assert pyigtl.PolyDataMessage(points=points, polygons=cells)._pack_content() == body


def test_a_run_is_streamed(tmp_path):
    """omentum retract --igtl: tools that move, and the tissue; the run is the same as one that nobody watches."""
    program = os.environ.get("OMENTUM_PROGRAM")
    if not program:
        pytest.skip("needs the program: OMENTUM_PROGRAM")
    port, folders = IGTL + 1, [tmp_path / "watched", tmp_path / "alone"]
    commands = [[program, "retract", SMALL, "-q", "-o", folder] for folder in folders]
    process = subprocess.Popen([*commands[0], "--real-time", "--igtl", str(port)], stdout=subprocess.DEVNULL)
    link, tips, kinds = None, [], set()
    while link is None and process.poll() is None:
        try:
            link = socket.create_connection(("127.0.0.1", port), timeout=20)
        except OSError:
            time.sleep(0.02)
    with link, link.makefile("rb") as file:
        while len(head := file.read(58)) == 58:
            name, body = head[14:34].rstrip(b"\0"), file.read(int.from_bytes(head[42:50], "big"))
            kinds.add((head[2:14].rstrip(b"\0"), name))
            if name == b"PSM1":
                tips.append(np.frombuffer(body, ">f4")[9:])
    assert process.wait(60) == 0 and subprocess.call(commands[1], stdout=subprocess.DEVNULL) == 0
    assert kinds == {(b"TRANSFORM", b"PSM1"), (b"TRANSFORM", b"PSM2"), (b"TRANSFORM", b"ECM"), (b"POLYDATA", b"Tissue")}
    assert len(tips) > 5 and np.ptp(tips, axis=0).max() > 10  # mm
    # actions with their times and places; the last line has the time on the wall
    lines = [[line for line in (folder / "audit.jsonl").read_text().splitlines() if '"action' in line] for folder in folders]
    assert len(lines[0]) > 4 and lines[0] == lines[1]


def recording(tmp_path, *arguments):
    program = os.environ.get("OMENTUM_PROGRAM")
    if not program:
        pytest.skip("needs the program: OMENTUM_PROGRAM")
    file = tmp_path / "run.mcap"
    return file, subprocess.Popen([program, "dvrk", SMALL, "--domain", str(DOMAIN + 1), "--record", file, *arguments], stdout=subprocess.DEVNULL)


def read_recording(file):
    """Topics with their counts; each message is, byte by byte, what rosbags serialises of the fields that it read."""
    highlevel = pytest.importorskip("rosbags.highlevel")
    hashes = dict(re.findall(r"&(\w+?_msg_dds__\w+)__desc,\s*\"(RIHS01_[0-9a-f]{64})\"", (ROOT / "src/dds/dds_link.c").read_text(encoding="utf-8")))
    with highlevel.AnyReader([file]) as reader:
        for kind in {c.msgtype for c in reader.connections}:  # the schemas of the file
            assert reader.typestore.hash_rihs01(kind) == hashes[kind.replace("/msg/", "_msg_dds__")], kind
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            assert bytes(reader.typestore.serialize_cdr(message, connection.msgtype)) == bytes(raw), connection.topic
            if hasattr(message, "header"):
                assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
        return {c.topic: c.msgcount for c in reader.connections}


def test_a_recording_is_read_by_rosbags(tmp_path):
    pytest.importorskip("rosbags")
    file, process = recording(tmp_path, "--time", "0.6", "--rate", "50", "--record-pictures")
    assert process.wait(30) == 0
    count = read_recording(file)
    assert count["/PSM1/measured_cp"] == count["/PSM2/jaw/measured_js"] == count["/tf"] == count["/clock"] == 30
    assert count["/tf_static"] == count["/ECM/operating_state"] == 1
    assert abs(count["/endoscope/image_raw"] - count["/depth/points"]) <= 1 < count["/depth/points"]  # by turns


def test_a_recording_outlives_kill_9(tmp_path):
    """What a killed program leaves is read by an unchanged reader: all whole chunks, of a second each."""
    pytest.importorskip("rosbags")
    file, process = recording(tmp_path, "--time", "60", "--rate", "50")
    end = time.time() + 30
    while time.time() < end and not (file.exists() and file.stat().st_size > 200000):
        time.sleep(0.05)
    process.kill()
    process.wait()
    count = read_recording(file)
    assert count["/PSM1/measured_js"] >= 25 and "/depth/points" not in count


def test_no_robot():
    with pytest.raises(om.Unavailable, match="PSM1/measured_cp.*rmw_zenoh"):
        om.RobotWorld(SMALL, DOMAIN + 2, wait=0.3)


def test_a_robot_is_where_its_file_says(robot, tmp_path):
    """A frame of the file counts before that of the robot's tf_static."""
    frame = '{"frames": [{"name": "PSM1_base", "position_mm": [30, -105, 145], "quaternion_xyzw": [0, 0, 0, 1], "points": 4, "rms_mm": 0, "max_mm": 0}]}'
    (tmp_path / "frames.json").write_text(frame)
    world = om.RobotWorld(SMALL, DOMAIN, stale=2, frames=tmp_path / "frames.json")
    at = [world._c.contents.psm[arm].contents.pose_world_rcm for arm in range(2)]
    assert at[0].p == pytest.approx([0.03, -0.105, 0.145]) and at[0].q == pytest.approx([0, 0, 0, 1])
    assert abs(at[1].p[2] - 0.145) > 0.005 and abs(at[1].q[0]) > 0.1  # as the robot says
    world.close()
    with pytest.raises(om.Error, match="no.json"):
        om.RobotWorld(SMALL, DOMAIN, instrument=tmp_path / "no.json")
    with pytest.raises(om.Error, match="no_arm.json"):
        om.RobotWorld(SMALL, DOMAIN, arm=tmp_path / "no_arm.json")
    (tmp_path / "bad.json").write_text("{")
    with pytest.raises(om.Invalid, match="bad.json"):
        om.RobotWorld(SMALL, DOMAIN, frames=tmp_path / "bad.json")


def test_hashes_of_types():
    """Of the .msg files, as rosbags computes them. A wrong digit in type_table would be noticed."""
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    for name, text in {"crtk_msgs/msg/StringStamped": "std_msgs/Header header\nstring string\n",
                       "crtk_msgs/msg/OperatingState": "std_msgs/Header header\nstring state\nbool is_homed\nbool is_busy\n",
                       "omentum_msgs/msg/Tick": "uint32 client\nuint32 number\nuint32 ncommand\nuint32 what\nfloat64 dt\n",
                       "omentum_msgs/msg/Tock": "uint32 client\nuint32 number\nfloat64 time\nstring error\n"}.items():
        store.register(typesys.get_types_from_msg(text, name))
    source = (ROOT / "src/dds/dds_link.c").read_text(encoding="utf-8")
    rows = re.findall(r"&(\w+?)_msg_dds__(\w+)__desc,\s*\"(RIHS01_[0-9a-f]{64})\"", source)
    assert len(rows) == 17
    for package, name, digest in rows:
        assert store.hash_rihs01(f"{package}/msg/{name}") == digest, (package, name)
