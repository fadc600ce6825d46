"""D-optimal design of static experiments: isobaric and isometric runs within the limits of a test
rig.

The information matrix of a design is M = Sum J^T J / sigma^2, where J holds the derivatives of the
quantity that the law gives with respect to its free parameters, at every point of every run.
D-optimal runs maximise det M, and so minimise the volume of the confidence ellipsoid. They are
selected greedily and then improved by exchanges. Reference: Fedorov, V. V., Theory of Optimal
Experiments, Academic Press, 1972.
"""

import dataclasses
import math
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from ...core import Array, IdentificationError, ParameterError, check_field_types
from ...physics.muscle.characteristic import Characteristic, ValidityRange
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Table, TableColumn
from ..estimation import (
    EXACT_RANK_TOLERANCE,
    UNCENSORED,
    UndeterminedCombination,
    analyse_identifiability,
    first_greatest,
)
from ..inspection import POINT_COLUMNS
from ..reported import Reported
from .fit_problem import make_problem

LEVEL_COUNT = 13
"""Levels of pressure, and of contraction, of the candidate runs; chosen."""
MIN_FORCE_SHARE = 0.01
MIN_PRESSURE_SHARE = 0.02
"""Minimum force and pressure of a point, as fractions of the maxima; below them nothing pulls
(chosen).
"""
MIN_POINTS = 3
"""Minimum number of feasible points of a run; chosen."""
ASSUMPTION = (
    "the expected standard errors suppose independent errors of the points; errors that a run"
    " shares (zero and gain of the sensors) are not contained, and several points of a run do not"
    " reduce them"
)
REGULARISATION = 1e-9
"""Relative information added in every direction, so that designs of fewer runs than parameters can
be compared.
"""


@dataclasses.dataclass(frozen=True)
class BenchLimits:
    """Limits of a test rig: the range of gauge pressure [Pa] and contraction [1], and the range of
    force [N].
    """

    validity_range: ValidityRange
    max_force: float
    min_force: float = 0.0
    """Minimum force of a point [N]."""

    def __post_init__(self) -> None:
        check_field_types(self)
        if not -math.inf < self.min_force < self.max_force < math.inf:
            raise ParameterError(
                f"BenchLimits: {self} needs finite forces, and min_force below max_force."
            )


@dataclasses.dataclass(frozen=True, eq=False)
class PlannedRun:
    """A static run: `constant` names the quantity that is kept constant while the other is swept.
    The columns are gauge pressure [Pa], contraction [1] and the expected force [N], shape (points,)
    each."""

    constant: str
    pressure: Array
    contraction: Array
    force: Array

    @property
    def swept(self) -> str:
        """The quantity that is swept, `contraction` or `pressure`."""
        return "contraction" if self.constant == "pressure" else "pressure"

    @property
    def level(self) -> float:
        """The value of the constant quantity [SI]."""
        return float(getattr(self, self.constant)[0])

    @property
    def sweep_limits(self) -> tuple[float, float]:
        """First and last value of the swept quantity [SI]."""
        values = getattr(self, self.swept)
        return float(values[0]), float(values[-1])


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ExperimentPlan(Reported):
    """The runs to measure, sorted by the constant quantity and its level, and the expected
    precision.
    """

    runs: tuple[PlannedRun, ...]
    names: tuple[str, ...]
    values: Array
    standard_errors: Array
    """Expected standard error of every parameter [SI], for independent errors and a law that is
    true.

    An error that a whole run shares, such as the zero or the gain of a sensor, is not contained.
    With s its standard deviation, n points of a run and sigma that of one point, the standard
    errors are greater by up to sqrt(1 + n s^2/sigma^2).
    """
    relative_d_efficiency: float
    """(det M / det M_0)^(1/P), M_0 the information matrix of the same number of evenly spaced
    runs.
    """
    undetermined: tuple[UndeterminedCombination, ...]

    def chapter(self) -> Chapter:
        """The description of the plan: runs, expected precision, efficiency."""
        columns: dict[str, Any] = {
            "parameter": list(self.names),
            "present value": TableColumn(self.values),
            "expected standard error": TableColumn(self.standard_errors, digits=3),
        }
        return Chapter(
            name="plan",
            title="D-optimal static runs",
            summary=(
                f"Relative D-efficiency {self.relative_d_efficiency:.2f}, compared with the same"
                " number of evenly spaced runs."
            ),
            values=(
                NamedValue(
                    "relative D-efficiency", self.relative_d_efficiency, "1", digits=3, brief=False
                ),
            ),
            tables=(
                run_table(self.runs, "runs", "Runs"),
                Table(
                    "precision", "Expected precision", columns, "SI units.", brief=len(self.names)
                ),
            ),
            notes=(*map(str, self.undetermined), ASSUMPTION),
        )

    def recording(self) -> Recording:
        """The points in order, as a set-point list for the test rig: run, pressure, contraction,
        expected force.
        """
        numbers = np.concatenate([np.full(r.force.size, i + 1.0) for i, r in enumerate(self.runs)])
        origin = "plan of static runs; force is that of the initial parameters"
        return Recording({"run": numbers, **_columns_of(self.runs)}, origin)


