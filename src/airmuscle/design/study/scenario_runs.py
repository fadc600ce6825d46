"""Simulation of scenarios: the interface between studies and the dynamics."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from ...core.arrays import Array
from ...core.errors import AirmuscleError, SimulationError
from ...engine.run import Problem, solve
from ...engine.run.output_times import output_times
from ...files.scenario.scenario import Scenario
from ...recording import Recording

RUN_ERRORS = (AirmuscleError, ArithmeticError, ValueError)
"""Exceptions that fail a single run, without ending the study."""


def simulate_all(scenarios: Sequence[Scenario], times: Array) -> Iterator[Recording | str]:
    """Simulate scenarios in order, with additional rows at `times` [s]; yield the reason (text) of a failed run.

    Raises KeyboardInterrupt if the user interrupts a run.
    """
    for scenario in scenarios:
        try:
            problem = dataclasses.replace(scenario.problem, output_times=_output_times(scenario.problem, times))
            yield solve(problem).raise_if_incomplete().recording
        except RUN_ERRORS as error:
            if isinstance(error, SimulationError) and error.interrupted:
                raise KeyboardInterrupt from None
            yield failure_reason(error)


def failure_reason(error: Exception) -> str:
    """The reason of a failed run, on one line."""
    kind = "" if isinstance(error, AirmuscleError) else f"{type(error).__name__}: "
    return f"{kind}{' '.join(str(error).split())}"


def _output_times(problem: Problem, times: Array) -> Array:
    """The output times of the problem and those of `times` that lie within the run [s]."""
    within = times[(times >= problem.start_time) & (times < problem.end_time)]
    instants = np.append(within, problem.end_time)
    return output_times(problem.output_times, problem.start_time, problem.duration, instants)
