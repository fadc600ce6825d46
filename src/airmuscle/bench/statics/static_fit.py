"""Fit of a static characteristic to measured points, `fit`, with notes on what affects its
interpretation.
"""

import dataclasses
from collections.abc import Collection, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, Hint, HintedText, IdentificationError, ParameterError, one_line, tree
from ...physics.muscle.characteristic import Characteristic, PooledLengthLaw
from ...recording import Recording, resting_length_of
from ..diagnosis import (
    HELD,
    MAX_CONTRACTION,
    Remarks,
    branch_distance,
    branch_notes,
    find_suspicious,
    level_text,
    support_of,
)
from ..estimation import (
    UNCENSORED,
    Censoring,
    LeastSquares,
    Loss,
    check_determined,
    find_initial_values,
    fit_statistics,
    gauss_newton,
    uncensored_rank,
)
from ..inspection import RIPPLE_BAND
from .fit_points import FitPoints
from .fit_problem import FORCE, RESTING_LENGTH, FitProblem, default_censoring, evaluate
from .goodness import check_determined_by_levels, goodness_of_fit
from .lagging_rows import find_lagging_rows
from .pooling import check_poolable, make_pooling, pool, population_of
from .slack import solve_bounded
from .static_fit_result import Fit

NO_EFFECT = 0.05
"""Effective number of parameters of the specimen effects below which the specimens do not differ
(chosen).
"""
ILL_CONDITIONED = 1e5
"""Condition number of the scaled design matrix above which a note is added (chosen): half of the
digits are lost.
"""


def check_arguments(characteristic: object, recording: object) -> None:
    """Raise ParameterError for a characteristic or a recording of another type."""
    if not isinstance(characteristic, Characteristic):
        given = one_line(characteristic)
        example = "load(...).characteristic"
        if isinstance(characteristic, type):
            given = f"the class {characteristic.__name__}"
            if issubclass(characteristic, Characteristic):
                values = (
                    ".blank(degree=5)"
                    if hasattr(characteristic, "blank")
                    else "(...) with initial values"
                )
                example = f"an object of the class, {characteristic.__name__}{values}"
        raise ParameterError(
            f"fit: {given} is not a characteristic. Give one, for example {example}."
        )
    runs = (
        recording
        if isinstance(recording, Sequence) and not isinstance(recording, str)
        else [recording]
    )
    for run in runs:
        if not isinstance(run, Recording):
            raise ParameterError(
                f"fit: {one_line(run)} is not a Recording. Give one, as returned by read, read_csv"
                " or simulate."
            )


def fit(
    law: Characteristic,
    recordings: Recording | Sequence[Recording],
    *,
    loss: Loss = LeastSquares(),
    censoring: Censoring | None = None,
    sigma: npt.ArrayLike | None = None,
    fixed: Collection[str] = (),
) -> Fit:
    """Estimate the parameters of a law from measured points.

    law         structure and initial values; parameters declared as not fitted keep their value
    recordings  one recording or several, with the columns pressure [Pa], contraction [1] and force
                [N]
    loss        LeastSquares() or Huber(scale), the scale in the unit of the fitted quantity
    censoring   the range of force within which rows are measured values. By default rows at zero
                force, at the clamp of the law, or at the limit of the force sensor are censored:
                they contribute only where the law violates their bound. `UNCENSORED` treats all
                rows as measured values
    sigma       standard deviations of the rows, of which only the ratios matter. By default the
                rows of different test rigs are weighted by the standard deviations of their
                sensors; `sigma=1.0` weights all rows equally
    fixed       names of further parameters that keep their value

    Residuals are taken in the quantity that the law gives (force, contraction or pressure), and the
    parameters stay within their declared bounds. Raises IdentificationError where the data do not
    determine the parameters, and names these; first the cause in the data, if they have one
    (`support_of`).
    """
    check_arguments(law, recordings)
    points = FitPoints.from_recordings(recordings)
    try:
        return fit_to_points(law, points, loss=loss, censoring=censoring, sigma=sigma, fixed=fixed)
    except IdentificationError as error:
        support = support_of(points.recordings)
        if support.cause is not None:
            refusal = HintedText(support.refusal, " ", error.message)
            raise IdentificationError(refusal, cause=support.cause.name) from None
        # What the recordings show without a law may be the cause; `read` has stated the rest.
        known = find_suspicious(points.recordings)
        remarks = [
            part for note in points.checks.notes if note not in known for part in (" ", note)
        ]
        raise IdentificationError(HintedText(error.message, *remarks), cause=error.cause) from None


