"""Which static runs to measure: a D-optimal design over the runs that a bench can do.

The information of a design is M = Sum J^T J / sigma^2, J the derivatives of what the law gives by its free parameters
at every point of every run. D-optimal runs make det M greatest, so the volume of the confidence ellipsoid least; they
are chosen one by one and then exchanged while that helps.
Reference: Fedorov, V. V., Theory of Optimal Experiments, Academic Press, 1972.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence

import numpy as np
import numpy.typing as npt

from ..characteristic.base import Characteristic
from ..characteristic.validity_range import ValidityRange
from ..core.arrays import Array
from ..core.errors import IdentificationError, ParameterError
from ..recording import Recording
from .censoring import UNCENSORED
from .dynamic.identifiability import EXACT_RANK_TOLERANCE, UndeterminedCombination, analyse_identifiability
from .problem import make_problem

LEVEL_COUNT = 13
"""Levels of pressure, and of contraction, among the candidates; chosen."""
MIN_POINTS = 3
"""A candidate with fewer points within the limits is no run; chosen."""
REGULARISATION = 1e-9
"""Information that every direction has before the first run, so that runs can be compared one by one."""


@dataclasses.dataclass(frozen=True)
class BenchLimits:
    """What a bench can do: the validity range of gauge pressure [Pa] and contraction, the greatest tension [N]."""

    validity_range: ValidityRange
    max_force: float


@dataclasses.dataclass(frozen=True, eq=False)
class PlannedRun:
    """A static run: one quantity held at a level while the other is swept, with the tension to expect."""

    constant: str
    pressure: Array
    contraction: Array
    force: Array

    @property
    def swept(self) -> str:
        return "contraction" if self.constant == "pressure" else "pressure"

    @property
    def level(self) -> float:
        return float(getattr(self, self.constant)[0])

    @property
    def sweep_limits(self) -> tuple[float, float]:
        """First and last value of what is swept."""
        values = getattr(self, self.swept)
        return float(values[0]), float(values[-1])


@dataclasses.dataclass(frozen=True, eq=False)
class ExperimentPlan:
    """The runs to measure, in rising order of what is held, and what they will tell."""

    runs: tuple[PlannedRun, ...]
    names: tuple[str, ...]
    values: Array
    standard_errors: Array
    """Standard deviation to expect of every parameter."""
    relative_d_efficiency: float
    """Root of det M per parameter over that of as many runs spread evenly: how much information a run carries."""
    undetermined: tuple[UndeterminedCombination, ...]

    def recording(self) -> Recording:
        """The points in order, to be followed on the bench: run, pressure, contraction, and the force to expect."""
        numbers = np.concatenate([np.full(r.force.size, i + 1.0) for i, r in enumerate(self.runs)])
        columns = {n: np.concatenate([getattr(r, n) for r in self.runs]) for n in ("pressure", "contraction", "force")}
        return Recording({"run": numbers, **columns}, "plan of static runs; force is what the start of the fit expects")


def optimal_design(
    characteristic: Characteristic,
    bench: BenchLimits,
    *,
    runs: int = 6,
    points: int = 15,
    sigma: float = 1.0,
    fixed: Collection[str] = (),
) -> ExperimentPlan:
    """The D-optimal choice of isobaric and isometric runs for fitting a characteristic, started from its own values.

    points  of a run, evenly spread over what is swept
    sigma   standard deviation of one reading, in the unit of what the law gives
    fixed   parameters that the fit will leave alone

    Raises IdentificationError where the bench leaves no runs, ParameterError for limits that make no sense.
    """
    if runs < 1 or points < MIN_POINTS or not sigma > 0 or not bench.max_force > 0:
        raise ParameterError(
            f"plan needs one run or more of {MIN_POINTS} points or more, sigma and greatest force above 0."
        )
    candidates = candidate_runs(characteristic, bench, points)
    names, values, designs = _jacobians(characteristic, candidates, fixed)
    information = np.array([design.T @ design for design in designs])
    chosen = _exchange(information, _select_greedily(information, runs))
    chosen.sort(key=lambda i: (candidates[i].constant != "pressure", candidates[i].level))
    even = np.unique(np.linspace(0, len(candidates) - 1, runs).astype(int))
    difference = (
        _log_determinant(information, chosen)
        - _log_determinant(information, even)
        + values.size * np.log(even.size / runs)
    )
    scales = np.where(values == 0, 1.0, np.abs(values))
    found = analyse_identifiability(
        np.vstack([designs[i] for i in chosen]) / scales / sigma, names, scales, tolerance=EXACT_RANK_TOLERANCE
    )
    deviations = np.sqrt(np.diag(found.inverse())) * scales
    gain = float(np.exp(difference / values.size))
    return ExperimentPlan(tuple(candidates[i] for i in chosen), names, values, deviations, gain, found.undetermined)


def candidate_runs(characteristic: Characteristic, bench: BenchLimits, points: int) -> list[PlannedRun]:
    """Isobaric and isometric runs on even levels, each cut to where the tension is positive and within the limit."""
    sides = {"pressure": bench.validity_range.pressure, "contraction": bench.validity_range.contraction}
    found = []
    for held, swept in (("pressure", "contraction"), ("contraction", "pressure")):
        (low, high), (first, last) = sides[held], sides[swept]
        for level in np.linspace(low, high, LEVEL_COUNT):
            found += _feasible_run(characteristic, bench, held, float(level), np.linspace(first, last, 201), points)
    if not found:
        raise IdentificationError(
            f"{type(characteristic).__name__} pulls nowhere between 0 and {bench.max_force:g} N within the "
            "bench's pressures and contractions. Widen the limits, or look at the units."
        )
    return found


def _feasible_run(
    law: Characteristic, bench: BenchLimits, held: str, level: float, sweep: Array, points: int
) -> list[PlannedRun]:
    allowed = sweep[_is_feasible(law, bench, held, level, sweep)]
    if allowed.size < MIN_POINTS:
        return []
    values = np.linspace(allowed[0], allowed[-1], points)
    values = values[_is_feasible(law, bench, held, level, values)]
    if values.size < MIN_POINTS:
        return []
    pressure, contraction = _coordinates(held, level, values)
    return [PlannedRun(held, pressure, contraction, np.asarray(law.force(pressure, contraction), dtype=float))]


def _is_feasible(
    law: Characteristic, bench: BenchLimits, held: str, level: float, values: Array
) -> npt.NDArray[np.bool_]:
    force = np.asarray(law.force(*_coordinates(held, level, values)), dtype=float)
    return np.asarray(np.isfinite(force) & (force > 0) & (force <= bench.max_force))


def _coordinates(held: str, level: float, values: Array) -> tuple[Array, Array]:
    steady = np.full(values.size, level)
    return (steady, values) if held == "pressure" else (values, steady)


def _jacobians(
    law: Characteristic, candidates: Sequence[PlannedRun], fixed: Collection[str]
) -> tuple[tuple[str, ...], Array, list[Array]]:
    """Names and values of the free parameters, and every candidate's design by parameters relative to their size."""
    columns = {n: np.concatenate([getattr(r, n) for r in candidates]) for n in ("pressure", "contraction", "force")}
    data = Recording(columns, "candidate runs")
    problem = make_problem(law, data, UNCENSORED, np.ones(len(data)), fixed)
    values = problem.initial_values
    slopes = problem.jacobian(values) * np.where(values == 0, 1.0, np.abs(values))
    if not np.isfinite(slopes).all():
        raise IdentificationError(
            f"{type(law).__name__} is not smooth within the bench's limits; raise the least pressure or contraction."
        )
    ends = np.cumsum([r.force.size for r in candidates])[:-1]
    paths = tuple(problem.leaves[i].path for i in problem.free)
    return paths, values, np.split(slopes, ends)


def _log_determinant(information: Array, chosen: Sequence[int] | Array) -> float:
    """log det of the information of these runs, with the ridge in units of what all runs together tell."""
    size = information.shape[1]
    lengths = np.sqrt(np.maximum(np.diag(information.sum(axis=0)), 1e-300))
    even = information[list(chosen)].sum(axis=0) / np.outer(lengths, lengths)
    return float(np.linalg.slogdet(even + REGULARISATION * np.eye(size))[1])


def _select_greedily(information: Array, runs: int) -> list[int]:
    chosen: list[int] = []
    for _ in range(runs):
        gains = [_log_determinant(information, [*chosen, i]) for i in range(len(information))]
        chosen.append(int(np.argmax(gains)))
    return chosen


def _exchange(information: Array, chosen: list[int]) -> list[int]:
    """Each run exchanged for a better one until none is."""
    best, improved = _log_determinant(information, chosen), True
    while improved:
        improved = False
        for k in range(len(chosen)):
            rest = chosen[:k] + chosen[k + 1 :]
            gains = [_log_determinant(information, [*rest, i]) for i in range(len(information))]
            if max(gains) > best + 1e-9:
                best, improved = max(gains), True
                chosen = [*rest, int(np.argmax(gains))]
    return chosen
