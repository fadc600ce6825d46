"""Fit of a static characteristic to measured points: `fit`."""

import dataclasses
from collections.abc import Collection, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import HintedText, IdentificationError, ParameterError, one_line, tree
from ...physics.muscle.characteristic import Characteristic, PooledLengthLaw
from ...recording import Recording
from ..checks import find_suspicious
from ..checks.contractions import MAX_CONTRACTION
from . import statistics as stats
from .fit_notes import collect_notes, examine
from .fit_points import FitPoints
from .gauss_newton import gauss_newton
from .pooling import check_poolable, pool, population_of, refit_pooled
from .problem import FitProblem, LeastSquaresSolution, evaluate
from .result import Estimate, Fit
from .slack import solve_bounded
from .solver import is_linear
from .variable_projection import find_initial_values
from .weighting import Censoring, LeastSquares, Loss


def check_arguments(characteristic: object, recording: object) -> None:
    """Raise ParameterError for a characteristic or a recording of another type."""
    if not isinstance(characteristic, Characteristic):
        given, example = one_line(characteristic), "load(...).characteristic"
        if isinstance(characteristic, type):
            given = f"the class {characteristic.__name__}"
            if issubclass(characteristic, Characteristic):
                values = ".blank(degree=5)" if hasattr(characteristic, "blank") else "(...) with initial values"
                example = f"an object of the class, {characteristic.__name__}{values}"
        raise ParameterError(f"fit: {given} is not a characteristic. Give one, for example {example}.")
    runs = recording if isinstance(recording, Sequence) and not isinstance(recording, str) else [recording]
    for run in runs:
        if not isinstance(run, Recording):
            raise ParameterError(
                f"fit: {one_line(run)} is not a Recording. Give one, as returned by read, read_csv or simulate."
            )


def fit(
    law: Characteristic, recordings: Recording | Sequence[Recording], *, loss: Loss = LeastSquares(),
    censoring: Censoring | None = None, sigma: npt.ArrayLike | None = None, fixed: Collection[str] = (),
) -> Fit:  # fmt: skip
    """Estimate the parameters of a law from measured points.

    law         structure and initial values; parameters declared as not fitted keep their value
    recordings  one recording or several, with the columns pressure [Pa], contraction [1] and force [N]
    loss        LeastSquares(), Huber(scale) or SoftL1(scale), the scale in the unit of the fitted quantity
    censoring   the range of force within which rows are measured values. By default rows at zero force, at the clamp of
                the law, or at the limit of the force sensor are censored: they contribute only where the law violates
                their bound. `UNCENSORED` treats all rows as measured values
    sigma       standard deviations of the rows, of which only the ratios matter. By default the rows of different test
                rigs are weighted by the standard deviations of their sensors; `sigma=1.0` weights all rows equally
    fixed       names of further parameters that keep their value

    Residuals are taken in the quantity that the law gives (force, contraction or pressure), and the parameters stay
    within their declared bounds. Raises IdentificationError where the data do not determine the parameters, and names
    these.
    """
    check_arguments(law, recordings)
    points = FitPoints.from_recordings(recordings)
    try:
        return fit_to_points(law, points, loss=loss, censoring=censoring, sigma=sigma, fixed=fixed)
    except IdentificationError as error:
        # What the recordings show without a law may be the cause; `read` has stated the rest.
        known = find_suspicious(points.recordings)
        remarks = [part for note in points.checks.notes if note not in known for part in (" ", note)]
        raise IdentificationError(HintedText(error.message, *remarks), cause=error.cause) from None


def fit_to_points(
    law: Characteristic, points: FitPoints, *, loss: Loss = LeastSquares(), censoring: Censoring | None = None,
    sigma: npt.ArrayLike | None = None, fixed: Collection[str] = (),
) -> Fit:  # fmt: skip
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
    law: Characteristic, points: FitPoints, loss: Loss, censoring: Censoring | None,
    sigma: npt.ArrayLike | None, fixed: Collection[str],
) -> Fit:  # fmt: skip
    problem = points.problem(law, censoring=censoring, sigma=sigma, fixed=fixed)
    solution = solve_bounded(problem, points, loss)
    statistics = stats.compute_statistics(problem, solution, loss, points.runs)
    stats.check_determined_by_levels(problem, solution, points.at_levels)
    data, quantity = problem.data, problem.fitted_quantity
    by_recording = None if sigma is not None else points.deviations(quantity.name)
    notes = tuple(collect_notes(problem, solution, statistics, loss, points.dropped, by_recording))
    model = tree.with_parameters(problem.law, problem.leaf_values(solution.values))
    return Fit(
        model=model,
        estimates=_build_estimates(problem, solution, statistics),
        correlations=statistics.correlations,
        parameter_covariance=statistics.covariance,
        rank=statistics.rank,
        condition=statistics.condition,
        sigma=statistics.sigma,
        rows_censored=int(np.count_nonzero(problem.censoring)),
        rows_dropped=points.dropped,
        recording=data,
        fitted_quantity=quantity,
        censoring=problem.censoring,
        problem=dataclasses.replace(problem, law=model, leaves=tuple(tree.leaves(model))),
        loss=loss,
        remarks=partial(examine, points, problem, solution.modelled, notes),
        **stats.goodness_of_fit(problem, evaluate(model, quantity.name, quantity.arguments, data), data),
    )


def _build_estimates(
    problem: FitProblem, solution: LeastSquaresSolution, statistics: stats.FitStatistics
) -> tuple[Estimate, ...]:
    leaves, numbers = [problem.leaves[i] for i in problem.free], (solution.values, statistics.standard_errors)
    columns = zip(leaves, problem.labels, *(each.tolist() for each in (*numbers, statistics.on_bound)), strict=True)
    return tuple(
        Estimate(leaf.path, label, value, stderr, leaf.declared.unit, leaf.declared.meaning, on_bound)
        for leaf, label, value, stderr, on_bound in columns
    )


def refit(
    law: Characteristic, points: FitPoints, *, loss: Loss = LeastSquares(), fixed: Collection[str] = ()
) -> Characteristic:
    """The law that `fit` finds for these points if its search starts at the parameters of `law`.

    Other initial values are tried only where the search does not converge, and nothing but the rank is computed of the
    solution. Raises IdentificationError where the points do not determine the parameters.
    """
    if isinstance(law, PooledLengthLaw):
        return refit_pooled(law, refit(law.population, points, loss=loss, fixed=fixed), points)
    problem = points.problem(law, fixed=fixed)
    near = None if is_linear(problem) or loss != LeastSquares() else gauss_newton(problem, problem.initial_values)
    try:
        solution = (
            solve_bounded(problem, points, loss, find_initial_values(problem, multi_start=False))
            if near is None
            else near
        )
    except IdentificationError:
        solution = solve_bounded(problem, points, loss)
    stats.check_determined(problem, solution)
    model: Characteristic = tree.with_parameters(problem.law, problem.leaf_values(solution.values))
    return model
