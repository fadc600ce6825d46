"""Extended Kalman filter: states and outputs of a plant by its linearisation at each sample; consistency."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from ...core.arrays import Array
from ...core.reference import Reference
from ...engine.compile.cache.kernel import Kernel
from .state_estimator import BoundFilter, StateEstimate, StateEstimator

BAR_SHALOM2001 = Reference(
    key="bar-shalom-2001",
    authors="Bar-Shalom, Y., Li, X. R., Kirubarajan, T.",
    title="Estimation with Applications to Tracking and Navigation",
    where="Wiley, New York, chapters 5 and 10",
    year=2001,
    doi="10.1002/0471221279",
    note="extended Kalman filter; consistency by the normalised estimation error squared",
)
_predict = Kernel("predict_extended", "kalman_filter")
_correct = Kernel("correct_extended", "kalman_filter")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ExtendedKalmanFilter(StateEstimator):
    """Extended Kalman filter of a plant; its fields are those of StateEstimator.

        prediction   x^- = x + h phi(h A) f(x, u),   P^- = F P F^T + Q h,   F = exp(A h),   phi(z) = (exp(z) - 1)/z
        correction   S = C P^- C^T + R,   K = P^- C^T S^-1,   x = x^- + K (y - o(x^-)),
                     P = (I - K C) P^- (I - K C)^T + K R K^T

    f rates, o outputs of the plant, A and C their derivatives at the estimate, u inputs held over the sample. The
    prediction is the exponential Euler method, which is stable for stiff plants and of second order. Rates, outputs,
    derivatives and the algebra are compiled.
    Reference: Bar-Shalom, Li and Kirubarajan (2001), chapters 5 and 10.
    """

    references: ClassVar[tuple[Reference, ...]] = (BAR_SHALOM2001,)

    def transition(self, state: Array, inputs: Sequence[float]) -> tuple[Array, Array]:
        """The state (n,) one sample later, and its derivative by the state now (n, n)."""
        bound = self._filled(StateEstimate(state, np.zeros((len(state), len(state)))), inputs)
        self._run(bound.predict, bound)
        matrix = bound.transition.copy()
        return self._taken(bound).mean, matrix

    def _bind(self) -> BoundFilter:
        functions, total, p = self._functions, len(self.states), len(self.measured)
        n, h = self._compiled.sizes.states, float(self.sample_time)
        x, u, covariance = np.zeros(total), np.zeros(self._compiled.sizes.inputs), np.zeros((total, total))
        transition, values, difference, s = np.zeros((total, total)), np.zeros(p), np.zeros(p), np.zeros((p, p))
        predict = _predict.bind(
            functions.rates, functions.constants, self.magnitudes, h, self.noise, x, u, covariance, transition,
            np.zeros(n), np.zeros((n, total)), np.zeros((5, n, total + 1)), np.zeros((total, total)),
        )  # fmt: skip
        correct = _correct.bind(
            functions.measured, functions.constants, self.variances, x, u, covariance, values, difference, s,
            np.zeros((p, p)), np.zeros((p, total)), np.zeros((total, p)), np.zeros((total, total)),
            np.zeros((total, total)),
        )  # fmt: skip
        return self._bound((x, covariance, u, values, difference, s), transition, predict, correct)


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
