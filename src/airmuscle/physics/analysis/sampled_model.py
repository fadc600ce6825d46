"""Sampled linear models, x_(k+1) = A x_k + B u_k, and delays."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleError, Array, ParameterError, install_command


@dataclasses.dataclass(frozen=True, eq=False)
class SampledModel:
    """x_(k+1) = A x_k + B u_k,  y_k = C x_k + D u_k, with inputs that are held over a sample time
    [s].

    A, B, C, D    (n, n), (n, m), (k, n), (k, m)
    states, inputs, outputs    names, in the order of rows and columns
    """

    A: Array
    B: Array
    C: Array
    D: Array
    sample_time: float
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def poles(self) -> npt.NDArray[np.complex128]:
        """Eigenvalues of A (n,), that of the greatest magnitude first."""
        values = np.linalg.eigvals(self.A).astype(complex)
        return values[np.argsort(-np.abs(values), kind="stable")]

    @property
    def nyquist_frequency(self) -> float:
        """Half of the sampling frequency [Hz]."""
        return 0.5 / self.sample_time

    def frequency_response(self, frequencies: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """H(z) = C (z I - A)^-1 B + D at z = exp(j 2 pi f h), frequencies f (F,) [Hz], of shape (F,
        k, m).

        Raises ParameterError for a frequency that is negative or not finite, and at a pole on the
        unit circle.
        """
        points = checked_frequencies(frequencies)
        return responses_at(self, np.exp(2j * math.pi * points * self.sample_time), points)

    def response(self, inputs: npt.ArrayLike) -> Array:
        """The outputs (K, k) at the samples for inputs (K, m) from rest."""
        state = np.zeros(len(self.A))
        rows = []
        samples = np.asarray(inputs, dtype=float).reshape(-1, len(self.inputs))
        for u in samples:
            row = self.C @ state + self.D @ u
            rows.append(row)
            state = self.A @ state + self.B @ u
        return np.array(rows).reshape(-1, len(self.outputs))

    def to_control(self) -> Any:
        """A control.StateSpace with this sample time and the names. Needs the package `control`."""
        return control_model(self, self.sample_time)


def responses_at(
    model: Any, points: npt.NDArray[np.complex128], frequencies: Array
) -> npt.NDArray[np.complex128]:
    """C (s I - A)^-1 B + D (F, k, m) of a model at points s (F,), which belong to frequencies (F,)
    [Hz].
    """
    matrices = points[:, None, None] * np.eye(len(model.A)) - model.A
    try:
        states = np.linalg.solve(matrices, np.broadcast_to(model.B, (len(points), *model.B.shape)))
    except np.linalg.LinAlgError:
        f = frequencies[int(np.argmin(np.abs(np.linalg.det(matrices))))]
        raise ParameterError(
            f"frequency_response: there is a pole at {f:g} Hz, and the response is infinite (for"
            " enclosed air at 0 Hz). Choose another frequency."
        ) from None
    return np.asarray(model.C @ states + model.D, dtype=complex).reshape(-1, *model.D.shape)


def checked_frequencies(frequencies: npt.ArrayLike) -> Array:
    """Frequencies (F,) [Hz] that are finite and not negative; otherwise ParameterError."""
    points = np.atleast_1d(np.asarray(frequencies, dtype=float))
    wrong = points[~(np.isfinite(points) & (points >= 0))]
    if wrong.size:
        raise ParameterError(
            f"frequency_response: a frequency is {float(wrong[0])!r} Hz; it must be finite and not"
            " negative."
        )
    return points


def control_model(model: Any, sample_time: float | None = None) -> Any:
    """A control.StateSpace of a model, with its names; raises AirmuscleError without the package
    `control`.
    """
    control = imported_control()
    names = control_names(model)
    return control.StateSpace(model.A, model.B, model.C, model.D, sample_time or 0, **names)


def imported_control() -> Any:
    """The package python-control. Raises AirmuscleError where it is not installed."""
    try:
        import control
    except ImportError:
        raise AirmuscleError(
            f"to_control needs python-control; {install_command('control')}, or use to_scipy()."
        ) from None
    return control


def control_names(model: Any) -> dict[str, list[str]]:
    """The names of states, inputs and outputs, as python-control takes them: a dot would separate
    systems.
    """
    kinds: dict[str, Sequence[str]] = {
        "states": model.states,
        "inputs": model.inputs,
        "outputs": model.outputs,
    }
    return {kind: [name.replace(".", "_") for name in dotted] for kind, dotted in kinds.items()}


def held(a: Array, b: Array, duration: float) -> tuple[Array, Array]:
    """exp(A t) (n, n), and the integral of exp(A s) B over a duration t [s] (n, m): the effect of
    held inputs.
    """
    from scipy.linalg import expm, matrix_balance

    n, m = b.shape
    # states of units as different as kilograms of air and pascals: scaled, the exponential keeps
    # its digits
    both = np.block([[a, b], [np.zeros((m, n + m))]]) * duration
    balanced, (scale, _) = matrix_balance(both, permute=False, separate=True)
    both = expm(balanced) * scale[:, None] / scale
    return both[:n, :n], both[:n, n:]


def sampled(model: Any, sample_time: float, *, before: bool = False) -> SampledModel:
    """A LinearModel between samples, exact for held inputs that arrive after their delays, also
    parts of a sample.

    before  whether outputs are those just before a sample, on which its input has no influence even
            without a delay

    A delay tau = d h + theta, 0 <= theta < h, of an input u is

        x_(k+1) = exp(A h) x_k + exp(A (h - theta)) G(theta) u_(k-d-1) + G(h - theta) u_(k-d),
        G(t) = integral of exp(A s) B ds from 0 to t,

    with the last values of u as further states, `u.1` the newest. Raises ParameterError for a
    sample time that is not positive.
    """
    if not 0 < sample_time < math.inf:
        raise ParameterError(
            f"the sample time is {sample_time!r} s; it must be positive and finite."
        )
    n = len(model.states)
    columns = []
    for name in model.inputs:
        samples, rest = divided(float(model.delays.get(name, 0.0)), sample_time)
        columns.append((samples, rest, samples + (1 if rest > 0 or before else 0)))
    total = n + sum(length for *_, length in columns)
    a = np.zeros((total, total))
    b = np.zeros((total, len(columns)))
    c = np.zeros((len(model.outputs), total))
    d = np.zeros((len(model.outputs), len(columns)))
    a[:n, :n] = held(model.A, model.B[:, :0], sample_time)[0]
    c[:, :n] = model.C
    names = list(model.states)
    place = n
    for j, (samples, rest, length) in enumerate(columns):
        # where the values of each age stand: age 0 is the present input
        at = {0: b[:, j], **{age: a[:, place + age - 1] for age in range(1, length + 1)}}
        feed = {0: d[:, j], **{age: c[:, place + age - 1] for age in range(1, length + 1)}}
        (_, late), (moved, early) = (
            held(model.A, model.B[:, j : j + 1], t) for t in (rest, sample_time - rest)
        )
        at[samples][:n] += early[:, 0]
        if rest > 0:
            at[samples + 1][:n] += (moved @ late)[:, 0]
        feed[samples + (1 if rest > 0 or before else 0)][:] += model.D[:, j]
        for age in range(1, length + 1):
            at[age - 1][place + age - 1] += 1.0
        names += [f"{model.inputs[j]}.{age}" for age in range(1, length + 1)]
        place += length
    return SampledModel(a, b, c, d, float(sample_time), tuple(names), model.inputs, model.outputs)


def divided(delay: float, sample_time: float) -> tuple[int, float]:
    """Whole samples of a delay and the rest [s], which is 0 within rounding."""
    samples = math.floor(delay / sample_time + 1e-9)
    rest = delay - samples * sample_time
    return samples, rest if rest > 1e-9 * sample_time else 0.0


def pade(delay: float, order: int) -> tuple[Array, Array, Array, float]:
    """A (p, p), b (p,), c (p,), d of the Pade approximation exp(-s T) = P(-s)/P(s) of a delay [s]
    in state space.
    """
    factorial = math.factorial
    # P(s T) = sum of these times (s T)^k, the last one 1; controllable canonical form in the time
    # t/T
    below = np.array(
        [factorial(2 * order - k) / (factorial(order - k) * factorial(k)) for k in range(order + 1)]
    )
    below /= below[-1]
    above = below * (-1.0) ** np.arange(order + 1)
    a = np.eye(order, k=1)
    a[-1] = -below[:-1]
    b = np.zeros(order)
    d = float(above[-1])
    b[-1] = 1.0
    return a / delay, b / delay, above[:-1] - d * below[:-1], d
