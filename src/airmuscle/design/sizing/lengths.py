"""Shortest muscles of a lift, between whose end points the load is held, and of an antagonistic
joint.
"""

import dataclasses
import functools
import math
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, SolveError
from .requirement_and_choice import (
    JointRequirement,
    MuscleDesign,
    PullRequirement,
    SizingConditions,
)
from .static_muscle import EndPoint, StaticMuscle, least_sufficient

GRID = 257
ZOOMS = 6
"""Contractions at which the limits of an end point of a lift are searched (chosen), and the number
of refinements of a limit, each by a factor of 256, to rounding precision."""
MOUNTINGS = 65
"""Contractions at the start that are tried for one length (chosen)."""
ROUNDING = 1e-9
"""Part of the load, or of the length of a joint, by which a condition may be missed through
rounding (chosen).
"""
GROWTH = 1.02
"""Ratio of the lengths that are tried where the load limits the muscle between the ends
(chosen).
"""
MAX_GROWTH = 50.0
"""Maximum ratio of the length to that of the end points alone (chosen)."""


class LoadLimits(NamedTuple):
    """Least and greatest load of one muscle [N] at a position: at rest, and accelerated in a
    harmonic motion.
    """

    least: Any
    greatest: Any


@dataclasses.dataclass(frozen=True)
class LiftSearch:
    """Search of the lengths and mountings with which `count` muscles in parallel meet a lift.

    At each position, the muscle holds the safety factor times the load, and can yield to it, both
    at rest and in a harmonic motion over the stroke with the cycle time.
    """

    requirement: PullRequirement
    conditions: SizingConditions
    count: int

    def _loads(self, displacement: Array) -> LoadLimits:
        """Least and greatest load of one muscle [N] at displacements [m]. Raises SolveError if it
        overshoots.
        """
        least, greatest = self.requirement.loads(displacement, self.conditions.cycle_time)
        if not least.min() > 0.0:
            at = 1e3 * float(displacement[least.argmin()])
            raise SolveError(
                f"with a cycle of {self.conditions.cycle_time:.4g} s, the load pulls with"
                f" {least.min():.4g} N at {at:.4g} mm, where it is decelerated: it would overshoot."
                " Give a longer cycle time"
            )
        return LoadLimits(least / self.count, greatest / self.count)

    @property
    def _ends(self) -> tuple[LoadLimits, LoadLimits]:
        """Loads of one muscle [N] at the start and at the end."""
        start, end = zip(*self._loads(np.array([0.0, self.requirement.travel])), strict=True)
        return LoadLimits(*start), LoadLimits(*end)

    @property
    def _path(self) -> tuple[Array, LoadLimits]:
        """Displacements [m] along the stroke and the loads [N] there, (PATH_POINTS,) each."""
        displacement, _ = self.requirement.path
        return displacement, self._loads(displacement)

    def margin(self, muscle: StaticMuscle, contraction: Array, load: LoadLimits) -> Array:
        """Force [N] by which a load is inside the limits of the muscle at a contraction [1];
        negative outside.
        """
        upper = muscle.capacity(contraction) - self.conditions.safety_factor * load.greatest
        return np.asarray(np.minimum(upper, load.least - muscle.floor(contraction)))

    @functools.lru_cache(maxsize=256)  # noqa: B019 - a search and its muscles are small
    def end_limits(self, muscle: StaticMuscle) -> tuple[float, float]:
        """Minimum contraction at the start and maximum at the end. Raises SolveError, with the
        reason.
        """
        start, end = self._ends
        grid = np.linspace(*muscle.contraction_range, GRID)
        possible = [np.flatnonzero(self.margin(muscle, grid, load) >= 0.0) for load in (start, end)]
        for load, rows, place in zip((start, end), possible, ("start", "end"), strict=True):
            if not rows.size:
                raise SolveError(self._no_contraction(muscle, grid, load, place))
        first = int(possible[0][0])
        last = int(possible[1][-1])
        low = (
            self._edge(muscle, start, grid[first], grid[first - 1]) if first > 0 else float(grid[0])
        )
        high = (
            self._edge(muscle, end, grid[last], grid[last + 1])
            if last + 1 < GRID
            else float(grid[-1])
        )
        if not low < high:
            raise SolveError(
                f"the start of the stroke needs at least {100 * low:.4g} % contraction, its end at"
                f" most {100 * high:.4g} %"
            )
        return low, high

    def _edge(self, muscle: StaticMuscle, load: LoadLimits, inside: float, outside: float) -> float:
        """The contraction between two neighbours of the grid at which the margin is zero, from
        inside.
        """
        for _ in range(ZOOMS):
            grid = np.linspace(inside, outside, GRID)
            last = int(np.argmax(self.margin(muscle, grid, load) < 0.0)) - 1
            if last < 0:  # the neighbours differ by rounding only
                break
            inside = float(grid[last])
            outside = float(grid[last + 1])
        return float(inside)

    def _no_contraction(
        self, muscle: StaticMuscle, grid: Array, load: LoadLimits, place: str
    ) -> str:
        capacity = muscle.capacity(grid)
        needed = self.conditions.safety_factor * float(load.greatest)
        best = int(np.argmax(capacity))
        if capacity[best] < needed:
            permitted = ", which the maker permits" if capacity[best] >= muscle.max_force else ""
            return f"{_force_at(muscle, float(grid[best]))}{permitted}; {needed:.4g} N is needed"
        return (
            f"the load at the {place}, {load.least:.4g} N, is less than the force at the least"
            f" pressure of {muscle.pressure_range[0] / 1e5:.4g} bar,"
            f" {muscle.floor(grid).min():.4g} N"
        )

    def mounting(self, muscle: StaticMuscle, length: float) -> float | None:
        """The least contraction at the start with which a length [m] meets the requirement; None if
        there is none.
        """
        low, high = self.end_limits(muscle)
        used = self.requirement.travel / length
        if used > (high - low) * (1.0 + ROUNDING):
            return None
        starts = np.unique(np.linspace(low, max(low, high - used), MOUNTINGS))
        displacement, load = self._path
        contractions = np.minimum(
            starts[:, None] + displacement / length, muscle.contraction_range[1]
        )
        is_possible = (self.margin(muscle, contractions, load) >= -ROUNDING * load.greatest).all(
            axis=1
        )
        return float(starts[is_possible.argmax()]) if is_possible.any() else None

    def required_length(self, muscle: StaticMuscle) -> float:
        """Shortest length [m] for a law that does not depend on it. Raises SolveError, with the
        reason.
        """
        low, high = self.end_limits(muscle)
        shortest = self.requirement.travel / (high - low)
        length = shortest
        while self.mounting(muscle, length) is None:
            length *= GROWTH
            if length > MAX_GROWTH * shortest:
                raise SolveError(
                    "between the ends of the stroke, the load exceeds the force of the muscle"
                )
        if length == shortest:
            return length
        return least_sufficient(
            lambda x: self.mounting(muscle, x) is not None, length / GROWTH, length
        )

    def design(self, muscle: StaticMuscle, length: float) -> MuscleDesign | None:
        """The design with this length [m]; None if it does not meet the requirement."""
        start = self.mounting(muscle, length)
        if start is None:
            return None
        contractions = (
            start,
            min(start + self.requirement.travel / length, muscle.contraction_range[1]),
        )
        extended, contracted = (
            muscle.end_point(eps, self.requirement.load(at) / self.count)
            for eps, at in zip(contractions, (0.0, self.requirement.travel), strict=True)
        )
        displacement, load = self._path
        along = np.minimum(start + displacement / length, muscle.contraction_range[1])
        reserve = float(np.min(muscle.capacity(along) / load.greatest)) - 1.0
        return MuscleDesign(extended, contracted, reserve)

    def shortfall(self, muscle: StaticMuscle, length: float) -> str:
        """Reason why a length [m] is not sufficient."""
        low, high = self.end_limits(muscle)
        needed = low + self.requirement.travel / length
        highest = muscle.contraction_range[1]
        if needed > highest:
            return (
                f"with {1e3 * length:.4g} mm, the stroke needs a contraction of {100 * needed:.4g}"
                f" %; {100 * highest:.4g} % is allowed"
            )
        if needed > high:
            force = self.conditions.safety_factor * float(self._ends[1].greatest)
            return (
                f"with {1e3 * length:.4g} mm, {_force_at(muscle, needed)}; {force:.4g} N is needed"
            )
        return (
            f"with {1e3 * length:.4g} mm, the load exceeds the force between the ends of the stroke"
        )


