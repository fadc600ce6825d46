"""Prediction of a record by a static law along its pressure and motion, or by simulation of an
identified plant; notes on where the record leaves the ranges of those of the fit: pressure,
contraction, resting length and rates.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import (
    Array,
    ColumnError,
    Hint,
    IdentificationError,
    ParameterError,
    ShortRepr,
    check_field_types,
)
from ...engine.compile import System
from ...engine.run.integrators import Integrator, Rodas4
from ...physics import Characteristic, CreepElements, ForceLaw, Friction, NoFriction, ValidityRange
from ...recording import Recording
from ...recording.columns import displayed
from .. import diagnosis, dynamics
from ..diagnosis import DataUse, LawMisfit, Scatter, branch_distance, force_noise, support_of
from ..estimation import NORMAL_QUANTILE
from ..inspection import Mask, rate_of_change
from ..statics import FORCE, FORCE_MARGIN, evaluate, find_lagging_rows, fitted_quantity_of
from .force_along_motion import predicted_force
from .result import QuantityPrediction, RecordPrediction

COLUMNS = ("pressure", "contraction", "force")
"""Columns that a static law relates."""
USUAL_OF_LAWS = (
    "another specimen, a resting length or a zero of a sensor that differs, a muscle that has"
    " changed, and outliers"
)
USUAL_OF_PLANTS = (
    "another valve opening, supply or muscle, a wrong start time, and another initial pressure"
    " (--own, --start-margin)"
)
"""Usual causes of a band that does not hold, where nothing recorded shows one."""


def predict_static(
    law: Characteristic,
    recording: Recording,
    *,
    friction: Friction | None = None,
    creep: CreepElements | None = None,
    half_width: float | None = None,
    validity_range: ValidityRange | None = None,
    rates: Mapping[str, float | None] | None = None,
    band: str = "",
    notes: Sequence[str] = (),
    differences: Sequence[str] = (),
) -> RecordPrediction:
    """Predict the quantity that a law gives at the rows of a recording with pressure, contraction
    and force.

    law             the static law of the muscle of this recording
    friction, creep subtracted from the force along the recorded motion, relaxed at the first row;
    they need time and
                    the constant `resting_length`
    half_width      half width of the stated 95 % band of the quantity [SI]
    validity_range  range of the measurements of the law; rows outside it are counted in a note
    rates           maximum rates of contraction [1/s] and pressure [Pa/s] of these measurements, by
                    quantity; a record that is faster is named in a note
    band            where the band comes from, or why there is none
    notes           further notes on the record
    differences     what differs from the muscle of the fit, such as "another specimen": named as
                    likely reason where far fewer than 95 % of the rows are within the band

    Rows without tension are compared where the predicted force exceeds the half width, or 0 without
    one. Raises ColumnError for a recording without these columns, IdentificationError where its
    rows are not those of a pulling muscle (`support_of`).
    """
    support_of([recording]).check(DataUse.PREDICTION)
    complete, tension = _rows_with_tension(recording)
    quantity = fitted_quantity_of(law)
    remarks = list[str]()
    moving = [
        part for part in (friction, creep) if part not in (None, NoFriction(), CreepElements())
    ]
    if moving and quantity == FORCE and recording.constants.get("resting_length") is None:
        remarks = [
            "friction and creep of the muscle are left out, because the record states no resting"
            " length"
        ]
    limits = dict[str, tuple[float, float]]()
    faster = rate_notes(recording, rates or {})
    if validity_range is not None:
        limits = {"pressure": validity_range.pressure, "contraction": validity_range.contraction}
    outside, leaving = rows_outside(recording, limits, LIMIT_MARGIN)
    remarks += [*leaving, *faster]
    pulling = np.zeros(len(recording), dtype=bool)
    if isinstance(law, ForceLaw):
        limit = FORCE_MARGIN * float(np.nanmax(recording["force"]))
        force = predicted_force(
            law, recording, friction or NoFriction(), creep or CreepElements(), limit
        )
        predicted = np.maximum(force, 0.0)
        late = find_lagging_rows([recording])
        remarks += late.notes()
        slack = complete & ~tension & ~late.joined
        pulling = slack & (predicted > (half_width or 0.0))
        if pulling.any():
            remarks.append(
                f"the law pulls at {int(pulling.sum())} of {int(slack.sum())} rows without tension,"
                f" up to {float(np.max(predicted[pulling])):.4g} N; these rows count as errors"
                " outside the band"
            )
    else:
        predicted = evaluate(law, quantity.method, quantity.arguments, recording)
    known = np.isfinite(predicted)
    if (tension & ~known).any():
        remarks.append(
            f"the law gives no {quantity.name} at {int((tension & ~known).sum())} rows with tension"
        )
    widths = None if half_width is None else np.full(len(recording), float(half_width))
    measured = recording[quantity.name]
    result = QuantityPrediction(
        quantity.name, measured, predicted, widths, (tension | pulling) & known, band
    )
    driving = np.column_stack([recording[name] for name in COLUMNS if name != quantity.name])
    misfit = _record_misfit(recording, result)
    return RecordPrediction(
        recording,
        (result,),
        (*remarks, *notes),
        outside,
        driving,
        misfit,
        differences=(*differences, *(["a faster motion"] if faster else [])),
        usual_causes=USUAL_OF_LAWS,
    )


def _record_misfit(recording: Recording, force: QuantityPrediction) -> LawMisfit | None:
    """The misfit of a predicted force, by the rule of a fit; None where it follows the record, and
    of another quantity.
    """
    if force.name != FORCE.name or not force.compared.any():
        return None
    residuals = [np.where(force.compared, force.errors, np.nan)]
    distance = branch_distance([recording], residuals, force.name)
    scatter = Scatter(force_noise([recording]), None, distance)
    rows = int(np.count_nonzero(force.compared))
    misfit = scatter.misfit(force.rms, rows, float(np.nanmax(recording["force"])))
    if misfit is None:
        return None
    return dataclasses.replace(misfit, causes=diagnosis.misfit_causes([recording], residuals))


def _rows_with_tension(recording: Recording) -> tuple[Mask, Mask]:
    """Masks (N,) of the complete rows, and of those with tension. Raises ColumnError without
    columns.
    """
    missing = [name for name in COLUMNS if name not in recording]
    if missing:
        by_length = Hint("To compute it from the length", "resting_length", "300 mm")
        raise ColumnError(
            f"{recording.origin}: the prediction of a static law is compared with pressure,"
            f" contraction and force; missing is {', '.join(missing)}.",
            hint=by_length if missing == ["contraction"] else None,
        )
    complete = np.isfinite(sum(recording[name] for name in COLUMNS))
    return complete, (recording["force"] > 0.0) & complete


LIMIT_MARGIN = 1e-3
NOISY_MARGIN = 0.05
"""Noise of the sensors at the limits of the range of a law, relative to the range, and of a noisy
quantity (chosen).
"""
RATE_MARGIN = 1.25
"""Ratio of the rate of a record to that of the fit from which it is outside (chosen)."""
LENGTH_MARGIN = 1e-3
"""Relative difference of two resting lengths that are the same (chosen)."""
NOT_THERE = "the stated band does not apply there"


def rows_outside(
    recording: Recording, ends: Mapping[str, tuple[float, float]], margin: float
) -> tuple[Mask | None, list[str]]:
    """The mask (N,) of the rows with a quantity outside its ends [SI], None without ends; and a
    note on their number, with both ranges of each quantity that leaves it."""
    beyond = dict[str, Mask]()
    for name, (low, high) in ends.items():
        if name in recording:
            values = recording[name]
            allowed = margin * (high - low)
            beyond[name] = (values < low - allowed) | (values > high + allowed)
    outside = np.asarray(np.logical_or.reduce(list(beyond.values()))) if beyond else None
    if outside is None or not outside.any():
        return outside, []
    parts = [
        f"{name} {_span(name, np.nanmin(recording[name]), np.nanmax(recording[name]))}, fitted "
        f"{_span(name, *ends[name])}"
        for name, rows in beyond.items()
        if rows.any()
    ]
    rows = (
        f"{int(outside.sum())} of {len(recording)} rows are outside the range of the measurements"
        " of the fit"
    )
    return outside, [f"{rows} ({'; '.join(parts)}); {NOT_THERE}"]


def rate_notes(recording: Recording, fitted: Mapping[str, float | None]) -> list[str]:
    """The rates of change that exceed those of the fit [SI per s], by quantity; None where the fit
    has none.
    """
    parts = []
    for name, rate in fitted.items():
        own = rate_of_change(recording, name)
        if rate is not None and own > RATE_MARGIN * rate:
            parts.append(
                f"{name} changes by up to {displayed(name, own)}/s, in the fit by"
                f" {displayed(name, rate)}/s"
            )
    return (
        [f"the record is faster than those of the fit: {'; '.join(parts)}; {NOT_THERE}"]
        if parts
        else []
    )


def length_notes(length: float | None, fitted: Sequence[float]) -> list[str]:
    """A resting length [m] outside the range of those of the fit [m]."""
    if length is None or not fitted:
        return []
    low = min(fitted)
    high = max(fitted)
    if low * (1 - LENGTH_MARGIN) <= length <= high * (1 + LENGTH_MARGIN):
        return []
    span = displayed("length", low) if low == high else _span("length", low, high)
    return [
        f"the resting length, {displayed('length', length)}, is outside that of the fit, {span};"
        f" {NOT_THERE}"
    ]


def _span(name: str, low: float, high: float) -> str:
    return f"{displayed(name, float(low))} to {displayed(name, float(high))}"


ASSUMED_DEVIATION = 0.01
"""Standard deviation of a quantity without a stated one, relative to its range in the record
(chosen).
"""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class PlantUncertainty(ShortRepr):
    """The uncertainty of an identified plant.

    deviations  standard deviation of the residuals of each observed quantity [SI], with the model
                error that the records of the fit showed
    parameters  the fitted parameters; several paths have one common value
    covariance  their covariance matrix [SI], shape (P, P)
    records     number of records of the fit; None if it is not known
    factors     half width of the band in standard deviations, from records that were predicted by
                the others; with `records`, a quantity without a factor has no band
    ranges      ends of the measured quantities in the records of the fit [SI]
    rates       their maximum rates of change [SI per s]
    """

    deviations: Mapping[str, float]
    parameters: tuple[dynamics.ParameterPaths, ...] = ()
    covariance: Array = dataclasses.field(default_factory=lambda: np.zeros((0, 0)))
    records: int | None = None
    factors: Mapping[str, float] = dataclasses.field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    rates: Mapping[str, float] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        check_field_types(self)

    def factor(self, name: str) -> float | None:
        """Half width of the band of a quantity in standard deviations; None where it is not
        known.
        """
        if name not in self.deviations:
            return None
        return self.factors.get(name, None if self.records else NORMAL_QUANTILE)

    def source(self, name: str) -> str:
        """Where the band of a quantity comes from, or why there is none."""
        if name not in self.deviations:
            return ""
        if self.factor(name) is None:
            one = "not known from one record"
            return (
                one
                if self.records == 1
                else "not known, because the records did not predict each other"
            )
        if not self.records:
            return "residuals of the fit of the plant, and the covariance of its parameters"
        return (
            f"errors of {self.records} records, each predicted by the others, and the covariance of"
            f" the parameters; half width of {name}: {self.factor(name):.3g} standard deviations"
            " (Student's t)"
        )


def predict_dynamic(
    plant: System,
    experiment: dynamics.Experiment,
    observed: Mapping[str, float],
    *,
    uncertainty: PlantUncertainty | None = None,
    own: Sequence[dynamics.RecordUnknown] = (),
    method: Integrator | None = None,
) -> RecordPrediction:
    """Predict quantities of a transient record by simulating an identified plant from its initial
    conditions.

    plant        the identified plant; that of the experiment replaces it, for example one in other
                 ambient air, which a note states
    observed     the quantities to predict, outputs of the plant that the recording has, each with
                 the standard deviation of its sensor [SI], which weights the estimation of `own`; 0
                 where it is not known
    uncertainty  of the plant; the half width of the 95 % band is k sqrt(g^T C g + s^2) with the
                 sensitivities g to the fitted parameters, their covariance C, the standard
                 deviation s of the residuals and its factor k
    own          unknowns that are estimated from the record itself before the prediction:
                 StartTime(margin), CommandInstants(margin), InitialValue(name, margin) or paths,
                 such as a supply pressure
    method       by default Rodas4(rtol=1e-6)

    Raises IdentificationError where the simulation fails, ParameterError for unknown names.
    """
    notes = dynamics.describe_other_ambient(plant, experiment)
    other_air = ["other ambient air"] if notes else []
    plant = experiment.plant or plant
    known = uncertainty or PlantUncertainty({})
    deviations = {
        name: sensor or _deviation(name, experiment, known) for name, sensor in observed.items()
    }
    if own:
        fit = dynamics.fit_dynamic(
            plant, [experiment], free=(), per_record=own, observed=deviations, method=method
        )
        plant = fit.plant()
        experiment = _with_estimates(fit, experiment)
        values = [
            f"{e.name.removesuffix(' of record 1')} {e.value:.4g} {e.display_unit}"
            for e in fit.estimates
        ]
        texts = [value.rstrip() for value in values]
        bounded = [text for text, e in zip(texts, fit.estimates, strict=True) if e.on_bound]
        notes += [f"estimated from the record itself: {', '.join(texts)} (SI)"]
        notes += [f"on its bound: {text}. {dynamics.RECORD_CONSEQUENCE}" for text in bounded]
    unknowns = (
        dynamics.make_unknowns(plant, [experiment], known.parameters, (), {})
        if known.parameters
        else ()
    )
    model = dynamics.RecordModel(plant, experiment, 0, unknowns, deviations, method or Rodas4())
    modelled = model.evaluate(np.array([unknown.value for unknown in unknowns]))
    spread = _parameter_variance(modelled, unknowns, known)
    recording = experiment.recording
    quantities = []
    for i, name in enumerate(observed):
        factor = known.factor(name)
        measured = recording[name]
        predicted = modelled.values[:, i]
        half = (
            None if factor is None else factor * np.sqrt(spread[:, i] + known.deviations[name] ** 2)
        )
        compared = np.isfinite(measured) & np.isfinite(predicted)
        quantities.append(
            QuantityPrediction(name, measured, predicted, half, compared, known.source(name))
        )
    faster = rate_notes(recording, known.rates)
    outside, leaving = rows_outside(recording, known.ranges, NOISY_MARGIN)
    notes += [*leaving, *faster]
    notes += [
        f"the band of {q.name} is {q.band}" for q in quantities if q.half_width is None and q.band
    ]
    driving = dynamics.commands_at(
        plant, experiment.command, recording["time"] - experiment.start_time
    )
    return RecordPrediction(
        recording,
        tuple(quantities),
        tuple(notes),
        outside,
        driving,
        differences=(*other_air, *(["faster changes"] if faster else [])),
        usual_causes=USUAL_OF_PLANTS,
    )


def _deviation(name: str, experiment: dynamics.Experiment, uncertainty: PlantUncertainty) -> float:
    if name in uncertainty.deviations:
        return float(uncertainty.deviations[name])
    values = [value for value in experiment.recording[name].tolist() if np.isfinite(value)]
    return ASSUMED_DEVIATION * float(np.ptp(values or [0.0])) or 1.0


def _with_estimates(
    fit: dynamics.DynamicFit, experiment: dynamics.Experiment
) -> dynamics.Experiment:
    """The experiment with its estimated start time and initial values, and the plant with its own
    parameters.
    """
    model = fit.problem.record_models[0]
    known = dict(experiment.initial_conditions.known)
    for estimate, unknown in zip(fit.estimates, fit.unknowns, strict=True):
        if isinstance(unknown.target, dynamics.InitialValue):
            known[unknown.target.name] = estimate.value
    conditions = dataclasses.replace(experiment.initial_conditions, known=known)
    start = model.start_time(fit.values)
    command = model.command(fit.values)
    return dynamics.Experiment(experiment.recording, command, conditions, start, fit.plant())


def _parameter_variance(
    modelled: dynamics.ModelOutputs,
    unknowns: Sequence[dynamics.Unknown],
    uncertainty: PlantUncertainty,
) -> Array:
    """Variance of the outputs by the covariance of the parameters [SI], shape (N, Q)."""
    if not unknowns:
        return np.zeros(modelled.values.shape)
    if uncertainty.covariance.shape != (len(unknowns),) * 2:
        raise ParameterError(
            f"PlantUncertainty: {len(unknowns)} parameters need a covariance of {len(unknowns)}"
            f" rows and columns, not {uncertainty.covariance.shape}."
        )
    variance = np.einsum(
        "nqi,ij,nqj->nq", modelled.jacobian, uncertainty.covariance, modelled.jacobian
    )
    if not np.isfinite(variance).all():
        raise IdentificationError(
            "the sensitivities of the prediction are not finite. Check the plant and the input."
        )
    return np.asarray(np.maximum(variance, 0.0))
