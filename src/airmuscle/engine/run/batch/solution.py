"""BatchSolution: final states, stored columns and status of every plant."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core.arrays import Array
from ....core.diagnostics import Columns, Status
from ....core.errors import ColumnError, suggestion
from ....core.reference import Reference, cite
from ....core.system import System
from ....recording import Recording
from ..integrators import Integrator
from .variations import Variations


@dataclasses.dataclass(frozen=True, eq=False)
class BatchSolution:
    """The solution of N plants that were simulated together.

    time     (T,) times [s] of the columns, the same for all
    columns  by name (N, T), those that were kept; NaN beyond the row that a plant reached
    final    by state (N,), at the end of the run, or where a plant failed
    status   (N,) values of Status, DONE where a plant reached the end; `reason(i)` says why not
    reached  (N,) number of rows of each plant
    notes    remarks that hold for all: integrator, precision
    """

    variations: Variations
    integrator: Integrator
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
        """A stored column (N, T) by its name, or the times (T,) [s] of all, `batch["time"]`."""
        if name == "time" and name not in self.columns:
            return self.time
        if name not in self.columns:
            known = ", ".join(self.columns) or "none; name them in keep"
            raise ColumnError(f"batch: no column '{name}'; kept are {known}.{suggestion(name, self.columns)}")
        return self.columns[name]

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """The plants that did not reach the end."""
        return np.flatnonzero(self.status)

    @property
    def interrupted(self) -> bool:
        """Whether the user ended the batch before all plants were simulated."""
        return bool((self.status == Status.INTERRUPTED).any())

    @property
    def references(self) -> list[Reference]:
        """Sources of the models and of the integrator."""
        return cite((self.variations.system, self.integrator))

    def reason(self, index: int) -> str:
        """How the run of a plant ended."""
        index = self._row(index)
        return self.reasons.get(index, Status(int(self.status[index])).message)

    def plant(self, index: int) -> System:
        """One of the plants."""
        return self.variations.one(self._row(index))

    def _row(self, index: int) -> int:
        """The row of a plant, counted from the end where the index is negative."""
        if not isinstance(index, int | np.integer) or not -len(self) <= index < len(self):
            raise ColumnError(f"batch: there is no plant {index}; there are 0 to {len(self) - 1}.")
        return int(index) % len(self)

    def recording(self, index: int) -> Recording:
        """The stored columns of one plant as a Recording, up to the end of its run."""
        index = self._row(index)
        system = self.plant(index)
        rows = slice(int(self.reached[index]))
        kept = {name: np.asarray(values[index, rows], dtype=float) for name, values in self.columns.items()}
        columns = {"time": self.time[rows], **kept}
        remarks = [*system.describe(), *(system.diagnose(Columns(columns)) if self.reached[index] else [])]
        notes = [f"plant {index} of a batch", *self.notes, *map(str, remarks)]
        if self.status[index]:
            notes.append(self.reason(index))
        return Recording(columns, "simulation", system.constants, tuple(notes), references=tuple(self.references))

    def __repr__(self) -> str:
        failed = f", {self.failed.size} failed" if self.failed.size else ""
        kept = f"{', '.join(self.columns)} at {self.time.size} times" if self.columns else "final states"
        return f"BatchSolution({len(self)} plants: {kept}{failed})"
