"""Table of the rules of static fits, and what they find in a fit: rows that are no measured values,
parameters that the data do not determine, branches, and a law that does not follow the data.
"""

import dataclasses
import functools
from collections.abc import Iterator

import numpy as np

from ...core import Array, Hint, HintedText
from ...recording import resting_length_of
from .. import diagnosis
from ..diagnosis import (
    FRICTION,
    HELD,
    DiagnosisRule,
    Findings,
    LawMisfit,
    MisfitCause,
    Scatter,
    Subject,
    apply_rules,
    branch_distance,
    branch_notes,
    causes_text,
    level_text,
)
from ..estimation import UNCENSORED, Censoring, LeastSquares
from ..inspection import RIPPLE_BAND
from .fit_points import FitPoints
from .fit_problem import FORCE, RESTING_LENGTH, FitProblem, default_censoring
from .static_fit_result import Fit

NO_EFFECT = 0.05
"""Effective number of parameters of the specimen effects below which the specimens do not differ
(chosen).
"""
ILL_CONDITIONED = 1e5
"""Condition number of the scaled design matrix above which a note is added (chosen): half of the
digits are lost.
"""


@dataclasses.dataclass(frozen=True, eq=False)
class FitCase:
    """A static fit as its rules see it; for a pooled law `problem` and its quantity `modelled` are
    those of its population."""

    fit: Fit
    points: FitPoints
    problem: FitProblem
    modelled: Array
    """The fitted quantity, not clamped, at the rows of the problem, shape (N,)."""
    measured: int
    """Rank of the uncensored rows."""
    sensor_deviations: Array | None
    """Standard deviations of sensors that differ, by recording."""

    @functools.cached_property
    def residuals(self) -> list[Array]:
        """Model - measured at the rows of each recording, NaN where a row is not measured [SI]."""
        points = self.points
        residuals = np.full(len(points.joined), np.nan)
        differences = self.modelled - self.problem.data[self.problem.fitted_quantity.name]
        residuals[~points.missing] = np.where(self.problem.censoring == 0, differences, np.nan)
        ends = np.cumsum([len(run) for run in points.recordings])
        return np.split(residuals, ends[:-1])

    @functools.cached_property
    def scatter(self) -> Scatter:
        """The scatter of the recordings, with the distance of the branches of the residuals."""
        quantity = self.problem.fitted_quantity.name
        distance = branch_distance(self.points.recordings, self.residuals, quantity)
        return dataclasses.replace(self.points.findings.scatter, branches=distance)

    @functools.cached_property
    def misfit(self) -> LawMisfit | None:
        """That the law does not follow the data, with the causes; None if it does, and of a law
        that gives no force."""
        fit = self.fit
        if self.problem.fitted_quantity != FORCE:
            return None
        lengths = {resting_length_of(run) for run in self.points.recordings} - {None}
        count = 1 if hasattr(fit.model, "with_resting_length") else len(lengths)
        greatest = fit.data_ranges["force"][1]
        misfit = self.scatter.misfit(fit.rmse, fit.degrees_of_freedom, greatest, count)
        return None if misfit is None else dataclasses.replace(misfit, causes=self.causes)

    @functools.cached_property
    def causes(self) -> tuple[MisfitCause, ...]:
        """What explains the residuals of a force, the greatest share first."""
        if self.problem.fitted_quantity != FORCE:
            return ()
        return diagnosis.misfit_causes(self.points.recordings, self.residuals)

    @property
    def stated_causes(self) -> tuple[MisfitCause, ...]:
        """The causes where the residuals are more than noise."""
        is_stated = self.misfit is not None or self.scatter.branches > 0.0
        return self.causes if is_stated else ()

    @property
    def unit(self) -> str:
        """The unit of the fitted quantity after a number, empty for a ratio."""
        unit = self.problem.fitted_quantity.unit
        return "" if unit == "1" else f" {unit}"


def examine_fit(
    points: FitPoints,
    problem: FitProblem,
    modelled: Array,
    measured: int,
    sensor_deviations: Array | None,
    fit: Fit,
) -> Findings:
    """The findings of the rules of recordings, points and fits; arguments as for `FitCase`."""
    case = FitCase(fit, points, problem, modelled, measured, sensor_deviations)
    diagnoses = (*points.diagnoses, *apply_rules(FIT_RULES, case))
    return Findings(diagnoses, case.scatter, points.findings.delay, case.misfit, case.stated_causes)


