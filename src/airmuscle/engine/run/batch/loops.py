"""Control loops of a batch: one for all plants or one for each, and controllers whose parameters differ."""

import dataclasses
import functools
import threading
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core import Array, ParameterError, System
from ...compile.program import CompiledSystem
from ...loop import COMMAND, MEASURED, SETPOINT, ControlLaw, ControlLoop, designed_loop
from ..compiled_loop import CompiledLoop, CompiledRun
from ..integrators import Integrator
from ..problem import Problem
from ..sampled_loop import SampledLoop, first_rows_of, prepare_loop
from .variations import Variations, variations_of

CONTROLLER = "controller."
"""Prefix of the paths of a controller's parameters among variations."""


@dataclasses.dataclass(frozen=True, eq=False)
class LoopBatch:
    """The control loops of N plants.

    template  a problem with the plant, for which loops are prepared; its output times are the rows
    loops     one for all plants, or one for each
    laws      the controllers, where their parameters differ
    """

    template: Problem
    loops: tuple[ControlLoop, ...]
    laws: Variations | None
    times: Array
    _prepared: dict[int, CompiledLoop] = dataclasses.field(default_factory=dict)
    _preparing: Any = dataclasses.field(default_factory=threading.Lock)
    _idle: dict[int, list[CompiledRun]] = dataclasses.field(default_factory=dict)
    _at_rows: dict[int, tuple[npt.NDArray[np.intp], Array]] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(
        cls, plant: System, loops: tuple[ControlLoop, ...], laws: Variations | None, span: tuple[float, float],
        times: Array, integrator: Integrator,
    ) -> "LoopBatch":  # fmt: skip
        """The loops of plants that are simulated over a span (start, duration) [s] with rows at `times` (N,)."""
        start, duration = span
        template = Problem(plant, loops[0], duration, start_time=start, integrator=integrator)
        return cls(template, loops, laws, times)

    @functools.cached_property
    def column_names(self) -> tuple[str, ...]:
        """The columns that loops add to those of the plant."""
        controller = self.loops[0].controller
        kinds = (
            (SETPOINT, controller.setpoints),
            (MEASURED, controller.measured_columns),
            (COMMAND, controller.inputs),
        )
        return tuple(f"{prefix}{name}" for prefix, names in kinds for name in names)

    def loop_of(self, index: int) -> ControlLoop:
        """The loop of one plant."""
        return self.loops[index if len(self.loops) > 1 else 0]

    def prepared(self, loop: ControlLoop) -> SampledLoop:
        """A loop prepared for runs with rows at the times of the batch."""
        return self._loop(loop).prepared

    def place_of(self, column: str) -> tuple[int, int]:
        """Whether a column that loops add is a set point (0), measurement (1) or command (2), and its number."""
        prefix, name = column.split(".", 1)
        kind = (SETPOINT, MEASURED, COMMAND).index(f"{prefix}.")
        controller = self.loops[0].controller
        names = (controller.setpoints, controller.measured_columns, controller.inputs)[kind]
        return kind, names.index(name)

    def setpoints_of(self, loop: ControlLoop) -> Array:
        """Set points (T, s) of a loop at the rows."""
        return self._rows_of(loop, self.prepared(loop))[1]

    def _rows_of(self, loop: ControlLoop, prepared: SampledLoop) -> tuple[npt.NDArray[np.intp], Array]:
        """The interval of each row (T,), and the set points (T, s) there."""
        key = id(loop)
        if key not in self._at_rows:
            at = np.maximum(np.searchsorted(prepared.instants, self.times, side="right") - 1, 0)
            self._at_rows[key] = at, prepared.setpoint_signal.inputs_at(self.times, self.template.start_time)
        return self._at_rows[key]

    def run(self, index: int, compiled: CompiledSystem, state: Array) -> CompiledRun:
        """The loop of one plant, integrated from its initial state (n,)."""
        loop = self._loop(self.loop_of(index))
        parameters = loop.parameters.copy() if self.laws is None else self.laws.parameters(index)
        run = self._compiled(loop, compiled, state, parameters)
        run.integrate()
        return run

    def _compiled(
        self, prepared: CompiledLoop, compiled: CompiledSystem, state: Array, parameters: Array
    ) -> CompiledRun:
        """A run in the arrays of one that is not needed any more, or a new one."""
        loop, start = prepared.prepared.loop, self.template.start_time
        idle = self._idle.setdefault(id(prepared), [])
        try:
            run = idle.pop()
        except IndexError:
            integrator = self.template.integrator
            assert integrator is not None
            return CompiledRun(prepared, compiled, integrator, state, loop.init(start), parameters)
        # a controller of the user may have changed its first memory, although a memory is a value
        run.restart(compiled, state, parameters, loop.init(start) if prepared.law is None else None)
        return run

    def release(self, run: CompiledRun) -> None:
        """State that nothing of a run is needed any more; its arrays serve another one."""
        self._idle[id(run.loop)].append(run)

    def _loop(self, loop: ControlLoop) -> CompiledLoop:
        """A loop prepared for its runs, once for all plants that share it."""
        with self._preparing:
            if id(loop) not in self._prepared:
                problem = dataclasses.replace(self.template, input=loop)
                prepared = self._at_times(prepare_loop(problem, loop.init(problem.start_time)))
                self._prepared[id(loop)] = CompiledLoop(problem.compiled, prepared)
        return self._prepared[id(loop)]

    def _at_times(self, prepared: SampledLoop) -> SampledLoop:
        """The same loop with rows at the times of the batch alone."""
        rows = first_rows_of(self.times, prepared.instants)
        return dataclasses.replace(prepared, times=self.times, first_rows=rows)

    def columns(self, index: int, wanted: Collection[str], run: CompiledRun, count: int) -> dict[str, Array]:
        """The wanted ones of set points, measurements and commands at the first rows (R,) of one plant."""
        controller = self.loops[0].controller
        intervals, setpoints = self._rows_of(self.loop_of(index), run.prepared)
        intervals = np.minimum(intervals[:count], max(len(run.measured) - 1, 0))
        columns: dict[str, Array] = {}
        for values, rows, prefix, names in (
            (setpoints, slice(count), SETPOINT, controller.setpoints),
            (run.measured, intervals, MEASURED, controller.measured_columns),
            (run.commanded, intervals, COMMAND, controller.inputs),
        ):
            columns |= {f"{prefix}{n}": values[rows, i] for i, n in enumerate(names) if f"{prefix}{n}" in wanted}
        return columns


