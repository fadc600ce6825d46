"""Parameters of a plant from records of its motion: fill, discharge, release."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ...errors import AirmuscleError, IdentificationError, ParameterError
from ...method import Method, Rodas4
from ...program import System
from ..result import Estimate
from .course import Course, observations, stacked
from .experiment import Experiment, Own, Shared, Unknown, unknowns
from .identifiable import Identifiability, identifiable
from .result import DynamicFit

Array = npt.NDArray[np.float64]
CORRELATED = 0.3
"""Correlation of neighbouring residuals from which on they are called model error, not noise; chosen."""


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """Residuals over unknowns in units of their scales."""

    courses: tuple[Course, ...]
    unknowns: tuple[Unknown, ...]
    deviations: Array

    @property
    def scales(self) -> Array:
        return np.array([u.scale for u in self.unknowns])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds in units of the scales."""
        low, high = np.array([u.low for u in self.unknowns]), np.array([u.high for u in self.unknowns])
        return low / self.scales, high / self.scales

    def residuals(self, scaled: Array) -> tuple[Array, Array]:
        """Residuals (R,) in sensor deviations and their slopes (R, P) by the scaled unknowns."""
        errors, slopes = stacked(self.courses, scaled * self.scales, self.deviations)
        return errors, slopes * self.scales

    def solve(self, scaled: Array, held: Sequence[int] = (), most: int = 200) -> tuple[Array, float]:
        """The least squares from a start, some unknowns held: unknowns and sum of squares, infinite where it fails."""
        from scipy.optimize import least_squares

        loose = [k for k in range(scaled.size) if k not in held]
        whole, (low, high) = scaled.copy(), self.bounds
        if not loose:
            return whole, self._cost(whole)
        search = _Search(self, whole, loose)
        begin = np.clip(scaled[loose], low[loose], high[loose])
        try:
            found = least_squares(
                search.errors, begin, search.slopes, (low[loose], high[loose]), "trf", ftol=1e-10, xtol=1e-10,
                gtol=1e-12, x_scale="jac", max_nfev=most,
            )  # fmt: skip
        except (AirmuscleError, ValueError):  # the start itself cannot be run
            return scaled, np.inf
        whole[loose] = found.x
        return whole, 2.0 * float(found.cost)

    def _cost(self, scaled: Array) -> float:
        try:
            return float(np.sum(self.residuals(scaled)[0] ** 2))
        except AirmuscleError:
            return np.inf


class _Search:
    """What the solver calls: residuals, and slopes at the same place without a second run."""

    def __init__(self, problem: Problem, whole: Array, loose: Sequence[int]) -> None:
        self.problem, self.whole, self.loose = problem, whole.copy(), list(loose)
        self.at = b""
        self.found: tuple[Array, Array] = (np.empty(0), np.empty((0, 0)))

    def _run(self, x: Array) -> None:
        if x.tobytes() != self.at:
            self.whole[self.loose] = x
            self.found = self.problem.residuals(self.whole)
            self.at = x.tobytes()

    def errors(self, x: Array) -> Array:
        """Residuals; infinite where the plant cannot be run, which the solver takes as a step too far."""
        try:
            self._run(x)
        except AirmuscleError:
            if not self.found[0].size:
                raise
            return np.full_like(self.found[0], np.inf)
        return self.found[0]

    def slopes(self, x: Array) -> Array:
        """Slopes of the residuals by the unknowns that are loose."""
        self._run(x)
        return self.found[1][:, self.loose]


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
    method: Method | None = None,
) -> DynamicFit:
    """Find parameters of a plant by weighted least squares over all records, with exact sensitivities.

    plant     starts the search with its own values; a record may bring its own plant of the same structure
    free      paths shared by all records, `("circuit.fill.conductance",)`; a tuple of paths shares one value
    observed  the outputs that were measured, each with the standard deviation of its sensor, in SI
    own       what every record has for itself: paths (supply pressure), StartTime(margin), StartValue(name, margin)
    bounds    by first path; those declared otherwise
    starts    number of starts: the plant's own values, and a Latin hypercube a factor of three around them
    method    Rodas4(rtol=1e-6) unless given

    Standard deviations are scaled by the scatter of the residuals. What the records cannot tell apart is named in
    the notes. Raises IdentificationError where no start can be run, or there are fewer readings than unknowns.
    """
    if not experiments or not observed or starts < 1:
        raise ParameterError("fit_dynamic needs at least one record, one observed quantity and one start.")
    wanted = unknowns(plant, experiments, free, own, bounds or {})
    method = method or Rodas4()
    courses = tuple(Course(plant, e, i, wanted, observed, method) for i, e in enumerate(experiments))
    problem = Problem(courses, wanted, np.array(list(observed.values()), dtype=float))
    _refuse_too_little(problem)
    outcomes = sorted((problem.solve(z) for z in _starts(problem, starts, seed)), key=lambda outcome: outcome[1])
    best, cost = outcomes[0]
    if not np.isfinite(cost):
        problem.residuals(np.array([u.value for u in wanted]) / problem.scales)  # raises the reason, if it is one
        raise IdentificationError("the plant could not be run from any start; look at the bounds and the start.")
    return _result(problem, best, np.array([c for _, c in outcomes]))


def _refuse_too_little(problem: Problem) -> None:
    count = observations(problem.courses)
    if count <= len(problem.unknowns):
        raise IdentificationError(
            f"{count} readings cannot determine {len(problem.unknowns)} unknowns; give more rows or free fewer."
        )
    if not (problem.deviations > 0).all():
        raise ParameterError("the standard deviation of an observed quantity must be positive, in SI.")


def _starts(problem: Problem, count: int, seed: int) -> list[Array]:
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


def _result(problem: Problem, scaled: Array, costs: Array) -> DynamicFit:
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


def _notes(problem: Problem, errors: Array, found: Identifiability, estimates: Sequence[Estimate]) -> tuple[str, ...]:
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
