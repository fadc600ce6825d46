"""Designs of linear controllers: checks, sampled plants and gains; linear-quadratic Gaussian,
disturbance rejection.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array, ParameterError, check_known, published
from ...physics.analysis import LinearModel, held
from ..laws.state_feedback import StateFeedback

DISTURBANCE = ".disturbance"
"""End of the name of an estimated disturbance, after that of its state."""
HAN2009 = published("han-2009")
GAO2003 = published("gao-2003")


def check_numbers(
    owner: str,
    argument: str,
    given: Mapping[str, float],
    known: Sequence[str],
    needed: Sequence[str],
) -> None:
    """Raise ParameterError for an unknown name, a number that is not positive and finite, or a
    missing number.
    """
    check_known(f"{owner}: {argument} names", given, known)
    for name, value in given.items():
        if not 0 < value < float("inf"):
            raise ParameterError(
                f"{owner}: {argument} of '{name}' is {value!r}; it must be positive and finite."
            )
    for name in needed:
        if name not in given:
            raise ParameterError(f"{owner}: {argument} has no number for '{name}'; give one.")


def check_count(owner: str, what: str, values: Sequence[float], names: Sequence[str]) -> None:
    """Raise ParameterError where there are not as many values as names."""
    if len(values) != len(names):
        needed = ", ".join(names) or "none"
        raise ParameterError(
            f"{owner}: the {what} are {values}, {len(values)}; needed are {needed}."
        )


def checked_scale(
    owner: str,
    model: LinearModel,
    columns: Mapping[str, Sequence[str]],
    disturbed: Sequence[str],
    permitted: Mapping[str, float],
    noise: tuple[Mapping[str, float], Mapping[str, float]],
) -> tuple[tuple[str, ...], Array]:
    """The names of states and disturbances, and the magnitude (n,) of each state, by which
    equations are scaled.

    columns  names by argument: `measured`, `controlled`, which are measured, and others
    noise    standard deviations of states and disturbances after 1 s, and of measured columns

    Raises ParameterError for unknown names, numbers that are missing or not positive, and direct
    feedthrough.
    """
    names = (*model.states, *(f"{name}{DISTURBANCE}" for name in disturbed))
    check_known(f"{owner}: disturbed names", disturbed, model.states)
    for argument, chosen in columns.items():
        known = tuple(columns["measured"]) if argument == "controlled" else model.outputs
        check_known(f"{owner}: {argument} names", chosen, known)
        for name, row in zip(chosen, model.select(outputs=list(chosen)).D, strict=True):
            if row.any():
                raise ParameterError(
                    f"{owner}: '{name}' depends on inputs at once; use states, or outputs of"
                    " states."
                )
    check_numbers(owner, "permitted", permitted, (*model.states, *model.inputs), model.inputs)
    check_numbers(owner, "process_noise", noise[0], names, names[len(model.states) :])
    check_numbers(owner, "measurement_noise", noise[1], columns["measured"], columns["measured"])
    return names, np.array(
        [permitted.get(i, noise[0].get(i, max(abs(model.state[i]), 1.0))) for i in model.states]
    )


def check_sample_time(owner: str, sample_time: float, of_estimator: float) -> None:
    """Raise ParameterError where the sample time of the loop [s] is not that of the estimator
    [s].
    """
    if abs(sample_time - of_estimator) > 1e-9 * sample_time:
        raise ParameterError(
            f"{owner}: the sample time of the loop is {sample_time:g} s and that of the estimator"
            f" {of_estimator:g} s; they must be equal."
        )


def sampled_plant(
    model: LinearModel, sample_time: float, scale: Array, sizes: Array, disturbed: Sequence[str]
) -> tuple[Array, Array, Array]:
    """Matrices of states (n, n), inputs (n, m) and constant disturbances (n, d) of a plant with
    held inputs.

    States and inputs are divided by `scale` (n,) and `sizes` (m,); a disturbance is added to the
    rate of its state.
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
    failure = (
        "inputs do not stabilise the plant, or a weight is missing. Give states a permitted"
        " deviation, or command"
    )
    p = _riccati(a, b, weights, costs, f"{owner}: these {failure} more.")
    return np.asarray(np.linalg.solve(costs + b.T @ p @ b, b.T @ p @ a)), p


def _riccati(a: Array, b: Array, weights: Array, costs: Array, failure: str) -> Array:
    """The solution (n, n) of the discrete algebraic Riccati equation; ParameterError with this text
    without one.
    """
    from scipy.linalg import solve_discrete_are

    try:
        return np.asarray(solve_discrete_are(a, b, weights, costs))
    except np.linalg.LinAlgError:
        raise ParameterError(failure) from None


