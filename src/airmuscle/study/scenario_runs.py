"""The one seam to the dynamics: scenarios are carried through time, and each gives a run or a reason."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..core.arrays import Array
from ..core.errors import AirmuscleError, SimulationError
from ..recording import Recording
from ..scenario.scenario import Scenario
from ..simulation.arguments import output_times
from ..simulation.simulate import simulate

RUN_ERRORS = (AirmuscleError, ArithmeticError, ValueError)
"""What one run of many may end by, from values that nobody foresaw, without ending the others."""


def simulate_all(scenarios: Sequence[Scenario], instants: Array) -> Iterator[Recording | str]:
    """The runs of the scenarios in order, with rows at these instants [s] too; the reason in words where one fails.

    A run that the user interrupts raises KeyboardInterrupt.
    """
    for scenario in scenarios:
        try:
            yield simulate(
                scenario.plant,
                scenario.command,
                duration=scenario.duration,
                start=scenario.start,
                start_time=scenario.start_time,
                method=scenario.method,
                output=_output_times(scenario, instants),
            )
        except RUN_ERRORS as error:
            if isinstance(error, SimulationError) and error.interrupted:
                raise KeyboardInterrupt from None
            yield failure_reason(error)


def failure_reason(error: Exception) -> str:
    """Why a run failed, on one line."""
    kind = "" if isinstance(error, AirmuscleError) else f"{type(error).__name__}: "
    return f"{kind}{' '.join(str(error).split())}"


def _output_times(scenario: Scenario, instants: Array) -> Array:
    """The scenario's own rows, and the instants that lie within the run."""
    end = scenario.start_time + scenario.duration
    within = instants[(instants >= scenario.start_time) & (instants < end)]
    return output_times(scenario.output, scenario.start_time, scenario.duration, np.append(within, end))
