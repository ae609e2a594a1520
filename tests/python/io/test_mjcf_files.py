"""An MJCF may include files and attach models; each is read with the care of the first one."""

import os

import numpy as np
import pytest

import linkwise as lw

pytest.importorskip("mujoco")

BODY = '<body name="{0}"><joint name="{0}"/><geom size="0.1" mass="{1}"/>{2}</body>'


@pytest.fixture
def folder(tmp_path):
    """Writes files by name, and gives the path of the first."""

    def write(**texts):
        for name, text in texts.items():
            path = tmp_path / (name.replace("__", "/") + ".xml")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        return tmp_path / f"{next(iter(texts))}.xml"

    return write


def include(file):
    return f'<include file="{file}"/>'


def test_included_files_are_the_model(folder):
    """MuJoCo looks beside the first file, then beside the one that includes."""
    inner = include("deep.xml") + include("parts/wide.xml")
    path = folder(
        main=f"<mujoco>{include('parts/arm.xml')}</mujoco>",
        parts__arm=f"<m><worldbody>{BODY.format('a', 1, inner)}</worldbody></m>",
        parts__deep=f"<m>{BODY.format('b', 2, '')}</m>",
        parts__wide=f"<m>{BODY.format('c', 4, '')}</m>",
    )
    model = lw.load(path)
    assert model.joint_names == ["a", "b", "c"]
    assert model.child_link_masses.tolist() == [1, 2, 4]


def test_an_included_text_is_the_same_machine_as_a_pasted_one(folder):
    pasted = (
        f"<mujoco><worldbody>{BODY.format('a', 1, BODY.format('b', 2, ''))}</worldbody></mujoco>"
    )
    parts = folder(
        main=f"<mujoco><worldbody>{BODY.format('a', 1, include('b.xml'))}</worldbody></mujoco>",
        b=f"<m>{BODY.format('b', 2, '')}</m>",
    )
    q = [0.3, -0.7]
    assert np.array_equal(lw.mass_matrix(lw.load(parts), q), lw.mass_matrix(lw.load(pasted), q))


ATTACH = (
    '<mujoco><asset><model name="m" file="robot.xml"/></asset><worldbody><replicate count="{0}">'
    '<frame><attach model="m" body="a" prefix="_"/></frame></replicate></worldbody></mujoco>'
)
ROBOT = f"<mujoco><worldbody>{BODY.format('a', 1, '')}</worldbody></mujoco>"


def test_a_model_is_attached_as_often_as_the_file_says(folder):
    model = lw.load(folder(main=ATTACH.format(3), robot=ROBOT))
    assert model.n_joints == 3
    assert model.child_link_masses.tolist() == [1, 1, 1]


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (
            {"main": f"<mujoco>\n{include('none.xml')}</mujoco>"},
            "main.xml:2: element 'include': the file 'none.xml' does not exist; correct the path",
        ),
        (
            {"main": f"<mujoco>{include('a' + chr(92) + 'b.xml')}</mujoco>"},
            "main.xml:1: element 'include': the file 'a\\b.xml' does not exist; write / instead of",
        ),
        (
            {
                "main": f"<mujoco><worldbody>{include('b.xml')}</worldbody></mujoco>",
                "b": f"<m>\n{include('b.xml')}</m>",
            },
            "b.xml:2: element 'include': the file 'b.xml' is included already; include it once",
        ),
        (
            {
                "main": f"<mujoco>{include('b.xml')}{include('./b.xml')}</mujoco>",
                "b": "<m/>",
            },
            "main.xml:1: element 'include': the file './b.xml' is included already; include it ",
        ),
        (
            {"main": f"<mujoco>{include('b.xml')}</mujoco>", "b": "<!DOCTYPE m><m/>"},
            "b.xml:1: DOCTYPE: document type and entity definitions are not allowed",
        ),
        (
            {"main": f"<mujoco>{include('b.xml')}</mujoco>", "b": "<m>"},
            "b.xml:1: model file: ",
        ),
        (
            {"main": f"<mujoco>{include('/dev/zero')}</mujoco>"},
            "/dev/zero: model file: is not a regular file; give",
        ),
        (
            {
                "main": f"<mujoco>{include('b.xml')}</mujoco>",
                "b": '<m>\n<custom><numeric name="n" size="2000000000"/></custom></m>',
            },
            "b.xml:2: element 'numeric': brings what the file orders",
        ),
        (
            {
                "main": '<mujoco><worldbody><replicate count="1000"><replicate count="20">'
                + f"{include('b.xml')}</replicate></replicate></worldbody></mujoco>",
                "b": '<m><body><geom size="1"/></body></m>',
            },
            "main.xml:1: element 'mujoco': has more than 20000 elements once all are replicated",
        ),
        (
            {"main": ATTACH.format(10_000), "robot": ROBOT},
            "main.xml:1: element 'mujoco': has more than 20000 elements once all are replicated",
        ),
        (
            {"main": ATTACH.format(1), "robot": ATTACH.format(1)},
            "robot.xml:1: element 'model': the file 'robot.xml' attaches itself in the end; attach",
        ),
        (
            {"main": ATTACH.format(1), "robot": "<robot/>"},
            "main.xml:1: element 'model': the file 'robot.xml' is no MJCF; attach another",
        ),
        (
            {
                "main": ATTACH.format(2000),
                "robot": '<mujoco><custom><numeric name="n" size="1e5"/></custom><worldbody>'
                '<body name="a"/></worldbody></mujoco>',
            },
            "robot.xml:1: element 'numeric': brings what the file orders",
        ),
    ],
)
def test_what_is_wrong_in_another_file_is_named_there(folder, tmp_path, texts, expected):
    with pytest.raises(lw.InputError) as caught:
        lw.load(folder(**texts))
    assert str(caught.value).replace(f"{tmp_path}{os.sep}", "").startswith(expected)


def test_a_chain_of_many_files_ends(folder):
    texts = {f"f{i}": f"<m>{include(f'f{i + 1}.xml')}</m>" for i in range(300)}
    path = folder(main=f"<mujoco>{include('f0.xml')}</mujoco>", **texts)
    with pytest.raises(lw.InputError, match=r"f254.xml:1: .*is one of more than 256 files; put"):
        lw.load(path)
