"""Elastic links as they bend, and the loads inside them: against closed forms and one another."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.loads.bent import beams_of, row_of, section_frames, spread
from linkwise.loads.sections import extreme_stress, fibres, stress_at

E, G = 210e9, 80e9
LENGTH, TIP_MASS = 4.0, 3.0
BOX = lw.Section.box(0.06, 0.10, 0.004)


def cantilever(section=BOX, *, mass=0.01, bodies=1, tip_mass=TIP_MASS, gravity=(0, 0, -9.81)):
    """A light beam along x, welded to a wall, with a mass at its end."""
    builder = lw.ModelBuilder("cantilever", gravity=gravity)
    builder.add_link("wall")
    builder.add_link("beam", mass=mass)
    builder.add_link("weight", mass=tip_mass, inertia=np.eye(3) * 1e-6)
    builder.add_joint("root", "fixed", "wall", "beam")
    builder.add_joint("hook", "fixed", "beam", "weight", translation=(LENGTH, 0, 0))
    builder.make_flexible("beam", section=section, E=E, G=G, bodies=bodies, interior_modes=1)
    return builder.build()


def at_rest(model):
    """The position in which nothing accelerates, by Newton's method on differences."""
    q, rest = np.zeros(model.nq), np.zeros(model.nv)

    def residual(q):
        return lw.inverse_dynamics(model, q, rest, rest) - lw.passive_torque(model, q, rest)

    for _ in range(6):
        step = 1e-6 * np.eye(model.nq)
        slope = np.array([(residual(q + e) - residual(q - e)) / 2e-6 for e in step]).T
        q = q - np.linalg.solve(slope, residual(q))
    return q


def crane(bodies=2, **given):
    builder = lw.ModelBuilder("crane")
    builder.add_link("tower")
    builder.add_link("jib", mass=240.0)
    builder.add_link("load", mass=500.0, com=(0.1, 0, -1), inertia=np.diag([20.0, 20, 20]))
    slew = {"axis": (0, 0, 1), "translation": (0, 0, 20), "damping": 2000}
    builder.add_joint("slew", "revolute", "tower", "jib", **slew)
    builder.add_joint("hook", "revolute", "jib", "load", axis=(0, 1, 0), translation=(12, 1, 0.5))
    section = given.pop("section", lw.Section.box(0.3, 0.4, 0.008))
    builder.make_flexible("jib", section=section, E=E, G=G, damping=0.02, bodies=bodies, **given)
    return builder.build()


@pytest.fixture(scope="module")
def run():
    return lw.simulate(
        crane(),
        duration=0.6,
        every=0.01,
        tolerance=1e-7,
        drives={"slew": lw.Torque(4000)},
        wrenches={"jib:end": [300.0, -200.0, 100.0, 5.0, 0.0, 0.0]},
    )


@pytest.mark.parametrize("bodies", [1, 3])
def test_the_last_section_is_the_frame_of_the_end(bodies):
    model = crane(bodies)
    q = np.random.default_rng(bodies).normal(size=(5, model.nq)) * 0.05
    places = spread(row_of(model, "jib"), model.beam_lengths, 7)
    frames, _ = section_frames(model, *places[:2], q)
    end = lw.link_poses(model, q)[:, model.link_names.index("jib:end")]
    assert frames[:, -1] == pytest.approx(end, abs=1e-12)
    start = lw.joint_poses(model, q)[:, 0, :3, 3]
    assert frames[:, 0, :3, 3] == pytest.approx(start, abs=1e-12)


def test_sections_stay_together_where_two_beams_meet():
    model = crane(3)
    q = np.random.default_rng(3).normal(size=model.nq) * 0.05
    third = model.beam_lengths["jib"]
    frames, _ = section_frames(model, ["jib", "jib:2"], [third, 0.0], q)
    assert frames[0] == pytest.approx(frames[1], abs=1e-12)


