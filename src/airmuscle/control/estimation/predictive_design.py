"""Design of linear model predictive control for a linearised plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.errors import ParameterError
from ...physics.analysis.linear_model import LinearModel
from ..laws.linear_model_predictive import LinearModelPredictive, ObserverModel, TargetMap, condense
from .riccati import (
    DISTURBANCE,
    check_known,
    check_numbers,
    disturbance_observer,
    regulator,
    sampled_plant,
    steady_target,
)

MAX_HORIZON = 200
"""Maximum number of samples of a horizon, whose matrices have the square of it (chosen)."""
SLACK_WEIGHT = 1e4
"""Weight of the slack of a limited column, relative to the permitted deviation of 1 (chosen)."""


def design_predictive(
    model: LinearModel, sample_time: float, *, measured: Sequence[str], controlled: Sequence[str],
    disturbed: Sequence[str], permitted: Mapping[str, float], process_noise: Mapping[str, float],
    measurement_noise: Mapping[str, float], horizon: int = 20,
    limits: Mapping[str, tuple[float, float]] | None = None, slack_weight: float = SLACK_WEIGHT,
) -> LinearModelPredictive:  # fmt: skip
    """Model predictive control of a linearised plant, at a sample time [s] with a horizon of samples.

    measured, controlled    columns that the observer uses, and those with a set point; controlled ones are measured
    disturbed               states to whose rate an unknown disturbance is added: as many as measured columns
    permitted               maximum permitted deviation of states and inputs, for Bryson's rule: weight 1/d^2; every
                            input needs one, a state without one has the weight 0
    process_noise           standard deviation of states after 1 s of noise, also of disturbances ("speed.disturbance")
    measurement_noise       standard deviation of every measured column
    limits                  minimum and maximum of columns without direct feedthrough, such as {"pressure": (0, 5e5)}
    slack_weight            weight of the squared violation of a limit relative to the size of its range; infinity makes
                            the limits hard

    Plant and disturbances are discretised exactly for held inputs. Raises ParameterError for an unknown name, a number
    that is not positive, set points that the inputs cannot keep, or columns that do not detect the disturbances.
    Reference: Rawlings, Mayne and Diehl (2017), chapters 1, 2 and 8.
    """
    states, limits = model.states, limits or {}
    names = (*states, *(f"{name}{DISTURBANCE}" for name in disturbed))
    where = "design_predictive"
    _check(model, measured, controlled, disturbed, limits, horizon, slack_weight)
    check_numbers(where, "permitted", permitted, (*states, *model.inputs), model.inputs)
    check_numbers(where, "process_noise", process_noise, names, [f"{name}{DISTURBANCE}" for name in disturbed])
    check_numbers(where, "measurement_noise", measurement_noise, measured, measured)
    scale = np.array([permitted.get(s, process_noise.get(s, max(abs(model.state[s]), 1.0))) for s in states])
    sizes = np.array([permitted[name] for name in model.inputs])
    a, b, by_disturbance = sampled_plant(model, sample_time, scale, sizes, disturbed)
    c, z, limited = (model.select(outputs=list(part)).C * scale for part in (measured, controlled, limits))
    weights = np.diag([(s / permitted[i]) ** 2 if i in permitted else 0.0 for i, s in zip(states, scale, strict=True)])
    costs = np.eye(len(model.inputs))
    _, terminal = regulator(where, a, b, weights, costs, "inputs do not stabilise")
    noise = [
        (process_noise.get(i, 0.0) / s) ** 2 for i, s in zip(names, (*scale, *np.ones(len(disturbed))), strict=True)
    ]
    deviations = np.array([measurement_noise[name] for name in measured])
    observer = ObserverModel(
        *disturbance_observer(where, (a, b, by_disturbance, c), np.diag(noise) * sample_time, deviations),
        np.array([model.output_values[name] for name in measured]),
        np.array([model.input_values[name] for name in model.inputs]), sizes,
    )  # fmt: skip
    target = steady_target(where, a, b, by_disturbance, z)
    ranges = np.array([high - low for low, high in limits.values()])
    problem = condense(a, b, weights, costs, terminal, horizon, limited / ranges[:, None], slack_weight)
    at = np.array([model.output_values[name] for name in limits])
    low, high = (np.array([pair[i] for pair in limits.values()]) for i in (0, 1))
    maps = TargetMap(
        *target, np.array([model.output_values[name] for name in controlled]), limited / ranges[:, None],
        (low - at) / ranges, (high - at) / ranges,
    )  # fmt: skip
    return LinearModelPredictive(tuple(measured), tuple(controlled), model.inputs, observer, maps, problem)


def _check(
    model: LinearModel, measured: Sequence[str], controlled: Sequence[str], disturbed: Sequence[str],
    limits: Mapping[str, tuple[float, float]], horizon: int, slack_weight: float,
) -> None:  # fmt: skip
    """Raise ParameterError for names, limits or numbers that make no problem."""
    for argument, names, known in (
        ("measured", measured, model.outputs), ("controlled", controlled, tuple(measured)),
        ("disturbed", disturbed, model.states), ("limits", limits, model.outputs),
    ):  # fmt: skip
        check_known("design_predictive", argument, names, known)
    for name, row in zip((*measured, *limits), model.select(outputs=[*measured, *limits]).D, strict=True):
        if row.any():
            raise ParameterError(
                f"design_predictive: '{name}' depends on the inputs at once; use states, or outputs of states."
            )
    for name, (low, high) in limits.items():
        if not -np.inf < low < high < np.inf:
            raise ParameterError(
                f"design_predictive: the limits of '{name}' are {low:g} and {high:g}; the minimum must be below the "
                "maximum, and both finite."
            )
    if len(disturbed) != len(measured):
        raise ParameterError(
            f"design_predictive: {len(disturbed)} states are disturbed and {len(measured)} columns measured; there "
            "must be as many, so that no offset remains."
        )
    if not 1 <= horizon <= MAX_HORIZON:
        raise ParameterError(f"design_predictive: horizon is {horizon}; allowed range: 1 to {MAX_HORIZON} samples.")
    if not slack_weight > 0.0:
        raise ParameterError(f"design_predictive: slack_weight is {slack_weight!r}; it must be positive.")
