"""Solution: the recording of a run with its status, statistics, diagnostics, final state and references."""

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core import Diagnostic, Reference, SimulationError, Status
from ...recording import Recording
from ...recording.columns import column_units
from ...recording.notebook import Card, NotebookDisplay
from ...recording.plot import plot_columns
from ...recording.recording import recording_card
from ..loop.control_loop import ControlLoopState
from .problem import Problem

if TYPE_CHECKING:
    import pandas as pd


class Statistics(NamedTuple):
    """Accepted and rejected steps of an integrator."""

    steps: int
    rejected_steps: int


@dataclasses.dataclass(frozen=True, eq=False)
class Solution(NotebookDisplay):
    """The solution of a Problem, as far as it was computed.

    recording      states, outputs and inputs at the output times; its notes are the diagnostics
    status         how the run ended
    statistics     steps of the integrator
    diagnostics    what the reader must know: assumptions, extrapolation, an early end
    final_time     [s], and
    final_state    by state: the end of the run, or where it failed; of a control loop the last sampling instant from
                   which the run can be continued
    control_state  of a control loop, for a Problem that continues the run
    """

    problem: Problem
    recording: Recording
    status: Status
    statistics: Statistics
    diagnostics: tuple[Diagnostic, ...]
    final_time: float
    final_state: Mapping[str, float]
    control_state: ControlLoopState | None = None

    @property
    def complete(self) -> bool:
        """Whether the run reached its end."""
        return self.status == Status.DONE

    @property
    def references(self) -> list[Reference]:
        """Sources of the models, of the integrator and of the controller."""
        return list(self.problem.references)

    def continuation(self, duration: float) -> Problem:
        """The Problem that continues this run for `duration` [s] from its final state, at the same output spacing.

        After a list of output times the default spacing is used. Raises ParameterError for a duration <= 0.
        """
        given = self.problem.output_times
        return dataclasses.replace(
            self.problem,
            duration=duration,
            initial_state=self.final_state,
            start_time=self.final_time,
            output_times=given if isinstance(given, float | int) else None,
            control_state=self.control_state,
        )

    def raise_if_incomplete(self) -> "Solution":
        """The solution itself; raises SimulationError with the solution if the run ended early."""
        if self.complete:
            return self
        raise SimulationError(self.diagnostics[-1].message, self, interrupted=self.status == Status.INTERRUPTED)

    def to_pandas(self) -> "pd.DataFrame":
        """The recording as a data frame."""
        return self.recording.to_pandas()

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Plot the named columns, or all, over time, as `Recording.plot`, with the units of the system."""
        units = column_units(self.problem.system, [])
        columns = {name: self.recording[name] for name in (names or self.recording) if name != "time"}
        options: dict[str, Any] = {"ax": ax, "units": units, "ordered": not names}
        return plot_columns(columns, self.recording["time"], self.recording.origin, **options)

    def _card(self) -> Card:
        card = recording_card(self.recording, column_units(self.problem.system, []))
        text = f"{self.status.name}, {self.statistics.steps} steps, {self.statistics.rejected_steps} rejected"
        notes = [f"{text}, final time {self.final_time:.4g} s", *(each.message for each in self.diagnostics)]
        return dataclasses.replace(card, title=f"Solution: {card.title}", notes=notes)

    def __repr__(self) -> str:
        return f"Solution({self.status.name}, {self.statistics.steps} steps, {self.recording!r})"
