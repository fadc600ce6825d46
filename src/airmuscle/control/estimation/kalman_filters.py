"""Nonlinear Kalman filters of a plant, extended and unscented, and their consistency."""

import dataclasses
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from ...core import Array, ParameterError, Reference, check_whole, published
from ...engine.compile.cache.kernel import Kernel
from ...recording.recording import Recording
from .state_estimator import UNDEFINED, StateEstimate, StateEstimator

_predict_extended = Kernel("predict_extended", "kalman_filter")
_correct_extended = Kernel("correct_extended", "kalman_filter")
_predict_unscented = Kernel("predict_unscented", "kalman_filter")
_correct_unscented = Kernel("correct_unscented", "kalman_filter")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ExtendedKalmanFilter(StateEstimator):
    """Extended Kalman filter of a plant; its fields are those of StateEstimator.

        prediction   x^- = x + h phi(h A) f(x, u),   P^- = F P F^T + Q h,   F = exp(A h),   phi(z) =
                     (exp(z) - 1)/z
        correction   S = C P^- C^T + R,   K = P^- C^T S^-1,   x = x^- + K (y - o(x^-)),
                     P = (I - K C) P^- (I - K C)^T + K R K^T

    f rates, o outputs of the plant, A and C their derivatives at the estimate, u inputs held over
    the sample. The prediction is the exponential Euler method, which is stable for stiff plants and
    of second order. Rates, outputs, derivatives and the algebra are compiled. Reference:
    Bar-Shalom, Li and Kirubarajan (2001), chapters 5 and 10.
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("bar-shalom-2001"),
        published("rauch-1965"),
    )

    def transition(self, state: Array, inputs: Sequence[float]) -> tuple[Array, Array]:
        """The state (n,) one sample later, and its derivative by the state now (n, n)."""
        bound = self._filled(StateEstimate(state, np.zeros((len(state), len(state)))), inputs)
        status = bound.predict()
        matrix = bound.transition.copy()
        return self._taken(bound, status).mean, matrix

    def observation(self, state: Array, inputs: Sequence[float]) -> tuple[Array, Array]:
        """The measured columns (p,) at a state (n,), and their derivative by it (p, n)."""
        bound = self._filled(StateEstimate(state, np.zeros((len(state), len(state)))), inputs)
        bound.values[:] = 0.0
        bound.variances[:] = self.variances
        status = bound.correct()
        columns = -bound.difference
        slopes = bound.slopes.copy()
        self._taken(bound, status, UNDEFINED)
        return columns, slopes

    def smooth(self, recording: Recording, first: StateEstimate) -> dict[str, Array]:
        """The columns of `estimate`, where each row also knows all later measurements: for records,
        not for control.

            x_k^s = x_k + G (x_(k+1)^s - x_(k+1)^-),   G = P_k F_k^T (P_(k+1)^-)^-1,   backwards
                                                       from the last row

        For a linear plant it is the estimate with the least squares of all noise.
        Reference: Rauch, Tung and Striebel (1965).
        """
        rows = self.rows(recording)
        passes = list(self._passes(rows, first))
        means = [passes[-1].corrected.mean]
        for now, after in zip(passes[-2::-1], passes[:0:-1], strict=True):
            _, f = self.transition(now.corrected.mean, after.inputs.tolist())
            deviations = np.sqrt(np.diag(after.predicted.covariance))
            scale = np.where(deviations > 0, deviations, 1.0)
            known = after.predicted.covariance / np.outer(scale, scale)
            moved = (
                np.linalg.lstsq(known, (means[-1] - after.predicted.mean) / scale, rcond=1e-14)[0]
                / scale
            )
            means.append(now.corrected.mean + now.corrected.covariance @ f.T @ moved)
        means_of_rows = [
            mean for mean, step in zip(reversed(means), passes, strict=True) if step.row is not None
        ]
        measured = [step for step in passes if step.row is not None]
        return {
            "time": rows.time,
            **self.table(np.array(means_of_rows), rows.held),
            **self.rejected_rows(rows, [step.corrected is step.predicted for step in measured]),
        }

    def _kernels(self, at: SimpleNamespace) -> tuple[Any, Any]:
        functions = self._functions
        n = self._compiled.sizes.states
        p, total = at.slopes.shape
        predict = _predict_extended.bind(
            rates=functions.rates,
            c=functions.constants,
            sizes=self.magnitudes,
            h=float(self.sample_time),
            noise=self.noise,
            x=at.mean,
            u=at.inputs,
            covariance=at.covariance,
            transition=at.transition,
            f=np.zeros(n),
            a=np.zeros((n, total)),
            work=np.zeros((5, n, total + 1)),
            product=np.zeros((total, total)),
        )
        correct = _correct_extended.bind(
            measured=functions.measured,
            constants=functions.constants,
            noise=at.variances,
            x=at.mean,
            u=at.inputs,
            covariance=at.covariance,
            values=at.values,
            difference=at.difference,
            s=at.difference_covariance,
            factor=np.zeros((p, p)),
            c=at.slopes,
            gain=np.zeros((total, p)),
            rest=np.zeros((total, total)),
            product=np.zeros((total, total)),
        )
        return predict, correct


def normalised_error_squared(estimate: StateEstimate, state: Any) -> float:
    """NEES (x - x_true)^T P^-1 (x - x_true) [1] of an estimate for the true state (n,); n on
    average if consistent.
    """
    scale = np.sqrt(np.diag(estimate.covariance))
    error = (estimate.mean - np.asarray(state, dtype=float)) / scale
    return float(error @ np.linalg.solve(estimate.covariance / np.outer(scale, scale), error))


def consistency_band(dimension: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """Band [1] of the average NEES of independent runs that a consistent filter keeps with this
    probability.
    """
    from scipy.stats import chi2

    check_whole("consistency_band", "dimension", dimension, 1)
    check_whole("consistency_band", "runs", runs, 1)
    tails = ((1.0 - probability) / 2.0, (1.0 + probability) / 2.0)
    low, high = (float(chi2.ppf(tail, dimension * runs)) / runs for tail in tails)
    return low, high


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class UnscentedKalmanFilter(StateEstimator):
    """Unscented Kalman filter of a plant; its first fields are those of StateEstimator.

        sigma points  X_0 = x,   X_i = x +- gamma (column i of L),   L L^T = P,   gamma^2 = alpha^2
                      (n + kappa)
        weights       W_i = 1/(2 gamma^2),   W_0 = 1 - n/gamma^2 of the mean,   W_0 + 1 - alpha^2 +
                      beta of covariances
        prediction    x^- = sum W_i g(X_i),   P^- = sum W_i (g(X_i) - x^-)(g(X_i) - x^-)^T + Q h
        correction    sigma points of x^- and P^-, Y_i = o(X_i),   S = cov(Y, Y) + R,   K = cov(X,
                      Y) S^-1,
                      x = x^- + K (y - y^-),   P = P^- - K S K^T

    g is the exponential Euler step of ExtendedKalmanFilter. No derivative of the outputs is used.
    For a linear plant it is the Kalman filter. The defaults of alpha and kappa (chosen) give
    weights W_i >= 0. References: Julier and Uhlmann (2004); Wan and van der Merwe (2000).
    """

    references: ClassVar[tuple[Reference, ...]] = (
        published("julier-uhlmann-2004"),
        published("wan-van-der-merwe-2000"),
    )

    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        n = len(self.states)
        if not (
            0.0 < self.alpha <= 10.0
            and -n < self.kappa < float("inf")
            and 0.0 <= self.beta < float("inf")
        ):
            raise ParameterError(
                f"UnscentedKalmanFilter: alpha, beta and kappa are {self.alpha!r}, {self.beta!r}"
                f" and {self.kappa!r}; allowed range: alpha above 0 to 10, beta from 0, kappa above"
                f" {-n} (minus the number of states)."
            )

    @property
    def weights(self) -> tuple[float, float, float]:
        """Weights of the central point in means and in covariances, and of every other point."""
        gamma_squared = self.alpha**2 * (len(self.states) + self.kappa)
        centre = 1.0 - len(self.states) / gamma_squared
        return centre, centre + 1.0 - self.alpha**2 + self.beta, 0.5 / gamma_squared

    def _kernels(self, at: SimpleNamespace) -> tuple[Any, Any]:
        functions = self._functions
        n = self._compiled.sizes.states
        p, total = at.slopes.shape
        spread = float(0.5 / self.weights[2]) ** 0.5
        weights = np.array(self.weights)
        points = np.zeros((2 * total + 1, total))
        root = np.zeros((total, total))
        predict = _predict_unscented.bind(
            rates=functions.rates,
            c=functions.constants,
            sizes=self.magnitudes,
            h=float(self.sample_time),
            spread=spread,
            weights=weights,
            noise=self.noise,
            x=at.mean,
            u=at.inputs,
            covariance=at.covariance,
            points=points,
            root=root,
            f=np.zeros(n),
            a=np.zeros((n, total)),
            work=np.zeros((5, n, total + 1)),
        )
        correct = _correct_unscented.bind(
            measured=functions.measured,
            constants=functions.constants,
            spread=spread,
            weights=weights,
            noise=at.variances,
            x=at.mean,
            u=at.inputs,
            covariance=at.covariance,
            values=at.values,
            difference=at.difference,
            s=at.difference_covariance,
            factor=np.zeros((p, p)),
            points=points,
            root=root,
            y=np.zeros((2 * total + 1, p)),
            c=np.zeros((p, total)),
            gain=np.zeros((total, p)),
            cross=np.zeros((total, p)),
        )
        return predict, correct
