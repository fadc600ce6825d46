"""Linear-quadratic Gaussian design: a sampled state feedback with observer for a linearised plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.arrays import Array
from ...core.errors import ParameterError
from ...physics.analysis.linear_model import LinearModel
from ..laws.state_feedback import StateFeedback
from .design_checks import check_numbers
from .riccati import discretised, observer_gain, regulator


def design_lqg(
    model: LinearModel, sample_time: float, *, measured: Sequence[str], controlled: Sequence[str],
    permitted: Mapping[str, float], permitted_integral: Mapping[str, float], process_noise: Mapping[str, float],
    measurement_noise: Mapping[str, float],
) -> StateFeedback:  # fmt: skip
    """The state feedback with observer that minimises a quadratic cost of a linearised plant at a sample time [s].

    measured, controlled    columns that the observer uses, and those with a set point; controlled ones are measured
    permitted               maximum permitted deviation of states and inputs, for Bryson's rule: weight 1/d^2; every
                            input needs one, a state without one has the weight 0
    permitted_integral      the same for the integral of the error of every controlled column [unit s]
    process_noise           standard deviation of states after 1 s of noise; states without one have none
    measurement_noise       standard deviation of every measured column

    The plant is discretised exactly for held inputs; cost and process noise are discretised to first order in the
    sample time. The gains are those of the discrete algebraic Riccati equations. Raises ParameterError for an unknown
    name, a number that is not positive, a measured column with direct feedthrough, or a plant that these inputs do not
    stabilise or these columns do not detect.
    Reference: Franklin, Powell and Workman (1998), chapters 8 and 9.
    """
    selected = model.select(outputs=list(measured))
    check_numbers("design_lqg", "permitted", permitted, (*model.states, *model.inputs), model.inputs)
    check_numbers("design_lqg", "permitted_integral", permitted_integral, controlled, controlled)
    check_numbers("design_lqg", "process_noise", process_noise, model.states, ())
    check_numbers("design_lqg", "measurement_noise", measurement_noise, measured, measured)
    for name, row in zip(measured, selected.D, strict=True):
        if row.any():
            raise ParameterError(
                f"design_lqg: '{name}' depends on the inputs at once; measure states, or outputs of states."
            )
    n, scale = len(model.states), _scales(model, permitted, process_noise)
    a, b = discretised(model.A * scale / scale[:, None], model.B / scale[:, None], sample_time)
    c = selected.C * scale
    rows = [list(measured).index(name) for name in controlled]
    wide = np.block([[a, np.zeros((n, len(rows)))], [sample_time * c[rows], np.eye(len(rows))]])
    wide_inputs = np.vstack([b, np.zeros((len(rows), len(model.inputs)))])
    weights = [
        (s / permitted[name]) ** 2 if name in permitted else 0.0 for name, s in zip(model.states, scale, strict=True)
    ]
    weights += [1.0 / permitted_integral[name] ** 2 for name in controlled]
    costs = np.diag([1.0 / permitted[name] ** 2 for name in model.inputs])
    gains, _ = regulator(
        "design_lqg", wide, wide_inputs, np.diag(weights) * sample_time, costs * sample_time, "inputs do not stabilise"
    )
    noise = [(process_noise.get(name, 0.0) / s) ** 2 for name, s in zip(model.states, scale, strict=True)]
    covariance = np.diag([measurement_noise[name] ** 2 for name in measured])
    observer = observer_gain("design_lqg", a, c, np.diag(noise) * sample_time, covariance)
    return StateFeedback(
        tuple(measured), tuple(controlled), model.inputs, model.states,
        _flat(a * scale[:, None] / scale), _flat(b * scale[:, None]), _flat(selected.C),
        _flat(observer * scale[:, None]), _flat(gains[:, :n] / scale), _flat(gains[:, n:]),
        tuple(model.output_values[name] for name in measured), tuple(model.input_values[name] for name in model.inputs),
    )  # fmt: skip


def _scales(model: LinearModel, permitted: Mapping[str, float], noise: Mapping[str, float]) -> Array:
    """Magnitude of each state, by which the equations are scaled."""
    return np.array([permitted.get(name, noise.get(name, max(abs(model.state[name]), 1.0))) for name in model.states])


def _flat(matrix: Array) -> tuple[float, ...]:
    return tuple(np.asarray(matrix, dtype=float).ravel().tolist())
