"""The picture of an example: the machine at some times, and curves of what its joints carry."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt

import linkwise as lw
from linkwise import _core

# Fixed identifiers and no time stamp: the same picture gives the same file.
mpl.rcParams |= {"svg.hashsalt": "linkwise", "svg.fonttype": "none"}
mpl.rcParams |= {"font.sans-serif": ["DejaVu Sans"], "font.size": 9, "path.simplify": True}


def save(path, run, panels, *, times, tips, view="xz", most=400):
    """Write an SVG file.

    panels: (label of the axis, {name: values over the run's time}), one a panel; names in brackets
    are dashed. times: when the machine is drawn. tips: {joint: point in its body's frame}, what is
    drawn beyond the last joints. view: the world's axes that are drawn. most: points of a curve.
    """
    figure, axes = plt.subplots(
        1,
        1 + len(panels),
        figsize=(9.6, 3.0),
        layout="constrained",
        width_ratios=[1.25] + [1] * len(panels),
    )
    draw_machine(axes[0], run, times, tips, view)
    every = max(1, run.sizes["time"] // most)
    for axis, (label, curves) in zip(axes[1:], panels, strict=True):
        for name, values in curves.items():
            style = "--" if name.startswith("(") else "-"
            shown = np.asarray(values)[::every]
            axis.plot(run.time[::every], shown, style, label=name, linewidth=1.2)
        axis.set(xlabel="time [s]", ylabel=label, xlim=(run.time[0], run.time[-1]))
    if all(curves.keys() == panels[0][1].keys() for _, curves in panels):
        names, labels = axes[-1].get_legend_handles_labels()
        figure.legend(names, labels, loc="outside lower center", ncols=6, frameon=False)
    else:
        for axis in axes[1:]:
            axis.legend(frameon=False, fontsize=8)
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, metadata={"Date": None, "Creator": None})
    print(f"picture: {path}")


def draw_machine(axis, run, times, tips, view):
    """Lines between joint points at these times, early ones pale; squares at the tips."""
    model = run.load_model()
    across, up = ("xyz".index(letter) for letter in view)
    names = model.joint_names
    greys = np.linspace(0.8, 0.0, len(times)) if len(times) > 1 else [0.0]
    for when, grey in zip(times, greys, strict=True):
        q = run.position.sel(time=when, method="nearest").values
        poses = np.asarray(lw.joint_poses(model, q))
        style = {"color": str(grey), "linewidth": 1.2, "markersize": 2.5}
        if len(names) > 100:
            style |= {"markersize": 0}
        for line in lines(model, poses, {j: np.append(p, 1.0) for j, p in tips.items()}):
            axis.plot(line[:, across], line[:, up], "o-", **style)
        for line in bent_lines(model, q):
            axis.plot(line[:, across], line[:, up], "-", color=str(grey), linewidth=1.2)
        for line in closing_lines(model, q, poses):
            axis.plot(line[:, across], line[:, up], "o-", **style)
        for joint, point in tips.items():
            end = poses[names.index(joint)] @ np.append(point, 1.0)
            axis.plot(end[across], end[up], "s", color=str(grey), markersize=5)
    told = ", ".join(f"{when:g}" for when in times)
    axis.set(xlabel=f"{view[0]} [m]", ylabel=f"{view[1]} [m]", aspect="equal", title=f"{told} s")


def lines(model, poses, tips):
    """Points (n, 3) of every branch, from its tip or last joint to where another has passed, or to
    the end of an elastic link, which `bent_lines` draws."""
    parents, seen = list(model.joint_parents), set()
    for last in reversed(range(len(parents))):
        if last in seen:
            continue
        points = []
        name = model.joint_names[last]
        if name in tips:
            points.append((poses[last] @ tips[name])[:3])
        joint = last
        while joint >= 0:
            points.append(poses[joint][:3, 3])
            if joint in seen:
                break
            seen.add(joint)
            if model.joint_names[joint].rpartition(":")[0] in model.beam_lengths:
                yield np.array(points)
                points = []
            joint = parents[joint]
        yield np.array(points)


def bent_lines(model, q):
    """Points (n, 3) along the bent centre line of every elastic link."""
    links = dict(zip(model.link_names, lw.link_poses(model, q), strict=True))
    for link, length in model.beam_lengths.items():
        places = np.linspace(0, length, 12).tolist()
        sections, _ = _core.bent_sections(model, [link] * len(places), places, q)
        yield (links[link] @ sections)[:, :3, 3]


def closing_lines(model, q, poses):
    """Points (n, 3) from the joints of the two links that a loop joint joins to its place on them,
    and from end to end of a rod."""
    links = dict(zip(model.link_names, lw.link_poses(model, q), strict=True))
    joint_of = {link: k for k, link in enumerate(model.child_link_names)}
    ends = zip(model.loop_parent_link_names, model.loop_child_link_names, strict=True)
    for (parent, child), places in zip(ends, model.loop_placements, strict=True):
        line = []
        for link, place, order in ((parent, places[0], 1), (child, places[1], -1)):
            there = (links[link] @ place)[:3, 3]
            start = [poses[joint_of[link]][:3, 3]] if link in joint_of else []
            line += [*start, there][::order]
        yield np.array(line)