def _dropped_rows(case: FitCase) -> Iterator[str]:
    if case.fit.rows_dropped:
        yield f"{case.fit.rows_dropped} rows with a missing value (NaN) were dropped."


def _censored_rows(case: FitCase) -> Iterator[str]:
    censored = case.fit.rows_censored
    if censored:
        yield HintedText(
            f"{censored} {'row is' if censored == 1 else 'rows are'} censored (at zero force, or at"
            " the limit of the force range): counted only where the law violates the bound.",
            Hint(
                "To treat them as measured values", "censoring", UNCENSORED, constant="UNCENSORED"
            ),
        )


def _rows_above_limit(case: FitCase) -> Iterator[str]:
    limit = default_censoring(case.problem.law).max_force
    is_above = (case.problem.data["force"] > limit) & (case.problem.censoring == -1)
    if is_above.any():
        yield (
            f"{np.count_nonzero(is_above)} rows are above the upper limit of the force of the law,"
            f" max_force {limit:.4g} N, which the fit does not change: the law gives no greater"
            " force. Give a law with a greater max_force."
        )


def _determined_by_bounds(case: FitCase) -> Iterator[str]:
    if case.measured < case.fit.rank:
        yield (
            f"The uncensored rows determine {case.measured} of {case.fit.rank} parameters; the"
            " others are limited only by the bounds of the censored rows, and the law is as close"
            " to these as possible."
        )


def _measured_without_force(case: FitCase) -> Iterator[str]:
    is_measured = case.problem.censoring == 0
    at_zero = int(np.count_nonzero((case.problem.data["force"] <= 0) & is_measured))
    if at_zero:
        slack = Hint(
            "To treat them as censored, if the muscle was slack there", "censoring", Censoring()
        )
        text = f"{at_zero} rows at zero force or below are treated as measured values."
        is_clamped = default_censoring(case.problem.law) != UNCENSORED
        yield HintedText(text, *([slack] if is_clamped else []))


def _another_resting_length(case: FitCase) -> Iterator[str]:
    length = case.problem.data.constants.get(RESTING_LENGTH)  # to which the contraction is relative
    if length is None:
        return
    for leaf in case.problem.leaves:
        if leaf.declared.name == RESTING_LENGTH and abs(leaf.value - float(length)) > 1e-6:
            yield (
                f"The muscle in the recording has a resting length of {length:.4g} m, but"
                f" {leaf.path} is {leaf.value:.4g} m."
            )


def _parameters_on_bounds(case: FitCase) -> Iterator[str]:
    for estimate in case.fit.estimates:
        if estimate.on_bound:
            yield f"{estimate.name} is on its bound; its value is not determined by the data."


def _no_degrees_of_freedom(case: FitCase) -> Iterator[str]:
    if not np.isfinite(case.fit.parameter_covariance.sigma):
        yield "There are as many rows as parameters, so the standard errors are unknown."


def _ill_conditioned(case: FitCase) -> Iterator[str]:
    if case.fit.condition > ILL_CONDITIONED:
        yield f"The problem is ill-conditioned (condition number {case.fit.condition:.2g})."


def _robust_loss(case: FitCase) -> Iterator[str]:
    if not isinstance(case.fit.loss, LeastSquares):
        yield f"Robust loss: {case.fit.loss}{case.unit and f', in{case.unit}'}."


def _different_sensors(case: FitCase) -> Iterator[str]:
    deviations = case.sensor_deviations
    if deviations is not None:
        yield HintedText(
            "The recordings come from test rigs with different sensors: rows are weighted by"
            f" standard deviations of {min(deviations):.3g} to {max(deviations):.3g}{case.unit}.",
            Hint("To weight all rows equally", "sigma", 1.0),
        )


def _small_scale_of_loss(case: FitCase) -> Iterator[str]:
    loss = case.fit.loss
    if isinstance(loss, LeastSquares):
        return
    residuals = np.abs(case.problem.residuals(case.modelled))[case.problem.censoring == 0]
    inside = int(np.count_nonzero(residuals <= loss.scale))
    if inside < residuals.size / 2:
        yield (
            f"Only {inside} of {residuals.size} residuals are within the scale of {loss}, so the"
            " standard errors are too small. Use a scale of about three times the standard"
            " deviation of the noise."
        )


