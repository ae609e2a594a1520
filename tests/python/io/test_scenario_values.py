"""Values that do not belong where they stand in a scenario end in one line with its name."""

import io

import pytest

import linkwise as lw
from linkwise.scenario import load_scenario
from linkwise.simulation.scenarios import run_scenario

CHAIN = "[model.chain]\nn_bodies = 3\n"
RUN = "[simulate]\nduration = 0.01\n"
DRIVE = '[drive.joint_1]\nkind = "torque"\ntable = "t.csv"\n'


@pytest.fixture
def write(tmp_path):
    def call(text, bom=b"", folder=tmp_path):
        path = folder / "s.toml"
        path.write_bytes(bom + text.encode())
        return path

    return call


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (f"{CHAIN}mass = [1, 2]\n{RUN}", "model.chain: mass is [1, 2]"),
        (f"{CHAIN}radius = []\n{RUN}", "model.chain: radius is []"),
        (f"{CHAIN}length = '1'\n{RUN}", "model.chain: length is '1'"),
        (f"{CHAIN}mass = true\n{RUN}", "model.chain: mass is True"),
        (f'{CHAIN}axes = ["x"]\n{RUN}', "model.chain: axes"),
        (f"{CHAIN}axes = [[1, 0, 0], [1]]\n{RUN}", "model.chain: axes"),
        (f"{CHAIN}seed = -1\naxes = 'random'\n{RUN}", "model.chain: "),
        (f"{CHAIN}damping = [1]\n{RUN}", "model.chain: "),
        (f"[model.tree]\nmass = [1]\n{RUN}", "model.tree: mass is [1]"),
        (f"[model.tree]\nbranching = 3000000000\n{RUN}", "model.tree: branching is 3000000000"),
        (f"[model.srms]\npayload_mass = []\n{RUN}", "model.srms: payload_mass is []"),
        (f"[model.chain]\nn_bodies = 3000000000\n{RUN}", "model.chain: n_bodies is 3000000000"),
        (
            "[model.chain]\nn_bodies = 2147483647\n" + RUN,
            "model.chain: a machine of 2147483647 bod",
        ),
        (f"{CHAIN}{RUN}max_iterations = 3000000000", "simulate.max_iterations: is 3000000000"),
        (f"{CHAIN}{RUN}threads = 3000000000", "simulate.threads: is 3000000000"),
        (f"{CHAIN}{RUN}max_steps = 3000000000", "simulate.max_steps: is 3000000000"),
        (f"{CHAIN}[simulate]\nduration = 5e-324", "duration: 4.94066e-324 s is too short"),
        (f"{CHAIN}{DRIVE}{RUN}", "drive.joint_1: table values: change by more"),
        (f"{CHAIN}{DRIVE}interpolation = 'cubic'\n{RUN}", "drive.joint_1: table values: change by"),
    ],
)
def test_one_line_with_file_and_key(write, tmp_path, text, named):
    (tmp_path / "t.csv").write_text("t,joint_1\n0,-1e308\n1,1e308\n2,0\n")
    path = write(text)
    with pytest.raises(lw.InputError) as caught:
        run_scenario(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: {named}")
    assert "\n" not in said


def test_cubic_table_whose_derivatives_overflow():
    with pytest.raises(lw.InputError, match="than a double holds"):
        lw.Table([0, 1e-160, 1], [0, 1, 0], "cubic")
    lw.Table([0, 1e-160, 1], [0, 1, 0])


def test_the_command_calls_it_wrong_input(linkwise, write):
    assert linkwise("run", write(f"{CHAIN}mass = [1]\n{RUN}")).code == 2


def test_a_byte_order_mark_is_no_part_of_the_text(write):
    plain = load_scenario(write(f"{CHAIN}{RUN}"))
    marked = load_scenario(write(f"{CHAIN}{RUN}", bom=b"\xef\xbb\xbf"))
    assert marked.text == plain.text
    assert marked.settings == plain.settings


@pytest.mark.parametrize("link", [False, True])
def test_only_output_replaces_what_stands_outside_the_folder(linkwise, write, tmp_path, link):
    folder, outside = tmp_path / "scene", tmp_path / "kept.zarr"
    folder.mkdir()
    target = "kept.zarr" if link else "../kept.zarr"
    path = write(f"{CHAIN}{RUN}[output]\npath = '{target}'\n", folder=folder)
    run_scenario(path, output=outside)
    before = outside.stat().st_ino
    if link:
        (folder / "kept.zarr").symlink_to(outside)
    with pytest.raises(lw.InputError, match="exists outside the scenario's folder"):
        run_scenario(path)
    assert linkwise("run", path).code == 2
    assert outside.stat().st_ino == before
    assert linkwise("run", path, "-o", outside).code == 0
    assert outside.stat().st_ino != before


def test_inside_the_folder_a_run_is_replaced(write):
    path = write(f"{CHAIN}{RUN}[output]\npath = 'run.zarr'\n")
    assert run_scenario(path).completed
    assert run_scenario(path).completed


@pytest.mark.parametrize(("answer", "code"), [("n\n", 1), ("y\n", 0)])
def test_at_a_terminal_the_command_asks(linkwise, write, tmp_path, monkeypatch, answer, code):
    folder = tmp_path / "scene"
    folder.mkdir()
    path = write(f"{CHAIN}{RUN}[output]\npath = '../kept.zarr'\n", folder=folder)
    assert linkwise("run", path).code == 0
    before = (tmp_path / "kept.zarr").stat().st_ino

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr("sys.stdin", Terminal(answer))
    result = linkwise("run", path)
    assert result.code == code
    assert "lies outside the scenario's folder" in result.err
    assert ((tmp_path / "kept.zarr").stat().st_ino == before) == bool(code)
