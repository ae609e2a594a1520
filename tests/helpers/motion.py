"""Simulated motions as plain arrays."""

import numpy as np

import linkwise as lw


def simulate(model, duration, *, q0=None, v0=None, every=None, method="auto", **options):
    """Times, positions and velocities of a run sampled at `every` (start and end by default)."""
    options.setdefault("record", ["position", "velocity"])
    run = lw.simulate(
        model,
        duration=duration,
        q0=model.neutral_configuration() if q0 is None else np.asarray(q0, float),
        v0=np.zeros(model.nv) if v0 is None else np.asarray(v0, float),
        every=duration if every is None else every,
        numerics=lw.Numerics(method=method),
        **options,
    )
    assert run.outcome == "converged", run.outcome
    return run.time.values, run.position.values, run.velocity.values


def final_state(model, duration, **options):
    _, q, v = simulate(model, duration, **options)
    return q[-1], v[-1]
