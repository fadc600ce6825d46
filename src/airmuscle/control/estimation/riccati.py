"""Designs of linear controllers: checks of their arguments, sampled plants, steady states and gains."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array, ParameterError, check_known
from ...physics.analysis.linear_model import LinearModel
from ...physics.analysis.sampled_model import held

DISTURBANCE = ".disturbance"
"""End of the name of an estimated disturbance, after that of its state."""


def check_numbers(
    owner: str, argument: str, given: Mapping[str, float], known: Sequence[str], needed: Sequence[str]
) -> None:
    """Raise ParameterError for an unknown name, a number that is not positive and finite, or a missing number."""
    check_known(f"{owner}: {argument} names", given, known)
    for name, value in given.items():
        if not 0 < value < float("inf"):
            raise ParameterError(f"{owner}: {argument} of '{name}' is {value!r}; it must be positive and finite.")
    for name in needed:
        if name not in given:
            raise ParameterError(f"{owner}: {argument} has no number for '{name}'; give one.")


def checked_scale(
    owner: str, model: LinearModel, columns: Mapping[str, Sequence[str]], disturbed: Sequence[str],
    permitted: Mapping[str, float], noise: tuple[Mapping[str, float], Mapping[str, float]],
) -> tuple[tuple[str, ...], Array]:  # fmt: skip
    """The names of states and disturbances, and the magnitude (n,) of each state, by which equations are scaled.

    columns  names by argument: `measured`, `controlled`, which are measured, and others
    noise    standard deviations of states and disturbances after 1 s, and of measured columns

    Raises ParameterError for unknown names, numbers that are missing or not positive, and direct feedthrough.
    """
    names = (*model.states, *(f"{name}{DISTURBANCE}" for name in disturbed))
    check_known(f"{owner}: disturbed names", disturbed, model.states)
    for argument, chosen in columns.items():
        known = tuple(columns["measured"]) if argument == "controlled" else model.outputs
        check_known(f"{owner}: {argument} names", chosen, known)
        for name, row in zip(chosen, model.select(outputs=list(chosen)).D, strict=True):
            if row.any():
                raise ParameterError(f"{owner}: '{name}' depends on inputs at once; use states, or outputs of states.")
    check_numbers(owner, "permitted", permitted, (*model.states, *model.inputs), model.inputs)
    check_numbers(owner, "process_noise", noise[0], names, names[len(model.states) :])
    check_numbers(owner, "measurement_noise", noise[1], columns["measured"], columns["measured"])
    sizes = [permitted.get(i, noise[0].get(i, max(abs(model.state[i]), 1.0))) for i in model.states]
    return names, np.array(sizes)


def check_sample_time(owner: str, sample_time: float, of_estimator: float) -> None:
    """Raise ParameterError where the sample time of the loop [s] is not that of the estimator [s]."""
    if abs(sample_time - of_estimator) > 1e-9 * sample_time:
        raise ParameterError(
            f"{owner}: the sample time of the loop is {sample_time:g} s and that of the estimator {of_estimator:g} s; "
            "they must be equal."
        )


def sampled_plant(
    model: LinearModel, sample_time: float, scale: Array, sizes: Array, disturbed: Sequence[str]
) -> tuple[Array, Array, Array]:
    """Matrices of states (n, n), inputs (n, m) and constant disturbances (n, d) of a plant with held inputs.

    States and inputs are divided by `scale` (n,) and `sizes` (m,); a disturbance is added to the rate of its state.
    """
    entering = np.eye(len(scale))[:, [model.states.index(name) for name in disturbed]]
    driving = np.hstack([model.B * sizes, entering]) / scale[:, None]
    a, both = held(model.A * scale / scale[:, None], driving, sample_time)
    b, by_disturbance = np.hsplit(both, [sizes.size])
    return a, b, by_disturbance


def regulator(owner: str, a: Array, b: Array, weights: Array, costs: Array) -> tuple[Array, Array]:
    """Gain (m, n) of the linear-quadratic regulator, and the matrix (n, n) of its cost.

    Raises ParameterError that begins with `owner` where there is none.
    """
    failure = "inputs do not stabilise the plant, or a weight is missing. Give states a permitted deviation, or command"
    p = _riccati(a, b, weights, costs, f"{owner}: these {failure} more.")
    return np.asarray(np.linalg.solve(costs + b.T @ p @ b, b.T @ p @ a)), p


def observer_gain(owner: str, a: Array, c: Array, noise: Array, covariance: Array) -> Array:
    """Gain (n, p) of the stationary Kalman filter, which corrects a prediction by a measurement."""
    failure = "columns do not detect all states, or a process noise is missing. Give states a process noise, or measure"
    p = _riccati(a.T, c.T, noise, covariance, f"{owner}: these measured {failure} more.")
    return np.asarray(np.linalg.solve(c @ p @ c.T + covariance, c @ p).T)


def _riccati(a: Array, b: Array, weights: Array, costs: Array, failure: str) -> Array:
    """The solution (n, n) of the discrete algebraic Riccati equation; ParameterError with this text without one."""
    from scipy.linalg import solve_discrete_are

    try:
        return np.asarray(solve_discrete_are(a, b, weights, costs))
    except np.linalg.LinAlgError:
        raise ParameterError(failure) from None


def disturbance_observer(
    owner: str, sampled: tuple[Array, Array, Array, Array], noise: Array, deviations: Array
) -> tuple[Array, Array, Array, Array]:
    """State, input and output matrix of a sampled plant with constant disturbances as further states, and the gain of
    the observer of both.

    sampled     matrices of states (n, n), inputs (n, m), disturbances (n, d) and measured columns (p, n)
    noise       covariance (n + d, n + d) of the process noise of a sample
    deviations  standard deviations (p,) of the measured columns
    """
    a, b, by_disturbance, c = sampled
    n, d = by_disturbance.shape
    wide = np.block([[a, by_disturbance], [np.zeros((d, n)), np.eye(d)]])
    seen = np.hstack([c, np.zeros((len(c), d))])
    gain = observer_gain(owner, wide, seen, noise, np.diag(deviations**2))
    return wide, np.vstack([b, np.zeros((d, b.shape[1]))]), seen, gain


def place_observer(a: Array, c: Array, pole: float) -> Array:
    """Gain (n, 1) of an observer that corrects a prediction by y = c x (n,), all poles of its error at one place.

    The error of the corrected state obeys e' = (I - K c) a e; Ackermann's formula for the pair (a, c a).
    """
    n = len(a)
    seen = np.array([c @ np.linalg.matrix_power(a, i + 1) for i in range(n)])
    powers = np.linalg.matrix_power(a - pole * np.eye(n), n)
    return np.asarray(powers @ np.linalg.solve(seen, np.eye(n)[:, -1:]))


def steady_target(owner: str, a: Array, b: Array, entering: Array, controlled: Array) -> tuple[Array, Array]:
    """The smallest steady state and its inputs, linear in disturbances (n + m, d) and set points (n + m, q).

    a, b, entering (n, d)    of the sampled plant x' = a x + b u + entering d
    controlled               (q, n) matrix of the controlled columns

    Raises ParameterError that begins with `owner` where the inputs cannot keep every controlled column.
    """
    n, m = b.shape
    equations = np.block([[a - np.eye(n), b], [controlled, np.zeros((len(controlled), m))]])
    rows = np.maximum(np.abs(equations).max(axis=1), 1e-300)
    equations = equations / rows[:, None]
    if np.linalg.matrix_rank(equations, tol=1e-9) < n + len(controlled):
        raise ParameterError(
            f"{owner}: the inputs cannot keep every set point at rest against the disturbances. Control fewer columns, "
            "or command more inputs."
        )
    inverse = np.linalg.pinv(equations) / rows
    return -inverse[:, :n] @ entering, inverse[:, n:]
