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
from .experiment import Experiment, Own, Shared, unknowns
from .identifiability import Identifiability, identifiable
from .levenberg_marquardt import LevenbergMarquardt
from .problem import MOST, DynamicFitProblem
from .record_model import RecordModel, observations
from .result import DynamicFit

CORRELATED = 0.3
"""Correlation of neighbouring residuals from which on they are called model error, not noise; chosen."""

FIRST_LOOK, HOPELESS = 20, 1000.0
"""RunSplit after which a start whose sum of squares is so many times the least of all is left where it stands; chosen.

In nine problems of 40 to 100 starts, what came to the best optimum was within that of it after 14 runs at most."""


def fit_dynamic(
    plant: System,
    experiments: Sequence[Experiment],
    *,
    free: Sequence[Shared],
    observed: Mapping[str, float],
    own: Sequence[Own] = (),
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
    wanted = unknowns(plant, experiments, free, own, bounds or {})
    method = method or Rodas4()
    courses = tuple(RecordModel(plant, e, i, wanted, observed, method) for i, e in enumerate(experiments))
    problem = DynamicFitProblem(courses, wanted, np.array(list(observed.values()), dtype=float))
    _check_row_count(problem)
    outcomes = sorted(_solved(problem, spread(problem, starts, seed)), key=lambda outcome: outcome[1])
    best, cost = outcomes[0]
    if not np.isfinite(cost):
        problem.residuals(np.array([u.value for u in wanted]) / problem.scales)  # raises the reason, if it is one
        raise IdentificationError("the plant could not be run from any start; look at the bounds and the start.")
    return _result(problem, best, np.array([c for _, c in outcomes]))


def _solved(problem: DynamicFitProblem, begins: Sequence[Array]) -> list[tuple[Array, float]]:
    """The least squares from every start, on all cores: the kernels leave Python to the others while they run."""
    if len(begins) == 1:
        return [problem.solve(begins[0])]
    pool = ThreadPoolExecutor(min(len(begins), os.cpu_count() or 1))
    try:
        searches = list(pool.map(lambda z: _searched(problem.search(z), FIRST_LOOK), begins))
        least = min(one.cost for one in searches)
        hopeful = [one for one in searches if not one.ended and one.cost <= HOPELESS * least]
        list(pool.map(lambda one: _searched(one, MOST), hopeful))
        return [(one.x, one.cost) for one in searches]
    finally:
        pool.shutdown(cancel_futures=True)


def _searched(search: LevenbergMarquardt, most: int) -> LevenbergMarquardt:
    search.run(most)
    return search


def _check_row_count(problem: DynamicFitProblem) -> None:
    count = observations(problem.courses)
    if count <= len(problem.unknowns):
        raise IdentificationError(
            f"{count} readings cannot determine {len(problem.unknowns)} unknowns; give more rows or free fewer."
        )
    if not (problem.deviations > 0).all():
        raise ParameterError("the standard deviation of an observed quantity must be positive, in SI.")


def spread(problem: DynamicFitProblem, count: int, seed: int) -> list[Array]:
    """The plant's own values, then a Latin hypercube, even in the logarithm where the range is positive."""
    own = np.array([u.value for u in problem.unknowns])
    rng, cells = np.random.default_rng(seed), count - 1
    columns = []
    for unknown in problem.unknowns:
        low, high = unknown.search
        share = (rng.permutation(cells) + rng.random(cells)) / max(cells, 1)
        even = low * (high / low) ** share if low > 0 else low + share * (high - low)
        columns.append(even)
    return [own / problem.scales, *(np.column_stack(columns) / problem.scales)]


def _result(problem: DynamicFitProblem, scaled: Array, costs: Array) -> DynamicFit:
    errors, slopes = problem.residuals(scaled)
    low, high = problem.bounds
    near = 1e-6 * np.maximum(np.abs(scaled), 1.0)
    on_bound = (scaled - low <= near) | (high - scaled <= near)
    inner = np.flatnonzero(~on_bound)
    scatter = float(np.sqrt(np.sum(errors**2) / (errors.size - inner.size)))
    names = [problem.unknowns[k].name for k in inner]
    found = identifiable(slopes[:, inner], names, np.ones(inner.size), scatter)
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
        problem, estimates, correlations, found, scatter, costs, _notes(problem, errors, found, estimates)
    )


def _notes(
    problem: DynamicFitProblem, errors: Array, found: Identifiability, estimates: Sequence[Estimate]
) -> tuple[str, ...]:
    notes = [str(open_one) for open_one in found.undetermined]
    for estimate in estimates:
        if estimate.on_bound:
            notes.append(f"{estimate.name} stands on its bound, {estimate.value:.4g} {estimate.unit}")
    together = float(np.sum(errors[1:] * errors[:-1]) / max(np.sum(errors**2), 1e-300))
    if together > CORRELATED:
        factor = np.sqrt((1 + together) / (1 - together))
        notes.append(
            f"neighbouring residuals are alike (correlation {together:.2f}): what is left is model error rather than "
            f"noise, and the standard deviations are about {factor:.1f} times too small"
        )
    return tuple(notes)
