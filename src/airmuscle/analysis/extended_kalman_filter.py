"""ExtendedKalmanFilter: states and outputs of a plant from measured columns, by its linearisation at each sample."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..compile.jacobians import derivatives
from ..compile.program import CompiledSystem, compile_system
from ..control.control_loop import COMMAND
from ..core.arrays import Array
from ..core.errors import ParameterError, suggestion
from ..core.reference import Reference
from ..core.system import System
from ..plant.state import check_system, state_vector
from ..recording.recording import Recording

BAR_SHALOM2001 = Reference(
    key="bar-shalom-2001",
    authors="Bar-Shalom, Y., Li, X. R., Kirubarajan, T.",
    title="Estimation with Applications to Tracking and Navigation",
    where="Wiley, New York, chapters 5 and 10",
    year=2001,
    doi="10.1002/0471221279",
    note="extended Kalman filter; consistency by the normalised estimation error squared",
)


class StateEstimate(NamedTuple):
    """Mean (n,) and covariance (n, n) of the state of a plant."""

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


@dataclasses.dataclass(frozen=True, eq=False)
class ExtendedKalmanFilter:
    """Extended Kalman filter of a plant, from columns that are measured every `sample_time` [s].

        prediction   x^- = x + h phi(h A) f(x, u),   P^- = F P F^T + Q h,   F = exp(A h),   phi(z) = (exp(z) - 1)/z
        correction   S = C P^- C^T + R,   K = P^- C^T S^-1,   x = x^- + K (y - o(x^-)),
                     P = (I - K C) P^- (I - K C)^T + K R K^T

    f rates, o outputs of the plant, A and C their derivatives at the estimate, u inputs held over the sample. The
    prediction is the exponential Euler method, which is stable for stiff plants and of second order.

    measured           columns of the plant, such as ("left.pressure", "right.pressure")
    process_noise      standard deviation of states after 1 s of white noise; others have none
    measurement_noise  standard deviation of every measured column

    Raises ParameterError for an unknown name or a number that is not positive.
    Reference: Bar-Shalom, Li and Kirubarajan (2001), chapters 5 and 10.
    """

    references: ClassVar[tuple[Reference, ...]] = (BAR_SHALOM2001,)

    plant: System
    measured: tuple[str, ...]
    sample_time: float
    process_noise: Mapping[str, float]
    measurement_noise: Mapping[str, float]
    _compiled: CompiledSystem = dataclasses.field(init=False, repr=False)
    _rows: list[int] = dataclasses.field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_system("ExtendedKalmanFilter", self.plant)
        compiled = compile_system(self.plant)
        columns = (*compiled.description.state_names, *compiled.output_names)
        _check("measured", self.measured, columns)
        _check("process_noise", self.process_noise, compiled.description.state_names)
        _check("measurement_noise", self.measurement_noise, self.measured)
        for name in self.measured:
            if name not in self.measurement_noise:
                raise ParameterError(f"ExtendedKalmanFilter: measurement_noise has no number for '{name}'; give one.")
        for name, value in {**self.process_noise, **self.measurement_noise, "sample_time": self.sample_time}.items():
            if not 0 < value < float("inf"):
                raise ParameterError(f"ExtendedKalmanFilter: '{name}' is {value!r}; it must be positive and finite.")
        object.__setattr__(self, "_compiled", compiled)
        object.__setattr__(self, "_rows", [columns.index(name) for name in self.measured])

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the estimated states."""
        return tuple(self._compiled.description.state_names)

    @property
    def noise(self) -> Array:
        """Covariance (n, n) of the process noise of one sample."""
        return np.diag([self.process_noise.get(name, 0.0) ** 2 * self.sample_time for name in self.states])

    def start(self, state: Mapping[str, float], deviations: Mapping[str, float]) -> StateEstimate:
        """The first estimate: a state, and the standard deviations of its values; 0 unless given."""
        _check("deviations", deviations, self.states)
        spread = [deviations.get(name, 0.0) ** 2 for name in self.states]
        return StateEstimate(state_vector(self.plant, state), np.diag(spread))

    def predict(self, estimate: StateEstimate, inputs: Sequence[float]) -> StateEstimate:
        """The estimate one sample later, under inputs (m,) that are held."""
        mean, transition = self.transition(estimate.mean, inputs)
        return StateEstimate(mean, transition @ estimate.covariance @ transition.T + self.noise)

    def transition(self, state: Array, inputs: Sequence[float]) -> tuple[Array, Array]:
        """The state (n,) one sample later, and its derivative by the state now (n, n)."""
        at, n = derivatives(self._compiled, state.tolist(), inputs), len(state)
        scale = np.maximum(np.abs(state), 1e-12)
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = at.rates_by_state * scale / scale[:, None]
        matrix[:n, n] = at.rates / scale
        both = exponential(self.sample_time * matrix)
        return state + scale * both[:n, n], both[:n, :n] * scale[:, None] / scale

    def correct(
        self, estimate: StateEstimate, values: Sequence[float], inputs: Sequence[float]
    ) -> tuple[StateEstimate, Innovation]:
        """The estimate after a measurement (p,) under the inputs (m,) at that instant, and the innovation."""
        at, n = derivatives(self._compiled, estimate.mean.tolist(), inputs), len(estimate.mean)
        columns = np.concatenate([estimate.mean, at.outputs])
        c = np.vstack([np.eye(n), at.outputs_by_state])[self._rows]
        noise = np.diag([self.measurement_noise[name] ** 2 for name in self.measured])
        difference = np.asarray(values, dtype=float) - columns[self._rows]
        covariance = c @ estimate.covariance @ c.T + noise
        gain = np.linalg.solve(covariance, c @ estimate.covariance).T
        rest = np.eye(n) - gain @ c
        later = rest @ estimate.covariance @ rest.T + gain @ noise @ gain.T
        return StateEstimate(estimate.mean + gain @ difference, later), Innovation(difference, covariance)

    def columns(self, estimate: StateEstimate, inputs: Sequence[float]) -> dict[str, float]:
        """All states and outputs of the plant at an estimate, such as contraction and force."""
        at = derivatives(self._compiled, estimate.mean.tolist(), inputs)
        names = (*self.states, *self._compiled.output_names)
        return dict(zip(names, (*estimate.mean.tolist(), *at.outputs.tolist()), strict=True))

    def estimate(self, recording: Recording, first: StateEstimate) -> dict[str, Array]:
        """Columns (N,) that are estimated from a recording, row by row, and `time` [s].

        The rows must be `sample_time` apart. Inputs are the columns of their names, or the commands of a controller;
        an input without a column is 0. Raises ParameterError for other times.
        """
        time = np.asarray(recording["time"], dtype=float)
        if time.size < 2 or np.abs(np.diff(time) - self.sample_time).max() > 1e-6 * self.sample_time:
            raise ParameterError(
                f"ExtendedKalmanFilter.estimate: the rows must be {self.sample_time:g} s apart; simulate or resample "
                "with this interval."
            )
        inputs = np.column_stack([self._input(recording, name) for name in self._compiled.description.input_names])
        measured = np.column_stack([recording[name] for name in self.measured])
        told: list[dict[str, float]] = []
        estimate, before = first, inputs[0]
        for k in range(time.size):
            if k:
                estimate = self.predict(estimate, before)
            estimate, _ = self.correct(estimate, measured[k], before)
            told.append(self.columns(estimate, before))
            before = inputs[k]
        return {"time": time, **{name: np.array([row[name] for row in told]) for name in told[0]}}

    def _input(self, recording: Recording, name: str) -> Array:
        for column in (f"{COMMAND}{name}", name):
            if column in recording:
                return np.asarray(recording[column], dtype=float)
        return np.zeros(len(recording["time"]))


