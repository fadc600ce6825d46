"""Fisher information of test signals about the parameters of a plant with set points.

The derivatives are central differences over a finite change of a parameter: a regulator that
chatters at rest has analytical sensitivities that grow without bound.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array, ParameterError, counted, listed, tree
from ...engine import Schedule, simulate_batch
from ...physics import Plant
from ..estimation import MAX_RELATIVE_ERROR
from .experiment import ParameterPaths
from .regulator_fit import COMMANDS

PRIOR = math.log(3.0)
"""Relative standard deviation of a parameter of which nothing is known (chosen: a factor of
three)."""
DIFFERENCE = 0.05
"""Change of a parameter for a derivative, relative to its size (chosen)."""
ZERO_SIZE = 0.01
"""Size of a parameter whose value is 0, relative to the range of its declaration (chosen)."""
CORRELATION_TIME = 0.05
"""Time [s] within which residuals count as one observation (chosen), because a model error is not
independent from row to row."""
SETTLING = 5.0
"""Time after which the plant is at rest before a signal [s] (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class ParameterKnowledge:
    """What is known of P parameters of a plant before a signal is played.

    paths        of each parameter in the plant; several paths have one common value
    sizes        to which standard errors refer [SI], (P,)
    information  inverse covariance of the parameters relative to their sizes, (P, P)
    targets      indices of those to determine
    """

    paths: tuple[tuple[str, ...], ...]
    sizes: Array
    information: Array
    targets: tuple[int, ...]

    @property
    def names(self) -> list[str]:
        """The first path of each parameter."""
        return [paths[0] for paths in self.paths]

    def standard_errors(self, information: Array) -> Array:
        """Relative standard errors (P,) with an information matrix."""
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(information))))

    def uncertainty(self, information: Array) -> float:
        """Logarithm of the determinant of the relative covariance of the targets."""
        covariance = np.linalg.inv(information)
        block = covariance[np.ix_(self.targets, self.targets)]
        return float(np.linalg.slogdet(block)[1])


def knowledge_of(
    plant: Plant,
    parameters: Sequence[ParameterPaths] = (),
    covariance: Array | None = None,
    determine: Sequence[str] = (),
) -> ParameterKnowledge:
    """What a fit knows of a plant: its parameters with their covariance (P, P) [SI].

    Parameters of a regulator that a fit did not determine at all, and those of a plant without a
    fit, are known to a factor of three. Targets are those with a relative standard error above 50 %
    (all if there are none), or those of `determine`. Raises ParameterError for an unknown path.
    """
    fitted = [(paths,) if isinstance(paths, str) else tuple(paths) for paths in parameters]
    groups = _with_further_groups(plant, fitted, determine)
    leaves = {leaf.path: leaf for leaf in tree.leaves(plant)}
    sizes = np.array([_size(leaves[group[0]]) for group in groups])
    information = np.eye(len(groups)) / PRIOR**2
    if covariance is not None and fitted:
        part = slice(len(fitted))
        scale = np.outer(sizes[part], sizes[part])
        information[part, part] += _inverse(covariance / scale)
    targets = _targets(groups, information, determine)
    return ParameterKnowledge(tuple(groups), sizes, information, targets)


def _with_further_groups(
    plant: Plant, fitted: Sequence[tuple[str, ...]], determine: Sequence[str]
) -> list[tuple[str, ...]]:
    """The parameters of a fit with those that it did not contain. Raises ParameterError."""
    groups = list(fitted)
    known = {path for group in groups for path in group}
    for path in (*_usual_paths(plant), *determine):
        if path not in known:
            groups.append((path,))
            known.add(path)
    existing = {leaf.path for leaf in tree.leaves(plant)}
    unknown = sorted(known - existing)
    if unknown:
        usual = listed(_usual_paths(plant))
        raise ParameterError(f"plan: the plant has no parameter {unknown[0]!r}; it has {usual}.")
    if not groups:
        raise ParameterError(
            "plan: the plant has no parameter to determine. Name one with --determine, or plan for"
            " the scenario that fit-regulator or fit-joint has written."
        )
    return groups


def _targets(
    groups: Sequence[tuple[str, ...]], information: Array, determine: Sequence[str]
) -> tuple[int, ...]:
    """The parameters to determine: those that are named, or those known weakly, or all."""
    if determine:
        wanted = set(determine)
        named = [bool(wanted.intersection(group)) for group in groups]
        return tuple(np.flatnonzero(named).tolist())
    variances = np.diag(np.linalg.inv(information))
    weak = np.flatnonzero(np.sqrt(variances) > MAX_RELATIVE_ERROR)
    return tuple(weak.tolist()) or tuple(range(len(groups)))


def _usual_paths(plant: Plant) -> list[str]:
    """The parameters that fit-regulator and fit-joint estimate in such a plant, and that can be
    varied.
    """
    is_usual = _is_of_motion if plant.mechanism.coordinates else _is_of_regulator
    return [leaf.path for leaf in tree.leaves(plant) if is_usual(leaf)]


def _is_of_regulator(leaf: tree.Leaf) -> bool:
    """Whether a leaf is a parameter that fit-regulator estimates."""
    return leaf.path.startswith("circuit") and leaf.path.endswith(tuple(COMMANDS))


def _is_of_motion(leaf: tree.Leaf) -> bool:
    """Whether a leaf is a fitted parameter of the mechanism with a value."""
    is_varied = leaf.declared.fitted and float(leaf.value) != 0.0
    return leaf.path.startswith("mechanism.") and is_varied and "_angle" not in leaf.path


