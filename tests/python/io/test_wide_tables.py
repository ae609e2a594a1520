"""Tables with very many columns."""

import numpy as np
import pytest

import linkwise as lw
from linkwise.io.table import read_table


class Counted(str):
    """Text that counts how often it is compared."""

    compared = 0
    __hash__ = str.__hash__

    def __eq__(self, other):
        Counted.compared += 1
        return str.__eq__(self, other)

    def strip(self, *_):
        return self


def test_names_are_compared_in_proportion_to_their_number():
    """A header used to compare every name with all before it."""
    from linkwise.io.table import _header

    _header("t.csv", 1, [Counted("t"), *(Counted(f"c{k}") for k in range(3000))])
    assert Counted.compared < 20 * 3000


def test_each_column_is_found(tmp_path):
    names = [f"c{k}" for k in range(5000)]
    path = tmp_path / "wide.csv"
    rows = [",".join(["0", *map(str, range(5000))]), ",".join(["1", *map(str, range(5000))])]
    path.write_text("\n".join([",".join(["t", *names]), *rows]) + "\n")
    table = read_table(path)
    for k, name in enumerate(names):
        assert table.index(name) == k
    np.testing.assert_array_equal(table.column("c4999"), [4999, 4999])
    with pytest.raises(lw.InputError, match="'c5000': does not exist; did you mean"):
        table.column("c5000")
