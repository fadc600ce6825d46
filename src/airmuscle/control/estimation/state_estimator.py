"""State estimators of a plant: estimates, innovations, and the interface of the nonlinear Kalman filters."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import tree
from ...core.annotation import check_field_types
from ...core.arrays import Array
from ...core.diagnostics import Status
from ...core.errors import ParameterError, SolveError
from ...core.short_repr import ShortRepr
from ...core.system import System
from ...engine.compile.cache.kernel import evaluate
from ...engine.compile.function import AugmentedRates, augmented_rates, states_and_outputs
from ...engine.compile.program import CompiledSystem, compile_system
from ...engine.loop.control_loop import COMMAND
from ...engine.state import check_system, state_vector
from ...recording.recording import Recording
from .riccati import DISTURBANCE, check_known


class StateEstimate(NamedTuple):
    """Mean (n,) and covariance (n, n) of the estimated states of a plant."""

    mean: Array
    covariance: Array


class Innovation(NamedTuple):
    """Measured minus predicted columns (p,) and their covariance (p, p)."""

    difference: Array
    covariance: Array

    @property
    def normalised_square(self) -> float:
        """nu^T S^-1 nu [1]; its mean is p for a consistent filter."""
        return float(self.difference @ np.linalg.solve(self.covariance, self.difference))


FilterArrays = tuple[Array, Array, Array, Array, Array, Array]
"""The first six arrays of a BoundFilter."""


class BoundFilter(NamedTuple):
    """The compiled prediction and correction of a filter with the arrays that they read and write."""

    mean: Array
    covariance: Array
    inputs: Array
    values: Array
    difference: Array
    difference_covariance: Array
    transition: Array
    predict: Any
    correct: Any
    outputs: Any
    output_values: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StateEstimator(ShortRepr, abc.ABC):
    """Interface of the filters that estimate a plant's states from columns that are measured every `sample_time` [s].

    measured           columns of the plant, such as ("left.pressure", "right.pressure")
    process_noise      standard deviation of estimated states after 1 s of white noise; others have none
    measurement_noise  standard deviation of every measured column
    parameters         parameters of the plant that are estimated as further states, such as "mechanism.mass"
    disturbances       states to whose rate an unknown constant is added and estimated, such as "speed"; the estimated
                       state is "speed.disturbance", in the unit of the rate

    Parameters and disturbances follow a random walk by their process noise. Calls from several threads are permitted.
    Raises ParameterError for an unknown name or a number that is not positive.
    """

    plant: System
    measured: tuple[str, ...]
    sample_time: float
    process_noise: Mapping[str, float]
    measurement_noise: Mapping[str, float]
    parameters: tuple[str, ...] = ()
    disturbances: tuple[str, ...] = ()
    _compiled: CompiledSystem = dataclasses.field(init=False, repr=False)
    _functions: AugmentedRates = dataclasses.field(init=False, repr=False)
    _idle: list[BoundFilter] = dataclasses.field(init=False, repr=False)

    def __post_init__(self) -> None:
        owner = type(self).__name__
        check_field_types(self)
        check_system(owner, self.plant)
        compiled = compile_system(self.plant)
        object.__setattr__(self, "_compiled", compiled)
        states, leaves = compiled.description.state_names, [leaf.path for leaf in tree.leaves(self.plant)]
        columns = self.plant_columns
        for argument, names, known in (
            ("measured", self.measured, columns), ("parameters", self.parameters, leaves),
            ("disturbances", self.disturbances, states),
        ):  # fmt: skip
            check_known(owner, argument, names, known)
        check_known(owner, "process_noise", self.process_noise, self.states)
        check_known(owner, "measurement_noise", self.measurement_noise, self.measured)
        for name in self.measured:
            if name not in self.measurement_noise:
                raise ParameterError(f"{owner}: measurement_noise has no number for '{name}'; give one.")
        for name, value in {**self.process_noise, **self.measurement_noise, "sample_time": self.sample_time}.items():
            if not 0 < value < float("inf"):
                raise ParameterError(f"{owner}: '{name}' is {value!r}; it must be positive and finite.")
        seen = [columns.index(name) for name in self.measured]
        object.__setattr__(self, "_functions", augmented_rates(compiled, seen, *self.places))
        object.__setattr__(self, "_idle", [])

    def __getstate__(self) -> dict[str, Any]:
        """The fields that were given; machine code and arrays belong to one process."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.init}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, value)
        self.__post_init__()

    @abc.abstractmethod
    def _bind(self) -> BoundFilter:
        """The compiled filter with new arrays."""

    def _bound(self, arrays: FilterArrays, transition: Array, predict: Any, correct: Any) -> BoundFilter:
        """The compiled filter of arrays, with the function of the outputs."""
        mean, inputs = arrays[0], arrays[2]
        values = np.zeros((1, len(self._compiled.output_names)))
        outputs = evaluate.bind(
            self._functions.outputs, self._functions.constants, mean.reshape(1, -1), inputs.reshape(1, -1), values
        )
        return BoundFilter(*arrays, transition, predict, correct, outputs, values)

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the estimated states: those of the plant, then parameters and disturbances."""
        return (
            *self._compiled.description.state_names, *self.parameters,
            *(f"{name}{DISTURBANCE}" for name in self.disturbances),
        )  # fmt: skip

    @property
    def plant_columns(self) -> tuple[str, ...]:
        """The names of the states and outputs of the plant."""
        return (*self._compiled.description.state_names, *self._compiled.output_names)

    @property
    def places(self) -> tuple[list[int], list[int]]:
        """Indices of the estimated parameters among the leaves, and of the disturbed states."""
        leaves = [leaf.path for leaf in tree.leaves(self.plant)]
        states = self._compiled.description.state_names
        return [leaves.index(name) for name in self.parameters], [states.index(name) for name in self.disturbances]

    @property
    def noise(self) -> Array:
        """Covariance (n, n) of the process noise of one sample."""
        return np.diag([self.process_noise.get(name, 0.0) ** 2 * self.sample_time for name in self.states])

    @property
    def variances(self) -> Array:
        """Variances (p,) of the measured columns."""
        return np.array([self.measurement_noise[name] ** 2 for name in self.measured])

    @property
    def magnitudes(self) -> Array:
        """Magnitudes (n,) of the estimated states, by which the equations are scaled."""
        nominal = self._compiled.nominal.tolist()
        further = [abs(self._parameter_values[name]) or 1.0 for name in self.parameters]
        states = self._compiled.description.state_names
        return np.array([*nominal, *further, *(nominal[states.index(name)] for name in self.disturbances)])

    def start(self, state: Mapping[str, float], deviations: Mapping[str, float]) -> StateEstimate:
        """The first estimate: a state, and the standard deviations of its values; 0 unless given.

        Parameters start at those of the plant and disturbances at 0, unless the state contains them.
        """
        check_known(type(self).__name__, "deviations", deviations, self.states)
        count = len(self._compiled.description.state_names)
        further = {name: self._parameter_values.get(name, 0.0) for name in self.states[count:]}
        own = {name: value for name, value in state.items() if name not in further}
        values = [float(state.get(name, value)) for name, value in further.items()]
        spread = [deviations.get(name, 0.0) ** 2 for name in self.states]
        return StateEstimate(np.array([*state_vector(self.plant, own), *values]), np.diag(spread))

    def predict(self, estimate: StateEstimate, inputs: Sequence[float]) -> StateEstimate:
        """The estimate one sample later, under inputs (m,) that are held.

        Raises SolveError where the rates are not finite.
        """
        bound = self._filled(estimate, inputs)
        self._run(bound.predict, bound)
        return self._taken(bound)

    def correct(
        self, estimate: StateEstimate, values: Sequence[float], inputs: Sequence[float]
    ) -> tuple[StateEstimate, Innovation]:
        """The estimate after a measurement (p,) under the inputs (m,) at that instant, and the innovation.

        Raises SolveError for a value that is not finite, and where the innovation has no positive definite covariance.
        """
        if not np.isfinite(values).all():
            raise SolveError(
                f"{type(self).__name__}: the measured values must be finite; {', '.join(self.measured)} are {values}. "
                "Leave the correction out where a measurement is missing."
            )
        bound = self._filled(estimate, inputs)
        bound.values[:] = values
        self._run(bound.correct, bound)
        innovation = Innovation(bound.difference.copy(), bound.difference_covariance.copy())
        return self._taken(bound), innovation

    def columns(self, estimate: StateEstimate, inputs: Sequence[float]) -> dict[str, float]:
        """All states and outputs of the plant at an estimate, such as contraction and force."""
        bound = self._filled(estimate, inputs)
        bound.outputs()
        known = self._compiled.description
        count = len(known.state_names)
        mean: list[float] = bound.mean.tolist()
        outputs = dict(zip(known.output_names, bound.output_values[0].tolist(), strict=True))
        self._idle.append(bound)
        states = dict(zip(known.state_names, mean[:count], strict=True))
        return {**states, **outputs, **dict(zip(self.states[count:], mean[count:], strict=True))}

    def estimate(self, recording: Recording, first: StateEstimate) -> dict[str, Array]:
        """Columns (N,) that are estimated from a recording, row by row, and `time` [s].

        The rows must be `sample_time` apart. Inputs are the columns of their names, or the commands of a controller;
        an input without a column is 0. Raises ParameterError for other times.
        """
        time = np.asarray(recording["time"], dtype=float)
        rounding = 1e-6 * self.sample_time + 2.0 * np.spacing(np.abs(time).max(initial=0.0))
        if time.size < 2 or np.abs(np.diff(time) - self.sample_time).max() > rounding:
            raise ParameterError(
                f"{type(self).__name__}.estimate: the rows must be {self.sample_time:g} s apart; simulate or resample "
                "with this interval."
            )
        inputs = np.column_stack([_input(recording, name) for name in self._compiled.description.input_names])
        measured = np.column_stack([recording[name] for name in self.measured])
        held = np.vstack([inputs[:1], inputs[:-1]])
        means, estimate = np.empty((time.size, len(self.states))), first
        for k in range(time.size):
            if k:
                estimate = self.predict(estimate, held[k])
            estimate, _ = self.correct(estimate, measured[k], held[k])
            means[k] = estimate.mean
        return {"time": time, **self._table(means, held)}

    def _table(self, means: Array, inputs: Array) -> dict[str, Array]:
        known = self._compiled.description
        count = len(known.state_names)
        values = states_and_outputs(self._functions, count, means, inputs, len(known.output_names))
        further = dict(zip(self.states[count:], means[:, count:].T, strict=True))
        return {**dict(zip((*known.state_names, *known.output_names), values.T, strict=True)), **further}

    @property
    def _parameter_values(self) -> dict[str, float]:
        return {leaf.path: float(leaf.value) for leaf in tree.leaves(self.plant) if leaf.path in self.parameters}

    def _filled(self, estimate: StateEstimate, inputs: Sequence[float]) -> BoundFilter:
        bound = self._idle.pop() if self._idle else self._bind()
        bound.mean[:], bound.covariance[:], bound.inputs[:] = estimate.mean, estimate.covariance, inputs
        return bound

    def _taken(self, bound: BoundFilter) -> StateEstimate:
        estimate = StateEstimate(bound.mean.copy(), bound.covariance.copy())
        self._idle.append(bound)
        return estimate

    def _run(self, kernel: Any, bound: BoundFilter) -> None:
        status = kernel()
        if status != Status.DONE:
            self._idle.append(bound)
            reason = Status(status).message if kernel is bound.predict else "the covariance is not positive definite"
            raise SolveError(
                f"{type(self).__name__}: the step failed, because {reason}. Check the measured values, the first "
                "estimate and the noise."
            )


def _input(recording: Recording, name: str) -> Array:
    for column in (f"{COMMAND}{name}", name):
        if column in recording:
            return np.asarray(recording[column], dtype=float)
    return np.zeros(len(recording["time"]))
