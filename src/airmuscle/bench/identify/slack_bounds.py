"""Bounds of a law for muscles of any length, from the slack rows of the measured lengths.

A law that is linear in its parameters is extrapolated to further lengths and lower pressures as a polynomial, which may
turn upwards there. Where a muscle is slack far below the pressure at which it starts to pull, one of the same type and
another length is taken to be slack as well: rows of zero force at these points and lengths are added as upper bounds,
which count only where the law violates them.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...recording import Recording
from .fit_points import FitPoints
from .loss import Loss
from .problem import FORCE, RESTING_LENGTH, FitProblem
from .slack_rows import MIN_PULL, Slackness
from .solver import LeastSquaresSolution, is_linear, solve_least_squares

LENGTH_FACTORS = (0.4, 0.63, 1.0, 1.6, 2.5)
"""Lengths of the bounds as multiples of a measured length (chosen: from one measured length to beyond its neighbours in
a series of nominal lengths)."""
_SHARE = 0.5
"""Share of the slack range of pressure in which another length is taken to be slack (chosen)."""
_WEIGHT = 0.1
"""Weight of all bounds of a run relative to that of its rows (chosen): enough to keep a polynomial from turning
upwards, too little to change it where it is measured."""
_GRID = (3, 4)
"""Points of a run in contraction and in pressure (chosen)."""


class BoundedProblem(NamedTuple):
    """A problem with added bounds: its first rows are those of the given problem."""

    problem: FitProblem
    source: npt.NDArray[np.intp]
    """The recording of each added row, shape (M,)."""

    def groups(self, group: npt.NDArray[np.intp], points: FitPoints, otherwise: int) -> npt.NDArray[np.intp]:
        """The group of every row, from those of the given rows (N,); that of an added row is the one of its recording,
        or `otherwise` where that has several."""
        ends = np.cumsum([len(run) for run in points.recordings])
        member = np.searchsorted(ends, np.flatnonzero(~points.missing), side="right")
        of_run = {int(i): np.unique(group[member == i]) for i in np.unique(self.source)}
        added = [int(of_run[i][0]) if of_run[i].size == 1 else otherwise for i in self.source.tolist()]
        return np.concatenate([group, np.array(added, dtype=np.intp)])


def with_slack_bounds(problem: FitProblem, points: FitPoints) -> BoundedProblem:
    """The problem with bounds for further lengths; unchanged unless it is of a linear force law of several lengths."""
    unchanged = BoundedProblem(problem, np.zeros(0, dtype=np.intp))
    suits = problem.fitted_quantity == FORCE and RESTING_LENGTH in problem.data.columns
    if not suits or not hasattr(problem.law, "with_resting_length") or not is_linear(problem):
        return unchanged
    parts = [_bounds_of_run(run, i) for i, run in enumerate(points.recordings)] if (problem.censoring > 0).any() else []
    columns = {name: np.concatenate([part[name] for part in parts]) for name in _COLUMNS} if parts else {}
    if not parts or not columns["pressure"].size:
        return unchanged
    source = columns.pop("source").astype(np.intp)
    shares = columns.pop("share")
    data = Recording({n: np.concatenate([problem.data[n], columns[n]]) for n in columns}, problem.data.origin)
    mean_square = float(np.mean(problem.weights**2))
    return BoundedProblem(
        dataclasses.replace(
            problem,
            data=data,
            target=np.concatenate([problem.target, np.zeros(source.size)]),
            censoring=np.concatenate([problem.censoring, np.ones(source.size)]),
            weights=np.concatenate([problem.weights, np.sqrt(mean_square * shares)]),
        ),
        source,
    )


def solve_bounded(
    problem: FitProblem, points: FitPoints, loss: Loss, start: Array | None = None
) -> LeastSquaresSolution:
    """As `solve_least_squares`, with the slack bounds of further lengths; the solution at the rows of the problem."""
    solution, count = solve_least_squares(with_slack_bounds(problem, points).problem, loss, start), len(problem.data)
    return LeastSquaresSolution(solution.values, solution.modelled[:count], solution.jacobian[:count])


_COLUMNS = ("pressure", "contraction", "force", RESTING_LENGTH, "source", "share")


def _bounds_of_run(run: Recording, index: int) -> dict[str, Array]:
    """The bounds of one recording, with its index, and the number of its rows for which each of them stands."""
    pressure, contraction, force = (run[name] for name in ("pressure", "contraction", "force"))
    complete = np.isfinite(pressure + contraction + force)
    pressure, contraction, force = pressure[complete], contraction[complete], force[complete]
    if not (force <= 0).any():
        return {name: np.zeros(0) for name in _COLUMNS}
    steps = Slackness.of(pressure, contraction, force <= 0, force > MIN_PULL * float(force.max()))
    p, c = steps.region(float(pressure.min()), float(contraction.max()), _SHARE, _GRID)
    lengths = float(run.constants[RESTING_LENGTH]) * np.array(LENGTH_FACTORS)
    size = p.size * lengths.size
    columns = (np.tile(p, lengths.size), np.tile(c, lengths.size), np.zeros(size), np.repeat(lengths, p.size))
    numbers = np.full(size, float(index)), np.full(size, _WEIGHT * force.size / max(size, 1))
    return dict(zip(_COLUMNS, (*columns, *numbers), strict=True))
