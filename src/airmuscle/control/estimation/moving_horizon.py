"""Moving horizon estimation: the states of a window of samples with the least squared noise, within
bounds.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from ...core import (
    Array,
    ParameterError,
    Reference,
    ShortRepr,
    SolveError,
    Status,
    check_field_types,
    published,
)
from ...core.annotation import within
from ...core.errors import check_known
from ...engine.compile.cache.kernel import Kernel
from ...recording.recording import Recording
from ..laws.linear_model_predictive import TOLERANCES, UNLIMITED
from . import ExtendedKalmanFilter, StateEstimate

MAX_HORIZON = 200
STEPS = 20
SETTLED = 1e-9
"""Samples of a window at most; Gauss-Newton steps, and the step in standard deviations that ends
them (chosen).
"""
_shortest = Kernel("shortest_vector", "predictive")


class EstimationWindow(NamedTuple):
    """The samples of the window, each its inputs (m,), held before it, and measured columns (p,),
    NaN where missing or rejected by the gate; a filter's prediction before the first one, its
    estimate after the last one, and the noise (z,) of the last solution, from which the next search
    starts."""

    arrival: StateEstimate
    samples: tuple[tuple[Array, Array], ...]
    filtered: StateEstimate
    noise: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MovingHorizonEstimator(ShortRepr):
    """Moving horizon estimation (MHE): the states of the last N samples with the least squared
    noise, within bounds.

        min  |x_0 - x^-|_(P^-1)^2 + sum_k |w_k|_(Q^-1)^2 + sum_k |y_k - o(x_k)|_(R^-1)^2   over x_0,
             w_0 ... w_(N-1)
             x_(k+1) = g(x_k, u_k) + w_k,    x_min <= x_k <= x_max

    g step, o outputs of the plant, Q and R noise of the extended Kalman filter `filter`; x^- and P
    its prediction before the window (arrival cost). Without bounds and for a linear plant it is the
    Kalman filter; for a nonlinear one the window is linearised anew at its best trajectory. The
    quadratic program of each Gauss-Newton step is solved by the compiled method of
    LinearModelPredictive, with limits linearised at the last trajectory. A measurement beyond the
    gate of the filter is an outlier, which the window does not contain.

    filter     ExtendedKalmanFilter with model, sample time and noise
    horizon    number N of samples of the window
    bounds     minimum and maximum of estimated states by name, such as {"air_mass": (0, 1)}

    Raises ParameterError for an unknown name, a horizon outside 1 to 200, or a minimum that is not
    below the maximum. Reference: Rao, Rawlings and Mayne (2003).
    """

    references: ClassVar[tuple[Reference, ...]] = (published("rao-2003"),)

    filter: ExtendedKalmanFilter
    horizon: int = within(1, MAX_HORIZON, default=10)
    bounds: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        check_field_types(self)
        check_known("MovingHorizonEstimator: bounds names", self.bounds, self.filter.states)
        for name, (low, high) in self.bounds.items():
            if not low < high:
                raise ParameterError(
                    f"MovingHorizonEstimator: the bounds of '{name}' are {low:g} and {high:g}; the"
                    " minimum must be below the maximum."
                )

    def start(
        self, first: StateEstimate, values: Sequence[float], inputs: Sequence[float]
    ) -> EstimationWindow:
        """The window of the first sample, whose estimate before its measurement is `first`."""
        sample, filtered = self._gated(first, values, inputs)
        return self._solved(EstimationWindow(first, (sample,), filtered, np.zeros(len(first.mean))))

    def update(
        self, window: EstimationWindow, values: Sequence[float], inputs: Sequence[float]
    ) -> EstimationWindow:
        """The window one sample later, with measured columns (p,), NaN where one is missing, and
        inputs held before.
        """
        predicted = self.filter.predict(window.filtered, inputs)
        sample, filtered = self._gated(predicted, values, inputs)
        samples = (*window.samples, sample)
        arrival = window.arrival
        noise = window.noise
        if len(samples) > self.horizon:
            (applied, measured), (later, _) = samples[:2]
            corrected, _ = self.filter.corrected_by_all(
                arrival, measured.tolist(), applied.tolist()
            )
            arrival = self.filter.predict(corrected, later.tolist())
            samples = samples[1:]
            noise = np.zeros(0)
        size = len(arrival.mean) + (len(samples) - 1) * self._noisy.shape[1]
        return self._solved(
            EstimationWindow(arrival, samples, filtered, np.append(noise, np.zeros(size))[:size])
        )

    def _gated(
        self, predicted: StateEstimate, values: Sequence[float], inputs: Sequence[float]
    ) -> tuple[tuple[Array, Array], StateEstimate]:
        """A sample of the window, without the measurements that the gate rejects, and the estimate
        of the filter after it.
        """
        measured = np.array(values, dtype=float)
        filtered, innovation = self.filter.correct(predicted, values, inputs)
        if self.filter.rejects(innovation):
            measured[:] = np.nan
        return (np.array(inputs, dtype=float), measured), filtered

    def mean(self, window: EstimationWindow) -> Array:
        """The estimated states (n,) at the last sample of a window."""
        return self._trajectory(window, window.noise)[0][-1]

    def estimate(self, recording: Recording, first: StateEstimate) -> dict[str, Array]:
        """The columns (N,) of the filter's `estimate`, from a recording with such rows."""
        rows = self.filter.rows(recording)
        window = self.start(first, rows.measured[0], rows.held[0])
        windows = [window]
        none = np.full(len(self.filter.measured), np.nan)
        for count, values, held in zip(rows.counts, rows.measured[1:], rows.held[1:], strict=True):
            for readings in (*[none] * (count - 1), values):
                window = self.update(window, readings, held)
            windows.append(window)
        rejected = [
            bool(np.isnan(window.samples[-1][1]).all() and np.isfinite(values).any())
            for window, values in zip(windows, rows.measured, strict=True)
        ]
        return {
            "time": rows.time,
            **self.filter.table(np.array([self.mean(window) for window in windows]), rows.held),
            **self.filter.rejected_rows(rows, rejected),
        }

    @property
    def _noisy(self) -> Array:
        """Square root (n, q) of the process noise of a sample, of the states that have some."""
        deviations = np.sqrt(np.diag(self.filter.noise))
        return np.diag(deviations)[:, deviations > 0]

    def _trajectory(
        self, window: EstimationWindow, noise: Array
    ) -> tuple[list[Array], list[Array]]:
        """The states (n,) of the samples for a noise (z,), and their derivatives by it (n, z).

        The noise is scaled: the deviation of the first state, then those of the steps, in standard
        deviations.
        """
        root = square_root(window.arrival.covariance)
        step = self._noisy
        n, q = step.shape
        slope = np.zeros((n, len(noise)))
        slope[:, :n] = root
        states = [window.arrival.mean + root @ noise[:n]]
        slopes = [slope]
        for k, (inputs, _) in enumerate(window.samples[1:]):
            part = slice(n + k * q, n + (k + 1) * q)
            state, matrix = self.filter.transition(states[-1], inputs.tolist())
            slope = matrix @ slopes[-1]
            slope[:, part] += step
            states.append(state + step @ noise[part])
            slopes.append(slope)
        return states, slopes

    def _solved(self, window: EstimationWindow) -> EstimationWindow:
        """The window with the noise of the best trajectory. Raises SolveError where none is within
        the bounds.
        """
        names = self.filter.states
        noise = window.noise
        places = [names.index(name) for name in self.bounds]
        low, high = (np.array([pair[i] for pair in self.bounds.values()]) for i in (0, 1))
        for _ in range(STEPS):
            states, slopes = self._trajectory(window, noise)
            misfit, jacobian = self._residuals(window, states, slopes)
            rows = np.vstack([slope[places] for slope in slopes])
            here = np.concatenate([state[places] for state in states]) - rows @ noise
            count = len(states)
            better = least_squares(
                jacobian,
                misfit + jacobian @ noise,
                rows,
                np.tile(low, count) - here,
                np.tile(high, count) - here,
            )
            if better is None:
                raise SolveError(
                    "MovingHorizonEstimator: no trajectory of the window is within the bounds."
                    " Widen them, or give states more process noise."
                )
            moved = float(np.abs(better - noise).max())
            noise = better
            if moved < SETTLED or (not places and moved < 1e-6):
                break
        return window._replace(noise=noise)

    def _residuals(
        self, window: EstimationWindow, states: list[Array], slopes: list[Array]
    ) -> tuple[Array, Array]:
        """Measured minus predicted columns (r,) in standard deviations, and predictions by the
        noise (r, z).
        """
        deviations = np.sqrt(self.filter.variances)
        misfits = []
        rows = []
        for (inputs, values), state, slope in zip(window.samples, states, slopes, strict=True):
            predicted, by_state = self.filter.observation(state, inputs.tolist())
            here = ~np.isnan(values)
            misfits.append(((values - predicted) / deviations)[here])
            rows.append((by_state @ slope / deviations[:, None])[here])
        return np.concatenate(misfits), np.vstack(rows)