def disturbance_observer(
    owner: str, sampled: tuple[Array, Array, Array, Array], noise: Array, deviations: Array
) -> tuple[Array, Array, Array, Array]:
    """State, input and output matrix of a sampled plant with constant disturbances as states, and
    the gain (n + d, p) of its stationary Kalman filter, which corrects a prediction by a
    measurement.

    sampled     matrices of states (n, n), inputs (n, m), disturbances (n, d) and measured columns
                (p, n)
    noise       covariance (n + d, n + d) of the process noise of a sample
    deviations  standard deviations (p,) of the measured columns
    """
    a, b, by_disturbance, c = sampled
    n, d = by_disturbance.shape
    wide = np.block([[a, by_disturbance], [np.zeros((d, n)), np.eye(d)]])
    seen = np.hstack([c, np.zeros((len(c), d))])
    failure = (
        "columns do not detect all states, or a process noise is missing. Give states a process"
        " noise, or measure"
    )
    covariance = np.diag(deviations**2)
    p = _riccati(wide.T, seen.T, noise, covariance, f"{owner}: these measured {failure} more.")
    gain = np.asarray(np.linalg.solve(seen @ p @ seen.T + covariance, seen @ p).T)
    return wide, np.vstack([b, np.zeros((d, b.shape[1]))]), seen, gain


def place_observer(a: Array, c: Array, pole: float) -> Array:
    """Gain (n, 1) of an observer that corrects a prediction by y = c x (n,), all poles of its error
    at one place.

    The error of the corrected state obeys e' = (I - K c) a e; Ackermann's formula for the pair (a,
    c a).
    """
    n = len(a)
    seen = np.array([c @ np.linalg.matrix_power(a, i + 1) for i in range(n)])
    powers = np.linalg.matrix_power(a - pole * np.eye(n), n)
    return np.asarray(powers @ np.linalg.solve(seen, np.eye(n)[:, -1:]))


def steady_target(
    owner: str, a: Array, b: Array, entering: Array, controlled: Array
) -> tuple[Array, Array]:
    """The smallest steady state and its inputs, linear in disturbances (n + m, d) and set points (n
    + m, q).

    a, b, entering (n, d)    of the sampled plant x' = a x + b u + entering d
    controlled               (q, n) matrix of the controlled columns

    Raises ParameterError that begins with `owner` where the inputs cannot keep every controlled
    column.
    """
    n, m = b.shape
    equations = np.block([[a - np.eye(n), b], [controlled, np.zeros((len(controlled), m))]])
    rows = np.maximum(np.abs(equations).max(axis=1), 1e-300)
    equations = equations / rows[:, None]
    if np.linalg.matrix_rank(equations, tol=1e-9) < n + len(controlled):
        raise ParameterError(
            f"{owner}: the inputs cannot keep every set point at rest against the disturbances."
            " Control fewer columns, or command more inputs."
        )
    inverse = np.linalg.pinv(equations) / rows
    return -inverse[:, :n] @ entering, inverse[:, n:]


def design_lqg(
    model: LinearModel,
    sample_time: float,
    *,
    measured: Sequence[str],
    controlled: Sequence[str],
    permitted: Mapping[str, float],
    process_noise: Mapping[str, float],
    measurement_noise: Mapping[str, float],
    permitted_integral: Mapping[str, float] | None = None,
    disturbed: Sequence[str] = (),
) -> StateFeedback:
    """The state feedback with observer that minimises a quadratic cost of a linearised plant at a
    sample time [s].

    measured, controlled    columns that the observer uses, and those with a set point; controlled
                            ones are measured
    permitted               maximum permitted deviation of states and inputs, for Bryson's rule:
                            weight 1/d^2; every input needs one, a state without one has the weight
                            0
    permitted_integral      the same for the integral of the error of every controlled column [unit
                            s]
    disturbed               instead of integrals: states to whose rate an unknown constant is added,
                            which the observer estimates ("speed.disturbance") and the command
                            compensates; the set point has a gain
    process_noise           standard deviation of states after 1 s of noise, also of disturbances;
                            others have none
    measurement_noise       standard deviation of every measured column

    The plant is discretised exactly for held inputs; cost and process noise are discretised to
    first order in the sample time. The gains are those of the discrete algebraic Riccati equations.
    Raises ParameterError for an unknown name, a number that is not positive, a measured column with
    direct feedthrough, a plant that these inputs do not stabilise or these columns do not detect,
    and for both or none of `permitted_integral` and `disturbed`. References: Franklin, Powell and
    Workman (1998), chapters 8 and 9; Rawlings, Mayne and Diehl (2017), chapter 1, for the
    disturbances.
    """
    _check_integral(controlled, permitted_integral, disturbed)
    names, scale = checked_scale(
        "design_lqg",
        model,
        {"measured": measured, "controlled": controlled},
        disturbed,
        permitted,
        (process_noise, measurement_noise),
    )
    n = len(model.states)
    a, b, by_disturbance = sampled_plant(
        model, sample_time, scale, np.ones(len(model.inputs)), disturbed
    )
    c = model.select(outputs=list(measured)).C * scale
    z = c[[list(measured).index(name) for name in controlled]]
    weights = [
        (s / permitted[i]) ** 2 if i in permitted else 0.0
        for i, s in zip(model.states, scale, strict=True)
    ]
    integrals = {name: 1.0 / value**2 for name, value in (permitted_integral or {}).items()}
    costs = np.diag([1.0 / permitted[name] ** 2 for name in model.inputs])
    by_state, by_integral = _regulator_gains(
        (a, b, z[: len(integrals)]),
        [*weights, *(integrals[name] for name in controlled if integrals)],
        costs,
        sample_time,
    )
    setpoint = np.zeros((len(b.T), 0))
    if disturbed:
        from_disturbance, from_setpoint = steady_target("design_lqg", a, b, by_disturbance, z)
        setpoint = from_setpoint[n:] + by_state @ from_setpoint[:n]
        by_state = np.hstack([by_state, -(from_disturbance[n:] + by_state @ from_disturbance[:n])])
    sizes = np.concatenate([scale, np.ones(len(disturbed))])
    noise = [(process_noise.get(i, 0.0) / s) ** 2 for i, s in zip(names, sizes, strict=True)]
    deviations = np.array([measurement_noise[name] for name in measured])
    a, b, c, observer = disturbance_observer(
        "design_lqg", (a, b, by_disturbance, c), np.diag(noise) * sample_time, deviations
    )
    return StateFeedback(
        tuple(measured),
        tuple(controlled),
        model.inputs,
        names,
        _flat(a * sizes[:, None] / sizes),
        _flat(b * sizes[:, None]),
        _flat(c / sizes),
        _flat(observer * sizes[:, None]),
        _flat(by_state / sizes),
        _flat(by_integral),
        tuple(model.output_values[name] for name in measured),
        tuple(model.input_values[name] for name in model.inputs),
        _flat(setpoint),
    )


