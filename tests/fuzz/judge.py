"""What may come of an input, and what is a finding."""

import traceback
import unicodedata
import warnings

import numpy as np

import linkwise as lw
from linkwise.base import printable

LONGEST_LINE = 4600
WORKS = ("drive_work", "external_work", "dissipated_energy")


class Finding(Exception):  # noqa: N818, it is no error of linkwise
    """What must not come of any input."""


def judge(action, named=None):
    """Runs `action`; None where all is well, otherwise what went wrong.

    A result is well, and so are the documented exceptions with one printable line, which must
    hold `named` where that is given.
    """
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = _outcome(action, named)
    for warning in said:
        if (
            not issubclass(warning.category, lw.ModelWarning)
            and warning.category is not UserWarning
        ):
            return found or f"{warning.category.__name__} leaks: {warning.message}"
        if any(unicodedata.category(c) == "Cc" for c in str(warning.message)):
            return found or f"warning of more than one line: {str(warning.message)!r}"
    return found


def _outcome(action, named):
    try:
        action()
    except lw.SimulationError as error:
        return _line(error, None)
    except (lw.InputError, lw.NumericsError) as error:
        return _line(error, named if isinstance(error, lw.InputError) else None)
    except MemoryError as error:
        known = "GB" in str(error) or "bytes" in str(error)
        return None if known and not isinstance(error, np.exceptions.AxisError) else _trace(error)
    except Finding as finding:
        return str(finding)
    except TypeError as error:  # of Python's own calls: another kind of object, a missing argument
        return None if _is_of_a_call(error) else _trace(error)
    except Exception as error:
        return _trace(error)
    return None


def _is_of_a_call(error):
    return "argument" in str(error) or "(): takes (" in str(error)


def _line(error, named):
    text = str(error)
    if not text or any(unicodedata.category(c) == "Cc" for c in text):
        return f"{type(error).__name__} is not one line: {text!r}"
    if len(text) > LONGEST_LINE:
        return f"{type(error).__name__} of {len(text)} characters: {text[:300]}"
    if named is not None and named not in text:
        return f"{type(error).__name__} does not name {named}: {text}"
    return None


def _trace(error):
    frames = traceback.extract_tb(error.__traceback__)
    own = [f"{frame.filename.rpartition('linkwise/')[2]}:{frame.lineno}" for frame in frames[-3:]]
    return f"{type(error).__name__}: {printable(str(error))[:300]} ({' > '.join(own)})"


def must_be_finite(value, what):
    """Finding where a result holds NaN or infinity."""
    if isinstance(value, np.ndarray | float | np.floating):
        array = np.asarray(value)
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise Finding(f"{what} is not finite: {printable(str(array.ravel()[:8]))}")
    elif isinstance(value, tuple | list):
        for part in value:
            must_be_finite(part, what)
    elif isinstance(value, dict):
        for name, part in value.items():
            must_be_finite(part, f"{what}[{name!r}]")
    elif isinstance(value, lw.ForwardDynamicsResult):
        if value.report.outcome != "converged":
            return  # it says so
        must_be_finite([value.acceleration, value.joint_load, value.constraint_force], what)
    elif isinstance(value, lw.InverseDynamicsResult):
        must_be_finite([value.tau, value.loop_tau, value.joint_load], what)


def check_run(run):
    """Extremes are NaN where a joint has no such quantity, or ended before its first step; works
    are where a run that ended early went astray within a step."""
    for name, variable in run.dataset.variables.items():
        if name in WORKS and not run.completed:
            continue
        if not str(name).startswith("extreme_"):
            must_be_finite(variable.values, f"{name} of the run")
        elif run.completed and variable.dtype.kind == "f" and np.isinf(variable.values).any():
            raise Finding(f"{name} of the run is infinite")
