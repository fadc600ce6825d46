"""Randomisation of plants and tasks, and the episodes that begin with its draws."""

import abc
import dataclasses
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from ...bench.prediction import PlantUncertainty
from ...core import (
    Array,
    ParameterError,
    ShortRepr,
    abridged,
    check_field_types,
    one_line,
    suggestion,
    tree,
)
from ...engine.run.batch.variations import Column
from ...engine.run.integrators import RungeKutta4
from ...files.library.uncertainty import ParameterUncertainty
from ...files.scenario.plant_uncertainty import SEPARATOR, parameter_uncertainty
from ...physics.plant import Plant
from .task import EnvironmentTask, check_actions

T = TypeVar("T")
_LAW = "characteristic"
"""Name of the law in a muscle file; a muscle calls it `contractile`."""


class Randomisation(abc.ABC):
    """Distribution of parameters of a task, drawn anew for every episode (interface).

    A path is that of `airmuscle.core.tree.leaves(task)`: 'plant.mechanism.inertia',
    'target_frequency'.
    """

    paths: tuple[str, ...]

    @property
    @abc.abstractmethod
    def dimension(self) -> int:
        """Number of independent uniform numbers that a draw takes."""

    @abc.abstractmethod
    def values(self, nominal: Array, uniform: Array) -> Array:
        """Values (R, P) of the parameters, with their nominal values (P,), from uniform numbers (R,
        D) in [0, 1).
        """


@dataclasses.dataclass(frozen=True)
class UniformRange(Randomisation):
    """One number, uniformly distributed from `low` to `high`, for all paths (base)."""

    paths: tuple[str, ...]
    low: float
    high: float

    def __post_init__(self) -> None:
        name = type(self).__name__
        if isinstance(self.paths, str) or (isinstance(self.paths, tuple | list) and not self.paths):
            raise ParameterError(
                f"{name}: paths are {abridged(self.paths)}; give a tuple of one path or more."
            )
        check_field_types(self)
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low <= self.high):
            raise ParameterError(
                f"{name} of {self.paths[0]}: the range is {self.low} to {self.high}; it must be"
                " finite and rise."
            )

    @property
    def dimension(self) -> int:
        return 1


@dataclasses.dataclass(frozen=True)
class ValueRange(UniformRange):
    """A value [SI], uniformly distributed from `low` to `high`; all paths take the same value."""

    def values(self, nominal: Array, uniform: Array) -> Array:
        return np.repeat(self.low + (self.high - self.low) * uniform, nominal.size, axis=1)


@dataclasses.dataclass(frozen=True)
class FactorRange(UniformRange):
    """A factor of the nominal values, uniformly distributed from `low` to `high`; all paths take
    the same factor.
    """

    def values(self, nominal: Array, uniform: Array) -> Array:
        return nominal * (self.low + (self.high - self.low) * uniform)


@dataclasses.dataclass(frozen=True, repr=False)
class FitUncertainty(ShortRepr, Randomisation):
    """Normal distribution about the fitted values with the covariance of the fit, from a muscle
    file or a scenario.

    uncertainty  `am.load(PATH).uncertainty` of a muscle file, or `load_scenario(PATH).uncertainty`
                 of the scenario of an identified plant (fit-joint, fit-dynamic, campaign)
    muscles      of a muscle file, indices of the muscles of the plant to which it applies; all have
                 the same draw, because it is the common law that is uncertain

    Draws are limited to the declared ranges. Raises ParameterError where the fit states no
    covariance.
    """

    uncertainty: ParameterUncertainty | PlantUncertainty
    muscles: tuple[int, ...] = (0,)

    def __post_init__(self) -> None:
        if (
            not isinstance(self.uncertainty, ParameterUncertainty | PlantUncertainty)
            or not self.uncertainty.parameters
        ):
            raise ParameterError(
                "FitUncertainty: the fit states no covariance of its parameters"
                f" ({one_line(self.uncertainty)}); give am.load(PATH).uncertainty of a muscle file,"
                " or load_scenario(PATH).uncertainty of a scenario, with a table [uncertainty], or"
                " state ranges: FactorRange(paths, low, high)."
            )
        check_field_types(self)

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """The paths in the task that take each drawn value; a muscle that is not in a tuple has no
        index there.
        """
        if isinstance(self.uncertainty, PlantUncertainty):
            names = parameter_uncertainty(self.uncertainty).parameters
            return tuple(tuple(f"plant.{path}" for path in name.split(SEPARATOR)) for name in names)
        names = tuple(
            re.sub(rf"^{_LAW}\b", "contractile", name) for name in self.uncertainty.parameters
        )
        return tuple(tuple(f"plant.muscle[{i}].{name}" for i in self.muscles) for name in names)

    @property
    def paths(self) -> tuple[str, ...]:  # type: ignore[override]
        """The paths of all groups."""
        return tuple(path for group in self.groups for path in group)

    @property
    def dimension(self) -> int:
        return len(self.groups)

    def values(self, nominal: Array, uniform: Array) -> Array:
        from scipy.special import ndtri

        uncertainty = self.uncertainty
        fitted = (
            parameter_uncertainty(uncertainty)
            if isinstance(uncertainty, PlantUncertainty)
            else uncertainty
        )
        draws = fitted.deviations(ndtri(np.clip(uniform, 1e-12, 1.0 - 1e-12)))
        return np.asarray(nominal + np.repeat(draws, [len(group) for group in self.groups], axis=1))

    def variations(self, plant: Plant, count: int, seed: int = 0) -> dict[str, Array]:
        """Values (N,) of N draws by the path in the plant, as `simulate_batch(plant, variations,
        ...)` takes them.
        """
        leaves = {f"plant.{leaf.path}": leaf for leaf in tree.leaves(plant)}
        chosen = [_place(path, leaves) for path in self.paths]
        nominal = np.array([leaf.value for leaf in chosen], dtype=float)
        drawn = self.values(nominal, np.random.default_rng(seed).random((count, self.dimension)))
        return {
            leaf.path: np.clip(x, *leaf.declared.bounds)
            for leaf, x in zip(chosen, drawn.T, strict=True)
        }