def square_root(covariance: Array) -> Array:
    """The symmetric square root (n, n) of a covariance, which may be singular."""
    scale = np.sqrt(np.where(np.diag(covariance) > 0, np.diag(covariance), 1.0))
    values, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * (axes * np.sqrt(np.maximum(values, 0.0))) @ axes.T)


def least_squares(
    jacobian: Array, wanted: Array, rows: Array, low: Array, high: Array
) -> Array | None:
    """The z (n,) that minimises |z|^2 + |wanted - jacobian z|^2 with low <= rows z <= high; None
    without one.
    """
    size = jacobian.shape[1]
    factor = np.linalg.cholesky(np.eye(size) + jacobian.T @ jacobian)
    free = np.linalg.solve(factor, jacobian.T @ wanted)
    matrix = np.linalg.solve(factor, rows.T).T if len(rows) else np.zeros((0, size))
    length = np.linalg.norm(matrix, axis=1)
    used = length > 1e-12 * length.max(initial=0.0)
    if np.any(np.maximum(low, -high)[~used] > 0.0):
        return None
    matrix = matrix[used] / length[used, None]
    scale = 1.0 / length[used]
    lower, upper = (
        np.clip(each[used] * scale - matrix @ free, -UNLIMITED, UNLIMITED) for each in (low, high)
    )
    w = np.zeros(size)
    if len(matrix):
        status = _shortest(
            m=np.ascontiguousarray(matrix),
            lower=lower,
            upper=upper,
            tolerances=np.array(TOLERANCES),
            active=np.zeros(len(matrix)),
            order=np.zeros(size, dtype=np.int64),
            factor=np.zeros((size, size)),
            multipliers=np.zeros(size),
            change=np.zeros(size),
            rest=np.zeros(size),
            w=w,
        )
        if status != Status.DONE:
            return None
    return np.asarray(np.linalg.solve(factor.T, w + free))
