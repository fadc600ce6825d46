"""Arms: links in series with the routes of muscles over their joints, and the planar arm in a
vertical plane.
"""

import abc
import itertools
from collections.abc import Sequence
from typing import Any

from ...core import ParameterError, Value, Values, model, ops, parameter
from .antagonistic_joint import ConstantRadius, PulleyProfile
from .base import Coordinate, Mechanism, angle_limit, gravity_parameter

Matrix = list[list[Value]]


@model
class MuscleRoute:
    """Route of a muscle over the joints of an arm: eps = eps_0 + sum_k r_k F_k(theta_k)/L0.

    `joints` are the numbers of the joints that the muscle crosses, from 1; one for a monoarticular,
    two for a biarticular muscle. r_k moment arm at joint angle 0, positive if the muscle increases
    the angle; F_k integral of the pulley profile. `profiles` is empty for circular pulleys,
    otherwise it has one profile for each joint.
    """

    joints: tuple[int, ...]
    radii: tuple[float, ...] = parameter(
        "m", "r_k", "moment arm at each joint at angle 0", bounds=(-10.0, 10.0)
    )
    offset: float = parameter(
        "1", "eps_0", "contraction with all joints at angle 0", bounds=(-0.5, 0.9), default=0.0
    )
    profiles: tuple[PulleyProfile, ...] = ()

    def check(self) -> None:
        if not self.joints or len(set(self.joints)) < len(self.joints) or min(self.joints) < 1:
            raise ParameterError(
                f"MuscleRoute: joints is {self.joints}; it must contain different joint numbers,"
                " counted from 1."
            )
        if len(self.radii) != len(self.joints) or len(self.profiles) not in (0, len(self.joints)):
            raise ParameterError(
                f"MuscleRoute: {len(self.joints)} joints, {len(self.radii)} radii and"
                f" {len(self.profiles)} profiles are given; give one radius for each joint, and one"
                " profile for each or no profiles."
            )

    def shortening(self, angles: Sequence[Value]) -> Value:
        """Shortening [m] of the muscle from all joints at angle 0, at the joint angles [rad] of the
        arm.
        """
        profiles = self.profiles or (ConstantRadius(),) * len(self.joints)
        parts = zip(self.joints, self.radii, profiles, strict=True)
        return sum(radius * profile.integral(angles[joint - 1]) for joint, radius, profile in parts)


class Arm(Mechanism):
    """Mechanism of links in series; coordinates joint1.angle, ...; muscles along their routes
    (interface).

    A link has the fields damping [N m s/rad], min_angle and max_angle [rad] of its joint.
    """

    links: tuple[Any, ...]
    routes: tuple[MuscleRoute, ...]

    def check(self) -> None:
        name = type(self).__name__
        if not self.links or not self.routes:
            raise ParameterError(
                f"{name}: {len(self.links)} links and {len(self.routes)} routes are given; give one"
                " link for each joint and one route for each muscle."
            )
        for number, route in enumerate(self.routes, start=1):
            if max(route.joints) > len(self.links):
                raise ParameterError(
                    f"{name}: route {number} crosses joint {max(route.joints)}; allowed range: 1 to"
                    f" {len(self.links)}. Give another link, or another joint number."
                )

    @property
    def muscle_count(self) -> int | None:
        return len(self.routes)

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return tuple(
            Coordinate(
                f"joint{i}.angle",
                f"joint{i}.angular_speed",
                "rad",
                0.1,
                1.0,
                link.min_angle,
                link.max_angle,
            )
            for i, link in enumerate(self.links, start=1)
        )

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        angles = self._angles(q)
        muscles = zip(self.routes, resting_lengths, strict=True)
        return tuple(route.offset + route.shortening(angles) / length for route, length in muscles)

    @abc.abstractmethod
    def mass_matrix(self, q: Values) -> Matrix:
        """Mass matrix M [kg m^2] in the joint angles, n rows of n values; symmetric and positive
        definite.
        """

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        return _energy(self.mass_matrix(q), [v[c.speed] for c in self.coordinates])

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        return sum(
            link.damping * v[c.speed] ** 2
            for c, link in zip(self.coordinates, self.links, strict=True)
        )

    def _angles(self, q: Values) -> list[Value]:
        return [q[c.name] for c in self.coordinates]


def _energy(matrix: Matrix, speeds: Sequence[Value]) -> Value:
    """Kinetic energy [J] of a mass matrix at speeds."""
    count = range(len(speeds))
    return 0.5 * sum(matrix[i][j] * speeds[i] * speeds[j] for i in count for j in count)


