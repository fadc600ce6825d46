"""Solution: the recording of a run with its status, statistics, diagnostics, final state and
references.
"""

import dataclasses
import functools
import operator
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core import Array, Columns, Diagnostic, DiagnosticCode, Reference, SimulationError, Status
from ...recording import Recording
from ...recording.columns import column_units
from ...recording.notebook import Card, NotebookDisplay
from ...recording.plot import plot_columns
from ...recording.recording import recording_card
from ..compile.cache.kernel import record
from ..compile.program import CompiledSystem
from ..loop.control_loop import ControlLoopState
from ..loop.inputs import PiecewiseLinear
from .integrators import RawSolution
from .problem import Problem

if TYPE_CHECKING:
    import pandas as pd

_HINTS = {
    Status.TOO_MANY_STEPS: (
        "Raise the tolerance, lengthen a fixed step, or look for a valve that chatters."
    ),
    Status.INTERRUPTED: "Nothing is lost; the rows until then are in the recording.",
    Status.NON_FINITE_COMMAND: "Check the last measurement of the controller, and its parameters.",
}
_GENERAL_HINT = (
    "Check the last state: a parameter may be far from physical, or a fixed step too long."
)
_name = functools.lru_cache(maxsize=32)(str)
"""The text of an integrator."""


class RowTable(NamedTuple):
    """Inputs (N, m) and outputs (N, k) of a run, the ranges of its columns with limits, the first
    row not finite.

    lower, upper   smallest and largest values of the `ranged_names` of the system's description
    """

    inputs: Array
    outputs: Array
    lower: list[float]
    upper: list[float]
    first_invalid: int


class RowRecorder:
    """The kernel of the rows, bound to a compiled system. For one thread at a time."""

    def __init__(self, compiled: CompiledSystem) -> None:
        self.sizes = compiled.sizes
        columns = compiled.description.ranged_columns
        sizes = self.sizes
        self._ranges = np.empty((2, columns.size))
        function, width = compiled.program.outputs_at_rows
        no_inputs = np.empty((0, sizes.inputs))
        self._kernel = record.bind(
            function=function,
            c=compiled.precomputed,
            states=np.empty((0, sizes.states)),
            times=np.empty(0),
            begin=0.0,
            ends=np.empty(0),
            values=no_inputs,
            slopes=no_inputs,
            inputs=np.empty((0, sizes.inputs)),
            outputs=np.empty((0, sizes.outputs)),
            columns=columns,
            lower=self._ranges[0],
            upper=self._ranges[1],
            x=np.zeros((width, sizes.states)),
            u=np.zeros((width, sizes.inputs)),
            o=np.zeros((width, sizes.outputs)),
        )

    def adopt(self, compiled: CompiledSystem) -> None:
        """Take another compiled system of the same structure."""
        self._kernel.replace("c", compiled.precomputed)

    def evaluate(
        self, states: Array, times: Array, segments: PiecewiseLinear, start: float
    ) -> RowTable:
        """Inputs and outputs at states (N, n) and rising times (N,) of a run whose segments begin
        at `start` [s].
        """
        count = times.size
        inputs = np.empty((count, self.sizes.inputs))
        outputs = np.empty((count, self.sizes.outputs))
        kernel = self._kernel
        kernel.replace("states", states)
        kernel.replace_input("times", times)
        kernel.replace("begin", start)
        kernel.replace_input("ends", segments.ends)
        kernel.replace_input("values", segments.values)
        kernel.replace_input("slopes", segments.slopes)
        kernel.replace("inputs", inputs)
        kernel.replace("outputs", outputs)
        first = self._kernel()
        lower, upper = self._ranges.tolist()
        return RowTable(inputs, outputs, lower, upper, first)


def possible_rows(
    compiled: CompiledSystem,
    raw: RawSolution,
    times: Array,
    segments: PiecewiseLinear,
    start: float,
) -> tuple[RawSolution, RowTable]:
    """The solution with inputs and outputs of its rows, up to the first row that is impossible.

    Numbers can go on although the model does not hold: a fixed step can end in numbers that are far
    off; isothermal air has a pressure, below vacuum, in a negative volume. `start` [s] is where
    segments begin. For a system with its own parameters, whose recorder is kept with its
    description.
    """
    known = compiled.description
    all_reached = raw.reached == times.size
    positive = known.positive_outputs
    idle = known.cache.recorders
    shown = (raw.rows, times) if all_reached else (raw.rows[: raw.reached], times[: raw.reached])
    recorder: RowRecorder = idle.borrow(None) or RowRecorder(compiled)
    table = recorder.evaluate(*shown, segments, start)
    idle.give_back(None, recorder)
    if table.first_invalid == raw.reached and all(
        map(operator.ge, table.lower, known.range_floors)
    ):
        return raw, table
    reasons: dict[Status, Any] = {
        Status.NOT_FINITE: ~np.isfinite(table.outputs).all(axis=1),
        Status.NEGATIVE_AIR_MASS: (raw.rows[: raw.reached] < known.lower_bounds).any(axis=1),
        Status.NON_POSITIVE_VOLUME: (table.outputs[:, positive] <= 0.0).any(axis=1),
    }
    invalid = np.flatnonzero(np.any(list(reasons.values()), axis=0))
    if not invalid.size:
        return raw, table
    row = int(invalid[0])
    status = next(status for status, rows in reasons.items() if rows[row])
    raw = raw._replace(reached=row, time=float(times[row]), state=raw.rows[row], status=status)
    inputs = table.inputs[:row]
    outputs = table.outputs[:row]
    columns_of_rows = (
        np.hstack([raw.rows[:row], outputs])
        if row
        else np.full((1, outputs.shape[1] + raw.state.size), np.nan)
    )
    columns = columns_of_rows[:, known.ranged_columns]
    return raw, RowTable(
        inputs, outputs, columns.min(axis=0).tolist(), columns.max(axis=0).tolist(), row
    )


