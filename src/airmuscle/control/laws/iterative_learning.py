"""IterativeLearning: norm-optimal improvement of a feed-forward signal from trial to trial."""

import functools
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ...core import Array, ParameterError, Reference, model, parameter, published

MAX_SAMPLES = 4000
"""Maximum number of samples of a trial, whose matrices have the square of it (chosen)."""


@model
class IterativeLearning:
    """f_(j+1) = Q (f_j + L e_j),   L = (G^T G + rho g^2 I)^-1 G^T,   g = |G|: norm-optimal
    iterative learning control.

    f_j feed-forward signal of trial j (N,), e_j = r - y_j its error (N,), G lower triangular
    Toeplitz matrix of the impulse response from f to y of the closed loop, rho weight of the
    change. L e_j minimises |e_j - G d|^2 + rho g^2
    |d|^2 over the change d. Q is a zero-phase Butterworth low-pass filter of second order, forwards and backwards: it
    stops the learning above the frequency up to which the model holds. For a true response G_0 the
    signals converge monotonically, |f_(j+1) - f_inf| <= c |f_j - f_inf|, if c = |Q (I - L G_0)| <
    1: see `convergence_rate`. The limit of the error is not 0, because Q is not 1. A signal is
    limited to `minimum` and `maximum`. Trials begin at equal states and have equal references.
    References: Amann, Owens and Rogers (1996); Bristow, Tharayil and Alleyne (2006).
    """  # noqa: E501

    references: ClassVar[tuple[Reference, ...]] = (
        published("amann-1996"),
        published("bristow-2006"),
    )
    from_file: ClassVar[bool] = False

    sample_time: float = parameter("s", "h", "sample time", bounds=(1e-6, 1e3), fitted=False)
    impulse_response: tuple[float, ...] = parameter(
        "y/u", "g_k", "response to a unit command of one sample"
    )
    change_weight: float = parameter(
        "1", "rho", "weight of the change", bounds=(0.0, 1e6), default=1e-3
    )
    cutoff: float = parameter(
        "Hz", "f_c", "cut-off frequency of the filter Q", bounds=(1e-6, 1e6), default=5.0
    )
    minimum: float = parameter(
        "u", "f_min", "minimum of the signal", bounds=(-1e12, 1e12), default=-1e12
    )
    maximum: float = parameter(
        "u", "f_max", "maximum of the signal", bounds=(-1e12, 1e12), default=1e12
    )

    @classmethod
    def from_step_response(
        cls, step_response: npt.ArrayLike, amplitude: float, sample_time: float, **further: float
    ) -> "IterativeLearning":
        """Learning from the response (N,) of y to a step of the feed-forward signal of this
        amplitude at sample 0.

        Element k is y, less its value without the step, k + 1 samples after the step. Raises
        ParameterError for numbers that are not finite, an amplitude of 0, or too many samples.
        """
        response = np.asarray(step_response, dtype=float)
        if response.ndim != 1 or not np.isfinite(response).all() or not amplitude:
            raise ParameterError(
                "IterativeLearning.from_step_response needs finite numbers (N,) and an amplitude"
                " other than 0."
            )
        return cls(
            sample_time, tuple((np.diff(response, prepend=0.0) / amplitude).tolist()), **further
        )

    def check(self) -> None:
        count = len(self.impulse_response)
        if not 2 <= count <= MAX_SAMPLES:
            raise ParameterError(
                f"IterativeLearning: {count} samples; allowed range: 2 to {MAX_SAMPLES}."
            )
        if not any(self.impulse_response):
            raise ParameterError(
                "IterativeLearning: the impulse response is 0: the signal has no effect."
            )
        if self.cutoff >= 0.5 / self.sample_time:
            raise ParameterError(
                f"IterativeLearning: cutoff is {self.cutoff:g} Hz; allowed range: below"
                f" {0.5 / self.sample_time:g} Hz, half of the sampling frequency."
            )

    def improve(self, signal: npt.ArrayLike, error: npt.ArrayLike) -> Array:
        """The signal of the next trial (N,), from that of this trial (N,) and its error (N,).

        Element k of the error belongs to the sample after that of element k of the signal. Raises
        ParameterError for other lengths, or numbers that are not finite.
        """
        f, e = (np.asarray(each, dtype=float) for each in (signal, error))
        count = len(self.impulse_response)
        for name, each in (("signal", f), ("error", e)):
            if each.shape != (count,) or not np.isfinite(each).all():
                raise ParameterError(
                    f"IterativeLearning.improve: the {name} has shape {each.shape}; it must be"
                    f" ({count},), the length of the impulse response, and finite."
                )
        return np.clip(self._filtered(f + self._learning @ e), self.minimum, self.maximum)

    def convergence_rate(self, true_response: npt.ArrayLike) -> float:
        """|Q (I - L G_0)| [1], the factor by which the distance of the signal to its limit shrinks
        with each trial.

        `true_response` is the impulse response (N,) of the plant. Convergence is monotonic below 1,
        not sure above 1.
        """
        matrix = _toeplitz(np.asarray(true_response, dtype=float))
        return float(
            np.linalg.norm(self._filtered(np.eye(len(matrix)) - self._learning @ matrix), 2)
        )

    @functools.cached_property
    def _learning(self) -> Array:
        matrix = _toeplitz(np.array(self.impulse_response))
        weight = self.change_weight * np.linalg.norm(matrix, 2) ** 2
        return np.asarray(
            np.linalg.solve(matrix.T @ matrix + weight * np.eye(len(matrix)), matrix.T)
        )

    def _filtered(self, signals: Array) -> Array:
        """Signals along the first axis, filtered forwards and backwards."""
        from scipy.signal import butter, sosfiltfilt

        sections = butter(2, self.cutoff, fs=1.0 / self.sample_time, output="sos")
        padding = min(len(signals) - 1, int(3.0 / (self.cutoff * self.sample_time)))
        return np.asarray(sosfiltfilt(sections, signals, axis=0, padtype="even", padlen=padding))


def _toeplitz(response: Array) -> Array:
    """Lower triangular Toeplitz matrix (N, N) of an impulse response (N,)."""
    from scipy.linalg import toeplitz

    return np.asarray(toeplitz(response, np.zeros(len(response))))
