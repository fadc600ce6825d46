"""Designs of a sampled state feedback with observer: linear-quadratic Gaussian, active disturbance rejection."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import Array, ParameterError, published
from ...physics.analysis.linear_model import LinearModel
from ...physics.analysis.sampled_model import held
from ..laws.state_feedback import StateFeedback
from .riccati import (
    check_numbers,
    checked_scale,
    disturbance_observer,
    place_observer,
    regulator,
    sampled_plant,
    steady_target,
)

HAN2009 = published("han-2009")
GAO2003 = published("gao-2003")


def design_lqg(
    model: LinearModel, sample_time: float, *, measured: Sequence[str], controlled: Sequence[str],
    permitted: Mapping[str, float], process_noise: Mapping[str, float], measurement_noise: Mapping[str, float],
    permitted_integral: Mapping[str, float] | None = None, disturbed: Sequence[str] = (),
) -> StateFeedback:  # fmt: skip
    """The state feedback with observer that minimises a quadratic cost of a linearised plant at a sample time [s].

    measured, controlled    columns that the observer uses, and those with a set point; controlled ones are measured
    permitted               maximum permitted deviation of states and inputs, for Bryson's rule: weight 1/d^2; every
                            input needs one, a state without one has the weight 0
    permitted_integral      the same for the integral of the error of every controlled column [unit s]
    disturbed               instead of integrals: states to whose rate an unknown constant is added, which the observer
                            estimates ("speed.disturbance") and the command compensates; the set point has a gain
    process_noise           standard deviation of states after 1 s of noise, also of disturbances; others have none
    measurement_noise       standard deviation of every measured column

    The plant is discretised exactly for held inputs; cost and process noise are discretised to first order in the
    sample time. The gains are those of the discrete algebraic Riccati equations. Raises ParameterError for an unknown
    name, a number that is not positive, a measured column with direct feedthrough, a plant that these inputs do not
    stabilise or these columns do not detect, and for both or none of `permitted_integral` and `disturbed`.
    References: Franklin, Powell and Workman (1998), chapters 8 and 9; Rawlings, Mayne and Diehl (2017), chapter 1, for
    the disturbances.
    """
    _check_integral(controlled, permitted_integral, disturbed)
    names, scale = checked_scale(
        "design_lqg", model, {"measured": measured, "controlled": controlled}, disturbed, permitted,
        (process_noise, measurement_noise),
    )  # fmt: skip
    n = len(model.states)
    a, b, by_disturbance = sampled_plant(model, sample_time, scale, np.ones(len(model.inputs)), disturbed)
    c = model.select(outputs=list(measured)).C * scale
    z = c[[list(measured).index(name) for name in controlled]]
    weights = [(s / permitted[i]) ** 2 if i in permitted else 0.0 for i, s in zip(model.states, scale, strict=True)]
    integrals = {name: 1.0 / value**2 for name, value in (permitted_integral or {}).items()}
    costs = np.diag([1.0 / permitted[name] ** 2 for name in model.inputs])
    by_state, by_integral = _regulator_gains(
        (a, b, z[: len(integrals)]), [*weights, *(integrals[name] for name in controlled if integrals)], costs,
        sample_time,
    )  # fmt: skip
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
        tuple(measured), tuple(controlled), model.inputs, names,
        _flat(a * sizes[:, None] / sizes), _flat(b * sizes[:, None]), _flat(c / sizes),
        _flat(observer * sizes[:, None]), _flat(by_state / sizes), _flat(by_integral),
        tuple(model.output_values[name] for name in measured), tuple(model.input_values[name] for name in model.inputs),
        _flat(setpoint),
    )  # fmt: skip


def _regulator_gains(
    sampled: tuple[Array, Array, Array], weights: Sequence[float], costs: Array, sample_time: float
) -> tuple[Array, Array]:
    """Gains of the states and of the integrals of columns, from the sampled matrices of states, inputs and columns."""
    a, b, columns = sampled
    (n, m), q = b.shape, len(columns)
    wide = np.block([[a, np.zeros((n, q))], [sample_time * columns, np.eye(q)]])
    driving = np.vstack([b, np.zeros((q, m))])
    gains, _ = regulator("design_lqg", wide, driving, np.diag(weights) * sample_time, costs * sample_time)
    return gains[:, :n], gains[:, n:]


def design_adrc(
    measured: str, commanded: str, sample_time: float, *, order: int, gain: float, bandwidth: float,
    observer_bandwidth: float, operating_point: tuple[float, float] = (0.0, 0.0),
) -> StateFeedback:  # fmt: skip
    """Active disturbance rejection control (ADRC) of y^(n) = b_0 u + f with an unknown f, at a sample time [s].

    order                n, 1 to 4
    gain                 b_0, n-th derivative of the measured column by the command
    bandwidth            omega_c [rad/s] of the controller: poles of the closed loop at -omega_c
    observer_bandwidth   omega_o [rad/s] of the observer of y, its derivatives and f: poles at exp(-omega_o h)
    operating_point      measured column and command that belong together

        u = (k_1 (r - x_1) - k_2 x_2 - ... - k_n x_n - f)/b_0,    k_i coefficients of (s + omega_c)^n

    Raises ParameterError for another order, a gain of 0, or a bandwidth that is not positive.
    References: Han (2009); Gao (2003) for the bandwidths as parameters.
    """
    if not 1 <= order <= 4:
        raise ParameterError(f"design_adrc: order is {order}; allowed range: 1 to 4.")
    for name, value in (("gain", abs(gain)), ("bandwidth", bandwidth), ("observer_bandwidth", observer_bandwidth)):
        if not 0 < value < math.inf:
            raise ParameterError(f"design_adrc: {name} is {value!r}; it must be finite, and not 0 or negative.")
    chain = np.diag(np.ones(order), 1)
    inputs = np.zeros((order + 1, 1))
    inputs[order - 1] = gain
    a, b = held(chain, inputs, sample_time)
    c = np.eye(1, order + 1)
    observer = place_observer(a, c[0], math.exp(-observer_bandwidth * sample_time))
    k = [math.comb(order, i) * bandwidth ** (order - i) for i in range(order)]
    names = (measured, *(f"derivative{i}" for i in range(1, order)), "disturbance")
    return StateFeedback(
        (measured,), (measured,), (commanded,), names, _flat(a), _flat(b), _flat(c), _flat(observer),
        tuple(v / gain for v in (*k, 1.0)), (), (operating_point[0],), (operating_point[1],), (k[0] / gain,),
    )  # fmt: skip


def _check_integral(
    controlled: Sequence[str], permitted_integral: Mapping[str, float] | None, disturbed: Sequence[str]
) -> None:
    """Raise ParameterError for both or none of integral action and disturbances, or numbers that are missing."""
    if bool(permitted_integral) == bool(disturbed):
        raise ParameterError(
            "design_lqg: give either permitted_integral, for integral action, or disturbed, for an observer of "
            "disturbances."
        )
    needed = () if disturbed else controlled
    check_numbers("design_lqg", "permitted_integral", permitted_integral or {}, controlled, needed)


def _flat(matrix: Array) -> tuple[float, ...]:
    return tuple(np.asarray(matrix, dtype=float).ravel().tolist())
