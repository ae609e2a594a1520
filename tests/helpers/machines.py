"""Machines with known motions or loads (planar ones move in the x-y plane, gravity along -y)."""

import numpy as np

import linkwise as lw

G = 9.81
DOWN_Y = (0.0, -G, 0.0)


def rod_inertia(mass, length, radius):
    """Central inertia of a uniform solid cylinder along x [kg m2]."""
    across = mass * (3 * radius**2 + length**2) / 12
    return np.diag([mass * radius**2 / 2, across, across])


def pendulum(distance=1.0):
    """Unit mass whose equivalent length is 1 m: a point at distance 1, a plate when nearer."""
    swing = distance * (1.0 - distance)  # I_c + m d^2 = m d * 1
    builder = lw.ModelBuilder("pendulum", gravity=DOWN_Y)
    builder.add_link("ground")
    builder.add_link("bob", mass=1.0, com=(distance, 0, 0), inertia=swing * np.diag([0.5, 0.5, 1]))
    builder.add_joint("pivot", "revolute", "ground", "bob")
    return builder.build()


def stopped_rod(*, reach=1.0, inertia=0.01, **limits):
    """1 kg at `reach` on a hinge, which falls onto the stop that `limits` describe."""
    builder = lw.ModelBuilder("stopped rod")
    builder.add_link("ground")
    builder.add_link("rod", mass=1.0, com=(reach, 0, 0), inertia=inertia * np.eye(3))
    builder.add_joint("hinge", "revolute", "ground", "rod", axis=(0, 1, 0), **limits)
    return builder.build()


def stopped_arm(stiffness=1e8):
    """Two links that fall into a stiff stop."""
    builder = lw.ModelBuilder("stopped")
    builder.add_link("base")
    builder.add_link("upper", mass=4.0, com=(0.2, 0, 0.1), inertia=np.diag([0.1, 0.2, 0.2]))
    builder.add_link("fore", mass=2.0, com=(0.3, 0.1, 0), inertia=np.diag([0.05, 0.1, 0.1]))
    limits = {"lower": -0.5, "upper": 0.5, "limit_stiffness": stiffness}
    builder.add_joint("shoulder", "revolute", "base", "upper", axis=(0, 1, 0), **limits)
    builder.add_joint("elbow", "revolute", "upper", "fore", axis=(0, 1, 0), translation=(0.5, 0, 0))
    return builder.build()


def rod_chain(n, *, gravity=DOWN_Y, floating=False):
    """n unit rods end to end along x, hinged about z."""
    builder = lw.ModelBuilder(f"{n} rods", gravity=gravity)
    if not floating:
        builder.add_link("ground")
    # A thin rod's central inertia about its own axis is any small number: it never turns about it.
    inertia = np.diag([1e-3, 1 / 12, 1 / 12])
    for k in range(n):
        builder.add_link(f"rod{k}", mass=1.0, com=(0.5, 0, 0), inertia=inertia)
        if k == 0 and floating:
            builder.set_floating_base("base")
        else:
            parent = f"rod{k - 1}" if k else "ground"
            offset = (1.0 if k else 0.0, 0, 0)
            builder.add_joint(f"hinge{k}", "revolute", parent, f"rod{k}", translation=offset)
    return builder.build()


def rod_tip(q):
    """Tip of a rod chain from its relative angles (..., n): (..., 2)."""
    angle = np.cumsum(q, axis=-1)
    return np.stack([np.cos(angle).sum(-1), np.sin(angle).sum(-1)], axis=-1)


def babyboot():
    """Kane's babyboot, as in Drake's multibody benchmarks: rod A about x, plate B about A's z."""
    gram_cm2 = 1e-7
    builder = lw.ModelBuilder("babyboot", gravity=(0, 0, -G))
    builder.add_link("ground")
    for name, mass, depth, inertia in [
        ("rod", 0.010, 0.075, (50, 50, 1)),  # only Ixx of the rod matters
        ("plate", 0.100, 0.200, (2500, 500, 2000)),
    ]:
        builder.add_link(name, mass=mass, com=(0, 0, -depth), inertia=gram_cm2 * np.diag(inertia))
    builder.add_joint("swing", "revolute", "ground", "rod", axis=(1, 0, 0))
    builder.add_joint("twist", "revolute", "rod", "plate", axis=(0, 0, 1))
    return builder.build()


def free_body(inertia=(1.0, 2.0, 3.0)):
    builder = lw.ModelBuilder("free body", gravity=(0, 0, 0))
    builder.add_link("body", mass=1.0, inertia=np.diag(inertia))
    builder.set_floating_base("base")
    return builder.build()


SRMS_RODS = [(6.377, 139.35, 0.17), (7.06, 87.42, 0.17), (1.88, 99.63, 0.20)]  # m, kg, m


def srms_3l5d():
    """Shuttle-arm lengths and masses [Nguyen & Hughes 1994] as 3 solid rods with 5 freedoms."""
    builder = lw.ModelBuilder("srms-3l5d", gravity=(0, 0, 0))
    builder.add_link("orbiter")
    names = ["upper_arm", "lower_arm", "hand"]
    for name, (length, mass, radius) in zip(names, SRMS_RODS, strict=True):
        inertia = rod_inertia(mass, length, radius)
        builder.add_link(name, mass=mass, com=(length / 2, 0, 0), inertia=inertia)
    y, z = (0, 1, 0), (0, 0, 1)
    builder.add_joint("shoulder", "universal", "orbiter", "upper_arm", axes=[z, y])
    upper, lower = ((rod[0], 0, 0) for rod in SRMS_RODS[:2])
    builder.add_joint("elbow", "revolute", "upper_arm", "lower_arm", axis=y, translation=upper)
    builder.add_joint("wrist", "universal", "lower_arm", "hand", axes=[y, z], translation=lower)
    return builder.build()
