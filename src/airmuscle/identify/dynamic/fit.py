"""Parameters of a plant from records of its motion: fill, discharge, release."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...compile import System
from ...core.arrays import Array
from ...core.errors import IdentificationError, ParameterError
from ...simulation.integrators import Integrator, Rodas4
from ..result import Estimate
from .experiment import Experiment, ParameterPaths, RecordUnknown, make_unknowns
from .identifiability import Identifiability, analyse_identifiability
from .levenberg_marquardt import LevenbergMarquardt
from .problem import MAX_RUNS, DynamicFitProblem
from .record_model import RecordModel, count_readings
from .result import DynamicFit

MAX_AUTOCORRELATION = 0.3
"""Correlation of neighbouring residuals from which on they are called model error, not noise; chosen."""

SCREENING_RUNS, SCREENING_RATIO = 20, 1000.0
"""RunSplit after which a start whose sum of squares is so many times the least of all is left where it stands; chosen.

In nine problems of 40 to 100 starts, what came to the best optimum was within that of it after 14 runs at most."""


def fit_dynamic(
    plant: System,
    experiments: Sequence[Experiment],
    *,
    free: Sequence[ParameterPaths],
    observed: Mapping[str, float],
    own: Sequence[RecordUnknown] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    starts: int = 1,
    seed: int = 0,
    method: Integrator | None = None,
) -> DynamicFit:
    """Find parameters of a plant by weighted least squares over all records, with exact sensitivities.

    plant     starts the search with its own values; a record may bring its own plant of the same structure
    free      paths shared by all records, `("circuit.fill.conductance",)`; a tuple of paths shares one value
    observed  the outputs that were measured, each with the standard deviation of its sensor, in SI
    own       what every record has for itself: paths (supply pressure), StartTime(margin), StartValue(name, margin)
    bounds    by first path; those declared otherwise
    starts    number of starts: the plant's own values, and a Latin hypercube a factor of three around them; one that
              after 20 runs is a thousand times worse than the best is left where it stands
    method    Rodas4(rtol=1e-6) unless given

    Standard deviations are scaled by the scatter of the residuals. What the records cannot tell apart is named in
    the notes. Raises IdentificationError where no start can be run, or there are fewer readings than unknowns.
    """
    if not experiments or not observed or starts < 1:
        raise ParameterError("fit_dynamic needs at least one record, one observed quantity and one start.")
    wanted = make_unknowns(plant, experiments, free, own, bounds or {})
    method = method or Rodas4()
    courses = tuple(RecordModel(plant, e, i, wanted, observed, method) for i, e in enumerate(experiments))
    problem = DynamicFitProblem(courses, wanted, np.array(list(observed.values()), dtype=float))
    _check_row_count(problem)
    outcomes = sorted(_solve_all(problem, initial_guesses(problem, starts, seed)), key=lambda outcome: outcome[1])
    best, cost = outcomes[0]
    if not np.isfinite(cost):
        problem.residuals(np.array([u.value for u in wanted]) / problem.scales)  # raises the reason, if it is one
        raise IdentificationError("the plant could not be run from any start; look at the bounds and the start.")
    return _build_result(problem, best, np.array([c for _, c in outcomes]))


def _solve_all(problem: DynamicFitProblem, begins: Sequence[Array]) -> list[tuple[Array, float]]:
    """The least squares from every start, on all cores: the kernels leave Python to the others while they run."""
    if len(begins) == 1:
        return [problem.solve(begins[0])]
    pool = ThreadPoolExecutor(min(len(begins), os.cpu_count() or 1))
    try:
        searches = list(pool.map(lambda z: _run_search(problem.search(z), SCREENING_RUNS), begins))
        least = min(one.cost for one in searches)
        hopeful = [one for one in searches if not one.ended and one.cost <= SCREENING_RATIO * least]
        list(pool.map(lambda one: _run_search(one, MAX_RUNS), hopeful))
        return [(one.x, one.cost) for one in searches]
    finally:
        pool.shutdown(cancel_futures=True)


def _run_search(search: LevenbergMarquardt, most: int) -> LevenbergMarquardt:
    search.run(most)
    return search


def _check_row_count(problem: DynamicFitProblem) -> None:
    count = count_readings(problem.record_models)
    if count <= len(problem.unknowns):
        raise IdentificationError(
            f"{count} readings cannot determine {len(problem.unknowns)} unknowns; give more rows or free fewer."
        )
    if not (problem.sensor_deviations > 0).all():
        raise ParameterError("the standard deviation of an observed quantity must be positive, in SI.")


def initial_guesses(problem: DynamicFitProblem, count: int, seed: int) -> list[Array]:
    """The plant's own values, then a Latin hypercube, even in the logarithm where the range is positive."""
    own = np.array([u.value for u in problem.unknowns])
    rng, cells = np.random.default_rng(seed), count - 1
    columns = []
    for unknown in problem.unknowns:
        low, high = unknown.search_range
        share = (rng.permutation(cells) + rng.random(cells)) / max(cells, 1)
        even = low * (high / low) ** share if low > 0 else low + share * (high - low)
        columns.append(even)
    return [own / problem.scales, *(np.column_stack(columns) / problem.scales)]


def _build_result(problem: DynamicFitProblem, scaled: Array, costs: Array) -> DynamicFit:
    errors, slopes = problem.residuals(scaled)
    low, high = problem.bounds
    near = 1e-6 * np.maximum(np.abs(scaled), 1.0)
    on_bound = (scaled - low <= near) | (high - scaled <= near)
    inner = np.flatnonzero(~on_bound)
    scatter = float(np.sqrt(np.sum(errors**2) / (errors.size - inner.size)))
    names = [problem.unknowns[k].name for k in inner]
    found = analyse_identifiability(slopes[:, inner], names, np.ones(inner.size), scatter)
    inverse = np.full((scaled.size, scaled.size), np.nan)
    inverse[np.ix_(inner, inner)] = found.inverse() * scatter**2
    deviations = np.sqrt(np.diag(inverse))
    estimates = tuple(
        Estimate(u.name, u.symbol, float(v), float(d), u.unit, u.meaning, bool(b))
        for u, v, d, b in zip(
            problem.unknowns, scaled * problem.scales, deviations * problem.scales, on_bound, strict=True
        )
    )
    correlations = inverse / np.outer(deviations, deviations)
    return DynamicFit(
        problem, estimates, correlations, found, scatter, costs, _collect_notes(problem, errors, found, estimates)
    )


def _collect_notes(
    problem: DynamicFitProblem, errors: Array, found: Identifiability, estimates: Sequence[Estimate]
) -> tuple[str, ...]:
    notes = [str(open_one) for open_one in found.undetermined]
    for estimate in estimates:
        if estimate.on_bound:
            notes.append(f"{estimate.name} stands on its bound, {estimate.value:.4g} {estimate.unit}")
    together = float(np.sum(errors[1:] * errors[:-1]) / max(np.sum(errors**2), 1e-300))
    if together > MAX_AUTOCORRELATION:
        factor = np.sqrt((1 + together) / (1 - together))
        notes.append(
            f"neighbouring residuals are alike (correlation {together:.2f}): what is left is model error rather than "
            f"noise, and the standard deviations are about {factor:.1f} times too small"
        )
    return tuple(notes)
