"""Dynamic fit of plant parameters to transient records: `fit_dynamic`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ....core.arrays import Array
from ....core.errors import IdentificationError, ParameterError
from ....engine.compile import System
from ....engine.run.integrators import Integrator, Rodas4
from ..identifiability import analyse_identifiability
from ..model_evidence import lag_one_autocorrelation
from ..result import Estimate
from .ambient import check_ambient
from .experiment import Experiment, ParameterPaths, RecordUnknown, make_unknowns
from .levenberg_marquardt import LevenbergMarquardt
from .problem import MAX_RUNS, DynamicFitProblem
from .record_model import RecordModel, count_readings, separate_residuals
from .reliability import describe_bounds, describe_flatness, describe_optima, distinct_optima
from .result import DynamicFit

MAX_AUTOCORRELATION = 0.3
"""Lag-1 autocorrelation of the residuals above which they are attributed to model error, not noise; chosen."""

SCREENING_RUNS, SCREENING_RATIO = 20, 1000.0
"""After this many simulations a search whose sum of squares exceeds the lowest one by this factor is abandoned; chosen.

In nine problems with 40 to 100 initial guesses, every search that reached the best optimum was within this factor of it
after 14 simulations or fewer."""


def fit_dynamic(
    plant: System,
    experiments: Sequence[Experiment],
    *,
    free: Sequence[ParameterPaths],
    observed: Mapping[str, float],
    per_record: Sequence[RecordUnknown] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    starts: int = 1,
    seed: int = 0,
    method: Integrator | None = None,
) -> DynamicFit:
    """Estimate plant parameters by weighted least squares over all records, with exact sensitivities.

    plant       structure and initial values; an experiment may replace it by a plant of the same structure
    free        paths of the parameters common to all records, ("circuit.fill.conductance",); a tuple of paths has one
                common value
    observed    the measured outputs, each with the standard deviation of its sensor [SI]
    per_record  unknowns with a separate value in every record: paths (supply pressure), StartTime(margin),
                CommandInstants(margin) or InitialValue(name, margin)
    bounds      by the first path; by default those declared
    starts      number of initial guesses of a multi-start: the values of the plant, and a Latin hypercube within a
                factor of three. A search whose sum of squares is a thousand times the lowest one after 20 simulations
                is abandoned
    seed        of the Latin hypercube
    method      by default Rodas4(rtol=1e-6)

    The standard errors are scaled by the standard deviation of the residuals. Combinations of parameters that the
    records do not determine are named in the notes. Raises IdentificationError where no initial guess can be simulated,
    or there are no more observations than unknowns, ParameterError where a record states another ambient air than its
    plant has.
    """
    if not experiments or not observed or starts < 1:
        raise ParameterError("fit_dynamic needs at least one record, one observed quantity and one start.")
    for experiment in experiments:
        check_ambient(plant, experiment)
    unknowns = make_unknowns(plant, experiments, free, per_record, bounds or {})
    method = method or Rodas4()
    models = tuple(RecordModel(plant, e, i, unknowns, observed, method) for i, e in enumerate(experiments))
    problem = DynamicFitProblem(models, unknowns, np.array(list(observed.values()), dtype=float))
    _check_row_count(problem)
    outcomes = sorted(_solve_all(problem, initial_guesses(problem, starts, seed)), key=lambda outcome: outcome[1])
    if not np.isfinite(outcomes[0][1]):
        problem.residuals(problem.scaled(np.array([u.value for u in unknowns])))  # raises the cause, if there is one
        raise IdentificationError(
            "the plant cannot be simulated from any initial guess. Check the bounds and the initial conditions."
        )
    return _build_result(problem, np.array([x for x, _ in outcomes]), np.array([c for _, c in outcomes]))


def _solve_all(problem: DynamicFitProblem, guesses: Sequence[Array]) -> list[tuple[Array, float]]:
    """Least squares from every initial guess, in parallel threads: compiled kernels release the interpreter lock."""
    if len(guesses) == 1:
        return [problem.solve(guesses[0])]
    pool = ThreadPoolExecutor(min(len(guesses), os.cpu_count() or 1))
    try:
        searches = list(pool.map(lambda guess: _run_search(problem.search(guess), SCREENING_RUNS), guesses))
        lowest = min(search.cost for search in searches)
        continued = [s for s in searches if not s.finished and s.cost <= SCREENING_RATIO * lowest]
        list(pool.map(lambda search: _run_search(search, MAX_RUNS), continued))
        return [(search.x, search.cost) for search in searches]
    finally:
        pool.shutdown(cancel_futures=True)


def _run_search(search: LevenbergMarquardt, max_runs: int) -> LevenbergMarquardt:
    search.run(max_runs)
    return search


def _check_row_count(problem: DynamicFitProblem) -> None:
    count = count_readings(problem.record_models)
    if count <= len(problem.unknowns):
        raise IdentificationError(
            f"{count} observations cannot determine {len(problem.unknowns)} unknowns. Give more rows, or free fewer "
            "parameters."
        )
    if not (problem.sensor_deviations > 0).all():
        raise ParameterError("the standard deviation of an observed quantity must be positive, in SI.")


def initial_guesses(problem: DynamicFitProblem, count: int, seed: int) -> list[Array]:
    """The values of the plant, then a Latin hypercube; logarithmic where the range is positive. Scaled, (P,) each."""
    values = np.array([u.value for u in problem.unknowns])
    rng, cells = np.random.default_rng(seed), count - 1
    columns = []
    for unknown in problem.unknowns:
        low, high = unknown.search_range
        fraction = (rng.permutation(cells) + rng.random(cells)) / max(cells, 1)
        columns.append(low * (high / low) ** fraction if low > 0 else low + fraction * (high - low))
    return [problem.scaled(values), *problem.scaled(np.column_stack(columns))]


def _build_result(problem: DynamicFitProblem, searches: Array, costs: Array) -> DynamicFit:
    """The result from the scaled unknowns (S, P) and sums of squares (S,) of all searches, the lowest first."""
    scaled = searches[0]
    residuals, jacobian = problem.residuals(scaled)
    low, high = problem.bounds
    margin = 1e-6 * np.maximum(np.abs(scaled), 1.0)
    on_bound = (scaled - low <= margin) | (high - scaled <= margin)
    inner = np.flatnonzero(~on_bound)
    residual_std = float(np.sqrt(np.sum(residuals**2) / (residuals.size - inner.size)))
    names = [problem.unknowns[k].name for k in inner]
    analysis = analyse_identifiability(jacobian[:, inner], names, np.ones(inner.size), residual_std)
    covariance = np.full((scaled.size, scaled.size), np.nan)
    inverse = analysis.inverse()
    covariance[np.ix_(inner, inner)] = inverse * residual_std**2
    standard_errors = np.sqrt(np.diag(covariance))
    estimates = tuple(
        Estimate(u.name, u.symbol, float(value), float(stderr), u.unit, u.meaning, bool(bound))
        for u, value, stderr, bound in zip(
            problem.unknowns, problem.values(scaled), standard_errors * problem.scales, on_bound, strict=True
        )
    )
    correlations = covariance / np.outer(standard_errors, standard_errors)
    optima = distinct_optima(problem.values(searches), costs, problem.scales, problem.margins)
    notes = [
        *(str(combination) for combination in analysis.undetermined),
        *describe_bounds(estimates, jacobian, inverse, on_bound, problem.scales, problem.origins),
        *describe_optima(optima, estimates, costs, problem.margins),
        *_describe_model_error(problem, residuals, estimates, inner.size),
    ]
    return DynamicFit(problem, estimates, correlations, analysis, residual_std, costs, optima, tuple(notes))


def _describe_model_error(
    problem: DynamicFitProblem, residuals: Array, estimates: Sequence[Estimate], unknowns: int
) -> list[str]:
    """Sentences on autocorrelated residuals (R,), which are a sign of model error, and on what they leave open."""
    autocorrelation = lag_one_autocorrelation(separate_residuals(problem.record_models, residuals))
    if autocorrelation <= MAX_AUTOCORRELATION:
        return []
    factor = np.sqrt((1 + autocorrelation) / (1 - autocorrelation))
    return [
        f"the residuals are autocorrelated (lag 1: {autocorrelation:.2f}), which indicates model error rather than "
        f"noise; the standard errors are too small by a factor of about {factor:.1f}",
        *describe_flatness(estimates, residuals.size - unknowns, problem.margins),
    ]
