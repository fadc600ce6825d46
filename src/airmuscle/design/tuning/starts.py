"""Starts of a search by tuning rules: a simulated step of the command, a process model, and the settings of rules."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...control.laws.pid import PID
from ...core.arrays import Array
from ...core.errors import AirmuscleError, ParameterError
from ...engine.loop.control_law import inputs_of, range_of
from ...engine.loop.driver import WithDrivers
from ...engine.loop.inputs import Schedule
from ...engine.run import simulate
from ...engine.run.integrators import Integrator
from .case import LoopCase
from .process_models import ProcessModel, first_order_of_step, integrator_of_step
from .rules import RuleSettings, amigo_pi, amigo_pid, simc

STEP = 0.1
"""Step of the command, as a share of its range (chosen)."""
ROWS = 400
"""Rows of the simulated experiment (chosen)."""


class StepExperiment(NamedTuple):
    """A simulated step of the command at time 0: times (N,) [s], measured column (N,), size of the step, its model."""

    time: Array
    output: Array
    step: float
    model: ProcessModel


def step_experiment(
    case: LoopCase, duration: float, *, step: float | None = None, integrator: Integrator | None = None
) -> StepExperiment:
    """The response of the plant of a case to a step of the command of its PID, and the model that fits it best.

    step  size [u]; a tenth of the range of the command unless given

    The command before the step is `initial_output`. Half a sample time is added to the dead time of the model, the mean
    delay of a held command. Raises ParameterError for another controller, SimulationError if the run fails.
    """
    pid = case.controller
    if not isinstance(pid, PID):
        raise ParameterError(
            f"step_experiment: the controller is {type(pid).__name__}; rules give the settings of a PID alone."
        )
    low, high = _range(case, pid)
    size = STEP * (high - low) if step is None else step
    value = pid.initial_output + size
    if not low <= value <= high:
        raise ParameterError(f"step_experiment: the command would be {value:g}; allowed range: {low:g} to {high:g}.")
    names = inputs_of(pid.commanded)
    values = (value,) if len(names) == 1 else (max(value, 0.0), max(-value, 0.0))
    signal = WithDrivers(
        Schedule({n: ((0.0, v),) for n, v in zip(names, values, strict=True)}), case.loop.drivers
    )  # fmt: skip
    run = simulate(
        case.plant, signal, duration=duration, initial_state=case.start(), output_times=duration / ROWS,
        integrator=integrator,
    )  # fmt: skip
    time, first = np.unique(run["time"], return_index=True)
    output = run[pid.measured][first]
    return StepExperiment(time, output, size, _with_delay(_best_model(time, output, size), case.loop.sample_time / 2))


def _range(case: LoopCase, pid: PID) -> tuple[float, float]:
    known = {variable.name: variable for variable in case.plant.input_variables}
    ranges = {
        name: (0.0, 1.0) if name in case.loop.drivers else (known[name].minimum, known[name].maximum)
        for name in inputs_of(pid.commanded)
    }
    low, high = range_of(pid.commanded, ranges)
    return float(low), float(high)


def _best_model(time: Array, output: Array, step: float) -> ProcessModel:
    """The model with the smaller sum of squared residuals; the other one if one of them does not exist."""
    models: list[tuple[float, ProcessModel]] = []
    reasons = []
    for identify in (first_order_of_step, integrator_of_step):
        try:
            model = identify(time, output, step)
        except AirmuscleError as error:
            reasons.append(str(error))
        else:
            models.append((float(np.sum((output[0] + step * model.step_response(time) - output) ** 2)), model))
    if not models:
        raise ParameterError(f"step_experiment: {' '.join(reasons)}")
    return min(models, key=lambda pair: pair[0])[1]


def _with_delay(model: ProcessModel, delay: float) -> ProcessModel:
    return dataclasses.replace(model, dead_time=model.dead_time + delay)


def rule_settings(model: ProcessModel) -> tuple[RuleSettings, ...]:
    """The settings of all rules for a model: SIMC PI, AMIGO PI, AMIGO PID."""
    return simc(model), amigo_pi(model), amigo_pid(model)


def rule_starts(
    settings: Sequence[RuleSettings], bounds: Mapping[str, tuple[float, float]]
) -> tuple[dict[str, float], ...]:
    """The settings of rules as starts of a search: those gains that are tuned, moved into their bounds."""
    return tuple(
        {name: float(np.clip(value, *bounds[name])) for name, value in each.as_gains.items() if name in bounds}
        for each in settings
    )
