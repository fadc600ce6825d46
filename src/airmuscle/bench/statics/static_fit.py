"""Fit of a static characteristic to measured points, `fit`."""

import dataclasses
from collections.abc import Collection, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import HintedText, IdentificationError, ParameterError, one_line, tree
from ...physics.muscle.characteristic import Characteristic, PooledLengthLaw
from ...recording import Recording
from .. import statics
from ..diagnosis import MAX_CONTRACTION, VALUE_RULES, support_of
from ..estimation import (
    Censoring,
    LeastSquares,
    Loss,
    check_determined,
    find_initial_values,
    fit_statistics,
    gauss_newton,
    uncensored_rank,
)
from .fit_points import FitPoints
from .fit_problem import evaluate, population_of
from .fit_rules import examine_fit
from .goodness import check_determined_by_levels, goodness_of_fit
from .slack import solve_bounded
from .static_fit_result import Fit


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
        stated = {rule.name for rule in VALUE_RULES}
        remarks = [
            part
            for diagnosis in points.findings.diagnoses
            if diagnosis.rule not in stated
            for part in (" ", diagnosis.text)
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
        _ = points.findings  # raises ColumnError where no muscle is so short
    if isinstance(law, PooledLengthLaw):
        statics.check_poolable(law, points)
    population = population_of(law)
    key = tree.structure(population), tree.flatten(population).tobytes(), loss, tuple(fixed)
    kept: dict[str, Any] = points.kept if censoring is None and sigma is None else {}
    if kept.get("key") != key:
        kept.clear()
        kept.update(fit=_fit_law(population, points, loss, censoring, sigma, fixed), key=key)
    return (
        statics.pool(law, kept["fit"], points) if isinstance(law, PooledLengthLaw) else kept["fit"]
    )


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
    runs = dataclasses.replace(points.runs, arguments=problem.arguments)
    statistics = fit_statistics(problem, solution, loss, runs)
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
        findings=partial(examine_fit, points, problem, solution.modelled, measured, by_recording),
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
        pooling = statics.make_pooling(law, points, problem)
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
