"""A free-floating tree of 31 bodies whose joints are driven: its momenta do not notice.

Run it by: python examples/07_free_floating.py
"""

import numpy as np
from checked import check

import linkwise as lw

model = lw.scenes.tree(31, branching=2, floating_base=True, gravity=(0, 0, 0))
rng = np.random.default_rng(3)
q0 = model.neutral_configuration()
v0 = rng.uniform(-0.3, 0.3, model.nv)
before = lw.momentum(model, q0, v0)


def wave(t, q, v):
    """A torque [N m] of the joint's own making; q and v are the joint's alone."""
    return 0.5 * np.sin(3 * t) - 0.2 * v


drives = dict.fromkeys(model.joint_names[1:5], wave)
drives[model.joint_names[5]] = lw.PD(kp=20, kd=4, target=0.5)
run = lw.simulate(model, duration=5, every=1, drives=drives, q0=q0, v0=v0, tolerance=1e-9)

q, v = run.position.values[-1], run.velocity.values[-1]
after = lw.momentum(model, q, v)
check("linear momentum, largest change", np.abs(after - before)[:3].max(), 0, 1e-6, "N s")
check("angular momentum, largest change", np.abs(after - before)[3:].max(), 0, 1e-6, "N m s")
base = run.joint_load.isel(joint=0)
check("load of the floating base's joint", np.abs(base.values).max(), 0, 1e-9, "N, N m")
