"""What a batch returns: for every plant its end, the columns that were kept, and whether it got there."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ...compile import System
from ...core.arrays import Array
from ...core.errors import ColumnError, suggestion
from ...plant.plant import Plant
from ...recording import Recording
from ..diagnostics import validity_warnings
from ..integrators import REASONS
from ..result import describe_friction, extrapolation_warnings
from .variations import Variations

NOT_STARTED = 6
WORDS = {**REASONS, NOT_STARTED: "it had no start"}


@dataclasses.dataclass(frozen=True, eq=False)
class BatchSolution:
    """N plants that were run together.

    time     (T,) instants [s] of the columns, the same for all
    columns  by name (N, T), those that were kept; NaN where a plant did not get there
    final    by state (N,), where each plant ended: at the end of the run, or where it failed
    status   (N,) 0 where a plant got to the end; `reason(i)` says in words why not
    reached  (N,) how many rows each plant got to
    notes    what is true of all of them: the method, the precision
    """

    variations: Variations
    time: Array
    columns: Mapping[str, npt.NDArray[Any]]
    final: Mapping[str, Array]
    status: npt.NDArray[np.int64]
    reached: npt.NDArray[np.int64]
    reasons: Mapping[int, str]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return self.status.size

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """A kept column (N, T) by its name."""
        if name not in self.columns:
            known = ", ".join(self.columns) or "none; name them in keep"
            raise ColumnError(f"batch: no column '{name}'; kept are {known}.{suggestion(name, self.columns)}")
        return self.columns[name]

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """The plants that did not get to the end."""
        return np.flatnonzero(self.status)

    @property
    def interrupted(self) -> bool:
        """Whether the user ended the batch before all plants were run."""
        return bool((self.status == 5).any())

    def reason(self, index: int) -> str:
        """How a plant's run ended, in words."""
        index = self._place(index)
        return self.reasons.get(int(index), WORDS[int(self.status[index])])

    def plant(self, index: int) -> System:
        """One of the plants."""
        return self.variations.one(self._place(index))

    def _place(self, index: int) -> int:
        """The number of a plant, counted from the end where it is negative."""
        if not isinstance(index, int | np.integer) or not -len(self) <= index < len(self):
            raise ColumnError(f"batch: there is no plant {index}; there are 0 to {len(self) - 1}.")
        return int(index) % len(self)

    def recording(self, index: int) -> Recording:
        """The kept columns of one plant as a Recording, as far as it got."""
        index = self._place(index)
        system = self.plant(index)
        rows = slice(int(self.reached[index]))
        kept = {name: np.asarray(values[index, rows], dtype=float) for name, values in self.columns.items()}
        columns = {"time": self.time[rows], **kept}
        constants: dict[str, float | str] = {}
        notes = [f"plant {index} of a batch", *self.notes]
        if isinstance(system, Plant):
            constants = {"ambient": system.ambient.pressure}
            if len(system.muscles) == 1:
                constants["resting_length"] = system.muscles[0].geometry.resting_length
            notes += [f"gas: {system.gas}", describe_friction(system)]
            if all(f"{p}{name}" in columns for p in system.prefixes for name in ("pressure", "contraction")):
                notes += extrapolation_warnings(system, columns)
            notes += validity_warnings(system, columns) if self.reached[index] else []
        if self.status[index]:
            notes.append(self.reason(index))
        return Recording(columns, "simulation", constants, tuple(notes))

    def __repr__(self) -> str:
        failed = f", {self.failed.size} did not get to the end" if self.failed.size else ""
        kept = f"{', '.join(self.columns)} at {self.time.size} instants" if self.columns else "final states"
        return f"Batch({len(self)} plants: {kept}{failed})"
