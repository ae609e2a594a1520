"""Joints of several axes whose motion is given, in the tree and closing a loop: against the same
machine whose loop is cut at another joint."""

import numpy as np
import pytest

import linkwise as lw

POINTS = {"a": (0, 0, 0), "b": (0.4, 0.9, 0.2), "c": (1.3, 1.0, -0.3), "d": (1.5, 0.1, 0.4)}
BARS = {"first": "ab", "second": "bc", "third": "cd"}
AXES = {
    "revolute": {"axis": (0.1, 0.2, 1)},
    "cylindrical": {"axis": (1, 0.3, 0.2)},
    "universal": {"axes": [(0, 1, 0.2), (1, 0, 0)]},
    "planar": {"axis": (0, 0, 1)},
    "spherical": {},
}
R, C, U, P, S = AXES


def ring(cut, kinds, flat=False, **properties):
    """Four joints a, b, c, d, of the kinds named so, and three bars between them. The joint `cut`,
    c or d, closes the ring. All frames are parallel to the world's. flat: in the plane z = 0."""
    at = {name: np.array(p) * ([1, 1, 0] if flat else 1) for name, p in POINTS.items()}
    ends = {"a": ("base", "first"), "b": ("first", "second"), "c": ("second", "third")}
    ends["d"] = ("base", "third")
    origin = {"base": "a", "first": "a", "second": "b", "third": "d" if cut == "c" else "c"}
    builder = lw.ModelBuilder("ring", gravity=(0.7, -9.81, 0 if flat else 2.0))
    builder.add_link("base", mass=0)
    for k, (link, (one, other)) in enumerate(BARS.items()):
        builder.add_link(
            link,
            mass=1 + 0.3 * k,
            com=(at[one] + at[other]) / 2 - at[origin[link]],
            inertia=np.diag([0.3, 0.4, 0.5 + 0.1 * k]),
        )
    for name, (parent, child) in ends.items():
        kind = kinds[name]
        axes = {"axis": (0, 0, 1)} if flat else AXES[kind]
        where = {"translation": at[name] - at[origin[parent]], **axes, **properties.get(name, {})}
        if name == cut:
            where["child_translation"] = at[name] - at[origin[child]]
            builder.add_loop(name, kind, parent, child, **where)
        else:
            builder.add_joint(name, kind, parent, child, **where)
    return builder.build()


def of_joint(run, quantity, name):
    """A quantity of any joint (time, its coordinates), of the tree or not."""
    found = []
    for own in (quantity, f"loop_{quantity}"):
        values = run.dataset[own]
        dim = values.dims[1]
        labels = [str(label) for label in values[dim].values]
        found += [
            values.values[:, k] for k, label in enumerate(labels) if label.split(".")[0] == name
        ]
    return np.stack(found, axis=1)


def motion(*sizes):
    """Coordinates size (1 - cos 2 t) / 2, from rest."""

    def at(t):
        size = np.array(sizes) / 2
        return size * (1 - np.cos(2 * t)), 2 * size * np.sin(2 * t), 4 * size * np.cos(2 * t)

    return lw.Motion(at)


CASES = {
    "universal at the ground": ({"a": R, "b": C, "c": S, "d": U}, {"d": motion(0.3, -0.2)}),
    "universal between links": ({"a": R, "b": C, "c": U, "d": S}, {"c": motion(0.3, -0.2)}),
    "cylindrical at the ground": ({"a": U, "b": R, "c": S, "d": C}, {"d": motion(0.1, 0.3)}),
    "cylindrical between links": ({"a": R, "b": U, "c": C, "d": S}, {"c": motion(0.1, 0.3)}),
    "locked universal": ({"a": S, "b": C, "c": U, "d": S}, {"c": lw.Locked(), "b": 3.0}),
    "locked ball": ({"a": S, "b": R, "c": S, "d": S}, {"d": lw.Locked()}),
    "locked ball between links": ({"a": S, "b": R, "c": S, "d": S}, {"c": lw.Locked()}),
}
ROTORS = {"armature": 0.3, "damping": 0.2}


def both(kinds, drives, flat=False, **options):
    given = next(name for name, drive in drives.items() if isinstance(drive, lw.Motion | lw.Locked))
    options = {"duration": 0.6, "every": 0.1, "tolerance": 1e-10} | options
    models = [ring(cut, kinds, flat, **{given: ROTORS, "b": {"damping": 0.3}}) for cut in "cd"]
    return [lw.simulate(model, drives=drives, **options) for model in models]