def fit_to_points(
    law: Characteristic,
    points: FitPoints,
    *,
    loss: Loss = LeastSquares(),
    censoring: Censoring | None = None,
    sigma: npt.ArrayLike | None = None,
    fixed: Collection[str] = (),
) -> Fit:
    """As `fit`, for points whose sensors and runs are estimated once for several laws."""
    if np.nanmax(points.joined["contraction"], initial=0.0) > MAX_CONTRACTION:
        _ = points.checks  # raises ColumnError where no muscle is so short
    if isinstance(law, PooledLengthLaw):
        check_poolable(law, points)
    population = population_of(law)
    key = tree.structure(population), tree.flatten(population).tobytes(), loss, tuple(fixed)
    kept: dict[str, Any] = points.kept if censoring is None and sigma is None else {}
    if kept.get("key") != key:
        kept.clear()
        kept.update(fit=_fit_law(population, points, loss, censoring, sigma, fixed), key=key)
    return pool(law, kept["fit"], points) if isinstance(law, PooledLengthLaw) else kept["fit"]


def _fit_law(
    law: Characteristic,
    points: FitPoints,
    loss: Loss,
    censoring: Censoring | None,
    sigma: npt.ArrayLike | None,
    fixed: Collection[str],
) -> Fit:
    problem = points.problem(law, censoring=censoring, sigma=sigma, fixed=fixed)
    solution = solve_bounded(problem, points, loss)
    statistics = fit_statistics(problem, solution, loss, points.runs)
    check_determined_by_levels(problem, solution, points.at_levels)
    data = problem.data
    quantity = problem.fitted_quantity
    by_recording = None if sigma is not None else points.deviations(quantity.name)
    inside = [not estimate.on_bound for estimate in statistics["estimates"]]
    measured = (
        uncensored_rank(problem, solution.jacobian[:, inside])
        if problem.censoring.any()
        else statistics["rank"]
    )
    model = tree.with_parameters(problem.law, problem.leaf_values(solution.values))
    return Fit(
        model=model,
        recording=data,
        fitted_quantity=quantity,
        loss=loss,
        censoring=problem.censoring,
        rows_censored=int(np.count_nonzero(problem.censoring)),
        rows_dropped=points.dropped,
        problem=dataclasses.replace(problem, law=model, leaves=tuple(tree.leaves(model))),
        remarks=partial(examine, points, problem, solution.modelled, measured, by_recording),
        **statistics,
        **goodness_of_fit(problem, evaluate(model, quantity.name, quantity.arguments, data), data),
    )


def refit(
    law: Characteristic,
    points: FitPoints,
    *,
    loss: Loss = LeastSquares(),
    fixed: Collection[str] = (),
) -> Characteristic:
    """The law that `fit` finds for these points if its search starts at the parameters of `law`.
    Other initial values are tried only where the search does not converge, and nothing but the rank
    is computed of the solution. Raises IdentificationError where the points do not determine the
    parameters."""
    if isinstance(law, PooledLengthLaw):
        population = refit(law.population, points, loss=loss, fixed=fixed)
        problem = points.problem(population)
        pooling = make_pooling(law, points, problem)
        return pooling.law(population, pooling.predict(problem.initial_values))
    problem = points.problem(law, fixed=fixed)
    near = (
        None
        if problem.is_linear or loss != LeastSquares()
        else gauss_newton(problem, problem.initial_values)
    )
    try:
        solution = near or solve_bounded(
            problem, points, loss, find_initial_values(problem, multi_start=False)
        )
    except IdentificationError:
        solution = solve_bounded(problem, points, loss)
    check_determined(problem, solution)
    model: Characteristic = tree.with_parameters(problem.law, problem.leaf_values(solution.values))
    return model


def examine(
    points: FitPoints,
    problem: FitProblem,
    modelled: Array,
    measured: int,
    by_recording: Array | None,
    fit: Fit,
) -> Remarks:
    """The remarks on a fit and its points; for a pooled law those on `problem` and its quantity
    `modelled` are those on its population. `measured` is the rank of the uncensored rows,
    `by_recording` the standard deviations of sensors that differ."""
    checks = points.checks
    quantity = problem.fitted_quantity
    residuals = np.full(len(points.joined), np.nan)
    differences = modelled - problem.data[quantity.name]
    residuals[~points.missing] = np.where(problem.censoring == 0, differences, np.nan)
    ends = np.cumsum([len(run) for run in points.recordings])
    distance = branch_distance(points.recordings, np.split(residuals, ends[:-1]), quantity.name)
    scatter = dataclasses.replace(checks.scatter, branches=distance)
    branches = branch_notes(
        points.recordings, distance, quantity.name, delayed=checks.delay is not None
    )
    own = collect_notes(problem, modelled, measured, by_recording, fit)
    late = find_lagging_rows(points.recordings).notes()
    notes = (*checks.notes, *map(str, points.repeated), *late, *own, *branches)
    ranges = fit.data_ranges
    misfit = None
    notes += tuple(
        f"The {name} was measured at one level, {level_text(name, sum(ranges[name]) / 2)}: how the"
        " force depends on it follows from the form of the law, not from the data. Measure other"
        " levels before the law is used there."
        for name, band in (("pressure", RIPPLE_BAND * ranges["pressure"][1]), ("contraction", HELD))
        if np.ptp(ranges[name]) < band
    )
    if (effects := fit.effects) is not None:
        text = "the data show no difference between them."
        if effects.degrees_of_freedom >= NO_EFFECT:
            text = (
                "coefficients of the specimen effects with a standard deviation of"
                f" {effects.deviation:.3g} N (restricted maximum likelihood) and"
                f" {effects.degrees_of_freedom:.3g} effective parameters of"
                f" {effects.coefficients.size}. The standard errors of the population parameters"
                " contain this scatter."
            )
        notes += (f"Partial pooling of {len(effects.specimens)} specimens: {text}",)
    if quantity == FORCE:
        lengths = {resting_length_of(run) for run in points.recordings} - {None}
        count = 1 if hasattr(fit.model, "with_resting_length") else len(lengths)
        misfit = scatter.misfit(fit.rmse, fit.degrees_of_freedom, ranges["force"][1], count)
        if misfit is not None:
            misfit = misfit.with_causes(points.recordings, np.split(residuals, ends[:-1]))
            notes += (str(misfit),)
    return dataclasses.replace(checks, notes=notes, scatter=scatter, misfit=misfit)


