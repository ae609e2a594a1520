"""Parameter sweeps: one scenario with many values, run side by side into one Dataset."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise._core import InputError
from linkwise.io.complaint import shown
from linkwise.notes import Ignored, quiet, recorded_warnings, tell, warning_attrs, warnings_of
from linkwise.scenario import Scenario, load_scenario, variant
from linkwise.simulation.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

MOST_MEMBERS = 10_000


def _simulate(scenario: Scenario) -> xr.Dataset:
    """One member, in a process of its own; its samples in memory."""
    with quiet():
        model = scenario.load_model()
        arguments = scenario.simulate_arguments(model)
        arguments["output"] = None
        return simulate(model, **arguments, on_failure="return").dataset


def _check(scenario: Scenario) -> list[Ignored]:
    """What was ignored in a member; InputError if it cannot be simulated, before any member is."""
    with quiet():
        model = scenario.load_model()
    scenario.simulate_arguments(model)
    return warnings_of(model)


def _coordinate(values: Sequence[Any]) -> Any:
    """The values of one axis, one per member, as an array that files can hold."""
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return np.array(values, dtype=np.float64)
    return np.array([v if isinstance(v, str) else repr(v) for v in values], dtype=np.str_)


def sweep(
    scenario: Scenario | str | os.PathLike[str],
    axes: Mapping[str, Sequence[Any]],
    *,
    processes: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> xr.Dataset:
    """Simulate a scenario with every combination of values.

    Args:
        scenario: The scenario file, or what `load_scenario` returned.
        axes: Values by dotted key: `{"payload.box.mass": [0, 5, 10], "drive.elbow.table":
            ["slow.csv", "fast.csv"]}`.
        processes: How many run side by side; one per processor by default. Results do not depend on
            it.
        progress: Called with the number of members done and of all.

    Returns:
        The runs' variables with a first dimension `member`, whose coordinates are the keys of
        `axes` and `outcome`. Samples after a member's end are NaN. Pick one out by
        `linkwise.Run(dataset.sel(member=k))`. What was ignored or assumed in any member, and what
        its run noticed, is in the attribute `warnings`; the former is one ModelWarning, too.

    Raises:
        InputError: a member is wrong; nothing was simulated.
    """
    import xarray as xr

    base = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    for key, values in axes.items():
        if isinstance(values, str) or not len(values):
            raise InputError(f"axes[{shown(key)}]: give a list of values")
    combinations = list(itertools.islice(itertools.product(*axes.values()), MOST_MEMBERS + 1))
    if len(combinations) > MOST_MEMBERS:
        raise InputError(f"axes: more than {MOST_MEMBERS} members; sweep fewer values")
    members = [variant(base, dict(zip(axes, values, strict=True))) for values in combinations]
    ignored = dict.fromkeys(entry for member in members for entry in _check(member))
    tell(ignored, reading=True)
    datasets = _run_all(members, processes, progress)
    joined = xr.concat(
        datasets,
        dim="member",
        data_vars="all",
        coords="minimal",
        compat="override",
        join="outer",
        combine_attrs="drop_conflicts",
    )
    columns: dict[str, Any] = {
        key: ("member", _coordinate([values[k] for values in combinations]))
        for k, key in enumerate(axes)
    }
    outcomes = [str(dataset.attrs["outcome"]) for dataset in datasets]
    columns |= {"member": np.arange(len(members)), "outcome": ("member", outcomes)}
    return joined.assign_coords(columns).assign_attrs(_warnings(ignored, datasets))


def _warnings(ignored: Iterable[Ignored], datasets: Iterable[xr.Dataset]) -> dict[str, str]:
    """The models' own and what the members' runs noticed, each once."""
    noticed = (entry for dataset in datasets for entry in recorded_warnings(dataset.attrs))
    found = {(entry.element, entry.text): entry for entry in ignored}
    for entry in noticed:
        found.setdefault((entry["element"], entry["text"]), Ignored("", **entry))
    return warning_attrs(found.values())


def _run_all(
    members: Sequence[Scenario],
    processes: int | None,
    progress: Callable[[int, int], object] | None,
) -> list[xr.Dataset]:
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from concurrent.futures.process import BrokenProcessPool
    from multiprocessing import get_context

    wanted = processes if processes is not None else len(os.sched_getaffinity(0))
    if isinstance(wanted, bool) or not isinstance(wanted, int) or wanted < 1:
        raise InputError(f"processes: is {shown(wanted)}; give a whole number above zero")
    count = min(wanted, len(members))
    if count == 1:
        found = []
        for k, member in enumerate(members):
            found.append(_simulate(member))
            if progress is not None:
                progress(k + 1, len(members))
        return found
    # Spawned, not forked: a forked process would inherit threads of the caller's libraries.
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        waiting = [pool.submit(_simulate, member) for member in members]
        try:
            for done, _ in enumerate(as_completed(waiting), start=1):
                if progress is not None:
                    progress(done, len(members))
        except BrokenProcessPool:
            raise RuntimeError(
                "sweep: a process ended early; in a script, call sweep under "
                "if __name__ == '__main__':, or give processes=1"
            ) from None
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        return [future.result() for future in waiting]
