"""The page of a body and of a run: what is in it, and that a notebook shows it."""
import base64
import html
import json
import os
import re
import socket
import struct
import subprocess
import zlib

import pytest

import omentum as om


def small_sheet():
    scene = om.Scene()
    scene.tissue.cells = (4, 4, 1)
    return scene


def messages_of(page):
    """Kind and bytes of each message of a page."""
    packed = re.search(r'<script id="messages"[^>]*>([^<]*)<', page).group(1)
    data, at, out = zlib.decompress(base64.b64decode(packed)), 0, []
    while at < len(data):
        size, kind = struct.unpack_from("<II", data, at)
        out.append((kind, data[at + 4:at + 4 + size]))
        at += 4 + size
    return out


def test_a_view_holds_the_frames_of_a_body(tmp_path):
    body = om.Body(small_sheet())
    view = om.View(body)
    tip = body.x[0].copy()
    body.grasp(tip, radius=0.02)
    for step in range(1, 4):
        body.move(tip + [0, 0, 0.002 * step])
        body.step(0.02)
        view.add(0.02 * step, force=0.5 * step)
    view.save(tmp_path / "lift.html")
    page = (tmp_path / "lift.html").read_text()
    messages = messages_of(page)
    assert [kind for kind, _ in messages] == [1, 3, 4, 4, 4, 4] and view.nframe == 4
    scene = json.loads(messages[0][1][8:8 + struct.unpack_from("<I", messages[0][1], 4)[0]])
    assert [part["kind"] for part in scene["parts"]][0] == "tissue" and scene["grid"] == 5
    times = [struct.unpack_from("<d", data, 8)[0] for kind, data in messages if kind == 4]
    assert times == pytest.approx([0, 0.02, 0.04, 0.06])
    forces = [struct.unpack_from("<f", data, 20)[0] for kind, data in messages if kind == 4]
    assert forces[1:] == pytest.approx([0.5, 1, 1.5])
    shown = view._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and html.unescape(re.search('srcdoc="([^"]*)"', shown).group(1)) == page
    with pytest.raises(om.Error):
        view.save(tmp_path / "no" / "folder.html")


def test_view_takes_a_body_or_the_folder_of_a_run(tmp_path):
    assert isinstance(om.view(om.Body(small_sheet())), om.View)
    with pytest.raises(FileNotFoundError, match="view.html"):
        om.view(tmp_path)
    (tmp_path / "view.html").write_text("<p>page</p>")
    for source in (tmp_path, str(tmp_path / "view.html")):
        run = om.view(source)
        assert run.html() == "<p>page</p>" and "&lt;p&gt;page" in run._repr_html_()


class Page:
    """A page of a server in a few lines: lines out, messages in, without a library."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        host = f"127.0.0.1:{port}"
        self.socket.sendall((f"GET / HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
                             "Sec-WebSocket-Protocol: omentum\r\n\r\n").encode())
        self.stream = self.socket.makefile("rb")
        while self.stream.readline().strip():
            pass

    def send(self, line):
        data = line.encode()
        self.socket.sendall(bytes([0x81, 0x80 | len(data)]) + bytes(4) + data)

    def receive(self):
        head = self.stream.read(2)
        size = head[1]
        if size == 126:
            size = int.from_bytes(self.stream.read(2), "big")
        elif size == 127:
            size = int.from_bytes(self.stream.read(8), "big")
        data = self.stream.read(size)
        return json.loads(data) if head[0] & 15 == 1 else data

    def frame(self, is_it):
        """Time and force of the next frame of which this holds."""
        while True:
            data = self.receive()
            if isinstance(data, bytes) and struct.unpack_from("<I", data)[0] == 2:
                found = struct.unpack_from("<d", data, 8)[0], struct.unpack_from("<f", data, 20)[0]
                if is_it(*found):
                    return found

    def answer(self, words):
        while True:
            data = self.receive()
            if isinstance(data, dict) and words in data.get("say", ""):
                return data["say"]


@pytest.mark.skipif(not os.environ.get("OMENTUM_PROGRAM"), reason="the program is not built")
def test_the_force_of_a_hand_is_that_of_the_library(tmp_path):
    """Steps of a paused hand are those of a body that is moved by the same points: 5 mm a step at most, as 0.25 m/s."""
    scene, dt, steps = small_sheet(), 0.02, 6
    path = tmp_path / "sheet.yaml"
    path.write_text(scene.yaml())
    body = om.Body(om.Scene.load(path))
    body.settle(dt, 1e-3, 5, strict=False)
    tip = body.x[0].copy()
    goal = tip + [0, 0, 0.012]
    with subprocess.Popen([os.environ["OMENTUM_PROGRAM"], "view", str(path), "--free", "--port", "0", "-q"], stdout=subprocess.PIPE, text=True) as program:
        try:
            page = Page(int(re.search(r":(\d+)/", program.stdout.readline()).group(1)))
            page.answer("finite elements")  # the scene is there: earlier lines are not for it
            page.send("pause")
            page.answer("paused")
            page.send("reset")
            page.answer("back at rest")
            page.send("grasp {:.9f} {:.9f} {:.9f}".format(*tip))
            page.send("move {:.9f} {:.9f} {:.9f}".format(*goal))
            found = []
            for k in range(steps):
                page.send("step")
                found.append(page.frame(lambda time, _, k=k: abs(time - (k + 1) * dt) < 1e-6)[1])
        finally:
            program.kill()
    body.grasp(tip, radius=scene.task.grasp_radius)
    expected, place = [], tip.copy()
    for _ in range(steps):
        way = goal - place
        left = float((way @ way) ** 0.5)
        place = goal.copy() if left <= 0.25 * dt else place + way * (0.25 * dt / left)
        body.move(place)
        body.step(dt, strict=False)
        force = body.forces().grasp[0]
        expected.append(float((force @ force) ** 0.5))
    assert min(expected) > 0.01
    # the program settles in pieces: it stops at another step than the body here
    assert found == pytest.approx(expected, rel=0.02, abs=1e-3)