def _row_notes(problem: FitProblem, measured: int, fit: Fit) -> Iterator[str]:
    """Remarks on rows that are dropped, censored, above the limit of the law, or at zero force and
    not censored.
    """
    force = problem.data["force"]
    usual = default_censoring(problem.law)
    if fit.rows_dropped:
        yield f"{fit.rows_dropped} rows with a missing value (NaN) were dropped."
    if censored := fit.rows_censored:
        yield HintedText(
            f"{censored} {'row is' if censored == 1 else 'rows are'} censored (at zero force, or at"
            " the limit of the force range): counted only where the law violates the bound.",
            Hint(
                "To treat them as measured values", "censoring", UNCENSORED, constant="UNCENSORED"
            ),
        )
    if above := int(np.count_nonzero((force > usual.max_force) & (problem.censoring == -1))):
        yield (
            f"{above} rows are above the upper limit of the force of the law, max_force"
            f" {usual.max_force:.4g} N, which the fit does not change: the law gives no greater"
            " force. Give a law with a greater max_force."
        )
    if measured < fit.rank:
        yield (
            f"The uncensored rows determine {measured} of {fit.rank} parameters; the others are"
            " limited only by the bounds of the censored rows, and the law is as close to these as"
            " possible."
        )
    if at_zero := int(np.count_nonzero((force <= 0) & (problem.censoring == 0))):
        slack = Hint(
            "To treat them as censored, if the muscle was slack there", "censoring", Censoring()
        )
        text = f"{at_zero} rows at zero force or below are treated as measured values."
        yield HintedText(text, *([slack] if usual != UNCENSORED else []))


def collect_notes(
    problem: FitProblem, modelled: Array, measured: int, by_recording: Array | None, fit: Fit
) -> Iterator[str]:
    """Remarks on the solution of a fit that affect its interpretation, as sentences; arguments as
    for `examine`.
    """
    yield from _row_notes(problem, measured, fit)
    length = problem.data.constants.get(RESTING_LENGTH)  # to which the contraction is relative
    for leaf in problem.leaves:
        if (
            leaf.declared.name == RESTING_LENGTH
            and length is not None
            and abs(leaf.value - float(length)) > 1e-6
        ):
            text = f"The muscle in the recording has a resting length of {length:.4g} m"
            yield f"{text}, but {leaf.path} is {leaf.value:.4g} m."
    for estimate in fit.estimates:
        if estimate.on_bound:
            yield f"{estimate.name} is on its bound; its value is not determined by the data."
    if not np.isfinite(fit.parameter_covariance.sigma):
        yield "There are as many rows as parameters, so the standard errors are unknown."
    if fit.condition > ILL_CONDITIONED:
        yield f"The problem is ill-conditioned (condition number {fit.condition:.2g})."
    unit = "" if problem.fitted_quantity.unit == "1" else f" {problem.fitted_quantity.unit}"
    if not isinstance(fit.loss, LeastSquares):
        yield f"Robust loss: {fit.loss}{unit and f', in{unit}'}."
    if by_recording is not None:
        yield HintedText(
            "The recordings come from test rigs with different sensors: rows are weighted by"
            f" standard deviations of {min(by_recording):.3g} to {max(by_recording):.3g}{unit}.",
            Hint("To weight all rows equally", "sigma", 1.0),
        )
    if not isinstance(fit.loss, LeastSquares):
        residuals = np.abs(problem.residuals(modelled))[problem.censoring == 0]
        inside = int(np.count_nonzero(residuals <= fit.loss.scale))
        if inside < residuals.size / 2:
            yield (
                f"Only {inside} of {residuals.size} residuals are within the scale of {fit.loss},"
                " so the standard errors are too small. Use a scale of about three times the"
                " standard deviation of the noise."
            )
