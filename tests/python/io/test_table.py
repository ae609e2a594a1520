"""CSV tables: what is read, and one line for each way in which they are wrong."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from linkwise._core import InputError
from linkwise.io.table import read_table


@pytest.fixture
def write(tmp_path):
    def call(content):
        path = tmp_path / "drive.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return call


def test_columns_by_name(write):
    table = read_table(write("time,shoulder,elbow\n0,1,2\n0.5,3,-4e-1\n"))
    assert table.names == ("shoulder", "elbow")
    np.testing.assert_array_equal(table.times, [0, 0.5])
    np.testing.assert_array_equal(table.values, [[1, 2], [3, -0.4]])
    np.testing.assert_array_equal(table.column("elbow"), [2, -0.4])
    assert table.dimensions == (None, None)


@pytest.mark.parametrize(
    "content",
    [
        "# by hand\n\ntime, a\n# a comment\n0, 1\n1, 2\n\n\n",
        "a;t\n1;0\n2;1",
        "t,a\r\n0,1\r\n1,2\r\n",
        "t,a\r0,1\r1,2\r",
        '"t","a"\n"0","1"\n1,"2"\n',
        "\ufefftime,a\n0,1\n1,2\n",
        "time [ms],a\n0,1\n1000,2\n",
        "time\ta\n0\t1\n1\t2\n",
        "  time   a\n  0 1\n  1   2\n",
        '"time" "a"\n0 "1"\n1 2\n',
        "time;a\n0;1,0\n1;2\n",
        "time\ta\n0,0\t1\n1,000\t2\n",
        "time,a\n0,1\n1,2\n".encode("utf-16"),
        "\ufefftime\ta\n0\t1\n1\t2\n".encode("utf-16-be"),
        "Coordinates\nversion=1\nnote=a, b; c\ninDegrees=no\nendheader\n\ntime\ta\n0\t1\n1\t2\n",
    ],
    ids=[
        *["comments", "semicolons", "crlf", "cr", "quotes", "bom", "milliseconds", "tabs"],
        *["blanks", "blanks_quotes", "decimal_commas", "commas_and_tabs", "utf16", "utf16_be"],
        "opensim",
    ],
)
def test_dialects(write, content):
    table = read_table(write(content))
    assert table.names == ("a",)
    np.testing.assert_array_equal(table.times, [0, 1])
    np.testing.assert_array_equal(table.values, [[1], [2]])


def test_units_in_the_header(write):
    table = read_table(write("time [s],a [deg],b [N m],c [mm]\n0,0,0,0\n1,180,7,5\n"))
    assert table.names == ("a", "b", "c")
    assert table.dimensions == ("angle", "moment", "length")
    np.testing.assert_allclose(table.values[1], [math.pi, 7, 0.005])


def test_units_where_blanks_separate(write):
    table = read_table(write("time [ms]  a [N m]  b[deg]\n0 1 2\n1 2 180\n"))
    assert table.names == ("a", "b")
    assert table.dimensions == ("moment", "angle")
    np.testing.assert_allclose(table.times, [0, 0.001])
    np.testing.assert_allclose(table.values[1], [2, math.pi])


GAP = "give a finite number in every cell"


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", ": table: is empty; give a header line and at least two rows"),
        ("# only\n\n", ": table: is empty; give a header line and at least two rows"),
        (
            "time,a\n0,1\n",
            ":2: table: has only one row of numbers; give at least two (a constant needs no table)",
        ),
        (
            "time,a\n",
            ":1: table: has no rows of numbers; give at least two (a constant needs no table)",
        ),
        (
            "time,a\n0,5,1,25\n1,0,2,0\n",
            ":2: row: has 4 cells where the header has 2; "
            "separate columns by semicolons, or write decimals with points",
        ),
        (
            "time;a\n0;1.5\n0,5;2\n",
            ":3: table: numbers have commas and points; which are decimals is not clear; "
            "write decimals with points, as 1234.5",
        ),
        (
            "time;a\n0;1,000\n1;2,000\n",
            ":3: table: commas may separate thousands or decimals; "
            "write decimals with points, and no thousands apart",
        ),
        (
            "Coordinates\ninDegrees=yes\nendheader\ntime\ta\n0\t1\n1\t2\n",
            ":2: inDegrees: does not say which columns are angles; "
            "write their units in the header, as 'elbow [deg]', and delete this line",
        ),
        (
            "time\ta\n0\t1\n1\t\n",
            ":3: row: has 1 cells where the header has 2; give every row one number per column",
        ),
        ("time,a\n0,1\n1,\n", f":3: column 'a': the cell is empty: a gap; {GAP}"),
        (
            "time,a\n0,1\n\n2,3\n",
            ":3: table: an empty line is a gap; delete it or fill the row in",
        ),
        (
            "time,a\n0,1\n1\n",
            ":3: row: has 1 cells where the header has 2; give every row one number per column",
        ),
        (
            "time,a\n0,1\n1,2,3\n",
            ":3: row: has 3 cells where the header has 2; give every row one number per column",
        ),
        ("time,a\n0,1\n1,nan\n", f":3: column 'a': 'nan' is not a finite number; {GAP}"),
        ("time,a\n0,1\n1,-inf\n", f":3: column 'a': '-inf' is not a finite number; {GAP}"),
        ("time,a\n0,1\n1,1e400\n", f":3: column 'a': '1e400' is too large for a double; {GAP}"),
        ("time,a\n0,1\n1,two\n", f":3: column 'a': 'two' is not a number; {GAP}"),
        (
            "time,a\n0,1\n# later\n2,2\n1,3\n",
            ":5: time column: time runs backwards: 1 s after 2 s; "
            "sort the rows and give each time once",
        ),
        (
            "time,a\n0,1\n1,2\n1,3\n",
            ":4: time column: time stands still: 1 s after 1 s; "
            "sort the rows and give each time once",
        ),
        (
            "x,a\n0,1\n1,2\n",
            ":1: header: has no time column; call one column 'time' (columns: x, a)",
        ),
        (
            "0,1\n1,2\n",
            ":1: header: has no time column; call one column 'time' (columns: 0, 1)",
        ),
        (
            "t,Time,a\n0,1,2\n",
            ":1: header: has more than one time column; "
            "call one column 'time' (columns: t, Time, a)",
        ),
        ("time\n0\n1\n", ":1: header: has only a time column; add a column of values"),
        ("time,a,a\n0,1,2\n", ":1: column 3 'a': the name is used twice; rename one"),
        ("time,,a\n0,1,2\n", ":1: column 2: has no name; name every column in the header"),
        ("time [deg],a\n0,1\n", ":1: time column: has a unit of angle; use s, ms, min or h"),
        (b"time,a\n0,\xff\n", ":2: table: is not UTF-8 text; save it as CSV with UTF-8 encoding"),
        (b"time,a\n0,\x00\n", ": table: holds binary data; give a CSV file"),
        (
            'time,a\n0,"1\n1,2\n',
            ":2: table: is not CSV (unexpected end of data); check quotes and separators",
        ),
    ],
)
def test_defect_is_named(write, complaint, content, expected):
    assert complaint(read_table, write(content)) == expected


@pytest.mark.parametrize(
    ("head", "names"),
    [
        ("Time,a", ["a"]),
        ("TIME [s],a", ["a"]),
        ("T [s],a", ["a"]),
        ("time [s],time [rad]", ["time"]),
        ("time [s],time", ["time"]),
        ("time,t", ["t"]),
        ("time [s],Time [rad]", ["Time"]),
        ("Time,time", ["time"]),
    ],
)
def test_columns_called_time(write, head, names):
    table = read_table(write(f"{head}\n0,5\n1,3\n"))
    assert list(table.names) == names
    np.testing.assert_array_equal(table.times, [0, 1])
    np.testing.assert_array_equal(table.values, [[5], [3]])


@pytest.mark.parametrize("head", ["a,Time", "time [rad],t [s]", "T [kg],Time [s]"])
def test_the_time_need_not_stand_first(write, head):
    table = read_table(write(f"{head}\n5,0\n3,1\n"))
    np.testing.assert_array_equal(table.times, [0, 1])
    np.testing.assert_array_equal(table.values, [[5], [3]])


def test_unknown_unit_lists_the_known(write, complaint):
    message = complaint(read_table, write("time,a [furlong]\n0,1\n1,2\n"))
    assert message.startswith(":1: column 2 'a': unknown unit 'furlong'; known units: rad, deg, ")


def test_unknown_column(write):
    table = read_table(write("time,shoulder,elbow\n0,1,2\n1,3,4\n"))
    with pytest.raises(InputError, match=r"drive.csv:1: column 'elbw': .*did you mean 'elbow'\?$"):
        table.column("elbw")


def test_missing_file(tmp_path, complaint):
    expected = ": table: no such file; check the path"
    assert complaint(read_table, tmp_path / "drive.csv") == expected


LINE = st.lists(
    st.sampled_from(
        ["0", "1", "2.5", "-1e3", "nan", "", "x", "time", "a", '"', "#", "[deg]", "\0"]
    ),
    max_size=4,
).map(",".join)


@given(st.lists(LINE, max_size=6), st.booleans())
def test_any_text_is_a_table_or_one_line(tmp_path_factory, lines, with_header):
    path = tmp_path_factory.getbasetemp() / "fuzz.csv"
    path.write_text("\n".join(["time,a"] * with_header + lines))
    try:
        table = read_table(path)
    except InputError as error:
        message = str(error)
    else:
        assert np.isfinite(table.values).all()
        assert (np.diff(table.times) > 0).all()
        return
    assert message.isprintable()
    assert message.startswith(str(path))
    assert "; " in message