def _branches(case: FitCase) -> list[str]:
    quantity = case.problem.fitted_quantity.name
    if not case.scatter.branches:
        return []
    is_stated = case.misfit is None and bool(case.causes)
    is_friction = not case.causes or FRICTION in (case.causes[0].name, case.causes[0].rival)
    return branch_notes(
        case.points.recordings,
        case.scatter.branches,
        quantity,
        causes=causes_text(case.causes) if is_stated else "",
        is_friction=is_friction and case.points.findings.delay is None,
    )


def _one_level(case: FitCase) -> Iterator[str]:
    ranges = case.fit.data_ranges
    bands = {"pressure": RIPPLE_BAND * ranges["pressure"][1], "contraction": HELD}
    for name, band in bands.items():
        if np.ptp(ranges[name]) < band:
            yield (
                f"The {name} was measured at one level, {level_text(name, sum(ranges[name]) / 2)}:"
                " how the force depends on it follows from the form of the law, not from the data."
                " Measure other levels before the law is used there."
            )


def _specimen_effects(case: FitCase) -> Iterator[str]:
    effects = case.fit.effects
    if effects is None:
        return
    text = "the data show no difference between them."
    if effects.degrees_of_freedom >= NO_EFFECT:
        text = (
            "coefficients of the specimen effects with a standard deviation of"
            f" {effects.deviation:.3g} N (restricted maximum likelihood) and"
            f" {effects.degrees_of_freedom:.3g} effective parameters of"
            f" {effects.coefficients.size}. The standard errors of the population parameters"
            " contain this scatter."
        )
    yield f"Partial pooling of {len(effects.specimens)} specimens: {text}"


def _misfit(case: FitCase) -> Iterator[str]:
    if case.misfit is not None:
        yield str(case.misfit)


FIT_RULES = (
    DiagnosisRule("rows with a missing value", Subject.FIT, _dropped_rows, "record all quantities"),
    DiagnosisRule(
        "rows that are bounds", Subject.FIT, _censored_rows, "state which rows are measured"
    ),
    DiagnosisRule(
        "rows above the greatest force of the law",
        Subject.FIT,
        _rows_above_limit,
        "give a law with a greater max_force",
    ),
    DiagnosisRule(
        "parameters that bounds alone determine",
        Subject.FIT,
        _determined_by_bounds,
        "measure more rows with tension",
    ),
    DiagnosisRule(
        "measured values without force",
        Subject.FIT,
        _measured_without_force,
        "treat them as censored, if the muscle was slack",
    ),
    DiagnosisRule(
        "another resting length than that of the recording",
        Subject.FIT,
        _another_resting_length,
        "state the resting length of the muscle",
    ),
    DiagnosisRule(
        "a parameter on its bound",
        Subject.FIT,
        _parameters_on_bounds,
        "fix the parameter, or measure what depends on it",
    ),
    DiagnosisRule(
        "as many rows as parameters",
        Subject.FIT,
        _no_degrees_of_freedom,
        "measure more points",
    ),
    DiagnosisRule(
        "an ill-conditioned problem",
        Subject.FIT,
        _ill_conditioned,
        "choose a law with fewer parameters",
    ),
    DiagnosisRule("a robust loss", Subject.FIT, _robust_loss, "compare with least squares"),
    DiagnosisRule(
        "test rigs with different sensors",
        Subject.FIT,
        _different_sensors,
        "state the standard deviations of the rows, if they are known",
    ),
    DiagnosisRule(
        "a scale of the loss below the noise",
        Subject.FIT,
        _small_scale_of_loss,
        "use about three times the standard deviation of the noise",
    ),
    DiagnosisRule(
        "branches of the residuals",
        Subject.FIT,
        _branches,
        "repeat a run at another speed, and identify the friction",
    ),
    DiagnosisRule(
        "a quantity measured at one level",
        Subject.FIT,
        _one_level,
        "measure other levels before the law is used there",
    ),
    DiagnosisRule(
        "effects of the specimens",
        Subject.FIT,
        _specimen_effects,
        "measure more specimens, if their scatter matters",
    ),
    DiagnosisRule(
        "a law that does not follow the data",
        Subject.FIT,
        _misfit,
        "remove its cause, or compare other laws",
    ),
)
"""The rules of static fits, in the order in which they are told."""