def _regulator_gains(
    sampled: tuple[Array, Array, Array], weights: Sequence[float], costs: Array, sample_time: float
) -> tuple[Array, Array]:
    """Gains of the states and of the integrals of columns, from the sampled matrices of states,
    inputs and columns.
    """
    a, b, columns = sampled
    n, m = b.shape
    q = len(columns)
    wide = np.block([[a, np.zeros((n, q))], [sample_time * columns, np.eye(q)]])
    driving = np.vstack([b, np.zeros((q, m))])
    gains, _ = regulator(
        "design_lqg", wide, driving, np.diag(weights) * sample_time, costs * sample_time
    )
    return gains[:, :n], gains[:, n:]


def design_adrc(
    measured: str,
    commanded: str,
    sample_time: float,
    *,
    order: int,
    gain: float,
    bandwidth: float,
    observer_bandwidth: float,
    operating_point: tuple[float, float] = (0.0, 0.0),
) -> StateFeedback:
    """Active disturbance rejection control (ADRC) of y^(n) = b_0 u + f with an unknown f, at a
    sample time [s].

    order                n, 1 to 4
    gain                 b_0, n-th derivative of the measured column by the command
    bandwidth            omega_c [rad/s] of the controller: poles of the closed loop at -omega_c
    observer_bandwidth   omega_o [rad/s] of the observer of y, its derivatives and f: poles at
                         exp(-omega_o h)
    operating_point      measured column and command that belong together

        u = (k_1 (r - x_1) - k_2 x_2 - ... - k_n x_n - f)/b_0,    k_i coefficients of (s +
            omega_c)^n

    Raises ParameterError for another order, a gain of 0, or a bandwidth that is not positive.
    References: Han (2009); Gao (2003) for the bandwidths as parameters.
    """
    if not 1 <= order <= 4:
        raise ParameterError(f"design_adrc: order is {order}; allowed range: 1 to 4.")
    for name, value in (
        ("gain", abs(gain)),
        ("bandwidth", bandwidth),
        ("observer_bandwidth", observer_bandwidth),
    ):
        if not 0 < value < math.inf:
            raise ParameterError(
                f"design_adrc: {name} is {value!r}; it must be finite, and not 0 or negative."
            )
    chain = np.diag(np.ones(order), 1)
    inputs = np.zeros((order + 1, 1))
    inputs[order - 1] = gain
    a, b = held(chain, inputs, sample_time)
    c = np.eye(1, order + 1)
    observer = place_observer(a, c[0], math.exp(-observer_bandwidth * sample_time))
    k = [math.comb(order, i) * bandwidth ** (order - i) for i in range(order)]
    names = (measured, *(f"derivative{i}" for i in range(1, order)), "disturbance")
    return StateFeedback(
        (measured,),
        (measured,),
        (commanded,),
        names,
        _flat(a),
        _flat(b),
        _flat(c),
        _flat(observer),
        tuple(v / gain for v in (*k, 1.0)),
        (),
        (operating_point[0],),
        (operating_point[1],),
        (k[0] / gain,),
    )


def _check_integral(
    controlled: Sequence[str],
    permitted_integral: Mapping[str, float] | None,
    disturbed: Sequence[str],
) -> None:
    """Raise ParameterError for both or none of integral action and disturbances, or numbers that
    are missing.
    """
    if bool(permitted_integral) == bool(disturbed):
        raise ParameterError(
            "design_lqg: give either permitted_integral, for integral action, or disturbed, for an"
            " observer of disturbances."
        )
    needed = () if disturbed else controlled
    check_numbers("design_lqg", "permitted_integral", permitted_integral or {}, controlled, needed)


def _flat(matrix: Array) -> tuple[float, ...]:
    return tuple(np.asarray(matrix, dtype=float).ravel().tolist())