def _size(leaf: tree.Leaf) -> float:
    value = abs(float(leaf.value))
    if value > 0.0:
        return value
    low, high = leaf.declared.bounds
    return ZERO_SIZE * (high - low) if math.isfinite(high - low) else 1.0


def _inverse(covariance: Array) -> Array:
    """The inverse of a relative covariance along what it contains: a direction without variance is
    one that the model does not feel.
    """
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    is_known = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-12)
    inverse = np.where(is_known, 1.0 / np.where(is_known, values, 1.0), 0.0)
    return np.asarray((vectors * inverse) @ vectors.T)


@dataclasses.dataclass(frozen=True, eq=False)
class SignalResponse:
    """Responses of a plant to K signals: motions by coordinate (K, N) [SI], and the information of
    each signal (K, P, P); NaN where a run failed.
    """

    motions: Mapping[str, Array]
    information: Array


@dataclasses.dataclass(frozen=True, eq=False)
class SignalSimulator:
    """The plant on which signals are tried before they are played.

    deviations   standard deviation of the residuals of each observed quantity [SI]
    sample_time  of the commands [s]
    """

    plant: Plant
    knowledge: ParameterKnowledge
    deviations: Mapping[str, float]
    sample_time: float

    @property
    def coordinates(self) -> list[str]:
        """Names of the coordinates of the mechanism."""
        return [coordinate.name for coordinate in self.plant.mechanism.coordinates]

    def rest(self, level: float) -> dict[str, float]:
        """The state [SI] after a long rest at a pressure [Pa]. Raises ParameterError if there is
        none.
        """
        start = self.plant.state_at(pressure=level)
        held = Schedule(dict.fromkeys(self.plant.inputs, ((0.0, level),)))
        run = simulate_batch(
            self.plant,
            {},
            [held],
            duration=SETTLING,
            initial_states={name: np.array([value]) for name, value in start.items()},
            output_times=np.array([0.0, SETTLING]),
            keep=list(start),
        )
        state = {name: float(run[name][0, -1]) for name in start}
        if not all(map(math.isfinite, state.values())):
            raise ParameterError(
                f"plan: the plant does not come to rest at {level / 1e3:.4g} kPa in"
                f" {SETTLING:g} s. Give other limits of the pressure."
            )
        return state

    def motions(self, commands: Sequence[Array], rest: Mapping[str, float]) -> dict[str, Array]:
        """Motions (K, N) [SI] by coordinate under K commands of equal length (N, m)."""
        return self._run(commands, rest, {}, self.coordinates)

    def information(self, commands: Sequence[Array], rest: Mapping[str, float]) -> Array:
        """Information (K, P, P) of K commands (N, m) of equal length."""
        by_parameter = []
        for k in range(len(self.knowledge.paths)):
            by_parameter.append(self._slopes(commands, rest, k))
        slopes = np.stack(by_parameter, axis=-1)
        weight = min(1.0, self.sample_time / CORRELATION_TIME)
        products = np.einsum("knqi,knqj->kij", slopes, slopes)
        return np.asarray(weight * products)

    def _slopes(self, commands: Sequence[Array], rest: Mapping[str, float], k: int) -> Array:
        """Derivatives (K, N, Q) of the observed quantities in standard deviations by one
        parameter.
        """
        paths = self.knowledge.paths[k]
        leaves = {leaf.path: leaf for leaf in tree.leaves(self.plant)}
        step = DIFFERENCE * float(self.knowledge.sizes[k])
        low, high = leaves[paths[0]].declared.bounds
        value = float(leaves[paths[0]].value)
        ends = (max(value - step, low), min(value + step, high))
        runs = [
            self._run(commands, rest, dict.fromkeys(paths, end), list(self.deviations))
            for end in ends
        ]
        columns = [
            (runs[1][name] - runs[0][name]) / deviation
            for name, deviation in self.deviations.items()
        ]
        relative = (ends[1] - ends[0]) / float(self.knowledge.sizes[k])
        return np.stack(columns, axis=-1) / relative

    def _run(
        self,
        commands: Sequence[Array],
        rest: Mapping[str, float],
        values: Mapping[str, float],
        keep: Sequence[str],
    ) -> dict[str, Array]:
        count = len(commands)
        times = np.asarray(self.sample_time * np.arange(len(commands[0])), dtype=np.float64)
        run = simulate_batch(
            self.plant,
            {path: np.full(count, value) for path, value in values.items()},
            [held_schedule(self.plant.inputs, times, rows) for rows in commands],
            duration=float(times[-1]),
            initial_states={name: np.full(count, value) for name, value in rest.items()},
            output_times=times,
            keep=list(keep),
        )
        return {name: np.asarray(run[name]) for name in keep}


def held_schedule(inputs: Sequence[str], times: Array, commands: Array) -> Schedule:
    """Commands (N, m) that hold their values until the next change."""
    points = {}
    for name, values in zip(inputs, commands.T, strict=True):
        changed = np.flatnonzero(np.diff(values)) + 1
        rows = [0, *changed.tolist()]
        instants = times[rows].tolist()
        levels = values[rows].tolist()
        points[name] = tuple(zip(instants, levels, strict=True))
    return Schedule(points)


def check_set_points(plant: Plant) -> None:
    """Raise ParameterError for a plant whose inputs are no set points of pressures."""
    others = [name for name in plant.inputs if name.rpartition(".")[2] != "setpoint"]
    if others or not plant.inputs:
        raise ParameterError(
            f"plan: the inputs of the plant are {listed(list(plant.inputs))}; signals are planned"
            f" for pressure regulators, and {counted(len(others), 'input')} is no set point."
        )
