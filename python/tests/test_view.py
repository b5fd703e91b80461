"""The page of a body and of a run: what is in it, and that a notebook shows it."""
import base64
import html
import json
import re
import struct
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
