"""Functions of a run that take batches and sweeps too, member by member."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar, cast

import numpy as np

from linkwise._core import InputError, Model
from linkwise.base import AnyArray
from linkwise.record.schema import DETERMINATE

if TYPE_CHECKING:
    import xarray as xr

    from linkwise.loads.samples import RunLike

P = ParamSpec("P")
T = TypeVar("T")
#: Booleans, false where a member has no samples.
_MASKS = (
    DETERMINATE,
    *(f"{name}_{DETERMINATE}" for name in ("wrench", "force", "moment")),
)
_MOST_TEXTS = 3  # of attributes in which members differ


@dataclass(frozen=True)
class _Member:
    """One member as a run; its samples end where the member did."""

    dataset: xr.Dataset
    path: Path | None = None

    @property
    def outcome(self) -> str:
        return str(self.dataset.coords["outcome"].values)

    def load_model(self) -> Model:
        raise InputError("run: members do not hold their machine; give model=")


def each_member(
    function: Callable[Concatenate[RunLike, P], T],
) -> Callable[Concatenate[RunLike | xr.Dataset, P], T]:
    """`function` of a run, which may also be what `simulate_batch` or `sweep` returned.

    Then the result has the members' dimensions in front and their coordinates, and NaN where a
    member has no samples. `model` is the machine, or a sequence with the one of each member along
    the first of these dimensions.
    """

    @functools.wraps(function)
    def of_each(run: Any, *args: P.args, **kwargs: P.kwargs) -> T:
        dataset: Any = run if hasattr(run, "data_vars") else getattr(run, "dataset", None)
        dims = [] if dataset is None else member_dims(dataset)
        if not dims:
            return function(run, *args, **kwargs)
        signature = inspect.signature(function)
        arguments = signature.bind(run, *args, **kwargs).arguments
        arguments.pop(next(iter(arguments)))
        machines = arguments.pop("model", None) or getattr(run, "_model", None)
        models = _machines(dataset, dims[0], machines)
        if not (machines is None or isinstance(machines, Model)):
            dataset = dataset.copy()
            dataset.attrs.pop("model_hash", None)  # a batch has that of its first machine

        def of_one(member: xr.Dataset, model: Model | None) -> Any:
            if "model" in signature.parameters:
                arguments["model"] = model
            return function(_Member(member), **arguments)  # type: ignore[call-arg]

        made = _along(dataset, dims, models, of_one, "")
        if made is None:
            raise InputError("run: no member holds a sample")
        kept = {k: c for k, c in dataset.coords.items() if c.dims and set(c.dims) <= set(dims)}
        result: T = made.assign_coords(kept)
        return result

    return cast("Callable[Concatenate[RunLike | xr.Dataset, P], T]", of_each)


def member_dims(dataset: xr.Dataset) -> list[str]:
    """The dimensions of the members, which stand before the time; none of a single run."""
    timed = [v for v in dataset.data_vars.values() if "time" in v.dims]
    if not timed:
        return []
    return [str(dim) for dim in timed[0].dims[: timed[0].dims.index("time")]]


def _machines(
    dataset: xr.Dataset, dim: str, model: Model | Sequence[Model] | None
) -> list[Model | None]:
    """The machine of each member along `dim`."""
    count = dataset.sizes[dim]
    if model is None or isinstance(model, Model):
        several = dim == "model" or "model_hash" not in dataset.attrs
        if isinstance(model, Model) and several and count > 1:
            raise InputError(
                f"model: members are of different machines; give the {count} of them along {dim!r}"
            )
        return [model] * count
    models = list(model)
    if len(models) != count or not all(isinstance(one, Model) for one in models):
        raise InputError(f"model: give a Model, or the {count} of the members along {dim!r}")
    return list(models)


def _along(
    dataset: xr.Dataset,
    dims: Sequence[str],
    models: Sequence[Model | None],
    function: Callable[[xr.Dataset, Model | None], Any],
    where: str,
) -> Any:
    """The results of all members put together; None where none of them holds samples."""
    import xarray as xr

    dim, found = dims[0], {}
    for k in range(dataset.sizes[dim]):
        member, model = dataset.isel({dim: k}), models[k]
        here = f"{where}{dim} {k}: "
        if len(dims) > 1:
            models_here = [model] * dataset.sizes[dims[1]]
            made = _along(member, dims[1:], models_here, function, here)
        else:
            made = _of_one(member, model, function, here)
        if made is not None:
            found[k] = made
    if not found:
        return None
    joined = xr.concat(
        list(found.values()),
        dim=dim,
        data_vars="all",
        coords=_own_coordinates(list(found.values())),
        compat="override",
        join="outer",
        combine_attrs=_common_attrs,
    )
    if len(found) == dataset.sizes[dim]:
        return joined
    return joined.assign_coords({dim: list(found)}).reindex(
        {dim: range(dataset.sizes[dim])}, fill_value=dict.fromkeys(_MASKS, False)
    )


def _own_coordinates(parts: Sequence[Any]) -> list[str]:
    """Coordinates of each member, such as places along links of other lengths."""
    first = parts[0].coords
    differ = (
        name
        for name in first
        if first[name].dims
        and name not in first[name].dims
        and not all(name in p.coords and p.coords[name].equals(first[name]) for p in parts)
    )
    return list(dict.fromkeys([*(name for name in _MASKS if name in first), *map(str, differ)]))


def _of_one(
    member: xr.Dataset,
    model: Model | None,
    function: Callable[[xr.Dataset, Model | None], Any],
    where: str,
) -> Any:
    there = _samples(member)
    if not there.any():
        return None
    try:
        return function(member.isel(time=np.flatnonzero(there)), model)
    except InputError as error:
        raise InputError(f"{where}{error}") from None


def _samples(member: xr.Dataset) -> AnyArray:
    """Which samples are the member's own: those after its end are NaN."""
    name = next(n for n, v in member.data_vars.items() if "time" in v.dims)
    values = member["joint_load" if "joint_load" in member else name].transpose("time", ...).values
    there: AnyArray = ~np.isnan(values.reshape(len(values), -1)).any(axis=1)
    return there


def _common_attrs(attrs: Sequence[Mapping[str, Any]], context: object = None) -> dict[str, Any]:
    """Attributes that members share, and of others what some of them say."""
    found: dict[str, Any] = {}
    for key in dict.fromkeys(key for one in attrs for key in one):
        texts = list(dict.fromkeys(str(one[key]) for one in attrs if key in one))
        more = len(texts) - _MOST_TEXTS
        first = next(one[key] for one in attrs if key in one)
        joined = "; or ".join(texts[:_MOST_TEXTS]) + (f"; or {more} others" if more > 0 else "")
        found[key] = first if len(texts) == 1 else joined
    return found