@pytest.mark.parametrize("bodies", [1, 2])
def test_a_loaded_cantilever_bends_in_the_cubic_of_beam_theory(bodies):
    """w = F x^2 (3 L - x) / 6 EI, slope F x (2 L - x) / 2 EI, moment F (L - x). It bends by
    2e-4 of its length, so that what is of second order is 1e-7 of that."""
    model = cantilever(mass=1e-9, bodies=bodies, tip_mass=0.1)
    q = at_rest(model)
    links, places, x = spread(row_of(model, "beam"), model.beam_lengths, 9)
    frames, strains = section_frames(model, links, places, q)
    force, EI = 0.1 * 9.81, E * BOX.Iy
    sag = force * x**2 * (3 * LENGTH - x) / (6 * EI)
    assert frames[:, 2, 3] == pytest.approx(-sag, abs=1e-6 * sag[-1])
    slope = force * x * (2 * LENGTH - x) / (2 * EI)
    assert frames[:, 2, 0] == pytest.approx(-slope, abs=1e-6 * slope[-1])
    moment = force * (LENGTH - x)
    assert -strains[:, 2] == pytest.approx(moment, abs=1e-6 * moment[0])


def statics(section, weight=(0, 0, -9.81)):
    """Section loads (9, 6) of a cantilever at rest, and its beam's numbers."""
    from linkwise import _core

    model = cantilever(section, gravity=weight)
    q, rest = at_rest(model), np.zeros(model.nv)
    load = lw.joint_loads(model, q, rest, lw.passive_torque(model, q, rest))
    links, places, x = spread(row_of(model, "beam"), model.beam_lengths, 9)
    found = _core.section_loads(model, links, places, q, rest, rest, load)
    return x, found[:, :6], _core.beam_properties(model)["beam"]


SECTIONS = {
    "round": (lw.Section.round(0.08), 0.04, 0.04),
    "tube": (lw.Section.tube(0.08, 0.004), 0.04, 0.04),
    "rectangle": (lw.Section.rectangle(0.05, 0.07), 0.025, 0.035),
    "box": (BOX, 0.03, 0.05),
}


@pytest.mark.parametrize("name", SECTIONS)
def test_fibre_stress_is_that_of_beam_theory(name):
    """M c / I at the wall under a weight at the end, about either axis, tension above."""
    section, y, z = SECTIONS[name]
    moment = 9.81 * (TIP_MASS * LENGTH + 0.01 * LENGTH / 2)
    x, load, of = statics(section)
    low, high = extreme_stress(load, of)
    want = moment * z / section.Iy
    assert high[0] == pytest.approx(want, rel=1e-4)
    assert low[0] == pytest.approx(-want, rel=1e-4)
    above = stress_at(load, of, np.array([0.0, 0.0]), np.array([z, -z]))
    assert above[0] == pytest.approx([want, -want], rel=1e-4)
    # At the end no more than what of the weight is along the beam, which sags by some 1e-3.
    assert abs(above[-1]).max() < 0.01 * 9.81 * TIP_MASS / section.area
    assert x[-1] == LENGTH
    sideways = statics(section, (0, 9.81, 0))[1]
    right = stress_at(sideways, of, np.array([y, -y]), np.zeros(2))
    assert right[0] == pytest.approx(moment * y / section.Iz * np.array([-1, 1]), rel=1e-4)
    hung = statics(section, (9.81, 0, 0))[1]
    pulled = extreme_stress(hung, of)
    assert pulled[0][0] == pytest.approx(9.81 * (TIP_MASS + 0.01) / section.area, rel=1e-9)
    assert pulled[1][0] == pytest.approx(pulled[0][0], rel=1e-9)


def test_extreme_stresses_are_those_of_the_fibres():
    rng = np.random.default_rng(1)
    load = rng.normal(size=(50, 6)) * [1e4, 1, 1, 1, 1e3, 1e3]
    of_box, of_round = (
        {
            "EA": E * s.area,
            "EIy": E * s.Iy,
            "EIz": E * s.Iz,
            "area": s.area,
            "width": s.width,
            "height": s.height,
            "round": s.shape == "round",
        }
        for s in (BOX, lw.Section.tube(0.08, 0.004))
    )
    for of, rel in ((of_box, 1e-12), (of_round, 0.01)):  # 24 points miss 1 - cos 7.5 degrees
        low, high = extreme_stress(load, of)
        at = stress_at(load, of, *fibres(of))
        assert high == pytest.approx(at.max(axis=1), rel=rel, abs=rel * abs(at).max())
        assert low == pytest.approx(at.min(axis=1), rel=rel, abs=rel * abs(at).max())