def assert_alike(runs, kinds, components=slice(None)):
    for name, kind in kinds.items():
        quantities = ["velocity", "drive_torque", "drive_work"]
        for quantity in quantities if kind == S else ["position", *quantities]:
            one, other = (of_joint(run, quantity, name) for run in runs)
            size = 1 + np.abs(one).max()
            np.testing.assert_allclose(
                other, one, rtol=0, atol=2e-7 * size, err_msg=(quantity, name)
            )
        one, other = (run.joint_load.sel(joint=name).values[:, components] for run in runs)
        size = 1 + np.abs(one).max()
        np.testing.assert_allclose(other, one, rtol=0, atol=2e-6 * size, err_msg=name)
    for run in runs:
        balance = lw.loads.energy_balance(run)
        size = 1 + np.abs(balance.kinetic_energy).max() + np.abs(balance.drive_work).max()
        assert np.abs(balance.residual).max() < 1e-7 * size


@pytest.mark.parametrize("case", CASES)
def test_several_axes_follow_a_motion_wherever_the_loop_is_cut(case):
    kinds, drives = CASES[case]
    runs = both(kinds, drives)
    assert_alike(runs, kinds)
    given = next(iter(drives))
    for run in runs:
        held = of_joint(run, "drive_torque", given)
        assert np.abs(held).max(axis=0).min() > 0.1  # it takes a torque about every axis
        if isinstance(drives[given], lw.Locked):
            assert np.ptp(of_joint(run, "position", given), axis=0).max() < 1e-10
        else:
            want = np.stack([drives[given].value(t)[0] for t in run.time.values])
            np.testing.assert_allclose(of_joint(run, "position", given), want, atol=1e-11)


@pytest.mark.parametrize("case", CASES)
def test_their_loads_split_by_force_wherever_the_loop_is_cut(case):
    kinds, drives = CASES[case]
    runs = both(kinds, drives)
    shares = [lw.loads.split(run) for run in runs]
    for run, share in zip(runs, shares, strict=True):
        total = share.sum("cause", skipna=False).values
        np.testing.assert_allclose(total, run.joint_load.values, atol=1e-8 * np.abs(total).max())
    for name in kinds:
        one, other = (share.sel(joint=name).values for share in shares)
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-5 * (1 + np.abs(one).max()))


@pytest.mark.parametrize("planar", ["c", "d"])
def test_a_planar_joint_is_driven_in_the_plane(planar):
    """Of a planar chain of three hinges: its last bar is moved along the plane and turned."""
    kinds = {name: P if name == planar else R for name in POINTS}
    drives = {planar: motion(0.1, -0.15, 0.3)}
    runs = both(kinds, drives, flat=True)
    assert_alike(runs, kinds, components=[0, 1, 5])
    for run in runs:
        assert np.abs(of_joint(run, "drive_torque", planar)).max(axis=0).min() > 0.1


def test_what_holds_a_universal_joint_is_the_power_that_it_takes():
    """Of the given motion alone: the energy grows by torque times rate about both axes."""
    kinds, drives = CASES["universal at the ground"]
    run = both(kinds, drives, every=0.005)[1]
    rate, torque = (of_joint(run, name, "d") for name in ("velocity", "drive_torque"))
    from scipy.integrate import cumulative_simpson

    work = cumulative_simpson((rate * torque).sum(axis=1), x=run.time.values, initial=0)
    got = of_joint(run, "drive_work", "d").sum(axis=1)
    np.testing.assert_allclose(got, work, rtol=0, atol=1e-6 * (1 + np.abs(work).max()))
    assert np.abs(work).max() > 0.1


@pytest.mark.parametrize("case", ["universal at the ground", "cylindrical between links"])
def test_both_ways_to_accelerations_take_them(case):
    kinds, drives = CASES[case]
    model = ring("d", kinds, **{next(iter(drives)): ROTORS})
    options = {"duration": 0.3, "every": 0.1, "tolerance": 1e-9}
    first, second = (
        lw.simulate(model, drives=drives, method=method, **options)
        for method in ("articulated_body", "constraint_force")
    )
    for name in ("position", "joint_load", "drive_torque", "loop_drive_torque"):
        one, other = first.dataset[name].values, second.dataset[name].values
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-10 * (1 + np.abs(one).max()))


def test_motions_of_several_axes_that_loops_cannot_follow_are_named():
    kinds = {"a": R, "b": R, "c": S, "d": U}  # one way to move, and two coordinates given
    for cut in "cd":
        with pytest.raises(lw.SimulationError, match="motion of 'd' contradicts the loop that"):
            lw.simulate(ring(cut, kinds), duration=0.3, drives={"d": motion(0.3, -0.2)})