def _place(path: str, places: Mapping[str, T]) -> T:
    for known in (path, path.replace("plant.muscle[0].", "plant.muscle.")):
        if known in places:
            return places[known]
    raise ParameterError(
        f"randomisation: the task has no parameter '{path}'.{suggestion(path, places)} Its paths"
        " are those of airmuscle.core.tree.leaves(task)."
    )


class EpisodeDraw:
    """The beginning of episodes of a task: R plants with their parameters (R, P) and states (R, n).

    task            the task
    randomisations  distributions of parameters; () for the nominal plant

    Raises ParameterError for an unknown path, a path that is named twice, a range beyond the
    declared one, and an initial state that is impossible.
    """

    def __init__(self, task: EnvironmentTask, randomisations: tuple[Randomisation, ...]) -> None:
        if not isinstance(task, EnvironmentTask):
            raise ParameterError(
                f"the task is {one_line(task)}; give an EnvironmentTask, such as"
                " JointTracking(plant)."
            )
        if not isinstance(randomisations, tuple) or not all(
            isinstance(r, Randomisation) for r in randomisations
        ):
            raise ParameterError(
                f"the randomisation is {one_line(randomisations)}; give a tuple, such as "
                "(FactorRange(('plant.mechanism.inertia',), 0.8, 1.2),)."
            )
        check_actions(task.actions)
        leaves = list(tree.leaves(task))
        self.task, self._nominal, self._randomisations = task, tree.flatten(task), randomisations
        self._low, self._high = (
            np.array([leaf.declared.bounds[i] for leaf in leaves]) for i in (0, 1)
        )
        places = {leaf.path: i for i, leaf in enumerate(leaves)}
        self._places = [
            np.array([_place(path, places) for path in r.paths], dtype=np.intp)
            for r in randomisations
        ]
        self._varied = np.concatenate([*self._places, np.empty(0, dtype=np.intp)])
        for index in np.flatnonzero(np.bincount(self._varied, minlength=1) > 1):
            raise ParameterError(
                f"randomisation: '{leaves[index].path}' is varied twice; name it once."
            )
        self._check_ranges([leaf.path for leaf in leaves])
        self.dimension = sum(r.dimension for r in randomisations) + len(task.initial_ranges)
        """Number of uniform numbers D that an episode takes."""
        # raises for an initial state that is impossible
        self.begin(np.full((1, self.dimension), 0.5))

    def _check_ranges(self, paths: Sequence[str]) -> None:
        """Raise ParameterError for a range that exceeds the declared one. Draws of a fit are
        limited to it instead.
        """
        for (r, at), end in itertools.product(
            zip(self._randomisations, self._places, strict=True), (0.0, 1.0)
        ):
            if isinstance(r, FitUncertainty):
                continue
            values = r.values(self._nominal[at], np.full((1, r.dimension), end))[0]
            for value, i in zip(values, at, strict=True):
                if not self._low[i] <= value <= self._high[i]:
                    raise ParameterError(
                        f"randomisation: '{paths[i]}' would be {value:.4g}; allowed range:"
                        f" {self._low[i]:.4g} to {self._high[i]:.4g}."
                    )

    def begin(self, uniform: Array) -> tuple[Array, Array]:
        """Parameters (R, P) and initial states (R, n) from uniform numbers (R, D) in [0, 1); a
        normal draw is limited to the declared range."""
        parameters = np.repeat(self._nominal[None, :], len(uniform), axis=0)
        first = 0
        for r, at in zip(self._randomisations, self._places, strict=True):
            end = first + r.dimension
            drawn = r.values(self._nominal[at], uniform[:, first:end])
            parameters[:, at] = np.clip(drawn, self._low[at], self._high[at])
            first = end
        values: list[Any] = self._nominal.tolist()
        for i in self._varied:
            values[i] = parameters[:, i].view(Column)
        plants: EnvironmentTask = tree.unflatten(self.task, values)
        initial = {}
        for i, (name, (low, high)) in enumerate(plants.initial_ranges.items(), first):
            initial[name] = low + (high - low) * uniform[:, i]
        plant = plants.plant
        pressures = [initial.pop(f"{prefix}pressure") for prefix in plant.prefixes]
        start: dict[str, Any] = {
            n: 0.0 for c in plant.mechanism.coordinates for n in (c.name, c.speed)
        } | initial
        settled, volumes = plant.settle_muscles(pressures, start)
        filled = plant.fill_muscles(pressures, volumes, settled)
        states = np.empty((len(uniform), len(plant.states)))
        for i, state in enumerate(self.task.states):
            states[:, i] = filled[state.name]
        if not np.isfinite(states).all():
            raise ParameterError(
                "the initial state of an episode is not finite; narrow the ranges of the task."
            )
        return parameters, states


def whole_steps(task: EnvironmentTask, integrator: RungeKutta4) -> int:
    """Steps of the integrator in a period. Raises ParameterError if they are not a whole number."""
    steps = round(task.period / integrator.step)
    if steps < 1 or abs(steps * integrator.step - task.period) > 1e-9 * task.period:
        raise ParameterError(
            f"the period is {task.period:g} s, the step of the integrator {integrator.step:g} s;"
            " the period must be a whole number of steps."
        )
    return steps
