"""Run: the results of one simulation, labelled, with units and provenance."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linkwise._core import InputError
from linkwise.base import printable
from linkwise.loads.extremes import missed_peaks
from linkwise.loads.peaks import peak_loads
from linkwise.notes import recorded_warnings, warning_lines
from linkwise.plot.run_figures import RunPlots
from linkwise.record.export import write_csv, write_netcdf
from linkwise.record.model import read_model

if TYPE_CHECKING:
    import xarray as xr

    from linkwise._core import Model


class Run:
    """The results of one simulation.

    Wraps an xarray Dataset, `run.dataset`: attributes and items fall through to it, so that
    `run.joint_load.sel(joint="elbow")`, `run["position"]`, `run.attrs` and `run.sizes` work.
    Units, frames and sign conventions are in every variable's `attrs`, the provenance in
    `run.attrs`.

    Attributes:
        dataset: The xarray Dataset.
        path: The Zarr store it is read from, None for a run in memory.
    """

    def __init__(
        self,
        dataset: xr.Dataset,
        path: str | os.PathLike[str] | None = None,
        model: Model | None = None,
    ) -> None:
        self.dataset = dataset
        self.path = None if path is None else Path(os.path.abspath(path))
        self._model = model

    def __getattr__(self, name: str) -> Any:
        # Only called for what Run itself lacks; while unpickling there is no dataset yet.
        if name.startswith("__") or name == "dataset":
            raise AttributeError(name)
        try:
            return getattr(self.dataset, name)
        except AttributeError:
            held = ", ".join(str(key) for key in self.dataset.data_vars)
            raise AttributeError(f"run has no {name!r}; it holds {held}") from None

    def __getitem__(self, key: Any) -> Any:
        return self.dataset[key]

    def __contains__(self, key: object) -> bool:
        return key in self.dataset

    def __iter__(self) -> Iterator[Any]:
        return iter(self.dataset)

    def __len__(self) -> int:
        return len(self.dataset)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *dir(self.dataset)})

    @property
    def outcome(self) -> str:
        """ "converged", or how the run ended instead."""
        return str(self.dataset.attrs.get("outcome", "unknown"))

    @property
    def completed(self) -> bool:
        """Whether the run reached its end."""
        return self.outcome == "converged"

    @property
    def warnings(self) -> list[dict[str, str]]:
        """What was ignored or assumed when the machine was read, and what the integrator could not
        see of the inputs: `element` and `text` of each."""
        return recorded_warnings(self.dataset.attrs)

    def __repr__(self) -> str:
        return "\n".join(map(printable, self._summary()))

    def _repr_html_(self) -> str:
        from html import escape

        head = "<br>".join(escape(line) for line in self._summary())
        return f"<p>{head}</p>{self.dataset._repr_html_()}"

    def _summary(self) -> list[str]:
        attrs = self.dataset.attrs
        times = self.dataset["time"].values
        span = f"t = {times[0]:g} to {times[-1]:g} s" if times.size else "no samples"
        lines = [
            f"<linkwise.Run {attrs.get('model', '')!r}: {self.outcome}, {span} "
            f"in {times.size} samples, {attrs.get('model_joints', '?')} joints>"
        ]
        if not self.completed and attrs.get("message"):
            lines.append(f"  message     {attrs['message']}")
        for name, variable in self.dataset.data_vars.items():
            dims = ", ".join(f"{dim} {size}" for dim, size in variable.sizes.items())
            lines.append(f"  {name!s:<18} ({dims})  {variable.attrs.get('units', '')}")
        if "method" in attrs:
            solver = attrs.get("solver", "none")
            by = attrs["method"] if solver == "none" else f"{attrs['method']} with {solver}"
            lines.append(f"  computed by {by}")
        lines += [f"  warning     {line}" for line in warning_lines(self.warnings)]
        if self.path is not None:
            lines.append(f"  stored in   {self.path}")
        return lines

    def load_model(self) -> Model:
        """The machine that was simulated.

        Raises:
            InputError: the run does not hold it.
        """
        if self._model is None:
            if self.path is None:
                raise InputError("run does not hold its model; give the model as well")
            self._model = read_model(self.path)
        return self._model

    @property
    def plot(self) -> RunPlots:
        """Figures of this run: `run.plot.loads("elbow")`, `.split("elbow")`, `.energy()`."""
        return RunPlots(self)

    def peak_loads(self) -> xr.Dataset:
        """Largest force and moment of each joint, and when: `linkwise.loads.peak_loads`."""
        return peak_loads(self)

    def to_netcdf(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to one NetCDF-4 file (also an HDF5 file); replaces an existing file."""
        return write_netcdf(self.dataset, path)

    def to_csv(self, path: str | os.PathLike[str], quantity: str | None = None) -> list[Path]:
        """Write tables with a row per sample and a column per scalar, the first one `time [s]`.

        Args:
            path: A folder, which gets one file per quantity, and `extremes.csv` where the run holds
                them: the smallest and the largest value of each column, between the samples too.
                Or a `.csv` file for one quantity; UserWarning where its samples miss peaks of the
                loads.
            quantity: Which one, when `path` is a file: a variable's name, "energy" or "statistics".

        Returns:
            The files written.
        """
        written = write_csv(self.dataset, path, quantity)
        if quantity == "joint_load" and len(written) == 1:
            missed = missed_peaks(self)
            if missed:
                text = f"{written[0].name}: {missed[0]}; a folder gets extremes.csv as well"
                warnings.warn(text, UserWarning, stacklevel=2)
        return written
