"""Episodes: parameters and initial states, drawn from uniform numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core import tree
from ...core.annotation import one_line
from ...core.arrays import Array
from ...core.errors import ParameterError
from ...engine.run.batch.variations import Column
from ...engine.run.integrators import RungeKutta4
from .actuation import check_actions
from .randomisation import ParameterDraw, Randomisation
from .task import EnvironmentTask


class EpisodeDraw:
    """The beginning of episodes of a task: R plants with their parameters (R, P) and states (R, n).

    task            the task
    randomisations  distributions of parameters; () for the nominal plant
    """

    def __init__(self, task: EnvironmentTask, randomisations: tuple[Randomisation, ...]) -> None:
        if not isinstance(task, EnvironmentTask):
            raise ParameterError(
                f"the task is {one_line(task)}; give an EnvironmentTask, such as JointTracking(plant)."
            )
        if not isinstance(randomisations, tuple) or not all(isinstance(r, Randomisation) for r in randomisations):
            raise ParameterError(
                f"the randomisation is {one_line(randomisations)}; give a tuple, such as "
                "(FactorRange(('plant.mechanism.inertia',), 0.8, 1.2),)."
            )
        check_actions(task.actions)
        self.task, self._parameters = task, ParameterDraw(task, randomisations)
        self._names = tuple(task.initial_ranges)
        self.dimension = self._parameters.dimension + len(self._names)
        """Number of uniform numbers D that an episode takes."""
        self.begin(np.full((1, self.dimension), 0.5))  # raises for an initial state that is impossible

    def begin(self, uniform: Array) -> tuple[Array, Array]:
        """Parameters (R, P) and initial states (R, n) from uniform numbers (R, D) in [0, 1)."""
        parameters = self._parameters.values(uniform)
        count = len(uniform)
        plants: EnvironmentTask = self._with(parameters)
        drawn = uniform[:, self._parameters.dimension :]
        initial = {}
        for i, (name, (low, high)) in enumerate(plants.initial_ranges.items()):
            initial[name] = low + (high - low) * drawn[:, i]
        plant = plants.plant
        pressures = [initial.pop(f"{prefix}pressure") for prefix in plant.prefixes]
        start: dict[str, Any] = {n: 0.0 for c in plant.mechanism.coordinates for n in (c.name, c.speed)} | initial
        settled, volumes = plant.settle_muscles(pressures, start)
        filled = plant.fill_muscles(pressures, volumes, settled)
        states = np.empty((count, len(plant.states)))
        for i, state in enumerate(self.task.states):
            states[:, i] = filled[state.name]
        if not np.isfinite(states).all():
            raise ParameterError("the initial state of an episode is not finite; narrow the ranges of the task.")
        return parameters, states

    def _with(self, parameters: Array) -> EnvironmentTask:
        """The task with a column (R,) in place of every parameter that varies."""
        values: list[Any] = self._parameters.nominal.tolist()
        for i in self._parameters.varied:
            values[i] = parameters[:, i].view(Column)
        return tree.unflatten(self.task, values)


def whole_steps(task: EnvironmentTask, integrator: RungeKutta4) -> int:
    """Steps of the integrator in a period. Raises ParameterError if they are not a whole number."""
    steps = round(task.period / integrator.step)
    if steps < 1 or abs(steps * integrator.step - task.period) > 1e-9 * task.period:
        raise ParameterError(
            f"the period is {task.period:g} s, the step of the integrator {integrator.step:g} s; the period must be a "
            "whole number of steps."
        )
    return steps
