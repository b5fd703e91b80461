"""Reports as one HTML file, charts, and pictures that a notebook shows."""
from __future__ import annotations

import ctypes
import html
import os
import re
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _capi as c
from . import plot as _plot
from ._convert import array_of
from ._lib import Handle, Owner, lib, make_error, path_of
from .volume import picture_as_c

# The look of charts outside a report: colours that differ for colour-blind eyes, on white.
_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_STYLE = ("text{font:12px sans-serif;fill:#586573}.title{font-weight:600;font-size:14px;fill:#17212b}.grid{stroke:#e8ecf0}"
          ".axis{stroke:#586573;opacity:.55}.data{fill:none;stroke-width:2}.limit{stroke:#17212b;stroke-dasharray:6 4}"
          ".event{stroke:#586573;stroke-dasharray:2 3}.span{fill:#0072b2;opacity:.13}.odd{opacity:.22}.under{fill:#0072b2;opacity:.035}"
          ".span-name{fill:#17212b}" + "".join(f".c{i}{{stroke:{color}}}" for i, color in enumerate(_COLORS)))
_LETTER = 7  # px, mean width of a letter of 12 px


@dataclass
class Chart:
    """Lines over a common axis. A notebook shows it; Report.add draws it in a report; save writes SVG.

        Chart("Force of the tool", {"pull": (time, force)}, "time, s", "force, N")

    lines: by name (x, y), x ascending; values that are not finite leave a gap. At most OM_REPORT_MAX_SERIES.
    limits: at most two dashed lines, by name. events: thin vertical lines at these x. spans: (name, begin, end) above the lines.
    """

    title: str
    lines: dict[str, tuple[Any, Any]]
    x_label: str = ""
    y_label: str = ""
    limits: dict[str, float] = field(default_factory=dict)
    events: Any = ()
    spans: list[tuple[str, float, float]] = field(default_factory=list)
    is_log_x: bool = False
    is_log_y: bool = False

    def _as_c(self) -> Any:
        if len(self.lines) > c.OM_REPORT_MAX_SERIES or len(self.limits) > 2:
            raise ValueError(f"a chart has at most {c.OM_REPORT_MAX_SERIES} lines and two limits")
        raw = c.OmReportChart(title=self.title.encode(), x_label=self.x_label.encode(), y_label=self.y_label.encode(),
                              is_log_x=self.is_log_x, is_log_y=self.is_log_y, nseries=len(self.lines))
        keep = []
        for series, (name, (x, y)) in zip(raw.series, self.lines.items()):
            x = array_of(x, np.float64, (None,), f"x of {name}")
            y = array_of(y, np.float64, x.shape, f"y of {name}")
            series.name, series.x, series.y, series.n = name.encode(), x.ctypes.data, y.ctypes.data, len(x)
            keep += [x, y]
        for i, (name, value) in enumerate(self.limits.items()):
            number = str(i + 1) if i else ""
            raw.assign({"limit" + number: value, f"limit{number}_name": name.encode()})
            raw.has_limit = True
        events = array_of(self.events, np.float64, (None,), "events")
        spans = (c.OmReportSpan * max(1, len(self.spans)))()
        for span, (name, begin, end) in zip(spans, self.spans):
            span.label, span.begin, span.end = name.encode(), begin, end
        raw.event, raw.nevent = events.ctypes.data, len(events)
        raw.span, raw.nspan = spans, len(self.spans)
        raw._keep = (keep, events, spans)
        return raw

    def svg(self) -> str:
        """The chart as a file of its own."""
        with Report("") as report:
            report.add(self)
            page = report.html()
        drawing = re.search(r'<svg class="wide[^>]*viewBox="0 0 (\d+) (\d+)"[^>]*>(.*?)</svg>', page, re.S)
        if drawing is None:
            raise ValueError("the chart has no finite value")
        width, height, lines = int(drawing[1]), int(drawing[2]), drawing[3]
        lines = lines.replace("plot1", f"plot{zlib.crc32(lines.encode()):08x}")  # one page holds many charts
        head, x = [f'<text class="title" x="8" y="20">{html.escape(self.title)}</text>'], 8 + 9 * len(self.title) + 20
        if self.y_label:
            head.append(f'<text x="{x}" y="20">{html.escape(self.y_label)}</text>')
            x += _LETTER * len(self.y_label) + 30
        for i, name in enumerate(self.lines if len(self.lines) > 1 else ()):
            head.append(f'<line class="data c{i}" x1="{x}" x2="{x + 18}" y1="16" y2="16"/><text x="{x + 24}" y="20">{html.escape(name)}</text>')
            x += _LETTER * len(name) + 50
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height + 30}" width="{width}">'
                f'<style>{_STYLE}</style><rect width="{width}" height="{height + 30}" fill="#fff"/>'
                f'{"".join(head)}<g transform="translate(0 30)">{lines}</g></svg>\n')

    def plot(self, ax: Any = None) -> Any:
        """Draw the lines and limits with matplotlib; the axes are returned."""
        ax = _plot.axes_2d(ax, self.x_label, self.y_label)
        ax.set_title(self.title)
        for name, (x, y) in self.lines.items():
            ax.plot(x, y, label=name)
        for name, value in self.limits.items():
            ax.axhline(value, color="black", linestyle="--", label=name)
        ax.set_xscale("log" if self.is_log_x else "linear")
        ax.set_yscale("log" if self.is_log_y else "linear")
        if len(self.lines) + len(self.limits) > 1:
            ax.legend()
        return ax

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write .svg."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.svg())

    def _repr_svg_(self) -> str:
        return self.svg()