def exponential(matrix: Array) -> Array:
    """Matrix exponential (n, n) by a Taylor series of order 8 with scaling and squaring, quick for small matrices.

    The relative error is below 1e-11 times the norm of the matrix (tested).
    """
    halvings = max(0, math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=0).max()), 1e-300) * 8.0)))
    scaled = matrix / 2.0**halvings
    identity = np.eye(len(matrix))
    total = identity
    for order in range(8, 0, -1):
        total = identity + scaled @ total / order
    for _ in range(halvings):
        total = total @ total
    return np.asarray(total)


def normalised_error_squared(estimate: StateEstimate, state: Any) -> float:
    """NEES (x - x_true)^T P^-1 (x - x_true) [1] of an estimate for the true state (n,); n on average if consistent."""
    scale = np.sqrt(np.diag(estimate.covariance))
    error = (estimate.mean - np.asarray(state, dtype=float)) / scale
    return float(error @ np.linalg.solve(estimate.covariance / np.outer(scale, scale), error))


def consistency_band(dimension: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """Band [1] of the average NEES of independent runs that a consistent filter keeps with this probability."""
    from scipy.stats import chi2

    tails = ((1.0 - probability) / 2.0, (1.0 + probability) / 2.0)
    low, high = (float(chi2.ppf(tail, dimension * runs)) / runs for tail in tails)
    return low, high


def _check(argument: str, names: Sequence[str] | Mapping[str, float], known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            raise ParameterError(
                f"ExtendedKalmanFilter: {argument} names '{name}'; there are {', '.join(known)}."
                f"{suggestion(name, known)}"
            )
