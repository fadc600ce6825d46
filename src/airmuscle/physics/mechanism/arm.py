"""Arm (interface): links in series with a joint each, and the routes of muscles over these joints."""

import abc
from collections.abc import Sequence
from typing import Any

from ...core import ParameterError, Value, Values, check_structure, model, parameter
from .base import Coordinate, Mechanism
from .pulley_profile import ConstantRadius, PulleyProfile

Matrix = list[list[Value]]


@model
class MuscleRoute:
    """Route of a muscle over the joints of an arm: eps = eps_0 + sum_k r_k F_k(theta_k)/L0.

    `joints` are the numbers of the joints that the muscle crosses, from 1; one for a monoarticular, two for a
    biarticular muscle. r_k moment arm at joint angle 0, positive if the muscle increases the angle; F_k integral of the
    pulley profile. `profiles` is empty for circular pulleys, otherwise it has one profile for each joint.
    """

    joints: tuple[int, ...]
    radii: tuple[float, ...] = parameter("m", "r_k", "moment arm at each joint at angle 0", bounds=(-10.0, 10.0))
    offset: float = parameter("1", "eps_0", "contraction with all joints at angle 0", bounds=(-0.5, 0.9), default=0.0)
    profiles: tuple[PulleyProfile, ...] = ()

    def check(self) -> None:
        if not self.joints or len(set(self.joints)) < len(self.joints) or min(self.joints) < 1:
            raise ParameterError(
                f"MuscleRoute: joints is {self.joints}; it must contain different joint numbers, counted from 1."
            )
        if len(self.radii) != len(self.joints) or len(self.profiles) not in (0, len(self.joints)):
            raise ParameterError(
                f"MuscleRoute: {len(self.joints)} joints, {len(self.radii)} radii and {len(self.profiles)} profiles "
                "are given; give one radius for each joint, and one profile for each or no profiles."
            )

    def shortening(self, angles: Sequence[Value]) -> Value:
        """Shortening [m] of the muscle from all joints at angle 0, at the joint angles [rad] of the arm."""
        profiles = self.profiles or (ConstantRadius(),) * len(self.joints)
        parts = zip(self.joints, self.radii, profiles, strict=True)
        return sum(radius * profile.integral(angles[joint - 1]) for joint, radius, profile in parts)


class Arm(Mechanism):
    """Mechanism of links in series; coordinates joint1.angle, ...; muscles along their routes (interface).

    A link has the fields damping [N m s/rad], min_angle and max_angle [rad] of its joint.
    """

    links: tuple[Any, ...]
    routes: tuple[MuscleRoute, ...]

    def check(self) -> None:
        check_structure(self)
        name = type(self).__name__
        if not self.links or not self.routes:
            raise ParameterError(
                f"{name}: {len(self.links)} links and {len(self.routes)} routes are given; give one link for each "
                "joint and one route for each muscle."
            )
        for number, route in enumerate(self.routes, start=1):
            if max(route.joints) > len(self.links):
                raise ParameterError(
                    f"{name}: route {number} crosses joint {max(route.joints)}; allowed range: 1 to "
                    f"{len(self.links)}. Give another link, or another joint number."
                )

    @property
    def muscle_count(self) -> int | None:
        return len(self.routes)

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return tuple(
            Coordinate(f"joint{i}.angle", f"joint{i}.angular_speed", "rad", 0.1, 1.0, link.min_angle, link.max_angle)
            for i, link in enumerate(self.links, start=1)
        )

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        angles = self._angles(q)
        return tuple(
            route.offset + route.shortening(angles) / length
            for route, length in zip(self.routes, resting_lengths, strict=True)
        )

    @abc.abstractmethod
    def mass_matrix(self, q: Values) -> Matrix:
        """Mass matrix M [kg m^2] in the joint angles, n rows of n values; symmetric and positive definite."""

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        return sum(link.damping * v[c.speed] ** 2 for c, link in zip(self.coordinates, self.links, strict=True))

    def _angles(self, q: Values) -> list[Value]:
        return [q[c.name] for c in self.coordinates]


def solve_positive_definite(matrix: Sequence[Sequence[Value]], right: Sequence[Value]) -> list[Value]:
    """Return x of A x = b by the factorisation A = L D L^T without pivoting; A is symmetric and positive definite.

    The values may be numbers, arrays or symbols.
    """
    count = len(right)
    lower: list[list[Value]] = [[0.0] * count for _ in range(count)]
    diagonal: list[Value] = []
    for j in range(count):
        diagonal.append(matrix[j][j] - sum(lower[j][k] ** 2 * diagonal[k] for k in range(j)))
        for i in range(j + 1, count):
            known = sum(lower[i][k] * lower[j][k] * diagonal[k] for k in range(j))
            lower[i][j] = (matrix[i][j] - known) / diagonal[j]
    y: list[Value] = []
    for i in range(count):
        y.append(right[i] - sum(lower[i][k] * y[k] for k in range(i)))
    x = [value / pivot for value, pivot in zip(y, diagonal, strict=True)]
    for i in reversed(range(count)):
        x[i] = x[i] - sum(lower[k][i] * x[k] for k in range(i + 1, count))
    return x
