"""Prediction of a transient record by an identified plant: simulation of its input, with the band of the fit."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ....core import Array, IdentificationError, ParameterError, ShortRepr, check_field_types
from ....engine.compile import System
from ....engine.run.integrators import Integrator, Rodas4
from .. import dynamic
from ..parameter_covariance import NORMAL_QUANTILE
from . import result

UNKNOWN = "not known from one record"
"""Words in place of the band of a plant that was fitted to one record, which does not show how records differ."""
ASSUMED_DEVIATION = 0.01
"""Standard deviation of a quantity without a stated one, relative to its range in the record (chosen)."""
USUAL = (
    "another valve opening, supply or muscle, a wrong start time, and another initial pressure (--own, --start-margin)"
)
"""Usual causes of a band that does not hold, where nothing recorded shows one."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PlantUncertainty(ShortRepr):
    """The uncertainty of an identified plant.

    deviations  standard deviation of the residuals of each observed quantity [SI], with the model error that the
                records of the fit showed
    parameters  the fitted parameters; several paths have one common value
    covariance  their covariance matrix [SI], shape (P, P)
    records     number of records of the fit; None if it is not known
    factors     half width of the band in standard deviations, from records that were predicted by the others; with
                `records`, a quantity without a factor has no band
    ranges      ends of the measured quantities in the records of the fit [SI]
    rates       their maximum rates of change [SI per s]
    """

    deviations: Mapping[str, float]
    parameters: tuple[dynamic.ParameterPaths, ...] = ()
    covariance: Array = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    records: int | None = None
    factors: Mapping[str, float] = dataclasses.field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    rates: Mapping[str, float] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        check_field_types(self)

    def factor(self, name: str) -> float | None:
        """Half width of the band of a quantity in standard deviations; None where it is not known."""
        if name not in self.deviations:
            return None
        return self.factors.get(name, None if self.records else NORMAL_QUANTILE)

    def source(self, name: str) -> str:
        """Where the band of a quantity comes from, or why there is none."""
        if name not in self.deviations:
            return ""
        if self.factor(name) is None:
            return UNKNOWN if self.records == 1 else "not known, because the records did not predict each other"
        if not self.records:
            return "residuals of the fit of the plant, and the covariance of its parameters"
        return (
            f"errors of {self.records} records, each predicted by the others, and the covariance of the parameters; "
            f"half width of {name}: {self.factor(name):.3g} standard deviations (Student's t)"
        )


def predict_dynamic(
    plant: System, experiment: dynamic.Experiment, observed: Mapping[str, float], *,
    uncertainty: PlantUncertainty | None = None, own: Sequence[dynamic.RecordUnknown] = (),
    method: Integrator | None = None,
) -> result.RecordPrediction:  # fmt: skip
    """Predict quantities of a transient record by simulating an identified plant from its initial conditions.

    plant        the identified plant; that of the experiment replaces it, for example one in other ambient air, which a
                 note states
    observed     the quantities to predict, outputs of the plant that the recording has, each with the standard
                 deviation of its sensor [SI], which weights the estimation of `own`; 0 where it is not known
    uncertainty  of the plant; the half width of the 95 % band is k sqrt(g^T C g + s^2) with the sensitivities g to the
                 fitted parameters, their covariance C, the standard deviation s of the residuals and its factor k
    own          unknowns that are estimated from the record itself before the prediction: StartTime(margin),
                 CommandInstants(margin), InitialValue(name, margin) or paths, such as a supply pressure
    method       by default Rodas4(rtol=1e-6)

    Raises IdentificationError where the simulation fails, ParameterError for unknown names.
    """
    notes = dynamic.describe_other_ambient(plant, experiment)
    other_air = ["other ambient air"] if notes else []
    plant, known = experiment.plant or plant, uncertainty or PlantUncertainty({})
    deviations = {name: sensor or _deviation(name, experiment, known) for name, sensor in observed.items()}
    if own:
        fit = dynamic.fit_dynamic(plant, [experiment], free=(), per_record=own, observed=deviations, method=method)
        plant, experiment = fit.plant(), _with_estimates(fit, experiment)
        notes += _describe_estimates(fit)
    unknowns = dynamic.make_unknowns(plant, [experiment], known.parameters, (), {}) if known.parameters else ()
    model = dynamic.RecordModel(plant, experiment, 0, unknowns, deviations, method or Rodas4())
    modelled = model.evaluate(np.array([unknown.value for unknown in unknowns]))
    spread = _parameter_variance(modelled, unknowns, known)
    recording, quantities = experiment.recording, []
    for i, name in enumerate(observed):
        factor, measured, predicted = known.factor(name), recording[name], modelled.values[:, i]
        half = None if factor is None else factor * np.sqrt(spread[:, i] + known.deviations[name] ** 2)
        compared = np.isfinite(measured) & np.isfinite(predicted)
        quantities.append(result.QuantityPrediction(name, measured, predicted, half, compared, known.source(name)))
    faster = result.rate_notes(recording, known.rates)
    notes += [*result.range_notes(recording, known.ranges, result.NOISY_MARGIN), *faster]
    notes += [f"the band of {q.name} is {q.band}" for q in quantities if q.half_width is None and q.band]
    outside = result.rows_outside(recording, known.ranges, result.NOISY_MARGIN)
    driving = dynamic.commands_at(plant, experiment.command, recording["time"] - experiment.start_time)
    prediction = result.RecordPrediction(recording, tuple(quantities), tuple(notes), outside, driving)
    return result.with_band_notes(prediction, [*other_air, *(["faster changes"] if faster else [])], USUAL)


