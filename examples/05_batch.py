"""Ten thousand states in one call: accelerations of torques of accelerations are the same again.

Run it by: python examples/05_batch.py
"""

import time

import numpy as np
from checked import check

import linkwise as lw

COUNT = 10_000
model = lw.scenes.ssrms(gravity=(0, 0, -9.81))
rng = np.random.default_rng(7)
q, v, a = rng.uniform(-1, 1, (3, COUNT, model.nv))

torques = lw.inverse_dynamics(model, q, v, a)
started = time.perf_counter()
again = lw.forward_dynamics(model, q, v, torques)
spent = time.perf_counter() - started
check("largest difference in acceleration", np.abs(again - a).max(), 0.0, 1e-9, "rad/s^2")

# Leading axes broadcast: one configuration, many velocities.
loads = lw.joint_loads(model, q[0], v)
check("joints with six components each", float(np.prod(loads.shape[1:])), 6.0 * model.n_joints, 0)

# The mass matrix belongs to the same mechanics: H (a1 - a0) = tau.
tau = rng.uniform(-1, 1, model.nv)
response = lw.forward_dynamics(model, q[0], v[0], tau) - lw.forward_dynamics(model, q[0], v[0])
residual = np.abs(lw.mass_matrix(model, q[0]) @ response - tau).max()
check("H (a1 - a0) - tau", residual, 0.0, 1e-10, "N m")
print(f"{COUNT} evaluations of a {model.nv}-joint arm in {1e3 * spent:.1f} ms")
