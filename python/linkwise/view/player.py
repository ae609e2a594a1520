"""What the exported page shows beside viser's player: the load of a joint, with the time shown."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from linkwise.loads.figures import packed
from linkwise.loads.html import script_json
from linkwise.view.load_plot import COLORS, HALVES, MOST_SAMPLES
from linkwise.view.panel import legend

if TYPE_CHECKING:
    from linkwise.view.source import Recording, Source

MOST_JOINTS = 40  # of larger machines the most loaded ones: each takes some 16 kB
_STYLE = """
#linkwise { position: fixed; z-index: 10; right: 12px; top: 12px; width: 320px; padding: 6px 0;
  font: 12px system-ui, sans-serif; color: #1a1a1a; background: rgba(255, 255, 255, .88);
  border-radius: 6px }
#linkwise > b, #linkwise label { display: block; padding: 2px 12px; font-size: 13px }
#linkwise select { font: inherit; max-width: 230px }
#linkwise canvas { display: block; width: 100%; height: 130px }
#linkwise output { display: block; padding: 0 12px; font-variant-numeric: tabular-nums }
"""
# Viser's player says where it is by the value of its time slider, in seconds since the first frame.
_SCRIPT = """
(() => {
  const data = JSON.parse(document.getElementById("linkwise-loads").textContent);
  const unpack = packed => new Float32Array(
    Uint8Array.from(atob(packed.bdata), c => c.charCodeAt(0)).buffer);
  const times = unpack(data.times), n = times.length, first = times[0], last = times[n - 1];
  const choice = document.getElementById("linkwise-joint");
  const told = document.getElementById("linkwise-told");
  let plots = [], drawn = -1;
  // Size, then the three components, of a half of the load: force or moment.
  function columns(loads, half) {
    const parts = [0, 1, 2].map(c => times.map((_, k) => loads[6 * k + 3 * half + c]));
    return [times.map((_, k) => Math.hypot(...parts.map(part => part[k]))), ...parts];
  }
  function prepare(canvas, half, values) {
    const scale = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
    canvas.width = w * scale;
    canvas.height = h * scale;
    const [left, right, top, bottom] = [56, w - 10, 18, h - 16];
    let low = 0, high = 0;
    for (const part of values) {
      for (const v of part) { low = Math.min(low, v); high = Math.max(high, v); }
    }
    if (high === low) high = low + 1;
    const x = t => left + (right - left) * (t - first) / (last - first || 1);
    const y = v => bottom - (bottom - top) * (v - low) / (high - low);
    const to = canvas.getContext("2d");
    to.scale(scale, scale);
    to.font = "10px system-ui, sans-serif";
    const text = (words, at, height, align, color) => {
      to.textAlign = align;
      to.fillStyle = color || "#333";
      to.fillText(words, at, height);
    };
    const curve = (color, width, points) => {
      to.strokeStyle = color;
      to.lineWidth = width;
      to.beginPath();
      points.forEach(([a, b]) => to.lineTo(a, b));
      to.stroke();
    };
    for (const v of new Set([low, 0, high])) {
      curve("#ccc", 1, [[left, y(v)], [right, y(v)]]);
      text(`${+v.toPrecision(3)}`, left - 4, y(v) + 3, "right");
    }
    text(data.halves[half], 12, 11, "left");
    text(`${+first.toPrecision(4)} s`, left, h - 3, "left");
    text(`${+last.toPrecision(4)} s`, right, h - 3, "right");
    let end = right;
    for (const k of [3, 2, 1, 0]) {
      text(data.names[half][k], end, 11, "right", data.colors[k]);
      end -= to.measureText(data.names[half][k]).width + 8;
      curve(data.colors[k], k ? 1 : 2, [...values[k]].map((v, i) => [x(times[i]), y(v)]));
    }
    const still = to.getImageData(0, 0, canvas.width, canvas.height);
    return at => {
      to.putImageData(still, 0, 0);
      curve("#e67e22", 1, [[x(times[at]), top], [x(times[at]), bottom]]);
      to.fillStyle = "#e67e22";
      to.beginPath();
      to.arc(x(times[at]), y(values[0][at]), 4, 0, 7);
      to.fill();
    };
  }
  function choose() {
    const loads = unpack(data.loads[choice.selectedIndex]);
    plots = [...document.querySelectorAll("#linkwise canvas")].map((canvas, half) => {
      const values = columns(loads, half);
      return {size: values[0], show: prepare(canvas, half, values)};
    });
    drawn = -1;
  }
  function show() {
    const slider = document.querySelector("[role=slider][aria-valuemax]");
    const now = first + (slider ? Number(slider.getAttribute("aria-valuenow")) : 0);
    let at = times.findIndex(t => t >= now - 1e-6);
    if (at < 0) at = n - 1;
    if (at !== drawn) {
      drawn = at;
      plots.forEach(plot => plot.show(at));
      const [force, moment] = plots.map(plot => plot.size[at].toPrecision(4));
      told.textContent = `t = ${times[at].toPrecision(4)} s: ${force} N, ${moment} N m`;
    }
    requestAnimationFrame(show);
  }
  choice.addEventListener("change", choose);
  window.addEventListener("resize", choose);
  choose();
  show();
})();
"""


def overlay(source: Source, *, by_rating: bool) -> str:
    """HTML for the end of the page's body: title, colours and, of a run with loads, plots."""
    recording = source.recording
    title = f"<b>{escape(source.title)}</b>"
    if recording is None or not recording.has_loads:
        return f"<style>{_STYLE}</style><div id='linkwise'>{title}</div>"
    names, loads = _most_loaded(source, recording)
    options = "".join(f"<option>{escape(name)}</option>" for name in names)
    content = {
        "times": packed(recording.history(0, MOST_SAMPLES)[0]),
        "loads": loads,
        "halves": [title for title, _ in HALVES],
        "names": [["size", *labels] for _, labels in HALVES],
        "colors": COLORS,
    }
    chosen = recording.causes
    some = ""
    if chosen is not None and not chosen.everything:
        some = f"<label>caused by {escape(', '.join(sorted(chosen.chosen)))}</label>"
    return (
        f"<style>{_STYLE}</style><div id='linkwise'>{title}"
        f"{legend(recording.largest, by_rating)}{some}"
        f"<label>Joint <select id='linkwise-joint'>{options}</select></label>"
        "<canvas></canvas><canvas></canvas>"
        "<output id='linkwise-told'></output></div>"
        f"<script type='application/json' id='linkwise-loads'>{script_json(content)}</script>"
        f"<script>{_SCRIPT}</script>"
    )


def _most_loaded(source: Source, recording: Recording) -> tuple[list[str], list[dict[str, str]]]:
    """Names and packed loads of the joints that are plotted, in the model's order."""
    names = source.model.joint_names
    ranked = np.argsort(-recording.peaks, kind="stable")[:MOST_JOINTS]
    joints = sorted(int(k) for k in ranked)
    loads = [packed(recording.history(k, MOST_SAMPLES)[1]) for k in joints]
    return [names[k] for k in joints], loads