def _describe_estimates(fit: dynamic.DynamicFit) -> list[str]:
    """The unknowns estimated from the record itself, and those of them that are on a bound."""
    texts = [f"{e.name.removesuffix(' of record 1')} {e.value:.4g} {e.display_unit}".rstrip() for e in fit.estimates]
    bounded = [text for text, e in zip(texts, fit.estimates, strict=True) if e.on_bound]
    return [
        f"estimated from the record itself: {', '.join(texts)} (SI)",
        *(f"on its bound: {text}. {dynamic.RECORD_CONSEQUENCE}" for text in bounded),
    ]


def _deviation(name: str, experiment: dynamic.Experiment, uncertainty: PlantUncertainty) -> float:
    if name in uncertainty.deviations:
        return float(uncertainty.deviations[name])
    values = experiment.recording[name]
    return ASSUMED_DEVIATION * float(np.nanmax(values) - np.nanmin(values)) or 1.0


def _with_estimates(fit: dynamic.DynamicFit, experiment: dynamic.Experiment) -> dynamic.Experiment:
    """The experiment with its estimated start time and initial values, and the plant with its own parameters."""
    model, conditions = fit.problem.record_models[0], experiment.initial_conditions
    initial = {
        unknown.target.name: estimate.value
        for estimate, unknown in zip(fit.estimates, fit.unknowns, strict=True)
        if isinstance(unknown.target, dynamic.InitialValue)
    }
    conditions = dataclasses.replace(conditions, known={**conditions.known, **initial})
    start, command = model.start_time(fit.values), model.command(fit.values)
    return dynamic.Experiment(experiment.recording, command, conditions, start, fit.plant())


def _parameter_variance(
    modelled: dynamic.ModelOutputs, unknowns: Sequence[dynamic.Unknown], uncertainty: PlantUncertainty
) -> Array:
    """Variance of the outputs by the covariance of the parameters [SI], shape (N, Q)."""
    if not unknowns:
        return np.zeros(modelled.values.shape)
    if uncertainty.covariance.shape != (len(unknowns),) * 2:
        raise ParameterError(
            f"PlantUncertainty: {len(unknowns)} parameters need a covariance of {len(unknowns)} rows and columns, not "
            f"{uncertainty.covariance.shape}."
        )
    variance = np.einsum("nqi,ij,nqj->nq", modelled.jacobian, uncertainty.covariance, modelled.jacobian)
    if not np.isfinite(variance).all():
        raise IdentificationError("the sensitivities of the prediction are not finite. Check the plant and the input.")
    return np.asarray(np.maximum(variance, 0.0))