def _columns_of(runs: Sequence[PlannedRun]) -> dict[str, Array]:
    return {name: np.concatenate([getattr(run, name) for run in runs]) for name in POINT_COLUMNS}


def run_table(runs: Sequence[PlannedRun], name: str, title: str) -> Table:
    """The table of planned runs: the quantity that is constant has one value, the swept one its
    ends.
    """
    ends = {
        each: [(run.level if run.constant == each else run.sweep_limits) for run in runs]
        for each in ("pressure", "contraction")
    }
    columns: dict[str, Any] = {
        "run": list(range(1, len(runs) + 1)),
        "constant": [run.constant for run in runs],
        "pressure": TableColumn(ends["pressure"], "Pa", "kPa"),
        "contraction": TableColumn(ends["contraction"], "1", "%"),
        "points": [run.force.size for run in runs],
        "expected force": TableColumn(
            [(float(run.force.max()), float(run.force.min())) for run in runs], "N"
        ),
    }
    return Table(name, title, columns, brief=12)


def optimal_design(
    characteristic: Characteristic,
    bench: BenchLimits,
    *,
    runs: int = 6,
    points: int = 15,
    sigma: float = 1.0,
    fixed: Collection[str] = (),
) -> ExperimentPlan:
    """The D-optimal isobaric and isometric runs for fitting a characteristic, linearised at its
    present parameters.

    runs    number of runs
    points  points of a run, evenly spaced over the swept quantity
    sigma   standard deviation of one observation, in the unit of the quantity that the law gives
    fixed   parameters that will not be fitted

    Raises IdentificationError where no run is feasible, ParameterError for invalid arguments.
    """
    for name, value, minimum in (("runs", runs, 1), ("points", points, MIN_POINTS)):
        if value < minimum:
            raise ParameterError(
                f"design of experiments: {name} is {value}; it must be at least {minimum}."
            )
    for name, number in (("sigma", sigma), ("maximum force", bench.max_force)):
        if not 0 < number < math.inf:
            raise ParameterError(
                f"design of experiments: {name} is {number:g}; it must be positive and finite."
            )
    candidates = candidate_runs(characteristic, bench, points)
    names, values, jacobians = _jacobians(characteristic, candidates, fixed)
    information = np.array([jacobian.T @ jacobian for jacobian in jacobians])
    selected = _select_runs(information, runs)
    selected.sort(key=lambda i: (candidates[i].constant != "pressure", candidates[i].level))
    even = np.unique(np.linspace(0, len(candidates) - 1, runs).astype(int))
    chosen, evenly = (_log_determinant(information, each) for each in (selected, even))
    difference = chosen - evenly + values.size * np.log(even.size / runs)
    scales = np.where(values == 0, 1.0, np.abs(values))
    scaled = np.vstack([jacobians[i] for i in selected]) / scales / sigma
    analysis = analyse_identifiability(scaled, names, scales, tolerance=EXACT_RANK_TOLERANCE)
    standard_errors = np.sqrt(np.diag(analysis.inverse())) * scales
    efficiency = float(np.exp(difference / values.size))
    planned = tuple(candidates[i] for i in selected)
    return ExperimentPlan(
        planned, names, values, standard_errors, efficiency, analysis.undetermined
    )


def candidate_runs(
    characteristic: Characteristic, bench: BenchLimits, points: int
) -> list[PlannedRun]:
    """Isobaric and isometric runs on evenly spaced levels, each limited to points at which the
    muscle pulls, up to the maximum force."""
    bench, pull = _pulling(characteristic, bench)
    pressures = bench.validity_range.pressure
    contractions = bench.validity_range.contraction
    runs = []
    for constant, levels, swept in (
        ("pressure", pressures, contractions),
        ("contraction", contractions, pressures),
    ):
        for level in np.linspace(*levels, LEVEL_COUNT):
            sweep = np.linspace(*swept, 201)
            runs += _feasible_run(
                characteristic, bench, pull, constant, float(level), sweep, points
            )
    if not runs:
        raise IdentificationError(
            f"no run is feasible: {type(characteristic).__name__} gives no force between 0 and"
            f" {bench.max_force:g} N within the pressures and contractions of the test rig. Widen"
            " the limits, or check the units."
        )
    return runs


