"""A chain hangs between two anchors: what it pulls at them.

Links in equilibrium lie as the closed form of a polygon of equal weights says, and the more there
are, the closer their pull comes to the catenary's. The number that a designer wants: the tension
at an anchor.

Run it by: python examples/20_hanging_chain.py [PICTURE.svg]
"""

import sys

import numpy as np
from checked import check

import linkwise as lw

LENGTH, SPAN, WEIGHT, G = 12.0, 10.0, 240.0, 9.81  # m, m, N of the whole chain
AXIS = (0, -1, 0)


def between(low, high, function):
    """Where an increasing function passes through zero, by halving."""
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    return (low + high) / 2


def angles(pull, n):
    """Of n equal links against the horizon: their middles carry pull across, the weights up."""
    above = WEIGHT * (np.arange(n) + 0.5 - n / 2) / n
    return np.arctan2(above, pull)


def chain(n):
    """n links from the left anchor, the last one pinned to the right anchor."""
    length, mass = LENGTH / n, WEIGHT / G / n
    moment = mass * length**2 / 12
    builder = lw.ModelBuilder("hanging_chain", gravity=(0, 0, -G))
    builder.add_link("ground")
    before, at = "ground", (0, 0, 0)
    inertia = np.diag([0.01 * moment, moment, moment])
    for k in range(n):
        builder.add_link(f"link_{k}", mass=mass, com=(length / 2, 0, 0), inertia=inertia)
        builder.add_joint(
            f"pin_{k}", "revolute", before, f"link_{k}", translation=at, axis=AXIS, damping=0.5
        )
        before, at = f"link_{k}", (length, 0, 0)
    anchor = {"translation": at, "child_translation": (SPAN, 0, 0)}
    builder.add_loop("anchor", "revolute", before, "ground", axis=AXIS, **anchor)
    return builder.build()


def pull_of(n):
    """The horizontal pull of n links that span the anchors."""
    return between(1e-3, 1e6, lambda pull: LENGTH / n * np.cos(angles(pull, n)).sum() - SPAN)


# The catenary: half the span is a asinh(half the length / a), the pull is the weight of a length a.
wide = between(1e-3, 1e4, lambda a: a * np.arcsinh(LENGTH / 2 / a) - SPAN / 2)
tension = np.hypot(WEIGHT / LENGTH * wide, WEIGHT / 2)

print("links   pull at the left anchor [N]   of the catenary's")
errors = []
for n in (10, 20, 40):
    hanging, pull = chain(n), pull_of(n)
    lean = angles(pull, n)
    q = np.diff(lean, prepend=0.0)
    load = lw.joint_loads(hanging, q, np.zeros(n))
    found = float(np.hypot(*load[0, [0, 2]]))
    check(f"{n} links, against the polygon", found, float(np.hypot(pull, WEIGHT / 2)), 1e-7, "N")
    right = float(np.hypot(*load[-1, [0, 2]]))
    check("and at the right anchor", right, found, 1e-7, "N")
    errors.append(found / tension - 1)
    print(f"{n:5}{found:20.6f}{errors[-1]:22.2e}")
ratio = errors[1] / errors[2]
check("twice the links, a fourth of the error", ratio, 4.0, 0.02)

swinging = chain(20)
q0 = np.diff(angles(pull_of(20), 20), prepend=0.0)
push = lw.Wrench(lambda t: [0, 0, 60.0 if t < 0.5 else 0.0, 0, 0, 0], breakpoints=[0.5])
run = lw.simulate(swinging, duration=3.0, every=0.02, q0=q0, wrenches={"link_5": push})
check("loops stay closed", float(lw.loop_gaps(swinging, run.position.values).max()), 0, 1e-11, "m")
print(f"at rest an anchor holds {tension:.5g} N")
if len(sys.argv) > 1:
    from picture import save

    sizes = np.sqrt((run.joint_load[..., :3] ** 2).sum("component"))
    curves = {name: sizes.sel(joint=name) for name in ("pin_0", "pin_10", "anchor")}
    save(sys.argv[1], run, [("force [N]", curves)], times=[0.0, 0.3, 0.8], tips={})