def _force_at(muscle: StaticMuscle, contraction: float) -> str:
    pressure = muscle.pressure_range[1] / 1e5
    return (
        f"force at {pressure:.4g} bar and {100 * contraction:.4g} % is"
        f" {float(muscle.capacity(contraction)):.4g} N"
    )


JOINT_GRID = 129
ZOOM_GRID = 17
JOINT_ZOOMS = 12
"""Contractions of the search of a joint and of its refinements, each by a factor of 8 (chosen), and
their number.
"""
MARGIN = 1.1
"""Ratio of the length for which the range of radii is stated to the shortest one (chosen)."""
MOUNTING = 1.1
"""Ratio of the distance of the muscles on both sides of a pulley, its diameter, to their outer
diameter at pressure: a tenth for wall and clearance (chosen)."""


@dataclasses.dataclass(frozen=True)
class JointSearch:
    """Search of the lengths and radii with which a joint of 2 x `count` equal muscles meets its
    requirement.

        n r (F_max(eps_c) - F_min(eps_e)) >= S_F M,   n r (F_max(eps_e) - F_min(eps_c)) >= S_F (M +
                                                      M_J),
        eps_c - eps_e = r Theta/L,   2 r >= 1.1 D(eps_c)

    at either end of the range; eps_c, eps_e contraction of the contracted and the extended muscle,
    F_max capacity, F_min force at the least pressure, M_J torque that accelerates the inertia,
    which the extended muscle gives, D outer diameter at pressure: the muscles on both sides of the
    pulley do not touch. Those of one side are side by side along the axis of the joint.
    """

    requirement: JointRequirement
    conditions: SizingConditions
    count: int

    @property
    def _torques(self) -> tuple[float, float]:
        """Torque that the contracted and the extended muscle must give [N m], without the safety
        factor.
        """
        torque = self.requirement.torque
        return torque, torque + self.requirement.acceleration_torque(self.conditions.cycle_time)

    def _needed(self, muscle: StaticMuscle, extended: Array, contracted: Array) -> Array:
        """Needed lengths [m] (3, E, C) for the torques of the contracted and of the extended
        muscle, and for a pulley that leaves room for the muscles, of each pair of contractions (E,)
        and (C,); infinity where there is none.
        """
        torques = self._torques
        upper = muscle.capacity(contracted)
        lower = muscle.floor(extended)[:, None]
        upper_extended = muscle.capacity(extended)[:, None]
        lower_contracted = muscle.floor(contracted)
        ratio = (contracted - extended[:, None]) / self.requirement.angle  # r/L
        gains = (ratio * (upper - lower), ratio * (upper_extended - lower_contracted))
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = [
                self.conditions.safety_factor * torque / (self.count * gain)
                for torque, gain in zip(torques, gains, strict=True)
            ]
            lengths.append(0.5 * MOUNTING * muscle.outer_diameter(contracted) / ratio)
        possible = (ratio > 0.0) & (gains[0] > 0.0) & (gains[1] > 0.0)
        return np.where(possible, np.array(lengths), math.inf)

    def _best(self, muscle: StaticMuscle) -> tuple[float, float, float]:
        """Shortest length [m] and its contractions, extended and contracted. Raises SolveError,
        with the reason.
        """
        low, high = muscle.contraction_range
        extended = contracted = np.linspace(low, high, JOINT_GRID)
        for _ in range(JOINT_ZOOMS + 1):
            lengths = self._needed(muscle, extended, contracted).max(axis=0)
            i, k = np.unravel_index(int(np.argmin(lengths)), lengths.shape)
            best = float(lengths[i, k]), float(extended[i]), float(contracted[k])
            if not math.isfinite(best[0]):
                raise SolveError(
                    f"at {muscle.pressure_range[1] / 1e5:.4g} bar, the contracted muscle is not"
                    f" stronger than the extended one at {muscle.pressure_range[0] / 1e5:.4g} bar,"
                    " at any contraction"
                )
            step = float(extended[1] - extended[0]), float(contracted[1] - contracted[0])
            extended, contracted = (
                np.linspace(max(low, middle - width), min(high, middle + width), ZOOM_GRID)
                for middle, width in zip(best[1:], step, strict=True)
            )
        return best

    def required_length(self, muscle: StaticMuscle) -> float:
        """Shortest length [m] for a law that does not depend on it. Raises SolveError, with the
        reason.
        """
        return self._best(muscle)[0]

    def design(self, muscle: StaticMuscle, length: float) -> MuscleDesign | None:
        """The design of least radius with this length [m]; None if it does not meet the
        requirement.
        """
        shortest, extended, contracted = self._best(muscle)
        if length < shortest * (1.0 - ROUNDING):
            return None
        if length > shortest * (1.0 + ROUNDING):
            pairs = self._pairs(muscle, length)
            extended, contracted = (float(each[np.argmin(pairs[1] - pairs[0])]) for each in pairs)
        longer = MARGIN * length
        low = muscle.pressure_range[0]
        starts, ends = self._pairs(muscle, longer)
        radii = (
            self._radius(longer, float((ends - starts).min())),
            self._radius(longer, float((ends - starts).max())),
        )
        radius = self._radius(length, contracted - extended)
        rest = EndPoint(
            low, extended, float(muscle.floor(extended)), float(muscle.capacity(extended))
        )
        arm = self.count * radius
        torque, accelerating = self._torques
        pulling = muscle.end_point(contracted, rest.force + torque / arm)
        factors = (
            arm * (pulling.capacity - rest.force) / torque,
            arm * (rest.capacity - float(muscle.floor(contracted))) / accelerating,
        )
        return MuscleDesign(rest, pulling, min(factors) - 1.0, radius, radii)

    def _radius(self, length: float, contraction: float) -> float:
        return contraction * length / self.requirement.angle

    def _pairs(self, muscle: StaticMuscle, length: float) -> tuple[Array, Array]:
        """Pairs of contractions of the grid with which a length meets the requirement; the best one
        without any.
        """
        grid = np.linspace(*muscle.contraction_range, JOINT_GRID)
        rows, columns = np.nonzero(self._needed(muscle, grid, grid).max(axis=0) <= length)
        if not rows.size:  # the region is smaller than the grid
            _, extended, contracted = self._best(muscle)
            return np.array([extended]), np.array([contracted])
        return grid[rows], grid[columns]

    def shortfall(self, muscle: StaticMuscle, length: float) -> str:
        """Reason why a length [m] is not sufficient."""
        shortest, extended, contracted = self._best(muscle)
        lengths = self._needed(muscle, np.array([extended]), np.array([contracted])).ravel()
        limiting = int(
            np.argmax(lengths[:2])
        )  # the muscle whose torque determines the shortest length
        if lengths[2] > lengths[limiting]:
            reached, needed = (
                1e3 * self._radius(each, contracted - extended) for each in (length, shortest)
            )
            return (
                f"with {1e3 * length:.4g} mm, the pulley has a radius of at most {reached:.4g} mm;"
                " the muscles on both sides,"
                f" {1e3 * float(muscle.outer_diameter(np.array(contracted))):.4g} mm thick at"
                f" pressure, need {needed:.4g} mm"
            )
        needed = self.conditions.safety_factor * self._torques[limiting]
        reached = needed * length / shortest  # the needed length is proportional to the torque
        inertia = " with that of the inertia" if limiting else ""
        return (
            f"with {1e3 * length:.4g} mm, the torque at the ends is at most {reached:.4g} N m;"
            f" {needed:.4g} N m is needed{inertia}"
        )