@dataclass
class Picture:
    """A picture (height x width, or height x width x 1, 3 or 4) of bytes, with a caption. A notebook shows it; Report.add embeds it."""

    pixels: np.ndarray
    caption: str = ""

    def png(self) -> bytes:
        """The bytes of a PNG file."""
        text = c.OmText()
        try:
            lib.om_picture_encode_png(ctypes.byref(picture_as_c(self.pixels)), ctypes.byref(text))
            return ctypes.string_at(ctypes.c_void_p.from_buffer(text).value or 0, text.len)  # text.str ends at a zero byte
        finally:
            lib.om_text_done(ctypes.byref(text))

    def _repr_png_(self) -> bytes:
        return self.png()

    def __repr__(self) -> str:
        return f"Picture({self.pixels.shape[1]} x {self.pixels.shape[0]}, {self.caption!r})"


class Report(Owner):
    """A report as one HTML file, as the program writes them. Blocks appear in the order they are added.

        with Report("A lift", "fat over a kidney") as report:
            report.verdict("The region of interest is exposed", True)
            report.add("Forces", Chart(...), Picture(pixels, "at the end"), [["depth, mm", "error, mm"], [10, 0.2]])
            report.save("report.html")
    """

    def __init__(self, title: str, subtitle: str = "") -> None:
        raw = c.OmReport()
        lib.om_report_begin(ctypes.byref(raw), title.encode(), subtitle.encode())
        self._handle = Handle(raw, lambda report: lib.om_report_done(ctypes.byref(report)))

    def add(self, *blocks: Any) -> None:
        """Append blocks: text is a paragraph, a list of rows a table whose first row is its heading, or a Chart or Picture."""
        report = ctypes.byref(self._c)
        for block in blocks:
            if isinstance(block, str):
                lib.om_report_paragraph(report, block.encode())
            elif isinstance(block, Chart):
                lib.om_report_chart(report, ctypes.byref(block._as_c()))
            elif isinstance(block, Picture):
                lib.om_report_picture(report, ctypes.byref(picture_as_c(block.pixels)), block.caption.encode())
            else:
                self._table([[_text(cell) for cell in row] for row in block])
        self._check()

    def _table(self, rows: list[list[bytes]]) -> None:
        if not rows or not rows[0] or any(len(row) != len(rows[0]) for row in rows):
            raise ValueError("a table is a list of rows of the same length; the first is the heading")
        cells = [cell for row in rows[1:] for cell in row]
        lib.om_report_table(ctypes.byref(self._c), _texts(rows[0]), len(rows[0]), _texts(cells), len(rows) - 1)

    def heading(self, text: str) -> None:
        """Begin a section."""
        lib.om_report_heading(ctypes.byref(self._c), text.encode())
        self._check()

    def verdict(self, text: str, is_good: bool) -> None:
        """The outcome as one emphasised sentence."""
        lib.om_report_verdict(ctypes.byref(self._c), text.encode(), is_good)
        self._check()

    def facts(self, **values: Any) -> None:
        """Numbers side by side, by name; an underscore in a name is a blank."""
        names = [name.replace("_", " ").encode() for name in values]
        lib.om_report_facts(ctypes.byref(self._c), _texts([_text(v) for v in values.values()]), _texts(names), len(names))
        self._check()

    def listing(self, text: str) -> None:
        """Text with its lines and blanks: a plan."""
        lib.om_report_listing(ctypes.byref(self._c), text.encode())
        self._check()

    def _check(self) -> None:
        """Raise the first failure of the calls so far."""
        raw = self._c
        if raw.status:
            lib.om_error(int(raw.status), b"%s", raw.message.encode())
            raise make_error(raw.status)

    def html(self) -> str:
        """The page so far, without its end."""
        raw = self._c
        return ctypes.string_at(raw.html.str, raw.html.len).decode()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file whole or not at all; the report is then closed."""
        handle, raw = self._handle, self._c
        handle.address, self._handle = None, None  # type: ignore[union-attr]
        lib.om_report_save(ctypes.byref(raw), path_of(path))


def _text(value: Any) -> bytes:
    return (f"{value:.4g}" if isinstance(value, (float, np.floating)) else "" if value is None else str(value)).encode()


def _texts(values: list[bytes]) -> Any:
    return (ctypes.c_char_p * max(1, len(values)))(*values)


__all__ = ["Chart", "Picture", "Report"]
