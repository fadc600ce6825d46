"""Table [uncertainty] of a scenario: residuals of the fit of its plant, with the covariance of the
parameters.

It is written by airmuscle fit-dynamic, fit-joint and campaign, and read by predict;
docs/guides/prediction.md has its keys.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...bench import DynamicFit, PlantUncertainty
from ...bench.dynamics import OF_RECORD
from ...bench.estimation import (
    LEVEL,
    NORMAL_QUANTILE,
    degrees_of_freedom,
    root_mean_square,
    t_quantile,
)
from ...bench.inspection import estimate_noise, maximum_rate
from ...core import Array, ParameterError, check_known, tree
from ...physics.plant.plant import Plant
from ..library import Location, ParameterUncertainty, custom_field, located_errors
from .values import BySignal, table_reader

COVARIANCE_KEYS = ("parameters", "standard_errors", "correlations")
"""Keys of the covariance of the parameters."""
SEPARATOR = ", "
"""Between the paths of parameters with a common value."""


def fit_uncertainty(fit: DynamicFit, cross: Sequence[Mapping[str, float]] = ()) -> dict[str, Any]:
    """The table [uncertainty] of the scenarios of a dynamic fit; `cross` are the rms errors [SI] by
    quantity of each record predicted by the others.

    The deviation of a quantity is the rms residual of all records, or the rms error of the records
    predicted by each other if that is greater. It is multiplied by the 95 % quantile of the
    residuals over that of a normal distribution, if that is greater, because model errors are not
    normally distributed. The factor is the quantile of Student's t for the number of records, as
    far as their errors exceed the noise; one record, or records that do not predict each other,
    have none.
    """
    models = fit.problem.record_models
    deviations = {}
    factors = {}
    for name in models[0].names:
        predicted = [errors[name] for errors in cross if name in errors]
        error = root_mean_square([fit.rms(name, i) for i in range(len(models))])
        if predicted:
            error = max(error, root_mean_square(predicted))
        residuals = _finite_residuals(fit, name)
        deviations[name] = error * _tail_factor(np.concatenate(residuals))
        if len(predicted) > 1:
            # the noise contains no error of the model
            noise = root_mean_square([estimate_noise(series) for series in residuals])
            factors[name] = t_quantile(degrees_of_freedom(error, noise, len(predicted)))
    known = {name: value for name, value in deviations.items() if value > 0.0}
    records = [model.experiment.recording for model in models]
    table: dict[str, Any] = {
        "deviations": known,
        "records": len(models),
        **({"factors": factors} if factors else {}),
    }
    columns = {name: np.concatenate([record[name] for record in records]) for name in deviations}
    ranges = {
        name: [float(np.nanmin(column)), float(np.nanmax(column))]
        for name, column in columns.items()
    }
    return {
        **table,
        "ranges": ranges,
        "rates": {n: maximum_rate(records, n) for n in deviations},
        **_covariance(fit),
    }


def _covariance(fit: DynamicFit) -> dict[str, Any]:
    """The parameters that all records share, with their standard errors and correlations."""
    common = [
        i
        for i, (estimate, unknown) in enumerate(zip(fit.estimates, fit.unknowns, strict=True))
        if unknown.paths and OF_RECORD not in estimate.name and np.isfinite(estimate.stderr)
    ]
    if not common:
        return {}
    return {
        "parameters": [SEPARATOR.join(fit.unknowns[i].paths) for i in common],
        "standard_errors": [fit.estimates[i].stderr for i in common],
        "correlations": np.clip(fit.correlations[np.ix_(common, common)], -1.0, 1.0).tolist(),
    }


def _finite_residuals(fit: DynamicFit, name: str) -> list[Array]:
    """The residuals of a quantity in each record, where they are defined."""
    residuals = [fit.residuals(i)[name] for i in range(len(fit.problem.record_models))]
    return [series[np.isfinite(series)] for series in residuals]


def parameter_uncertainty(fitted: PlantUncertainty) -> ParameterUncertainty:
    """Standard errors and correlations of the parameters that have a variance; several paths of one
    are one name.
    """
    errors = np.sqrt(np.maximum(np.diag(fitted.covariance), 0.0))
    known = np.flatnonzero(errors)
    correlations = fitted.covariance[np.ix_(known, known)] / np.outer(errors[known], errors[known])
    return ParameterUncertainty(
        tuple(SEPARATOR.join(fitted.parameters[i]) for i in known),
        tuple(errors[known].tolist()),
        tuple(map(tuple, np.clip(correlations, -1.0, 1.0).tolist())),
    )


def uncertainty_table(fitted: PlantUncertainty) -> dict[str, Any]:
    """The table [uncertainty] of the deviations and of the covariance alone."""
    return {"deviations": fitted.deviations, **dataclasses.asdict(parameter_uncertainty(fitted))}


def _tail_factor(residuals: Array) -> float:
    """The 95 % quantile of residuals (N,) over that of a normal distribution of their rms; at least
    1.
    """
    rms = float(np.sqrt(np.mean(residuals**2)))
    return (
        1.0
        if rms == 0.0
        else max(float(np.quantile(np.abs(residuals), LEVEL)) / (NORMAL_QUANTILE * rms), 1.0)
    )


@dataclasses.dataclass(frozen=True)
class UncertaintyTable:
    """Table [uncertainty] of a scenario."""

    deviations: Mapping[str, float] = custom_field(
        BySignal(positive=True),
        "standard deviation of the residuals by quantity, such as pressure = 620.0",
    )
    records: int | None = None
    factors: Mapping[str, float] = custom_field(
        BySignal("1", positive=True), "half width of the band in deviations", default_factory=dict
    )
    ranges: Mapping[str, tuple[float, float]] = custom_field(
        BySignal(pairs=True), "ends of the measured quantities", default_factory=dict
    )
    rates: Mapping[str, float] = custom_field(
        BySignal(per="/s"), "maximum rates of change of the quantities", default_factory=dict
    )
    parameters: tuple[str, ...] = ()
    standard_errors: tuple[float, ...] = ()
    correlations: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        if self.records is not None and self.records < 1:
            raise ParameterError(f"records is {self.records}; it must be an integer of at least 1.")
        if not self.deviations:
            raise ParameterError(
                "deviations is empty; write standard deviations, such as pressure = 620.0."
            )


def read_plant_uncertainty(value: Any, plant: Plant, where: Location) -> PlantUncertainty:
    """The uncertainty of a table [uncertainty] of a scenario. Raises ParameterError or UnitError
    with the location.
    """
    place = where.inside("")
    table: UncertaintyTable = table_reader(plant).build(value, place, kind=UncertaintyTable)
    with located_errors(place):
        fitted = ParameterUncertainty(table.parameters, table.standard_errors, table.correlations)
    groups = tuple(tuple(name.split(SEPARATOR)) for name in fitted.parameters)
    known = [leaf.path for leaf in tree.leaves(plant)]
    what = f"{place}, parameters: the plant has no parameter"
    check_known(what, [path for group in groups for path in group], known, "its parameters are")
    return PlantUncertainty(
        table.deviations,
        groups,
        fitted.covariance,
        table.records,
        table.factors,
        table.ranges,
        table.rates,
    )