def status_of_state(
    compiled: CompiledSystem, segments: PiecewiseLinear, start: float, state: Array, time: float
) -> Status:
    """DONE, or why a state (n,) at a time [s] of a run is impossible; arguments as of
    `possible_rows`.
    """
    raw = RawSolution(state[np.newaxis].copy(), 1, time, state, Status.DONE, 0, 0)
    return possible_rows(compiled, raw, np.array([time]), segments, start)[0].status


def make_solution(
    problem: Problem,
    raw: RawSolution,
    table: RowTable,
    times: Array,
    end: tuple[float, Array],
    more: dict[str, Array],
    before: tuple[Diagnostic, ...] = (),
    control_state: ControlLoopState | None = None,
) -> "Solution":
    """The solution of a problem from the rows that were reached, with its diagnostics as notes of
    the recording.

    end     final time [s] and state (n,)
    more    further columns
    before  diagnostics that come first
    """
    compiled = problem.compiled
    known = compiled.description
    reached = raw.reached
    states = raw.rows
    if reached < times.size:
        states = states[:reached]
        times = times[:reached]
    for array in (times, states, table.outputs, table.inputs, *more.values()):
        array.setflags(write=False)
    values = times, *states.T, *table.outputs.T, *table.inputs.T
    columns: dict[str, Array] = dict(zip(known.recorded_names, values, strict=True))
    columns.update(more)
    text = f"simulated by {_name(problem.integrator)}: {raw.steps} steps, {raw.rejected} rejected"
    diagnostics = [*before, Diagnostic(DiagnosticCode.INTEGRATOR, "integrator", text)]
    notes = [*(diagnostic.message for diagnostic in diagnostics), *known.remark_texts]
    diagnostics += known.remarks
    later: list[Diagnostic] = []
    if reached:
        later += compiled.system.diagnose(
            Columns(columns, known.range_places, table.lower, table.upper)
        )
    if raw.status != Status.DONE:
        later.append(early_end(compiled, raw, problem.end_time))
    notes += [diagnostic.message for diagnostic in later]
    recording = Recording.from_arrays(
        columns, "simulation", known.constants, tuple(notes), problem.references
    )
    final = dict(zip(known.state_names, end[1].tolist(), strict=True))
    statistics = Statistics(raw.steps, raw.rejected)
    remarks = (*diagnostics, *later)
    return Solution(
        problem, recording, raw.status, statistics, remarks, end[0], final, control_state
    )


def early_end(compiled: CompiledSystem, raw: RawSolution, end: float) -> Diagnostic:
    """Time, reason and state of an early end of a run, and the remedy."""
    hint = _HINTS.get(raw.status, _GENERAL_HINT)
    if raw.status != Status.INTERRUPTED:
        state = dict(zip(compiled.description.state_names, raw.state.tolist(), strict=True))
        hint = compiled.system.failure_hint(state) or hint
    return Diagnostic(
        DiagnosticCode.INCOMPLETE, "run", reason_of_end(compiled, raw, end), hint=hint
    )


def reason_of_end(compiled: CompiledSystem, raw: RawSolution, end: float) -> str:
    """Time, reason and state of an early end of a run, without a full stop."""
    texts = []
    for variable, value in zip(compiled.system.states, raw.state.tolist(), strict=True):
        unit = "" if variable.unit in ("", "1") else f" {variable.unit}"
        texts.append(f"{variable.name} {value:.4g}{unit}")
    state = ", ".join(texts)
    why = f"{raw.status.message}, after {raw.steps} steps, at {state}"
    return f"the run ended at {raw.time:.6g} of {end:.6g} s because {why}"


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
    final_state    by state: the end of the run, or where it failed; of a control loop the last
                   sampling instant from which the run can be continued
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
        """The Problem that continues this run for `duration` [s] from its final state, at the same
        output spacing.

        After a list of output times the default spacing is used. Raises ParameterError for a
        duration <= 0.
        """
        requested = self.problem.output_times
        return dataclasses.replace(
            self.problem,
            duration=duration,
            initial_state=self.final_state,
            start_time=self.final_time,
            output_times=requested if isinstance(requested, float | int) else None,
            control_state=self.control_state,
        )

    def raise_if_incomplete(self) -> "Solution":
        """The solution itself; raises SimulationError with the solution if the run ended early."""
        if self.complete:
            return self
        raise SimulationError(
            self.diagnostics[-1].message, self, interrupted=self.status == Status.INTERRUPTED
        )

    def to_pandas(self) -> "pd.DataFrame":
        """The recording as a data frame."""
        return self.recording.to_pandas()

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Plot the named columns, or all, over time, as `Recording.plot`, with the units of the
        system.
        """
        units = column_units(self.problem.system, [])
        columns = {name: self.recording[name] for name in names or self.recording if name != "time"}
        options: dict[str, Any] = {"ax": ax, "units": units, "ordered": not names}
        return plot_columns(columns, self.recording["time"], self.recording.origin, **options)

    def _card(self) -> Card:
        card = recording_card(self.recording, column_units(self.problem.system, []))
        text = (
            f"{self.status.name}, {self.statistics.steps} steps, {self.statistics.rejected_steps}"
            " rejected"
        )
        notes = [
            f"{text}, final time {self.final_time:.4g} s",
            *(diagnostic.message for diagnostic in self.diagnostics),
        ]
        return dataclasses.replace(card, title=f"Solution: {card.title}", notes=notes)

    def __repr__(self) -> str:
        return f"Solution({self.status.name}, {self.statistics.steps} steps, {self.recording!r})"