def loops_of(given: Any, system: System) -> tuple[ControlLoop, ...] | None:
    """The control loops among the inputs of a batch; None where its inputs are signals.

    Raises ParameterError where signals and loops are mixed, or loops of different controllers.
    """
    inputs = tuple(given) if isinstance(given, Sequence) else (given,)
    loops = tuple(one for one in inputs if isinstance(one, ControlLoop))
    if not loops:
        return None
    if len(loops) < len(inputs):
        raise ParameterError("simulate_batch: the inputs are control loops and signals; give one kind for all plants.")
    distinct = {id(loop): designed_loop(loop, system) for loop in loops}
    loops = tuple(distinct[id(loop)] for loop in loops)
    first = _names(loops[0])
    for row, loop in enumerate(loops):
        if _names(loop) != first:
            raise ParameterError(
                f"inputs, row {row}: {type(loop.controller).__name__} measures or commands other columns than that of "
                "row 0; all loops of a batch need the same measured columns, set points and commanded inputs."
            )
    return loops


def _names(loop: ControlLoop) -> tuple[tuple[str, ...], ...]:
    controller = loop.controller
    return controller.measured_columns, controller.setpoints, controller.inputs


def vary(
    plant: System, given: Mapping[str, npt.ArrayLike], loops: tuple[ControlLoop, ...] | None, count: int | None
) -> tuple[Variations, Variations | None]:
    """The variations of the plants, and those of the controllers, whose paths begin with "controller."."""
    if not loops or not isinstance(given, Mapping):
        return variations_of(plant, given, count), None
    plants = {path: values for path, values in given.items() if not str(path).startswith(CONTROLLER)}
    laws = {path[len(CONTROLLER) :]: given[path] for path in given if path not in plants}
    if not laws:
        return variations_of(plant, plants, count), None
    controller = loops[0].controller
    if len(loops) > 1 or not isinstance(controller, ControlLaw):
        reason = "there is one loop for each plant" if len(loops) > 1 else "its controller is no ControlLaw"
        raise ParameterError(
            f"variations: '{CONTROLLER}{next(iter(laws))}' varies a parameter of the controller, but {reason}. Give a "
            "list of loops with the controllers instead."
        )
    varied = variations_of(controller, laws, count)
    return variations_of(plant, plants, len(varied.values)), varied
