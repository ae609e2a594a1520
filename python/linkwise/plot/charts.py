"""Line charts as SVG text, without any plotting library: for reports that are one file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import NamedTuple

COLOURS = ("#0b62a4", "#c4410c", "#1b7f4d", "#7a3e9d", "#8a6d00", "#555555", "#b3125d", "#00808a")
_LEFT, _RIGHT, _TOP, _BOTTOM = 68, 18, 34, 48


@dataclass(frozen=True)
class Line:
    """One curve: points, and how it is drawn."""

    label: str
    x: Sequence[float]
    y: Sequence[float]
    dashed: bool = False
    markers: bool = True
    colour: str = ""


@dataclass(frozen=True)
class Axis:
    """One axis: its label, and whether it is logarithmic."""

    label: str
    log: bool = False


@dataclass(frozen=True)
class Chart:
    """Curves over common axes."""

    title: str
    x: Axis
    y: Axis
    lines: Sequence[Line] = field(default_factory=tuple)
    width: int = 640
    height: int = 400


class _Scale:
    """From values to pixels along one axis, and where its ticks are."""

    def __init__(self, values: Sequence[float], log: bool, start: float, end: float) -> None:
        usable = [v for v in values if math.isfinite(v) and (v > 0 or not log)]
        low, high = (min(usable), max(usable)) if usable else (1.0, 10.0)
        self.log, self.start, self.end = log, start, end
        if log:
            self.low, self.high = math.log10(low), math.log10(high)
            if self.high - self.low < 0.3:
                self.low, self.high = self.low - 0.15, self.high + 0.15
        else:
            self.low, self.high = min(low, 0.0), high if high > low else low + 1.0
        margin = 0.03 * (self.high - self.low)
        self.high += margin
        if log or low < 0:
            self.low -= margin

    def __call__(self, value: float) -> float:
        position = math.log10(value) if self.log else value
        return self.start + (position - self.low) / (self.high - self.low) * (self.end - self.start)

    def ticks(self) -> list[float]:
        if not self.log:
            return _round_steps(self.low, self.high)
        decades = range(math.floor(self.low), math.ceil(self.high) + 1)
        digits = (1, 2, 5) if self.high - self.low < 2.5 else (1,)
        ticks = [d * 10.0**k for k in decades for d in digits]
        return [t for t in ticks if self.low <= math.log10(t) <= self.high]


def _round_steps(low: float, high: float) -> list[float]:
    """Five or so multiples of 1, 2 or 5 times a power of ten."""
    raw = (high - low) / 5
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= raw)
    first = math.ceil(low / step)
    count = math.floor(high / step) - first + 1
    return [(first + i) * step for i in range(count)]


def _tick_text(value: float) -> str:
    if value != 0 and (abs(value) >= 1e5 or abs(value) < 1e-3):
        mantissa, exponent = f"{value:.0e}".split("e")
        return f"{mantissa}e{int(exponent)}"
    return f"{value:.6g}"


def _text(x: float, y: float, content: str, anchor: str = "middle", extra: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {extra}>{escape(content)}</text>'


def _grid(chart: Chart, across: _Scale, up: _Scale) -> list[str]:
    right, bottom = chart.width - _RIGHT, chart.height - _BOTTOM
    parts = []
    for tick in across.ticks():
        x = across(tick)
        parts.append(f'<path d="M{x:.1f} {_TOP}V{bottom}" stroke="#e2e2e2"/>')
        parts.append(_text(x, bottom + 16, _tick_text(tick)))
    for tick in up.ticks():
        y = up(tick)
        parts.append(f'<path d="M{_LEFT} {y:.1f}H{right}" stroke="#e2e2e2"/>')
        parts.append(_text(_LEFT - 6, y + 4, _tick_text(tick), "end"))
    parts.append(
        f'<rect x="{_LEFT}" y="{_TOP}" width="{right - _LEFT}" height="{bottom - _TOP}" '
        'fill="none" stroke="#888"/>'
    )
    parts.append(_text((_LEFT + right) / 2, chart.height - 10, chart.x.label))
    middle = (_TOP + bottom) / 2
    parts.append(_text(16, middle, chart.y.label, extra=f'transform="rotate(-90 16 {middle:.1f})"'))
    parts.append(_text(_LEFT, 20, chart.title, "start", 'font-weight="600"'))
    return parts


def _curve(line: Line, colour: str, across: _Scale, up: _Scale) -> list[str]:
    points = [
        (across(x), up(y))
        for x, y in zip(line.x, line.y, strict=True)
        if math.isfinite(x) and math.isfinite(y) and (x > 0 or not across.log)
        if y > 0 or not up.log
    ]
    if not points:
        return []
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    dash = ' stroke-dasharray="6 4"' if line.dashed else ""
    parts = [f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.8"{dash}/>']
    if line.markers:
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points]
    return parts


def _legend(lines: Sequence[Line], colours: Sequence[str]) -> list[str]:
    parts = []
    for i, (line, colour) in enumerate(zip(lines, colours, strict=True)):
        y = _TOP + 16 + 16 * i
        dash = ' stroke-dasharray="6 4"' if line.dashed else ""
        parts.append(
            f'<path d="M{_LEFT + 10} {y - 4}h22" stroke="{colour}" stroke-width="2"{dash}/>'
        )
        parts.append(_text(_LEFT + 38, y, line.label, "start"))
    return parts


def to_svg(chart: Chart) -> str:
    """The chart as one <svg> element."""
    xs = [x for line in chart.lines for x in line.x]
    ys = [y for line in chart.lines for y in line.y]
    across = _Scale(xs, chart.x.log, _LEFT, chart.width - _RIGHT)
    up = _Scale(ys, chart.y.log, chart.height - _BOTTOM, _TOP)
    colours = [line.colour or COLOURS[i % len(COLOURS)] for i, line in enumerate(chart.lines)]
    parts = _grid(chart, across, up)
    for line, colour in zip(chart.lines, colours, strict=True):
        parts += _curve(line, colour, across, up)
    parts += _legend(chart.lines, colours)
    return _frame(chart.title, chart.width, chart.height, parts)


def _frame(title: str, width: int, height: int, parts: Sequence[str]) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" role="img" aria-label="{escape(title)}" '
        'font-family="system-ui, sans-serif" font-size="12" fill="#222">'
        '<rect width="100%" height="100%" fill="#fff"/>' + "".join(parts) + "</svg>"
    )


class Dot(NamedTuple):
    """A value in a row of a dot chart: its series, and whether it is drawn full."""

    x: float
    series: int
    full: bool = True


@dataclass(frozen=True)
class DotChart:
    """Rows of dots on a common logarithmic axis: (label, dots, remark at the end of the row)."""

    title: str
    label: str
    rows: Sequence[tuple[str, Sequence[Dot], str]]
    series: Sequence[str]
    width: int = 860


_ROW, _LABELS, _REMARKS, _HEAD = 22, 260, 170, 58


def dots_to_svg(chart: DotChart) -> str:
    """The chart as one <svg> element."""
    bottom = _HEAD + _ROW * len(chart.rows)
    right = chart.width - _REMARKS
    across = _Scale([d.x for _, dots, _ in chart.rows for d in dots], True, _LABELS, right)
    parts = [_text(12, 20, chart.title, "start", 'font-weight="600"')]
    for tick in across.ticks():
        x = across(tick)
        parts.append(f'<path d="M{x:.1f} {_HEAD}V{bottom}" stroke="#e2e2e2"/>')
        parts.append(_text(x, bottom + 16, _tick_text(tick)))
    parts.append(_text((_LABELS + right) / 2, bottom + 36, chart.label))
    for i, name in enumerate(chart.series):
        x = 14 + i * (chart.width - 28) / len(chart.series)
        colour = COLOURS[i % len(COLOURS)]
        parts.append(f'<circle cx="{x:.1f}" cy="38" r="5" fill="{colour}"/>')
        parts.append(_text(x + 10, 42, name, "start"))
    for i, (label, dots, remark) in enumerate(chart.rows):
        y = _HEAD + _ROW * (i + 0.5)
        parts.append(f'<path d="M{_LABELS} {y}H{right}" stroke="#eee"/>')
        parts.append(_text(_LABELS - 8, y + 4, label, "end"))
        parts.append(_text(right + 8, y + 4, remark, "start", 'fill="#b3321d"'))
        for dot in dots:
            colour = COLOURS[dot.series % len(COLOURS)]
            fill = colour if dot.full else "#fff"
            parts.append(
                f'<circle cx="{across(dot.x):.1f}" cy="{y}" r="5" fill="{fill}" '
                f'stroke="{colour}" fill-opacity="0.75"/>'
            )
    return _frame(chart.title, chart.width, bottom + 48, parts)
