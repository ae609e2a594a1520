"""Values that a careless or hostile person might give."""

import datetime
from decimal import Decimal
from fractions import Fraction

import numpy as np

NUMBER_TEXTS = (
    *("0", "-0", "1", "-1", "1e-9", "1e9", "1e30", "1e-30", "1e160", "1e308", "-1e308", "5e-324"),
    *(
        "nan",
        "inf",
        "-inf",
        "1e400",
        "1e-400",
        "1,5",
        "1 2",
        "1 2 3",
        "0x10",
        "1_0",
        "+-1",
        ".",
        "",
    ),
    *(
        " ",
        "१",
        "1\u200b",
        "${x}",
        "$(arg x)",
        "30 deg",
        "1e",
        "--1",
        "9" * 400,
        "0." + "0" * 400 + "1",
    ),
    *("2147483647", "2147483648", "4294967296", "9223372036854775808", "true", "None", "1;2"),
)
TEXTS = (
    *("", " ", "a", "base", "world", "a" * 5000, "../../up", "/dev/zero", "/dev/null", "~", "."),
    *("日本", "a\u200b", "\u202eabc", "[red]", "{0}", "%s", "=1+1", "a.b", "a/b", "a'b\"c", "a;b"),
    *("a\tb", "a\nb", "\\", "&", "<", "]]>", "nul", "time", "q", "joint_load", "x" * 300),
)
# Only Python can hand these over.
ODD_TEXTS = (*TEXTS, "\x1b[31m", "\x00", "\x9b1m", "\ud800", "a\rb")
NUMBERS = (
    *(0.0, -0.0, 1.0, -1.0, 1e-9, 1e9, 1e30, 1e160, 1e308, -1e308, 5e-324, 2.0**31, 2.0**63),
    *(float("nan"), float("inf"), float("-inf")),
)
WHOLE = (0, 1, 2, -1, 3, 7, 255, 2**31 - 1, 2**31, 2**32, 2**63, -(2**63), 10**30, 10**400)
OBJECTS = (
    *(None, True, False, "2", b"2", "", (), [], {}, {"a": 1}, {1, 2}, 2 + 1j, Decimal("1.5")),
    *(Fraction(1, 3), datetime.datetime(2020, 1, 1), datetime.timedelta(1), object(), repr, float),
    *(np.int64(2), np.float32(1.5), np.bool_(True), np.datetime64("NaT"), np.str_("a"), range(3)),
    *(iter(()), Ellipsis, NotImplemented, slice(1), np.ma.masked, [[1, 2], [3]], ["a"], [None]),
)


def hostile_number(rng):
    return (
        rng.choice(NUMBERS) if rng.random() < 0.7 else rng.gauss(0, 1) * 10 ** rng.uniform(-12, 12)
    )


def hostile_array(rng, array):
    """Another array in place of a good one: of other values, shape, type or memory."""
    array = np.array(array, dtype=float)
    return rng.choice(_ARRAY_CHANGES)(rng, array)


def _one_value(rng, array):
    if array.size:
        array.reshape(-1)[rng.randrange(array.size)] = hostile_number(rng)
    return array


def _all_values(rng, array):
    return np.full(array.shape, hostile_number(rng))


def _scaled(rng, array):
    with np.errstate(all="ignore"):
        return array * 10 ** rng.uniform(-300, 300)


def _shape(rng, array):
    shape = list(array.shape)
    for _ in range(rng.randint(1, 2)):
        where = rng.randint(0, len(shape))
        if shape and rng.random() < 0.6:
            shape[min(where, len(shape) - 1)] = rng.choice((0, 1, 2, 3, 5, 7))
        elif shape and rng.random() < 0.5:
            del shape[min(where, len(shape) - 1)]
        else:
            shape.insert(where, rng.choice((0, 1, 2, 3)))
    return np.resize(array, shape) if array.size else np.zeros(shape)


def _dtype(rng, array):
    kinds = ("complex", "int64", "bool", "float16", "longdouble", ">f8", "object", "U8", "S8", "O")
    kind = rng.choice((*kinds, "datetime64[s]", "timedelta64[s]", "f8,f8", "uint8"))
    with np.errstate(all="ignore"):
        try:
            return np.nan_to_num(array).astype(kind)
        except (TypeError, ValueError):
            return np.zeros(array.shape, kind)


def _memory(rng, array):
    wide = np.repeat(array[..., np.newaxis], 3, axis=-1) if array.ndim else array
    choices = [
        np.asfortranarray(array),
        np.ma.masked_array(array, mask=rng.random() < 0.5),
        np.broadcast_to(array, (2, *array.shape)),
        wide[..., ::3].reshape(array.shape) if array.ndim else array,
        array[..., ::-1] if array.ndim else array,
        array.tolist(),
        memoryview(np.ascontiguousarray(array)),
        [array, array],
    ]
    return rng.choice(choices)


def _object(rng, array):
    return rng.choice(OBJECTS)


_ARRAY_CHANGES = (
    _one_value,
    _one_value,
    _all_values,
    _scaled,
    _shape,
    _shape,
    _dtype,
    _memory,
    _object,
)
