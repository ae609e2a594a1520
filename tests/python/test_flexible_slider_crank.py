"""Simeon's slider-crank with a flexible connecting rod [simeon1996], from its mass integrals.

Of the published 24 values at 0.1 s, positions, velocities and the two forces between slider and
rod are put in; the tree of crank and rod then must answer with the seven accelerations and the
torque that turns the crank. In the published equations the axial mass matrix is 15 times that of
the shapes that are said (8, 1, 2 for 8/15, 1/15, 2/15), while what couples them to the rest is not.
"""

import numpy as np
import pytest

import linkwise as lw

CRANK, ROD = 0.15, 0.30  # m
ROD_MASS, SLIDER_MASS = 0.151104, 0.075552  # kg
E, WIDTH, DENSITY, SPEED = 0.2e12, 0.008, 7870.0, 150.0

# At 0.1 s: crank and rod angle, slider, bending by a half and a whole wave, two along the rod.
PHI1, PHI2, X3 = 15.0, -3.311734987910881e-01, 1.697373326718410e-01
Q = [1.893192460247178e-04, 2.375751865617931e-05, -5.323907988763734e-06, -8.363283141616840e-06]
DPHI2, DX3 = 6.025346682645789e01, -8.753116989887888e00
DQ = [-3.005536801092212e-02, -5.500488291932075e-03, 4.978243404809343e-04, 1.104933470696396e-03]
DDPHI2, DDX3 = 6.488722210234531e03, 2.167924253080623e03
DDQ = [3.391435115267547e01, 1.699107480197843e-01, -1.415799354959001e00, 9.903251655235532e-01]
FORCE = [-1.637910131687472e02, 6.232893262533717e01]  # on the rod's end, along the world's x, y
TORQUE = (
    -2.529853213732781e01
)  # on the crank: published are multipliers, whose forces are - G^T lambda


def connecting_rod():
    """Hinged at both ends in its frame, which is the chord: half and whole sine waves across, and
    4 s (1 - s), s (2 s - 1) along."""
    node, weight = np.polynomial.legendre.leggauss(30)
    s, share = (node + 1) / 2, ROD_MASS * weight / 2
    across = np.array([np.sin(np.pi * s), np.sin(2 * np.pi * s)])
    along = np.array([4 * s * (1 - s), s * (2 * s - 1)])
    phi = np.zeros((4, len(s), 3))
    phi[:2, :, 1], phi[2:, :, 0] = across, along
    r = np.outer(s, [ROD, 0, 0])
    product = np.einsum("g,kgx,lgy->klxy", share, phi, phi)
    product[2:, 2:] *= 15
    pull, wave = E * WIDTH**2 / ROD, np.pi**4 / 24 * (WIDTH / ROD) ** 2
    stiffness = np.zeros((4, 4))
    stiffness[:2, :2] = pull * np.diag([wave, 16 * wave])
    stiffness[2:, 2:] = pull / 3 * np.array([[16, -8], [-8, 7]])
    turn = np.zeros((3, 4))
    turn[2, :2] = np.pi / ROD * np.array([-1, 2])
    side = ROD_MASS * WIDTH**2 / 12
    return lw.FlexibleBody.from_invariants(
        mass=ROD_MASS,
        first_moment=[ROD_MASS * ROD / 2, 0, 0],
        second_moment=np.diag([ROD_MASS * ROD**2 / 3, side, side]),
        shape_mass=np.einsum("g,kgx->xk", share, phi),
        shape_moment=np.einsum("g,gx,kgy->kxy", share, r, phi),
        shape_product=product,
        stiffness=stiffness,
        outboard=[ROD, 0, 0],
        outboard_shift=[[0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0]],
        outboard_turn=turn,
    )


@pytest.fixture
def machine():
    builder = lw.ModelBuilder("slider-crank", gravity=(0, 0, 0))
    builder.add_link("ground")
    builder.add_link("crank", mass=0.36, inertia=0.002727 * np.eye(3))
    builder.add_link("rod")
    builder.add_joint("drive", "revolute", "ground", "crank", axis=(0, 0, 1))
    pin = {"axis": (0, 0, 1), "translation": (CRANK, 0, 0)}
    builder.add_joint("pin", "revolute", "crank", "rod", **pin)
    body = connecting_rod()
    builder.make_flexible("rod", body=body)
    model = builder.build().prescribe(["drive"])
    q = np.array([PHI1, PHI2 - PHI1, *np.linalg.solve(body.basis, Q)])
    v = np.array([SPEED, DPHI2 - SPEED, *np.linalg.solve(body.basis, DQ)])
    return model, body, q, v


def test_the_rod_ends_at_the_slider(machine):
    model, _, q, v = machine
    end = model.link_names.index("rod:end")
    assert lw.link_poses(model, q)[end, :3, 3] == pytest.approx([X3, 0, 0], abs=1e-12)
    step = 1e-6
    ahead = lw.link_poses(model, q + step * v)[end, :3, 3]
    behind = lw.link_poses(model, q - step * v)[end, :3, 3]
    assert (ahead - behind) / (2 * step) == pytest.approx([DX3, 0, 0], abs=1e-7)


def test_accelerations_are_the_published_ones(machine):
    model, body, q, v = machine
    assert FORCE[0] == pytest.approx(-SLIDER_MASS * DDX3, rel=1e-9)
    R = lw.link_poses(model, q)[model.link_names.index("rod:end"), :3, :3]
    external = np.zeros((len(model.joint_names), 6))
    external[list(model.joint_names).index("rod:1"), :3] = R.T @ [*FORCE, 0]
    passive = lw.passive_torque(model, q, v)
    du = lw.forward_dynamics(model, q, v, passive, external=external)
    assert du[1] == pytest.approx(DDPHI2, rel=1e-7)
    # Published with errors below 1e-9 of the forces of stiffness, omega^2 q, that cancel here.
    scale = (2 * np.pi * body.frequencies.max()) ** 2 * np.abs(Q).max()
    assert body.basis @ du[2:] == pytest.approx(DDQ, abs=1e-9 * scale)
    assert (body.basis @ du[2:])[2:] == pytest.approx(DDQ[2:], rel=1e-4)
    tau = lw.inverse_dynamics(model, q, v, du, external=external)
    assert tau[0] == pytest.approx(TORQUE, rel=1e-7)
