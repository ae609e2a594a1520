"""Ten machines in motion, and how often the stated bounds of their peak loads hold."""

import functools

import numpy as np

import linkwise as lw
from helpers.loaded_arm import arm, profile
from helpers.machines import babyboot, pendulum, rod_chain, srms_3l5d


def _double_pendulum():
    return {"model": rod_chain(2), "duration": 2.0}


def _crane():
    model = lw.scenes.srms(payload_mass=50.0, gravity=(0, 0, -9.81))
    drives = {name: lw.PD(kp=2e5, kd=4e4) for name in model.joint_names}
    drives["shoulder_yaw"] = lw.Motion(profile(0.5, 2.0))
    return {"model": model, "duration": 2.0, "drives": drives}


def _tumbling():
    model = rod_chain(3, floating=True)
    return {"model": model, "duration": 2.0, "v0": [0, 0, 0, 0.1, 2.0, 0.5, 1.0, -2.0]}


def _everything():
    return {
        "model": arm(),
        "duration": 1.0,
        "drives": {"shoulder": lw.Motion(profile(0.8, 1.0)), "elbow": 3.0},
        "wrenches": {"hand": lw.Wrench([5.0, -3.0, 2.0, 0.1, 0.2, -0.3])},
    }


def _swung(model, torque):
    drives = {model.joint_names[0]: lambda t, q, v: torque * np.cos(3 * t) * np.ones(v.size)}
    return {"model": model, "duration": 2.0, "drives": drives}


SCENES = {
    "pendulum let go": lambda: {"model": pendulum(), "duration": 3.0},
    "double pendulum": _double_pendulum,
    "chain of 8 hinges": lambda: {"model": rod_chain(8), "duration": 1.5},
    "chain of 6 ball joints": lambda: {
        "model": lw.scenes.chain(6, joint="spherical"),
        "duration": 1.0,
        "v0": 0.5 * np.ones(18),
    },
    "babyboot": lambda: {"model": babyboot(), "duration": 2.0, "q0": [1.0, 0.1]},
    "three rods tumbling freely": _tumbling,
    "three links, five freedoms": lambda: _swung(srms_3l5d(), 100.0),
    "Shuttle arm under gravity": _crane,
    "arm with stops and friction": lambda: _swung(arm(), 10.0),
    "arm with every cause": _everything,
}
TOLERANCE = 1e-5


@functools.lru_cache
def coverage(scene):
    """Peaks within their bounds, all peaks, and the largest error in units of its bound."""
    options = SCENES[scene]()
    options["every"] = options["duration"] / 200

    def simulated(tolerance):
        return lw.simulate(**options, tolerance=tolerance)

    run, tighter, truth = simulated(TOLERANCE), simulated(TOLERANCE / 100), simulated(1e-11)
    bound = lw.loads.bounds(run, tighter).plus_minus.values
    error = np.abs(lw.loads.summary(run).peak.values) - np.abs(lw.loads.summary(truth).peak.values)
    known = np.isfinite(bound)
    # What no run can do better: the tightest one's own error.
    floor = 1e-9 * np.nanmax(np.abs(lw.loads.summary(truth).peak.values))
    ratio = np.abs(error[known]) / (bound[known] + floor)
    return int((ratio <= 1).sum()), int(known.sum()), float(ratio.max())
