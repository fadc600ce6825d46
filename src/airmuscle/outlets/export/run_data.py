"""Run of an exported program: initial state, inputs, output times and integrator, as numbers."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...core.arrays import Array
from ...core.errors import ParameterError
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.piecewise_linear import PiecewiseLinear
from ...engine.run import Problem
from ...engine.run.integrators import ExplicitRungeKutta, Integrator


@dataclasses.dataclass(frozen=True, eq=False)
class RunData:
    """A run: `initial` (n,), the segments of the inputs, in a control loop of those that are not commanded, and `times`
    (N,) of the rows, from `start` [s] on."""

    initial: Array
    segments: PiecewiseLinear
    times: Array
    start: float
    integrator: Integrator


def run_data(problem: Problem) -> RunData:
    """The run of a problem with input signals; drivers are resolved into segments."""
    assert problem.integrator is not None
    return RunData(
        problem.initial_vector,
        problem.segments,
        problem.times,
        problem.start_time,
        check_integrator(problem.integrator),
    )


def loop_data(problem: Problem, others: PiecewiseLinear, times: Array) -> RunData:
    """The run of a problem with a control loop: the inputs that are not commanded, and the output times."""
    assert problem.integrator is not None
    start, integrator = problem.start_time, check_integrator(problem.integrator)
    return RunData(problem.initial_vector, others, times, start, integrator)


def check_integrator(integrator: Integrator) -> Integrator:
    """The integrator. Raises ParameterError for one that has no printed form."""
    if not integrator.printed_step:
        raise ParameterError(
            f"the integrator {type(integrator).__name__} has no printed form; choose Rodas4, RungeKutta4 or "
            "DormandPrince8."
        )
    return integrator


def check_open_loop(problem: Problem) -> None:
    """Raise ParameterError for a problem with a controller."""
    if isinstance(problem.input, ControlLoop):
        raise ParameterError(
            f"the controller {type(problem.input.controller).__name__} cannot be exported to this target; export the "
            "plant with input signals, or the loop to C, JavaScript, Octave, or as FMUs of an SSP package."
        )


def tableau_arrays(integrator: ExplicitRungeKutta) -> tuple[Array, Array, Array]:
    """Rows (s, s), weights (s,) and nodes (s,) of an explicit method."""
    rows, weights = integrator.tableau()
    count = len(weights)
    table = np.zeros((count, count))
    for i, row in enumerate(rows, 1):
        table[i, : len(row)] = row
    return table, np.array(weights), np.array([0.0, *(sum(row) for row in rows)])
