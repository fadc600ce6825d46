"""Control loops of a batch: one for all plants or one for each, and controllers whose parameters differ."""

import dataclasses
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy.typing as npt

from ....core import Array, ParameterError, System
from ...compile.program import CompiledSystem, Pool
from ...loop import ControlLaw, ControlLoop, designed_loop
from ..compiled_loop import CompiledLoop, CompiledRun
from ..loop_sensitivities import CONTROLLER
from ..problem import Problem
from ..sampled_loop import first_rows_of, prepare_loop
from .variations import Variations, variations_of


@dataclasses.dataclass(frozen=True, eq=False)
class LoopBatch:
    """The control loops of N plants.

    template  a problem with the plant, for which loops are prepared
    loops     one for all plants, or one for each
    laws      the controllers, where their parameters differ
    times     (T,) of the rows
    """

    template: Problem
    loops: tuple[ControlLoop, ...]
    laws: Variations | None
    times: Array
    _prepared: dict[int, CompiledLoop] = dataclasses.field(default_factory=dict)
    _preparing: Any = dataclasses.field(default_factory=threading.Lock)
    _idle: Pool = dataclasses.field(default_factory=Pool)

    def of_plant(self, index: int) -> CompiledLoop:
        """The loop of one plant, prepared for runs with rows at the times of the batch."""
        return self.compiled(self.loops[index if len(self.loops) > 1 else 0])

    def run(self, index: int, compiled: CompiledSystem, state: Array) -> CompiledRun:
        """The loop of one plant, integrated from its initial state (n,)."""
        loop, start = self.of_plant(index), self.template.start_time
        parameters = loop.parameters.copy() if self.laws is None else self.laws.parameters(index)
        run: CompiledRun | None = self._idle.borrow(id(loop))
        if run is None:
            assert self.template.integrator is not None
            control_state = loop.prepared.loop.init(start)
            run = CompiledRun(loop, compiled, self.template.integrator, state, control_state, parameters)
        else:  # a controller of the user may have changed its first memory, although a memory is a value
            run.restart(compiled, state, parameters, loop.prepared.loop.init(start) if loop.law is None else None)
        run.integrate()
        return run

    def release(self, run: CompiledRun) -> None:
        """State that nothing of a run is needed any more; its arrays serve another one."""
        self._idle.give_back(id(run.loop), run)

    def compiled(self, loop: ControlLoop) -> CompiledLoop:
        """A loop prepared for its runs, once for all plants that share it."""
        with self._preparing:
            if id(loop) not in self._prepared:
                problem = dataclasses.replace(self.template, input=loop)
                prepared = prepare_loop(problem, loop.init(problem.start_time))
                rows = first_rows_of(self.times, prepared.instants)
                prepared = dataclasses.replace(prepared, times=self.times, first_rows=rows)
                self._prepared[id(loop)] = CompiledLoop(problem.compiled, prepared)
        return self._prepared[id(loop)]


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
    for row, loop in enumerate(loops):
        if loop.signals != loops[0].signals:
            raise ParameterError(
                f"inputs, row {row}: {type(loop.controller).__name__} measures or commands other columns than that of "
                "row 0; all loops of a batch need the same measured columns, set points and commanded inputs."
            )
    return loops


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