def test_peaks_and_envelopes_are_those_of_the_section_loads(run):
    found = lw.loads.section_summary(run, "jib", 5)
    load = lw.loads.section_loads(run, "jib", 5)
    for name in load.component.values:
        own = load.section_load.sel(component=name)
        here = found.sel(quantity=name)
        assert here.maximum.values == pytest.approx(own.max("time").values)
        assert here.minimum.values == pytest.approx(own.min("time").values)
        assert abs(float(here.peak)) == float(abs(own).max())
        when, where = float(here.peak_time), int(np.argmin(abs(found.x - here.peak_x).values))
        assert float(own.sel(time=when)[where]) == float(here.peak)
        off = load.discretisation_error.sel(component=name).sel(time=when)[where]
        assert float(here.peak_error) == pytest.approx(float(off), nan_ok=True)
    stress = found.sel(quantity="stress")
    assert stress.maximum.values == pytest.approx(load.highest_stress.max("time").values)
    assert stress.minimum.values == pytest.approx(load.lowest_stress.min("time").values)
    assert list(found.quantity_units.values[[0, 3, 6]]) == ["N", "N m", "Pa"]


def test_the_first_section_is_the_inboard_joint(run):
    """In the beam's axes, whose x goes to where the load hangs."""
    load = lw.loads.section_loads(run, "jib", 3).section_load[:, 0].values
    frames = section_frames(run.load_model(), ["jib"], [0.0], np.asarray(run.position))[0][:, 0]
    joint = lw.joint_poses(run.load_model(), np.asarray(run.position))[:, 0]
    turn = np.swapaxes(frames[:, :3, :3], 1, 2) @ joint[:, :3, :3]
    given = run.joint_load.sel(joint="slew").values.reshape(-1, 2, 3)
    want = np.einsum("tij,thj->thi", turn, given).reshape(-1, 6)
    assert load == pytest.approx(want, abs=1e-9 * abs(want).max())


def test_causes_add_up_to_the_section_load(run):
    shares = lw.loads.section_split(run, "jib", 4)
    whole = lw.loads.section_loads(run, "jib", 4).section_load
    assert list(shares.cause.values) == ["gravity", "velocity", "acceleration", "external"]
    assert shares.sum("cause").values == pytest.approx(
        whole.values, abs=1e-11 * float(abs(whole).max())
    )
    # All weight outboard of the middle, whatever the motion; the wrench is on the end.
    lifted = np.linalg.norm(shares.sel(cause="gravity", component=["fx", "fy", "fz"])[:, 0], axis=1)
    assert lifted == pytest.approx(740 * 9.81, rel=1e-5)
    pulled = shares.sel(cause="external", component=["fx", "fy", "fz"])
    assert np.linalg.norm(pulled, axis=-1) == pytest.approx(np.linalg.norm([300, 200, 100]))


def test_damage_is_counted_at_the_worst_fibre(run):
    pytest.importorskip("rainflow")
    found = lw.loads.section_damage(run, "jib", 3, exponents=[4], repetitions=1000)
    load = lw.loads.section_loads(run, "jib", 3).section_load.values
    width, height, section = 0.3, 0.4, lw.Section.box(0.3, 0.4, 0.008)
    import rainflow

    ranges = []
    for y, z in ((0.15, 0.2), (0.15, -0.2), (-0.15, 0.2), (-0.15, -0.2)):
        one = -load[:, 0, 0] / section.area
        one = one - load[:, 0, 4] * z / section.Iy + load[:, 0, 5] * y / section.Iz
        damage = sum(cycle[2] * cycle[0] ** 4 for cycle in rainflow.extract_cycles(one))
        ranges.append((damage / 1000) ** 0.25)
    assert (width, height) == (0.3, 0.4)
    assert float(found.sel(quantity="stress")[0, 0]) == pytest.approx(max(ranges))
    ny = sum(cycle[2] * cycle[0] ** 4 for cycle in rainflow.extract_cycles(load[:, 1, 4]))
    assert float(found.sel(quantity="ny")[0, 1]) == pytest.approx((ny / 1000) ** 0.25)


