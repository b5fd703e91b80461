"""Reports, charts and pictures: numbers in the drawing against the data, and files that others read."""
import re
import xml.etree.ElementTree as tree

import numpy as np
import pytest

import omentum as om

TIME = np.linspace(0, 2, 21)


def chart(**fields):
    return om.Chart("Force & depth", {"pull": (TIME, TIME**2), "half": (TIME, TIME**2 / 2)}, "time, s", "force, N", **fields)


def test_a_chart_is_a_drawing_of_its_values():
    """The curve's corners, back in the units of the axes, are the values to the width of a line."""
    drawing = tree.fromstring(chart(limits={"limit": 3.0}, spans=[("pull", 0.5, 1.5)]).svg())
    space = "{http://www.w3.org/2000/svg}"
    path = next(p for p in drawing.iter(space + "path") if p.get("class") == "data c0")
    points = np.array([[float(v) for v in pair.split()] for pair in re.split("L", path.get("d").replace("h0", "")[1:])])
    assert len(points) == len(TIME)
    ticks = {t.text: (float(t.get("x")), float(t.get("y"))) for t in drawing.iter(space + "text") if t.get("x") and t.get("text-anchor")}
    x = (points[:, 0] - ticks["0.0"][0]) / (ticks["2.0"][0] - ticks["0.0"][0]) * 2
    y = (points[:, 1] - points[0, 1]) / (ticks["4"][1] - ticks["0"][1]) * 4
    assert x == pytest.approx(TIME, abs=0.005) and y == pytest.approx(TIME**2, abs=0.03)
    text = "".join(t.text for t in drawing.iter(space + "text") if t.text)
    assert all(name in text for name in ("Force & depth", "force, N", "time, s", "pull", "half", "limit"))
    assert chart().svg() == chart().svg() and chart()._repr_svg_() == chart().svg()


def test_a_chart_refuses_what_it_cannot_draw(tmp_path):
    with pytest.raises(ValueError, match="no finite value"):
        om.Chart("nothing", {"a": ([0.0], [np.nan])}).svg()
    with pytest.raises(ValueError, match="y of a"):
        om.Chart("wrong", {"a": ([0.0, 1.0], [1.0])}).svg()
    with pytest.raises(ValueError, match="at most"):
        om.Chart("many", {str(i): ([0.0], [1.0]) for i in range(7)}).svg()
    chart().save(tmp_path / "force.svg")
    assert (tmp_path / "force.svg").read_text() == chart().svg()


def test_the_bytes_of_a_picture_are_those_of_its_file(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (20, 30, 3), np.uint8)
    (tmp_path / "a.png").write_bytes(om.Picture(pixels).png())
    om.save_png(tmp_path / "b.png", pixels)
    assert np.array_equal(om.load_png(tmp_path / "a.png"), pixels) and np.array_equal(om.load_png(tmp_path / "b.png"), pixels)
    with pytest.raises(ValueError, match="bytes"):
        om.Picture(pixels.astype(float)).png()


def test_a_report_is_one_file(tmp_path, alive):
    with om.Report("A lift <b>", "fat") as report:
        report.verdict("The tumour is seen", True)
        report.facts(largest_force="0.4 N", steps=12)
        report.heading("Forces")
        report.add("A sentence.", chart(), om.Picture(np.zeros((8, 8, 3), np.uint8), "dark"), [["depth, mm", "error, mm"], [10, 0.25], [20, None]])
        report.listing("1. reach\n2. grasp")
        with pytest.raises(ValueError, match="same length"):
            report.add([["a", "b"], [1]])
        report.save(tmp_path / "report.html")
        with pytest.raises(om.Closed):
            report.add("too late")
    page = (tmp_path / "report.html").read_text()
    assert page.startswith("<!DOCTYPE html>") and page.rstrip().endswith("</html>")
    for part in ("A lift &lt;b&gt;", "The tumour is seen", "largest force", ">12<", "A sentence.", "Force &amp; depth", "data:image/png;base64", "0.25", "1. reach\n"):
        assert part in page
    with om.Report("never saved") as report:
        report.add("a")
    with pytest.raises(om.FileFailed):
        om.Report("no place").save(tmp_path / "missing" / "report.html")
    del report
    assert alive() == 0