def _pulling(law: Characteristic, bench: BenchLimits) -> tuple[BenchLimits, tuple[Array, Array]]:
    """The limits without the pressures and forces at which nothing pulls, and over the contraction
    the least pressure above which the law gives a force throughout: that of a polynomial that rises
    again below is no pull of a muscle.
    """
    low, high = bench.validity_range.pressure
    contractions = bench.validity_range.contraction
    low = max(low, min(MIN_PRESSURE_SHARE * high, high))
    pressure = np.linspace(low, high, 8 * LEVEL_COUNT)
    contraction = np.linspace(*contractions, 4 * LEVEL_COUNT)
    grid = np.meshgrid(pressure, contraction)
    forces = np.asarray(law.force(*(each.ravel() for each in grid)), dtype=float).reshape(
        grid[0].shape
    )
    reached = forces[np.isfinite(forces) & (forces > 0) & (forces <= bench.max_force)]
    least = max(bench.min_force, MIN_FORCE_SHARE * float(reached.max()) if reached.size else 0.0)
    slack = (forces <= 0) | (forces < least)
    limits = dataclasses.replace(
        bench, validity_range=ValidityRange(low, high, *contractions), min_force=least
    )
    return limits, (contraction, np.max(np.where(slack, pressure, low), axis=1))


def _feasible_run(
    law: Characteristic,
    bench: BenchLimits,
    pull: tuple[Array, Array],
    constant: str,
    level: float,
    sweep: Array,
    points: int,
) -> list[PlannedRun]:
    for _ in range(
        2
    ):  # the points of the sweep, then those of the run between the first and the last of these
        pressure, contraction = _coordinates(constant, level, sweep)
        force = np.asarray(law.force(pressure, contraction), dtype=float)
        feasible = (
            np.isfinite(force)
            & (force > 0)
            & (force >= bench.min_force)
            & (force <= bench.max_force)
        )
        feasible &= pressure >= np.interp(contraction, *pull)
        if np.count_nonzero(feasible) < MIN_POINTS:
            return []
        used = sweep[feasible]
        sweep = np.linspace(used[0], used[-1], points)
    return [PlannedRun(constant, *_coordinates(constant, level, used), force[feasible])]


def _coordinates(constant: str, level: float, values: Array) -> tuple[Array, Array]:
    """Pressure and contraction of the points of a sweep."""
    levels = np.full(values.size, level)
    return (levels, values) if constant == "pressure" else (values, levels)


def _jacobians(
    law: Characteristic, candidates: Sequence[PlannedRun], fixed: Collection[str]
) -> tuple[tuple[str, ...], Array, list[Array]]:
    """Names and values of the free parameters, and the Jacobian of every candidate by relative
    parameters.
    """
    data = Recording(_columns_of(candidates), "candidate runs")
    problem = make_problem(law, data, UNCENSORED, np.ones(len(data)), fixed)
    values = problem.initial_values
    jacobian = problem.jacobian(values) * np.where(values == 0, 1.0, np.abs(values))
    if not np.isfinite(jacobian).all():
        raise IdentificationError(
            f"the derivatives of {type(law).__name__} are not finite within the limits of the test"
            " rig. Increase the minimum pressure or the minimum contraction."
        )
    ends = np.cumsum([r.force.size for r in candidates])[:-1]
    return tuple(leaf.path for leaf in problem.free_leaves), values, np.split(jacobian, ends)


def _log_determinant(information: Array, selected: Sequence[int] | Array) -> float:
    """log det of the regularised information of these runs, scaled by the information of all
    candidates.
    """
    size = information.shape[1]
    lengths = np.sqrt(np.maximum(np.diag(information.sum(axis=0)), 1e-300))
    scaled = information[list(selected)].sum(axis=0) / np.outer(lengths, lengths)
    return float(np.linalg.slogdet(scaled + REGULARISATION * np.eye(size))[1])


def _select_runs(information: Array, runs: int) -> list[int]:
    """Runs added one by one; single ones are then replaced as long as the determinant increases."""

    def extended(others: list[int]) -> tuple[float, list[int]]:
        determinants = [
            _log_determinant(information, [*others, i]) for i in range(len(information))
        ]
        return max(determinants), [*others, first_greatest(np.asarray(determinants))]

    best = 0.0
    selected = list[int]()
    improved = True
    for _ in range(runs):
        best, selected = extended(selected)
    while improved:
        improved = False
        for k in range(runs):
            determinant, exchanged = extended(selected[:k] + selected[k + 1 :])
            if determinant > best + 1e-9:
                best = determinant
                selected = exchanged
                improved = True
    return selected