def test_margins_are_of_the_peaks_with_their_errors(run):
    summary = lw.loads.section_summary(run, "jib", 5)
    found = lw.loads.section_margins(summary, lw.loads.SectionRating(stress=2e8, fz=1e4))
    assert list(found.quantity.values) == ["fz", "stress"]
    stress = summary.sel(quantity="stress")
    use = (abs(float(stress.peak)) + float(stress.peak_error)) / 2e8
    assert float(found.use[1]) == pytest.approx(use)
    assert float(found.margin[1]) == pytest.approx(1 / use - 1)
    assert float(found.use[0]) == pytest.approx(abs(float(summary.peak.sel(quantity="fz"))) / 1e4)


def test_deflections_are_where_the_sections_are(run):
    """Straight line and deflection put each section where its frame is; the end's turn is that of
    the elastic joints."""
    found = lw.loads.section_deflections(run, "jib", 5)
    model, q = run.load_model(), np.asarray(run.position)
    frames = section_frames(model, *spread(row_of(model, "jib"), model.beam_lengths, 5)[:2], q)[0]
    straight = np.zeros((5, 3))
    straight[:, 0] = found.x
    local = straight + found.deflection.values
    start = frames[:, 0]
    world = start[:, None, :3, 3] + np.einsum("tij,tsj->tsi", start[:, :3, :3], local)
    assert world == pytest.approx(found.point.values, abs=1e-12)
    end = lw.link_poses(model, q)[:, model.link_names.index("jib:end")]
    assert found.point[:, -1].values == pytest.approx(end[:, :3, 3], abs=1e-12)
    turns = found.turn[:, -1].values
    for turn, begun, ended in zip(turns[5::20], start[5::20], end[5::20], strict=True):
        angle = np.linalg.norm(turn)
        K = np.cross(np.eye(3), turn / angle)
        R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
        assert pytest.approx(begun[:3, :3].T @ ended[:3, :3], abs=1e-12) == R
    assert abs(found.deflection[:, 0].values).max() == 0


def test_strain_energy_is_the_work_that_bent_it():
    """F^2 L^3 / 6 EI of a cantilever at rest, half of force times deflection."""
    from linkwise.loads.deflections import strain_energy

    for bodies in (1, 3):
        model = cantilever(mass=1e-9, bodies=bodies, tip_mass=0.1)
        force = 0.1 * 9.81
        found = strain_energy(model, "beam", bodies, at_rest(model))
        assert found == pytest.approx(force**2 * LENGTH**3 / (6 * E * BOX.Iy), rel=1e-5)


def test_general_sections_have_stresses_where_their_sizes_are_given():
    plain = {"area": 0.01, "Iy": 2e-4, "Iz": 1e-4, "J": 1e-4}
    drives = {"duration": 0.02, "every": 0.01, "drives": {"slew": lw.Torque(4000)}}
    bare = lw.simulate(crane(section=lw.Section(**plain)), **drives)
    sized = lw.simulate(crane(section=lw.Section(**plain, width=0.3, height=0.4)), **drives)
    assert "highest_stress" not in lw.loads.section_loads(bare, "jib")
    summary = lw.loads.section_summary(bare, "jib")
    assert "stress" not in summary.quantity
    with pytest.raises(lw.InputError, match="has no outer sizes; give Section"):
        lw.loads.section_margins(summary, lw.loads.SectionRating(stress=1e8))
    found = lw.loads.section_loads(sized, "jib")
    load = found.section_load.values
    bending = abs(load[..., 4]) * 0.2 / 2e-4 + abs(load[..., 5]) * 0.15 / 1e-4
    assert found.highest_stress.values == pytest.approx(-load[..., 0] / 0.01 + bending)


