"""Shortest muscles of an antagonistic joint: contractions of both muscles and pulley radius."""

import dataclasses
import math

import numpy as np

from ...core import Array, SolveError
from .choice import MuscleDesign
from .requirement import JointRequirement, SizingConditions
from .static_muscle import EndPoint, StaticMuscle

GRID, ZOOM_GRID = 129, 17
"""Contractions of the search and of each of its refinements (chosen)."""
ZOOMS = 12
"""Refinements of the search, each by a factor of 8."""
MARGIN = 1.1
"""Ratio of the length for which the range of radii is stated to the shortest one (chosen)."""
MOUNTING = 1.1
"""Ratio of the distance of the muscles on both sides of a pulley, its diameter, to their outer diameter at pressure: a
tenth for wall and clearance (chosen)."""
ROUNDING = 1e-9
"""Part of the length by which a condition may be missed through rounding (chosen)."""


@dataclasses.dataclass(frozen=True)
class JointSearch:
    """Search of the lengths and radii with which a joint of 2 x `count` equal muscles meets its requirement.

        n r (F_max(eps_c) - F_min(eps_e)) >= S_F M,   n r (F_max(eps_e) - F_min(eps_c)) >= S_F (M + M_J),
        eps_c - eps_e = r Theta/L,   2 r >= 1.1 D(eps_c)

    at either end of the range; eps_c, eps_e contraction of the contracted and the extended muscle, F_max capacity,
    F_min force at the least pressure, M_J torque that accelerates the inertia, which the extended muscle gives, D outer
    diameter at pressure: the muscles on both sides of the pulley do not touch. Those of one side are side by side along
    the axis of the joint.
    """

    requirement: JointRequirement
    conditions: SizingConditions
    count: int

    @property
    def _torques(self) -> tuple[float, float]:
        """Torque that the contracted and the extended muscle must give [N m], without the safety factor."""
        torque = self.requirement.torque
        return torque, torque + self.requirement.acceleration_torque(self.conditions.cycle_time)

    def needed(self, muscle: StaticMuscle, extended: Array, contracted: Array) -> Array:
        """Needed length [m] for each pair (E, C) of contractions (E,) and (C,); infinity where there is none."""
        return np.asarray(self._needed_of_each(muscle, extended, contracted).max(axis=0))

    def _needed_of_each(self, muscle: StaticMuscle, extended: Array, contracted: Array) -> Array:
        """Needed lengths [m] (3, E, C) for the torques of the contracted and of the extended muscle, and for a pulley
        that leaves room for the muscles."""
        torques = self._torques
        upper, lower = muscle.capacity(contracted), muscle.floor(extended)[:, None]
        upper_extended, lower_contracted = muscle.capacity(extended)[:, None], muscle.floor(contracted)
        ratio = (contracted - extended[:, None]) / self.requirement.angle  # r/L
        gains = (ratio * (upper - lower), ratio * (upper_extended - lower_contracted))
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = [self.conditions.safety_factor * torque / (self.count * gain)
                       for torque, gain in zip(torques, gains, strict=True)]  # fmt: skip
            lengths.append(0.5 * MOUNTING * muscle.outer_diameter(contracted) / ratio)
        possible = (ratio > 0.0) & (gains[0] > 0.0) & (gains[1] > 0.0)
        return np.where(possible, np.array(lengths), math.inf)

    def _best(self, muscle: StaticMuscle) -> tuple[float, float, float]:
        """Shortest length [m] and its contractions, extended and contracted. Raises SolveError, with the reason."""
        low, high = muscle.contraction_range
        extended = contracted = np.linspace(low, high, GRID)
        for _ in range(ZOOMS + 1):
            lengths = self.needed(muscle, extended, contracted)
            i, k = np.unravel_index(int(np.argmin(lengths)), lengths.shape)
            best = float(lengths[i, k]), float(extended[i]), float(contracted[k])
            if not math.isfinite(best[0]):
                raise SolveError(
                    f"at {muscle.pressure_range[1] / 1e5:.4g} bar, the contracted muscle is not stronger than the "
                    f"extended one at {muscle.pressure_range[0] / 1e5:.4g} bar, at any contraction"
                )
            extended, contracted = _around(extended, int(i), low, high), _around(contracted, int(k), low, high)
        return best

    def required_length(self, muscle: StaticMuscle) -> float:
        """Shortest length [m] for a law that does not depend on it. Raises SolveError, with the reason."""
        return self._best(muscle)[0]

    def design(self, muscle: StaticMuscle, length: float) -> MuscleDesign | None:
        """The design of least radius with this length [m]; None if it does not meet the requirement."""
        shortest, extended, contracted = self._best(muscle)
        if length < shortest * (1.0 - ROUNDING):
            return None
        if length > shortest * (1.0 + ROUNDING):
            pairs = self._pairs(muscle, length)
            extended, contracted = (float(each[np.argmin(pairs[1] - pairs[0])]) for each in pairs)
        radius = self._radius(length, contracted - extended)
        return self._design(muscle, extended, contracted, radius, self.radii(muscle, MARGIN * length))

    def _radius(self, length: float, contraction: float) -> float:
        return contraction * length / self.requirement.angle

    def _pairs(self, muscle: StaticMuscle, length: float) -> tuple[Array, Array]:
        """Pairs of contractions of the grid with which a length meets the requirement; the best one without any."""
        grid = np.linspace(*muscle.contraction_range, GRID)
        rows, columns = np.nonzero(self.needed(muscle, grid, grid) <= length)
        if not rows.size:  # the region is smaller than the grid
            _, extended, contracted = self._best(muscle)
            return np.array([extended]), np.array([contracted])
        return grid[rows], grid[columns]

    def radii(self, muscle: StaticMuscle, length: float) -> tuple[float, float]:
        """Minimum and maximum pulley radius [m] with this length [m], on the grid of contractions."""
        extended, contracted = self._pairs(muscle, length)
        used = contracted - extended
        return self._radius(length, float(used.min())), self._radius(length, float(used.max()))

    def _design(
        self, muscle: StaticMuscle, extended: float, contracted: float, radius: float, radii: tuple[float, float]
    ) -> MuscleDesign:
        low = muscle.pressure_range[0]
        rest = EndPoint(low, extended, float(muscle.floor(extended)), float(muscle.capacity(extended)))
        arm, (torque, accelerating) = self.count * radius, self._torques
        pulling = muscle.end_point(contracted, rest.force + torque / arm)
        factors = (
            arm * (pulling.capacity - rest.force) / torque,
            arm * (rest.capacity - float(muscle.floor(contracted))) / accelerating,
        )
        return MuscleDesign(rest, pulling, min(factors) - 1.0, radius, radii)

    def shortfall(self, muscle: StaticMuscle, length: float) -> str:
        """Reason why a length [m] is not sufficient."""
        shortest, extended, contracted = self._best(muscle)
        lengths = self._needed_of_each(muscle, np.array([extended]), np.array([contracted])).ravel()
        limiting = int(np.argmax(lengths[:2]))  # the muscle whose torque determines the shortest length
        if lengths[2] > lengths[limiting]:
            return (
                f"with {1e3 * length:.4g} mm, the pulley has a radius of at most "
                f"{1e3 * self._radius(length, contracted - extended):.4g} mm; the muscles on both sides, "
                f"{1e3 * float(muscle.outer_diameter(np.array(contracted))):.4g} mm thick at pressure, need "
                f"{1e3 * self._radius(shortest, contracted - extended):.4g} mm"
            )
        needed = self.conditions.safety_factor * self._torques[limiting]
        reached = needed * length / shortest  # the needed length is proportional to the torque
        inertia = " with that of the inertia" if limiting else ""
        return (
            f"with {1e3 * length:.4g} mm, the torque at the ends is at most {reached:.4g} N m; {needed:.4g} N m is "
            f"needed{inertia}"
        )


def _around(grid: Array, index: int, low: float, high: float) -> Array:
    """A finer grid around a point of a grid, within the limits."""
    step = float(grid[1] - grid[0])
    return np.linspace(max(low, grid[index] - step), min(high, grid[index] + step), ZOOM_GRID)
