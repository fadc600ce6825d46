"""Slack rows: measured points without force, where a law must not pull, and the bounds that they
imply.

Force rises with pressure and falls with contraction. A muscle that is slack at one point is
therefore slack at every lower pressure and greater contraction, unless a measured force at one of
these contradicts it: such a row is a transient of the rig, friction or an error of the sensor.

A law that is linear in its parameters is extrapolated to further lengths and lower pressures as a
polynomial, which may turn upwards there. Where a muscle is slack far below the pressure at which it
starts to pull, one of the same type and another length is taken to be slack as well: rows of zero
force at these points and lengths are added as upper bounds, which count only where the law violates
them.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, contraction_text, quantity_text
from ...recording import Recording
from ..estimation import LeastSquaresSolution, Loss, solve_least_squares
from ..inspection import POINT_COLUMNS
from .fit_points import FitPoints
from .fit_problem import FORCE, RESTING_LENGTH, FitProblem

Rows = npt.NDArray[np.bool_]
MIN_PULL = 0.02
"""Force at a slack row, as a fraction of the greatest measured force, below which a law does not
count as pulling (chosen)."""
PULL_RATIO = 3.0
"""The same in root mean square errors of the law on the measured rows (chosen: friction and noise
move the limit of slackness by as much as they change the force)."""
_GRID = (21, 11)
"""Points of the slack region of a specimen in contraction and pressure (chosen)."""


class Slackness(NamedTuple):
    """Steps of one specimen: greatest slack pressure up to a contraction, least pulling pressure
    from one on.
    """

    slack_contraction: Array
    slack_pressure: Array
    pull_contraction: Array
    pull_pressure: Array

    @classmethod
    def of(cls, pressure: Array, contraction: Array, slack: Rows, pulls: Rows) -> "Slackness":
        """The steps of rows (N,), of which two masks are slack and pull."""
        order = np.argsort(contraction[slack])
        last = np.argsort(-contraction[pulls])
        return cls(
            contraction[slack][order],
            np.maximum.accumulate(pressure[slack][order]),
            -contraction[pulls][last],
            np.minimum.accumulate(pressure[pulls][last]),
        )

    def slack_limit(self, contraction: Array) -> Array:
        """Pressure [Pa] up to which a slack row shows the muscle to be slack; -inf where none
        does.
        """
        place = np.searchsorted(self.slack_contraction, contraction, side="right")
        return np.asarray(np.append(-np.inf, self.slack_pressure)[place])

    def pull_limit(self, contraction: Array) -> Array:
        """Pressure [Pa] from which a measured force shows the muscle to pull; inf where none
        does.
        """
        place = np.searchsorted(self.pull_contraction, -contraction, side="right")
        return np.asarray(np.append(np.inf, self.pull_pressure)[place])

    def region(
        self,
        lowest_pressure: float,
        highest_contraction: float,
        share: float = 1.0,
        grid: tuple[int, int] = _GRID,
    ) -> tuple[Array, Array]:
        """Points (M,) of the slack region, pressure [Pa] and contraction, down to a pressure and up
        to a contraction.

        share  of the slack range of pressure at each contraction
        grid   numbers of points in contraction and in pressure

        None without slack rows.
        """
        if not self.slack_contraction.size:
            return np.zeros(0), np.zeros(0)
        contraction = np.linspace(self.slack_contraction[0], highest_contraction, grid[0])
        limit = np.minimum(self.slack_limit(contraction), self.pull_limit(contraction))
        inside = limit > lowest_pressure
        steps = np.linspace(0.0, share, grid[1])
        pressure = lowest_pressure + (limit[inside] - lowest_pressure)[:, None] * steps
        return pressure.ravel(), np.repeat(contraction[inside], grid[1])


@dataclasses.dataclass(frozen=True)
class SlackPull:
    """The force of a law at the slack rows of measurements; SI."""

    rows: int
    """Number of slack rows."""
    pulling: int
    """Number of slack rows at which the law pulls more than its limit, and that no measured force
    contradicts.
    """
    limit: float
    """Force [N] above which a law counts as pulling."""
    greatest: float
    """Greatest force [N] of the law at these rows; 0 without slack rows."""
    pressure: float = 0.0
    contraction: float = 0.0
    """The point of the greatest force."""

    def __str__(self) -> str:
        at = f"{quantity_text(self.pressure, 'Pa', 'kPa')} and {contraction_text(self.contraction)}"
        return (
            f"it pulls at {self.pulling} of {self.rows} slack rows, up to {self.greatest:.3g} N at"
            f" {at}"
        )


def slack_pull(
    pressure: Array,
    contraction: Array,
    force: Array,
    modelled: Array,
    limit: float,
    specimen: Array | None = None,
) -> SlackPull:
    """The forces `modelled` (N,) [N] of a law at the rows of measured force <= 0, of which `limit`
    [N] are permitted.

    specimen  labels (N,) of the specimens, whose slack regions are separate; by default one
    """
    count = int(np.count_nonzero(force <= 0))
    judged = np.zeros(force.size, dtype=bool)
    specimens = np.zeros(force.size) if specimen is None else specimen
    for name in np.unique(specimens):
        of_specimen = specimens == name
        p = pressure[of_specimen]
        c = contraction[of_specimen]
        f = force[of_specimen]
        judged[of_specimen] = (f <= 0) & (p < Slackness.of(p, c, f <= 0, f > limit).pull_limit(c))
    if not judged.any():
        return SlackPull(count, 0, limit, 0.0)
    worst = int(np.argmax(np.where(judged, modelled, -np.inf)))
    pulling = int(np.count_nonzero(judged & (modelled > limit)))
    greatest = max(float(modelled[worst]), 0.0)
    point = float(pressure[worst]), float(contraction[worst])
    return SlackPull(count, pulling, limit, greatest, *point)


LENGTH_FACTORS = (0.4, 0.63, 1.0, 1.6, 2.5)
"""Lengths of the bounds as multiples of a measured length (chosen: from one measured length to
beyond its neighbours in a series of nominal lengths)."""
_SHARE = 0.5
"""Share of the slack range of pressure in which another length is taken to be slack (chosen)."""
_WEIGHT = 0.1
"""Weight of all bounds of a run relative to that of its rows (chosen): enough to keep a polynomial
from turning upwards, too little to change it where it is measured."""
_BOUND_GRID = (3, 4)
"""Points of a run in contraction and in pressure (chosen)."""


class BoundedProblem(NamedTuple):
    """A problem with added bounds: its first rows are those of the given problem."""

    problem: FitProblem
    source: npt.NDArray[np.intp]
    """The recording of each added row, shape (M,)."""

    def groups(
        self, group: npt.NDArray[np.intp], points: FitPoints, otherwise: int
    ) -> npt.NDArray[np.intp]:
        """The group of every row, from those of the given rows (N,); that of an added row is the
        one of its recording, or `otherwise` where that has several."""
        ends = np.cumsum([len(run) for run in points.recordings])
        member = np.searchsorted(ends, np.flatnonzero(~points.missing), side="right")
        of_run = {int(i): np.unique(group[member == i]) for i in np.unique(self.source)}
        added = [
            int(of_run[i][0]) if of_run[i].size == 1 else otherwise for i in self.source.tolist()
        ]
        return np.concatenate([group, np.array(added, dtype=np.intp)])


def with_slack_bounds(problem: FitProblem, points: FitPoints) -> BoundedProblem:
    """The problem with bounds for further lengths; unchanged unless it is of a linear force law of
    several lengths.
    """
    unchanged = BoundedProblem(problem, np.zeros(0, dtype=np.intp))
    suits = problem.fitted_quantity == FORCE and RESTING_LENGTH in problem.data.columns
    suits = (
        suits
        and hasattr(problem.law, "with_resting_length")
        and bool((problem.censoring > 0).any())
    )
    if not suits or not problem.is_linear:
        return unchanged
    bounds = np.hstack([_bounds_of_run(run, i) for i, run in enumerate(points.recordings)])
    if not bounds.size:
        return unchanged
    *columns, source, shares = bounds
    names = (*POINT_COLUMNS, RESTING_LENGTH)
    joined = {
        n: np.concatenate([problem.data[n], column])
        for n, column in zip(names, columns, strict=True)
    }
    bounded = dataclasses.replace(
        problem,
        data=Recording(joined, problem.data.origin),
        target=np.concatenate([problem.target, np.zeros(source.size)]),
        censoring=np.concatenate([problem.censoring, np.ones(source.size)]),
        weights=np.concatenate(
            [problem.weights, np.sqrt(float(np.mean(problem.weights**2)) * shares)]
        ),
    )
    return BoundedProblem(bounded, source.astype(np.intp))


def solve_bounded(
    problem: FitProblem, points: FitPoints, loss: Loss, start: Array | None = None
) -> LeastSquaresSolution:
    """As `solve_least_squares`, with the slack bounds of further lengths; the solution at the rows
    of the problem.
    """
    solution = solve_least_squares(with_slack_bounds(problem, points).problem, loss, start)
    count = len(problem.data)
    return LeastSquaresSolution(
        solution.values, solution.modelled[:count], solution.jacobian[:count]
    )


def _bounds_of_run(run: Recording, index: int) -> Array:
    """Pressure, contraction, force and resting length of the bounds of one recording, its index,
    and the number of its rows for which each of them stands; shape (6, M)."""
    pressure, contraction, force = (run[name] for name in POINT_COLUMNS)
    complete = np.isfinite(pressure + contraction + force)
    pressure = pressure[complete]
    contraction = contraction[complete]
    force = force[complete]
    if not (force <= 0).any():
        return np.zeros((6, 0))
    steps = Slackness.of(pressure, contraction, force <= 0, force > MIN_PULL * float(force.max()))
    p, c = steps.region(float(pressure.min()), float(contraction.max()), _SHARE, _BOUND_GRID)
    lengths = float(run.constants[RESTING_LENGTH]) * np.array(LENGTH_FACTORS)
    size = p.size * lengths.size
    points = (
        np.tile(p, lengths.size),
        np.tile(c, lengths.size),
        np.zeros(size),
        np.repeat(lengths, p.size),
    )
    return np.stack(
        [*points, np.full(size, float(index)), np.full(size, _WEIGHT * force.size / max(size, 1))]
    )