def test_bad_input_is_one_line(run):
    for call, message in (
        (
            lambda: lw.loads.section_summary(run, "tower"),
            "link 'tower' is not an elastic beam; the",
        ),
        (lambda: lw.loads.section_deflections(run, "jib", True), "n: is True; give a number"),
        (lambda: lw.loads.section_split(run, "jip"), "did you mean 'jib'"),
        (lambda: lw.loads.section_damage(run, "jib", 1), "n: is 1; give a number of sections"),
        (lambda: lw.loads.section_loads(run, 3), "link: is 3; give the name"),
        (lambda: lw.loads.section_damage(run, "jib", 3, [0.0]), "exponents: give positive"),
        (lambda: lw.loads.SectionRating(stress=-1), "rating stress: is -1; give a positive"),
        (lambda: lw.loads.SectionRating(ny="x"), "rating ny: 'x' is not a number"),
        (lambda: lw.Section(area=1, Iy=1, Iz=1, J=1, width=1), "height of a section is 0"),
        (
            lambda: lw.Section(area=1, Iy=1, Iz=1, J=1, width=1, height=2, shape="round"),
            "give its diameter as both",
        ),
        (
            lambda: lw.Section(area=1, Iy=1, Iz=1, J=1, shape="oval"),
            "shape of a section: 'oval' is unknown",
        ),
    ):
        with pytest.raises(lw.InputError, match=message) as caught:
            call()
        assert "\n" not in str(caught.value)


def test_batches_go_member_by_member():
    """Members in front; each as a run of its own."""
    options = {"duration": 0.05, "every": 0.01, "integrator": "runge_kutta_4", "step": 1e-4}
    model = crane(1, interior_modes=0, stretches=False)
    v0 = np.zeros((2, model.nv))
    v0[1, model.v_slice("slew")] = 0.5
    batch = lw.simulate_batch(model, v0=v0, **options)
    alone = lw.simulate(model, v0=v0[1], **options)
    for function in (
        lw.loads.section_loads,
        lw.loads.section_summary,
        lw.loads.section_split,
        lw.loads.section_deflections,
    ):
        both, one = function(batch, "jib", 3, model), function(alone, "jib", 3)
        if function is lw.loads.section_summary:
            rating = lw.loads.SectionRating(stress=2e8, ny=1e5)
            use = lw.loads.section_margins(both, rating).use
            assert use.dims == ("member", "quantity")
            want = lw.loads.section_margins(one, rating).use.values
            assert use[1].values == pytest.approx(want, rel=1e-6)
        if hasattr(both, "data_vars"):
            name = next(iter(one.data_vars))
            both, one = both[name], one[name]
        assert both.dims == ("member", *one.dims)
        scale = float(abs(one).max())
        assert both[1].values == pytest.approx(one.values, abs=1e-6 * scale)


def test_rows_are_found_by_the_name_that_was_made_flexible():
    assert beams_of(crane(3)) == {"jib": ["jib", "jib:2", "jib:3"]}
    assert beams_of(lw.scenes.chain(3)) == {}


class TestPieces:
    """What the view draws."""

    def test_pieces_follow_the_centre_line(self):
        from linkwise.view.beams import MOST_PIECES, Beams

        model = crane(2)
        q = np.random.default_rng(5).normal(size=model.nq) * 0.05
        beams = Beams(model)
        found = beams.at(lw.link_poses(model, q), q)
        assert beams.count == MOST_PIECES
        along = found.rotations[:, :, 2] * found.lengths[:, None] / 2
        ends = found.middles + along
        assert ends[:-1] == pytest.approx((found.middles - along)[1:], abs=1e-12)
        end = lw.link_poses(model, q)[model.link_names.index("jib:end"), :3, 3]
        assert ends[-1] == pytest.approx(end, abs=1e-12)
        assert np.linalg.det(found.rotations) == pytest.approx(1)
        assert beams.sizes[0] == pytest.approx([0.3, 0.4])

    def test_the_largest_moment_is_that_at_the_wall(self):
        from linkwise.view.beams import Beams

        model = cantilever()
        q = at_rest(model)
        found = Beams(model).at(lw.link_poses(model, q), q)
        assert int(np.argmax(found.moments)) == 0
        assert found.moments[0] == pytest.approx(9.81 * TIP_MASS * LENGTH, rel=3e-3)
        assert Beams(model).largest([q[None], 0.5 * q[None]]) == pytest.approx(found.moments.max())

    def test_long_rows_are_coarser(self):
        from linkwise.view.beams import ALL_PIECES, Beams

        beams = Beams(crane(4000, interior_modes=0))
        assert beams.count == ALL_PIECES