def solve_positive_definite(
    matrix: Sequence[Sequence[Value]], right: Sequence[Value]
) -> list[Value]:
    """Return x of A x = b by the factorisation A = L D L^T without pivoting; A is symmetric and
    positive definite.

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


@model
class ArmLink:
    """Rigid link of an arm, with the joint at its upper end."""

    length: float = parameter("m", "l", "distance of the joints at both ends", bounds=(1e-3, 100.0))
    mass: float = parameter("kg", "m", "mass of the link", bounds=(1e-6, 1e5))
    centre: float = parameter(
        "m", "l_c", "distance of the centre of mass from the joint", bounds=(0.0, 100.0)
    )
    inertia: float = parameter(
        "kg m^2",
        "I_c",
        "moment of inertia about the centre of mass",
        bounds=(0.0, 1e5),
        default=0.0,
    )
    damping: float = parameter(
        "N m s/rad", "b", "viscous friction of the joint", bounds=(0.0, 1e5), default=0.0
    )
    min_angle: float = angle_limit("theta_min", "lower limit of the joint angle", -ops.pi)
    max_angle: float = angle_limit("theta_max", "upper limit of the joint angle", ops.pi)

    def check(self) -> None:
        if not self.inertia + self.mass * self.centre**2 > 0.0:
            raise ParameterError(
                "ArmLink: the moment of inertia about the joint is zero; give centre or inertia."
            )


@model
class PlanarArm(Arm):
    """Planar arm of n links: M(theta) theta'' + h(theta, theta') = J^T F - b theta', J from the
    muscle routes.

        phi_i = theta_1 + ... + theta_i,   Q_i of the link angles = tau_i - tau_(i+1)
        sum_j A_ij cos(phi_i - phi_j) phi_j'' + A_ij sin(phi_i - phi_j) phi_j'^2 = Q_i - g B_i sin
            phi_i

    theta_i angle of joint i, the angle of link i relative to link i-1; phi_i angle of link i from
    the vertical, 0 where it hangs downwards. A_ii = I_i + m_i l_ci^2 + M_i l_i^2 with the mass M_i
    beyond link i and, for i < j, A_ij = l_i (m_j l_cj + M_j l_j); B_i = m_i l_ci + M_i l_i. The
    payload is a point mass at the tip. With gravity 0 the arm moves in a horizontal plane.
    Derivation: Lagrange's equations in the link angles, in which the kinetic energy depends on
    differences of angles only.
    """

    links: tuple[ArmLink, ...]
    routes: tuple[MuscleRoute, ...]
    payload: float = parameter("kg", "m_p", "point mass at the tip", bounds=(0.0, 1e5), default=0.0)
    gravity: float = gravity_parameter()

    def mass_matrix(self, q: Values) -> Matrix:
        inner = self._link_matrix(self._link_angles(q))
        count = len(self.links)
        places = range(count)
        return [
            [sum(inner[a][b] for a in places[i:] for b in places[j:]) for j in places]
            for i in places
        ]

    def tip(self, q: Values) -> tuple[Value, Value]:
        """Horizontal position and height [m] of the tip relative to the first joint."""
        pairs = list(zip(self.links, self._link_angles(q), strict=True))
        across = sum(link.length * ops.sin(angle) for link, angle in pairs)
        return across, -sum(link.length * ops.cos(angle) for link, angle in pairs)

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        angles = self._link_angles(q)
        speeds = self._link_speeds(v)
        count = len(angles)
        coupling = self._couplings()
        moments = self._mass_moments()
        pairs = zip(self.coordinates, self.links, strict=True)
        torques = [forces[c.name] - link.damping * v[c.speed] for c, link in pairs]
        right = []
        for i in range(count):
            terms = (
                coupling[i][j] * ops.sin(angles[i] - angles[j]) * speeds[j] ** 2
                for j in range(count)
                if j != i
            )
            beyond = torques[i + 1] if i + 1 < count else 0.0
            right.append(
                torques[i] - beyond - sum(terms) - self.gravity * moments[i] * ops.sin(angles[i])
            )
        links = solve_positive_definite(self._link_matrix(angles), right)
        joints = [links[0], *(links[i] - links[i - 1] for i in range(1, count))]
        return {c.name: value for c, value in zip(self.coordinates, joints, strict=True)}

    def potential_energy(self, q: Values) -> Value:
        pairs = zip(self._mass_moments(), self._link_angles(q), strict=True)
        return sum(self.gravity * moment * (1.0 - ops.cos(angle)) for moment, angle in pairs)

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        return _energy(self._link_matrix(self._link_angles(q)), self._link_speeds(v))

    def _link_angles(self, q: Values) -> list[Value]:
        return list(itertools.accumulate(self._angles(q)))

    def _link_speeds(self, v: Values) -> list[Value]:
        return list(itertools.accumulate(v[c.speed] for c in self.coordinates))

    def _masses_beyond(self) -> list[Value]:
        """Mass [kg] beyond each link, with the payload."""
        masses: list[Value] = [self.payload]
        for link in reversed(self.links[1:]):
            masses.append(masses[-1] + link.mass)
        return masses[::-1]

    def _mass_moments(self) -> list[Value]:
        """B_i = m_i l_ci + M_i l_i [kg m]."""
        pairs = zip(self.links, self._masses_beyond(), strict=True)
        return [link.mass * link.centre + beyond * link.length for link, beyond in pairs]

    def _couplings(self) -> Matrix:
        """A_ij [kg m^2]."""
        count = range(len(self.links))
        moments = self._mass_moments()
        beyond = self._masses_beyond()
        matrix = [[self.links[min(i, j)].length * moments[max(i, j)] for j in count] for i in count]
        for i, (link, mass) in enumerate(zip(self.links, beyond, strict=True)):
            matrix[i][i] = link.inertia + link.mass * link.centre**2 + mass * link.length**2
        return matrix

    def _link_matrix(self, angles: Sequence[Value]) -> Matrix:
        """A_ij cos(phi_i - phi_j) [kg m^2]."""
        a = self._couplings()
        count = range(len(angles))
        return [
            [a[i][j] * ops.cos(angles[i] - angles[j]) if i != j else a[i][i] for j in count]
            for i in count
        ]
