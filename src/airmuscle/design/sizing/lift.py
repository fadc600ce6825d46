"""Shortest muscle of a lift: end points at which the load lies between the least force and the capacity."""

import dataclasses
import functools
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, SolveError
from .choice import MuscleDesign
from .requirement import LiftRequirement, SizingConditions
from .static_muscle import StaticMuscle, least_sufficient

GRID = 257
"""Contractions at which the limits of an end point are searched, before they are refined (chosen)."""
ZOOMS = 6
"""Refinements of a limit, each by a factor of 256, to rounding precision."""
MOUNTINGS = 65
"""Contractions at the start that are tried for one length (chosen)."""
ROUNDING = 1e-9
"""Part of the load by which a condition may be missed through rounding (chosen)."""
GROWTH = 1.02
"""Ratio of the lengths that are tried where the load limits the muscle between the ends (chosen)."""
MAX_GROWTH = 50.0
"""Maximum ratio of the length to that of the end points alone (chosen)."""


class LoadLimits(NamedTuple):
    """Least and greatest load of one muscle [N] at a position: at rest, and accelerated in a harmonic motion."""

    least: Any
    greatest: Any


@dataclasses.dataclass(frozen=True)
class LiftSearch:
    """Search of the lengths and mountings with which `count` muscles in parallel meet a lift.

    At each position, the muscle holds the safety factor times the load, and can yield to it, both at rest and in a
    harmonic motion over the stroke with the cycle time.
    """

    requirement: LiftRequirement
    conditions: SizingConditions
    count: int

    def _loads(self, displacement: Array) -> LoadLimits:
        """Least and greatest load of one muscle [N] at displacements [m]. Raises SolveError if it overshoots."""
        least, greatest = self.requirement.loads(displacement, self.conditions.cycle_time)
        if not least.min() > 0.0:
            at = 1e3 * float(displacement[least.argmin()])
            raise SolveError(
                f"with a cycle of {self.conditions.cycle_time:.4g} s, the load pulls with {least.min():.4g} N at "
                f"{at:.4g} mm, where it is decelerated: it would overshoot. Give a longer cycle time"
            )
        return LoadLimits(least / self.count, greatest / self.count)

    @property
    def _ends(self) -> tuple[LoadLimits, LoadLimits]:
        """Loads of one muscle [N] at the start and at the end."""
        least, greatest = self._loads(np.array([0.0, self.requirement.stroke]))
        return LoadLimits(least[0], greatest[0]), LoadLimits(least[1], greatest[1])

    @property
    def _path(self) -> tuple[Array, LoadLimits]:
        """Displacements [m] along the stroke and the loads [N] there, (PATH_POINTS,) each."""
        displacement, _ = self.requirement.path
        return displacement, self._loads(displacement)

    def margin(self, muscle: StaticMuscle, contraction: Array, load: LoadLimits) -> Array:
        """Force [N] by which a load is inside the limits of the muscle at a contraction [1]; negative outside."""
        upper = muscle.capacity(contraction) - self.conditions.safety_factor * load.greatest
        return np.asarray(np.minimum(upper, load.least - muscle.floor(contraction)))

    @functools.lru_cache(maxsize=256)  # noqa: B019 - a search and its muscles are small
    def end_limits(self, muscle: StaticMuscle) -> tuple[float, float]:
        """Minimum contraction at the start and maximum at the end. Raises SolveError, with the reason."""
        start, end = self._ends
        grid = np.linspace(*muscle.contraction_range, GRID)
        possible = [np.flatnonzero(self.margin(muscle, grid, load) >= 0.0) for load in (start, end)]
        for load, rows, place in zip((start, end), possible, ("start", "end"), strict=True):
            if not rows.size:
                raise SolveError(self._no_contraction(muscle, grid, load, place))
        first, last = int(possible[0][0]), int(possible[1][-1])
        low = self._edge(muscle, start, grid[first], grid[first - 1]) if first > 0 else float(grid[0])
        high = self._edge(muscle, end, grid[last], grid[last + 1]) if last + 1 < GRID else float(grid[-1])
        if not low < high:
            raise SolveError(
                f"the start of the stroke needs at least {100 * low:.4g} % contraction, its end at most "
                f"{100 * high:.4g} %"
            )
        return low, high

    def _edge(self, muscle: StaticMuscle, load: LoadLimits, inside: float, outside: float) -> float:
        """The contraction between two neighbours of the grid at which the margin is zero, from inside."""
        for _ in range(ZOOMS):
            grid = np.linspace(inside, outside, GRID)
            last = int(np.argmax(self.margin(muscle, grid, load) < 0.0)) - 1
            if last < 0:  # the neighbours differ by rounding only
                break
            inside, outside = float(grid[last]), float(grid[last + 1])
        return float(inside)

    def _no_contraction(self, muscle: StaticMuscle, grid: Array, load: LoadLimits, place: str) -> str:
        capacity, needed = muscle.capacity(grid), self.conditions.safety_factor * float(load.greatest)
        best = int(np.argmax(capacity))
        if capacity[best] < needed:
            permitted = ", which the maker permits" if capacity[best] >= muscle.max_force else ""
            return f"{_force_at(muscle, float(grid[best]))}{permitted}; {needed:.4g} N is needed"
        least = float(muscle.floor(grid).min())
        return (
            f"the load at the {place}, {load.least:.4g} N, is less than the force at the least pressure of "
            f"{muscle.pressure_range[0] / 1e5:.4g} bar, {least:.4g} N"
        )

    def mounting(self, muscle: StaticMuscle, length: float) -> float | None:
        """The least contraction at the start with which a length [m] meets the requirement; None if there is none."""
        low, high = self.end_limits(muscle)
        used = self.requirement.stroke / length
        if used > (high - low) * (1.0 + ROUNDING):
            return None
        starts = np.unique(np.linspace(low, max(low, high - used), MOUNTINGS))
        displacement, load = self._path
        contractions = np.minimum(starts[:, None] + displacement / length, muscle.contraction_range[1])
        margins = self.margin(muscle, contractions, load)
        possible = np.flatnonzero((margins >= -ROUNDING * load.greatest).all(axis=1))
        return float(starts[possible[0]]) if possible.size else None

    def required_length(self, muscle: StaticMuscle) -> float:
        """Shortest length [m] for a law that does not depend on it. Raises SolveError, with the reason."""
        low, high = self.end_limits(muscle)
        shortest = self.requirement.stroke / (high - low)
        length = shortest
        while self.mounting(muscle, length) is None:
            length *= GROWTH
            if length > MAX_GROWTH * shortest:
                raise SolveError("between the ends of the stroke, the load exceeds the force of the muscle")
        if length == shortest:
            return length
        return least_sufficient(lambda x: self.mounting(muscle, x) is not None, length / GROWTH, length)

    def design(self, muscle: StaticMuscle, length: float) -> MuscleDesign | None:
        """The design with this length [m]; None if it does not meet the requirement."""
        start = self.mounting(muscle, length)
        if start is None:
            return None
        contractions = (start, min(start + self.requirement.stroke / length, muscle.contraction_range[1]))
        extended, contracted = (
            muscle.end_point(eps, self.requirement.load(at) / self.count)
            for eps, at in zip(contractions, (0.0, self.requirement.stroke), strict=True)
        )
        displacement, load = self._path
        along = np.minimum(start + displacement / length, muscle.contraction_range[1])
        reserve = float(np.min(muscle.capacity(along) / load.greatest)) - 1.0
        return MuscleDesign(extended, contracted, reserve)

    def shortfall(self, muscle: StaticMuscle, length: float) -> str:
        """Reason why a length [m] is not sufficient."""
        low, high = self.end_limits(muscle)
        needed, highest = low + self.requirement.stroke / length, muscle.contraction_range[1]
        if needed > highest:
            return (
                f"with {1e3 * length:.4g} mm, the stroke needs a contraction of {100 * needed:.4g} %; "
                f"{100 * highest:.4g} % is allowed"
            )
        if needed > high:
            force = self.conditions.safety_factor * float(self._ends[1].greatest)
            return f"with {1e3 * length:.4g} mm, {_force_at(muscle, needed)}; {force:.4g} N is needed"
        return f"with {1e3 * length:.4g} mm, the load exceeds the force between the ends of the stroke"


def _force_at(muscle: StaticMuscle, contraction: float) -> str:
    pressure = muscle.pressure_range[1] / 1e5
    return f"force at {pressure:.4g} bar and {100 * contraction:.4g} % is {float(muscle.capacity(contraction)):.4g} N"
