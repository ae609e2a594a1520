"""What users of flexible links may get wrong is refused, or does not matter."""

import numpy as np
import pytest

import linkwise as lw

E, G = 70e9, 26e9


class TestMistakes:
    def crane(self, **given):
        builder = lw.ModelBuilder("crane")
        for link, mass in (("tower", 50.0), ("jib", 240.0), ("load", 100.0)):
            builder.add_link(link, mass=mass, inertia=mass * np.eye(3))
        builder.add_joint("slew", "revolute", "tower", "jib", axis=(0, 0, 1))
        builder.add_joint("hook", "spherical", "jib", "load", translation=(12, 0, 0))
        section = lw.Section.box(0.3, 0.4, 0.008)
        builder.make_flexible(**({"link": "jib", "section": section, "E": E, "G": G} | given))
        return builder.build()

    def test_the_ground_does_not_bend(self):
        with pytest.raises(lw.InputError, match="'tower': no joint moves it, it is the ground"):
            self.crane(link="tower", end=(0, 0, 12))

    def test_joints_are_where_the_link_ends(self):
        with pytest.raises(
            lw.InputError, match=r"joints at \(12, 0, 0\), and its end is at \(6, 0"
        ):
            self.crane(end=(6, 0, 0))
        assert self.crane(end=(12, 0, 0)).n_bodies == 3

    def test_names_of_its_parts_are_free(self):
        builder = lw.ModelBuilder("crane")
        for link in ("tower", "jib", "jib:2"):
            builder.add_link(link, mass=1.0)
        builder.add_joint("slew", "fixed", "tower", "jib")
        builder.add_joint("hook", "fixed", "jib", "jib:2", translation=(12, 0, 0))
        builder.make_flexible("jib", section=lw.Section.round(0.1), E=E, G=G)
        with pytest.raises(lw.InputError, match="'jib:2' has the name of a part of it"):
            builder.build()

    def test_a_wrench_along_it_is_refused(self):
        model = self.crane()
        push = lw.Wrench([0, 0, -2000, 0, 0, 0])
        with pytest.raises(lw.InputError, match="where that starts, and would not bend it"):
            lw.simulate(model, duration=0.01, wrenches={lw.Frame("jib", (6, 0, 0)): push})
        lw.simulate(model, duration=0.01, wrenches={"jib": push, "jib:end": push})

    def test_members_of_a_batch_have_as_many_coordinates(self):
        models = [self.crane(interior_modes=k) for k in (1, 2)]
        with pytest.raises(lw.InputError, match=r"model\[1\] has other joints"):
            lw.simulate_batch(models, duration=0.01, step=1e-3)

    def test_places_along_members_are_their_own(self):
        models = []
        for length in (12.0, 9.0):
            builder = lw.ModelBuilder("mast")
            builder.add_link("base")
            builder.add_link("mast", mass=100.0)
            builder.add_joint("foot", "fixed", "base", "mast")
            builder.make_flexible(
                "mast", section=lw.Section.round(0.2), E=E, G=G, end=(length, 0, 0)
            )
            models.append(builder.build())
        run = lw.simulate_batch(models, duration=0.01, step=1e-3)
        inside = lw.loads.section_loads(run, "mast", 5, model=models)
        np.testing.assert_allclose(inside.x, [np.linspace(0, 12, 5), np.linspace(0, 9, 5)])

    @pytest.mark.parametrize("tilt", [0, 1e-6, 1e-3, -1e-3])
    def test_rounding_does_not_choose_the_axes_of_an_upright_mast(self, tilt):
        builder = lw.ModelBuilder("mast")
        builder.add_link("base")
        builder.add_link("mast", mass=100.0)
        builder.add_joint("foot", "fixed", "base", "mast")
        section = lw.Section.rectangle(0.1, 0.3)
        end = (0, tilt * 12, 12)
        builder.make_flexible("mast", section=section, E=E, G=G, end=end)
        model = builder.build()
        z = lw.frame_pose(model, np.zeros(model.nq), "mast:end")[:3, 2]
        np.testing.assert_allclose(z, (1, 0, 0), atol=2e-3)

    def test_scenarios_give_mass_once_and_load_the_end(self, tmp_path):
        (tmp_path / "crane.urdf").write_text(CRANE)
        path = tmp_path / "crane.toml"
        beam = (
            "[flexible.jib]\nsection = 'round'\ndiameter = '0.2 m'\nE = '210 GPa'\nG = '80 GPa'\n"
        )
        model = "[model]\npath = 'crane.urdf'\n[simulate]\nduration = '1 ms'\n"
        payload = "[payload.drum]\nlink = 'jib:end'\nmass = '20 kg'\ninertia = [1, 1, 1]\n"
        path.write_text(model + beam + payload)
        loaded = lw.load_scenario(path).load_model()
        assert loaded.total_mass == pytest.approx(240 + 20 + 100)
        path.write_text(model + beam + "density = 7850\n[link.jib]\nmass = '200 kg'\n")
        with pytest.raises(lw.InputError) as error:
            lw.load_scenario(path).load_model()
        assert str(error.value).count("crane.toml") == 1
        assert "density is given beside mass in [link.jib]" in str(error.value)


CRANE = """<robot name="crane"><link name="tower"/>
<link name="jib"><inertial><mass value="240"/><inertia ixx="1" iyy="9" izz="9" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<link name="load"><inertial><mass value="100"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<joint name="slew" type="continuous"><parent link="tower"/><child link="jib"/><axis xyz="0 0 1"/>
</joint>
<joint name="hook" type="continuous"><parent link="jib"/><child link="load"/>
<origin xyz="12 0 0"/><axis xyz="0 1 0"/></joint></robot>"""
