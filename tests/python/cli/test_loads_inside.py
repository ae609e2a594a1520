"""`linkwise loads --sections`: what is inside flexible links, and one line for what is wrong."""

import csv

import pytest

import linkwise as lw

INERTIA = '<inertia ixx="{0}" iyy="{0}" izz="{0}" ixy="0" ixz="0" iyz="0"/>'
CRANE = f"""<robot name="crane"><link name="tower"/>
<link name="jib"><inertial><mass value="240"/>{INERTIA.format(9)}</inertial></link>
<link name="load"><inertial><origin xyz="0 0 -1"/><mass value="500"/>{INERTIA.format(20)}
</inertial></link>
<joint name="slew" type="continuous"><parent link="tower"/><child link="jib"/>
<axis xyz="0 0 1"/></joint>
<joint name="hook" type="continuous"><parent link="jib"/><child link="load"/>
<origin xyz="12 0 0"/><axis xyz="0 1 0"/></joint></robot>"""
SCENARIO = """model = "crane.urdf"
[flexible.jib]
section = "box"
width = "300 mm"
height = "400 mm"
wall = "8 mm"
E = "210 GPa"
G = "80 GPa"
damping = 0.05
interior_modes = 0
stretches = false
allowable_stress = "50 MPa"
[drive.slew]
kind = "torque"
value = 4000
[simulate]
duration = 0.2
[output]
every = 0.01
"""
GENERAL = (
    'section = "box"\nwidth = "300 mm"\nheight = "400 mm"\nwall = "8 mm"',
    'section = "general"\narea = "0.01 m2"\nIy = "3e-4 m4"\nIz = "2e-4 m4"\nJ = "3e-4 m4"',
)


@pytest.fixture
def run(linkwise, tmp_path):
    def make(*replacements):
        text = SCENARIO
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "crane.urdf").write_text(CRANE)
        (tmp_path / "crane.toml").write_text(text)
        made = linkwise("run", "crane.toml", "-o", "run.zarr")
        assert made.code == 0, made.err
        return "run.zarr"

    return make


def test_tables_json_and_csv_have_the_numbers_of_the_library(linkwise, run):
    path = run()
    summary = lw.loads.section_summary(lw.open_run(path), "jib", 5)
    shown = linkwise("loads", path, "--sections", "jib", "-n", "5", "--csv", "a.csv")
    assert shown.code == 0
    row = next(line for line in shown.out.splitlines() if "bending about y" in line)
    peak = summary.sel(quantity="ny")
    for value in (peak.peak, peak.peak_x, peak.peak_time):
        assert f"{float(value):.4g}" in row.split()
    assert "Along jib" in shown.out
    stress = next(line for line in shown.out.splitlines() if "fibre stress" in line)
    assert stress.split()[-2:] == [f"{100 * use(summary):.1f}", "%"]

    found = linkwise("loads", path, "--sections", "all", "-n", "5", "--json").json
    assert found["extremes"] == "of the samples"
    (inside,) = found["sections"]
    assert inside["link"] == "jib"
    one = next(record for record in inside["peaks"] if record["quantity"] == "stress")
    assert one["peak"] == float(summary.peak.sel(quantity="stress"))
    assert one["use"] == pytest.approx(use(summary))
    assert one["margin"] < 0 < use(summary)
    assert len(inside["along"]) == 5 * 7

    with open("a.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 35
    first = next(row for row in rows if row["quantity"] == "fz")
    assert float(first["maximum"]) == float(summary.maximum.sel(quantity="fz")[0])


def use(summary):
    stress = summary.sel(quantity="stress")
    return (abs(float(stress.peak)) + float(stress.peak_error)) / 50e6


def test_causes_at_the_peaks_add_up(linkwise, run):
    found = linkwise("loads", run(), "--sections", "jib", "--split", "motion", "--json").json
    for record in found["sections"][0]["peaks"][:6]:
        total = sum(record["causes"].values())
        assert total == pytest.approx(record["peak"], rel=1e-9, abs=1e-6)
    shown = linkwise("loads", "run.zarr", "--sections", "jib", "--split", "motion")
    assert "acceleration" in shown.out


def test_without_outer_sizes_there_is_no_stress_and_it_says_so(linkwise, run):
    path = run(GENERAL, ('allowable_stress = "50 MPa"\n', ""))
    shown = linkwise("loads", path, "--sections", "jib")
    assert "no stress: the section's outer sizes are not known" in " ".join(shown.out.split())
    assert "fibre stress" not in shown.out


def test_a_general_section_may_have_outer_sizes(linkwise, run):
    sized = (GENERAL[0], GENERAL[1] + '\nwidth = "0.3 m"\nheight = "0.4 m"')
    assert "fibre stress" in linkwise("loads", run(sized), "--sections", "jib").out


def test_loads_name_the_flexible_links(linkwise, run):
    path = run()
    assert "Flexible: jib. --sections jib: the loads inside it" in linkwise("loads", path).out
    assert linkwise("loads", path, "--json").json["flexible"] == ["jib"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--sections", "tower"],
            "link 'tower' is not an elastic beam; the elastic beams are: jib",
        ),
        (["--sections", "jip"], "did you mean 'jib'"),
        (["--sections", "jib", "-n", "1"], "n: is 1; give a number of sections from 2"),
        (["-n", "5"], "-n: goes with --sections"),
        (["--sections", "jib", "-j", "slew"], "goes with --sections, and that with --split"),
        (["--sections", "jib", "--split", "force"], "'force' does not go with --sections"),
        (["--sections", "jib", "--at", "world"], "--at: goes with"),
    ],
)
def test_bad_input_is_one_line(linkwise, run, arguments, message):
    found = linkwise("loads", run(), *arguments)
    assert found.code == 2
    assert message in found.err
    assert found.err.count("\n") == 1


def test_machines_without_flexible_links_say_so(linkwise, scenario):
    assert linkwise("run", scenario(), "-o", "rigid.zarr").code == 0
    found = linkwise("loads", "rigid.zarr", "--sections", "all")
    assert (found.code, found.err.count("\n")) == (2, 1)
    assert "has no flexible links" in found.err
