"""Runs of compiled control loops that are kept with a system, for the next loop of the same form.

Loops have the same form if they differ in the parameters of the control law alone: the sampling instants, the set
points and the segments of the other inputs are then the same, and so is the kernel with its arrays.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from ...core import tree
from ..loop.control_law import ControlLaw
from ..loop.control_loop import ControlLoop, ControlLoopState
from ..loop.inputs import Schedule
from .compiled_law import parameters_of
from .compiled_loop import CompiledRun
from .problem import Problem

MAX_FORMS = 4
"""Forms of loops for which a system keeps runs (chosen)."""
MAX_KEPT_ROWS = 100_000
"""Rows up to which a run is kept (chosen)."""


def form_of(problem: Problem) -> Hashable | None:
    """The form of a problem's loop; None where a part of it may change, or where the run continues another one."""
    loop = problem.input
    assert isinstance(loop, ControlLoop)
    law, given = loop.controller, problem.output_times
    signals = type(loop.setpoint) is Schedule and type(loop.other_inputs) is Schedule
    if not signals or problem.control_state is not None or not isinstance(law, ControlLaw):
        return None
    if not (given is None or type(given) in (float, int)):
        return None
    form = (
        tree.structure(law), id(loop.setpoint), id(loop.other_inputs), tuple(loop.drivers.items()), loop.sample_time,
        problem.start_time, problem.duration, given, problem.integrator,
    )  # fmt: skip
    try:
        hash(form)
    except TypeError:  # a driver or an integrator that can change
        return None
    return form


def kept_run(problem: Problem, form: Hashable | None, state: ControlLoopState) -> CompiledRun | None:
    """A run of this form that nothing else uses, at its beginning; None where none is kept."""
    try:
        run: CompiledRun = problem.compiled.description.loop_runs[form].pop()
    except (KeyError, IndexError):
        return None
    law: Any = problem.input.controller  # type: ignore[union-attr]
    run.restart(problem.compiled, problem.initial_vector, parameters_of(law), state)
    return run


def keep_run(problem: Problem, form: Hashable, run: CompiledRun) -> None:
    """Keep a run whose results have been copied. The form names signals by their identity, so the run holds them."""
    runs = problem.compiled.description.loop_runs
    if run.room > MAX_KEPT_ROWS:
        return
    if form not in runs and len(runs) >= MAX_FORMS:
        runs.clear()
    runs.setdefault(form, []).append(run)
