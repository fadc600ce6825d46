"""Table [uncertainty] of a scenario: residuals of the fit of its plant, with the covariance of the parameters.

[uncertainty]                               written by airmuscle fit-dynamic and campaign, read by airmuscle predict
deviations = { pressure = 620.0 }           standard deviation of the residuals of each observed quantity
parameters = ["gas.exponent", "circuit.fill.conductance, circuit.discharge.conductance"]
                                            fitted parameters; several paths have one common value
standard_errors = [0.01, 2.1e-11]           SI
correlations = [[1.0, 0.2], [0.2, 1.0]]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..core import tree
from ..core.errors import ParameterError
from ..identify.dynamic import CrossPrediction, DynamicFit
from ..identify.dynamic.cross_prediction import OF_RECORD
from ..identify.prediction import PlantUncertainty
from ..identify.prediction.dynamic import NORMAL_QUANTILE
from ..identify.prediction.result import LEVEL
from ..library.location import Location, check_keys, read_finite_number
from ..library.uncertainty import KEYS, read_uncertainty
from ..plant.plant import Plant
from .record import signal_unit

DEVIATIONS = "deviations"
ALL_KEYS = (DEVIATIONS, *KEYS)
"""Keys of the table."""
SEPARATOR = ", "
"""Between the paths of parameters with a common value."""


def fit_uncertainty(fit: DynamicFit, cross: Sequence[CrossPrediction] = ()) -> dict[str, Any]:
    """The table [uncertainty] of the scenarios of a dynamic fit.

    The deviation of a quantity is the rms residual of all records; where the records were predicted by each other, the
    rms error of these predictions if it is greater. It is multiplied by the 95 % quantile of the residuals over that of
    a normal distribution, if that is greater, because model errors are not normally distributed.
    """
    models = fit.problem.record_models
    deviations = {}
    for name in models[0].names:
        joint = np.mean([fit.rms(name, i) ** 2 for i in range(len(models))])
        predicted = [each.rms[name] ** 2 for each in cross if name in each.rms]
        deviation = float(np.sqrt(max([joint, *([np.mean(predicted)] if predicted else [])])))
        deviations[name] = deviation * tail_factor(fit, name)
    common = [
        i
        for i, (estimate, unknown) in enumerate(zip(fit.estimates, fit.unknowns, strict=True))
        if unknown.paths and OF_RECORD not in estimate.name and np.isfinite(estimate.stderr)
    ]
    table: dict[str, Any] = {DEVIATIONS: {name: value for name, value in deviations.items() if value > 0.0}}
    if common:
        table["parameters"] = [SEPARATOR.join(fit.unknowns[i].paths) for i in common]
        table["standard_errors"] = [fit.estimates[i].stderr for i in common]
        table["correlations"] = np.clip(fit.correlations[np.ix_(common, common)], -1.0, 1.0).tolist()
    return table


def tail_factor(fit: DynamicFit, name: str) -> float:
    """The 95 % quantile of the residuals of a quantity over that of a normal distribution of their rms; at least 1."""
    residuals = np.concatenate([fit.residuals(i)[name] for i in range(len(fit.problem.record_models))])
    residuals = residuals[np.isfinite(residuals)]
    rms = float(np.sqrt(np.mean(residuals**2)))
    return 1.0 if rms == 0.0 else max(float(np.quantile(np.abs(residuals), LEVEL)) / (NORMAL_QUANTILE * rms), 1.0)


def read_plant_uncertainty(table: Any, plant: Plant, location: Location) -> PlantUncertainty:
    """The uncertainty of a table [uncertainty] of a scenario. Raises ParameterError or UnitError with the location."""
    if not isinstance(table, Mapping):
        raise ParameterError(f"{location} is {table!r}; it must be a table with {', '.join(ALL_KEYS)}.")
    check_keys(table, ALL_KEYS, location)
    deviations = _read_deviations(table.get(DEVIATIONS), plant, location.inside(DEVIATIONS))
    given = {key: table[key] for key in KEYS if key in table}
    if not given:
        return PlantUncertainty(deviations)
    parameters = read_uncertainty(given, location)
    groups = tuple(tuple(name.split(SEPARATOR)) for name in parameters.parameters)
    paths = {leaf.path for leaf in tree.leaves(plant)}
    unknown = [path for group in groups for path in group if path not in paths]
    if unknown:
        raise ParameterError(f"{location}, parameters: the plant has no parameter '{unknown[0]}'.")
    return PlantUncertainty(deviations, groups, parameters.covariance)


def _read_deviations(table: Any, plant: Plant, location: Location) -> dict[str, float]:
    if not isinstance(table, Mapping) or not table:
        raise ParameterError(
            f"{location} is {table!r}; it must be a table of standard deviations, such as pressure = 620.0."
        )
    deviations = {}
    for name, value in table.items():
        deviations[name] = read_finite_number(value, signal_unit(name, plant) or "1", f"{location}, {name}")
        if not deviations[name] > 0.0:
            raise ParameterError(f"{location}, {name} is {value!r}; it must be greater than zero.")
    return deviations
