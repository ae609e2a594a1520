"""Encodings of XML files, and the usual slips with their cures."""

import pytest

import linkwise as lw

ROBOT = """<robot name="{name}"><link name="base"/><link name="arm"><inertial>
<mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"""


@pytest.mark.parametrize(
    ("declared", "encoding", "name"),
    [
        ("gb2312", "gb2312", "机械臂"),
        ("GBK", "gbk", "机械臂"),
        ("windows-1251", "cp1251", "рука"),
        ("koi8-r", "koi8-r", "рука"),
        ("ISO-8859-1", "latin-1", "bras é"),
        ("windows-1252", "cp1252", "œuvre"),
        ("shift_jis", "cp932", "腕"),
        ("euc-kr", "euc-kr", "로봇"),
        ("utf-16", "utf-16", "bras é"),
        (None, "utf-16-le", "arm"),
        ("utf-32", "utf-32", "arm"),
        (None, "utf-8-sig", "机"),
        ("utf-16", "utf-8", "机"),  # as .NET writes strings
        ("us-ascii", "utf-8", "机"),
    ],
)
def test_every_encoding_is_read(tmp_path, declared, encoding, name):
    path = tmp_path / "arm.urdf"
    head = f"<?xml version='1.0' encoding='{declared}'?>\n" if declared else ""
    path.write_bytes((head + ROBOT.format(name=name)).encode(encoding))
    assert lw.load(path).name == name


@pytest.mark.parametrize("version", ["0.0", "1.1", "2.0"])
def test_the_version_does_not_matter(tmp_path, version):
    path = tmp_path / "arm.urdf"
    path.write_text(f'<?xml version="{version}"?>\n' + ROBOT.format(name="a"))
    assert lw.load(path).name == "a"


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (ROBOT.format(name="é").encode("latin-1"), ":1: model file: holds a byte that is no UTF-8"),
        (b"<?xml version='1.0' encoding='ebcdic-x'?><robot/>", "encoding 'ebcdic-x', which is unk"),
        (b"<?xml version='1.0' encoding='hex'?><robot/>", "encoding 'hex', which is unknown"),
    ],
)
def test_encoding_that_cannot_be_read(tmp_path, complaint, data, expected):
    path = tmp_path / "arm.urdf"
    path.write_bytes(data)
    message = complaint(lw.load, path)
    assert expected in message
    assert "save it as UTF-8" in message


GOOD = ROBOT.format(name="a")
HEAD = '<?xml version="1.0"?>\n'


@pytest.mark.parametrize(
    ("text", "line", "expected"),
    [
        ("\n" + HEAD + GOOD, 2, "delete what stands before <?xml"),
        ("xacro: in-order processing\n" + HEAD + GOOD, 1, "delete what stands before <?xml"),
        ("<!-- made -->\n" + HEAD + GOOD, 2, "delete what stands before <?xml"),
        (HEAD + GOOD + HEAD + GOOD, 4, "delete that <?xml ...?>"),
        (GOOD + "\n<robot/>", None, "delete what follows it"),
        ("name: arm\n" + GOOD, 1, "delete what stands before the first <"),
        (HEAD + GOOD.replace('"a"', '"pick & place"'), 2, "write &amp; for &"),
        (GOOD.replace('"a"', '"a&nbsp;b"'), 1, "write the character itself"),
        (GOOD.replace("</inertial>", ""), 2, "write </inertial> where it ends"),
        (GOOD.replace("</robot>", ""), None, "add </robot>"),
        (GOOD[:-40], None, "fetch the whole file"),
        (GOOD.replace('value="2"', 'value="2" value="3"'), 2, "keep one of the two"),
        (GOOD.replace('value="2"', "value=2"), 2, "put it in quotes"),
        (GOOD.replace('value="2"', "value=“2”"), 2, "write straight quotes"),
        (GOOD.replace('ixy="0" ', 'ixy="0"'), 2, "put a space between"),
        (GOOD.replace('"a"', '"a<b"'), 1, "write &lt;"),
        (GOOD.replace('<mass value="2"/>', "<!-- a -- b --><mass/>"), None, "write - - instead"),
        (GOOD.replace("<mass", "<!-- <mass"), 2, "close it with -->"),
        (GOOD.replace('"a"', '"a\x0b"'), 1, "delete this character"),
        ("<!DOCTYPE html><html></html>", None, "download the raw file"),
        ("<!DOCTYPE html>\n<html><head></head></html>", None, "download the raw file"),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:1", 1, "git lfs pull"),
        ("<<<<<<< HEAD\n" + GOOD, 1, "resolve the conflict"),
        (GOOD + "</robot>", None, "delete </robot>"),
    ],
)
def test_a_slip_is_named_with_its_cure(tmp_path, complaint, text, line, expected):
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    message = complaint(lw.load, path)
    assert expected in message
    if line is not None:
        assert message.startswith(f":{line}: "), message


@pytest.mark.parametrize("piece", ["<!--", "<a ", "&amp;", "< a=", "<a>", '<a b="'])
def test_slips_are_found_in_linear_time(tmp_path, complaint, piece):
    path = tmp_path / "arm.urdf"
    path.write_text("<robot>" + piece * 200_000)
    complaint(lw.load, path)


def test_text_is_read_as_xacro_returns_it(tmp_path, monkeypatch):
    assert lw.load(HEAD + GOOD).name == "a"
    assert lw.load("\n " + GOOD, gravity=(0, 0, 0)).nv == 1
    monkeypatch.chdir(tmp_path)  # nothing is looked for here
    with pytest.raises(lw.InputError, match=r"^XML text:3: joint 'hinge'"):
        lw.load(GOOD.replace('type="continuous"', ""))
    with pytest.raises(lw.InputError, match=r"^XML text:1: model file: is not XML"):
        lw.load("<robot")


@pytest.mark.parametrize(
    ("attribute", "text", "expected"),
    [
        ("lower", "-inf", -float("inf")),
        ("upper", "+Infinity", float("inf")),
        ("effort", "-1", float("inf")),
        ("velocity", "INF", float("inf")),
        ("effort", ".inf", float("inf")),
        ("lower", "-1.#INF", -float("inf")),
        ("effort", "\u200b10", 10),
    ],
)
def test_limits_that_mean_unlimited(attribute, text, expected):
    limits = {"lower": "-1", "upper": "1", "effort": "2", "velocity": "3", attribute: text}
    written = " ".join(f'{key}="{value}"' for key, value in limits.items())
    model = lw.load(
        GOOD.replace("continuous", "revolute").replace("</joint>", f"<limit {written}/></joint>")
    )
    assert model.dof_property(attribute) == [expected]
    noted = [n for n in model.notes if "is read as unlimited" in n.text]
    assert len(noted) == (0 if expected == 10 else 1)


@pytest.mark.parametrize(
    ("attribute", "text"), [("lower", "inf"), ("upper", "-inf"), ("upper", "nan")]
)
def test_limits_that_mean_nothing(attribute, text):
    limits = {"lower": "-1", "upper": "1", "effort": "2", "velocity": "3", attribute: text}
    written = " ".join(f'{key}="{value}"' for key, value in limits.items())
    with pytest.raises(lw.InputError, match="is not a finite number"):
        lw.load(
            GOOD.replace("continuous", "revolute").replace(
                "</joint>", f"<limit {written}/></joint>"
            )
        )
