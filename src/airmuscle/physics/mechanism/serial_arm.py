"""Serial arm: links in space whose joints turn about any axes of their frames."""

from typing import NamedTuple

from ...core import ParameterError, Value, Values, model, ops, parameter
from .base import angle_limit, gravity_parameter
from .planar_arm import Arm, Matrix, MuscleRoute, solve_positive_definite

Vector = tuple[Value, Value, Value]
ROUNDING = 0.1
"""Force [N] across an axis below which its size is rounded (chosen)."""
AXES = {(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)}


@model
class SpatialLink:
    """Rigid link of a serial arm, with the joint at its origin.

    The frame of a link coincides in direction with that of the link before it where the joint angle
    is `zero_angle`; there, the joint turns about `axis`, one of the axes x, y, z of both frames or
    its opposite.
    """

    axis: tuple[int, int, int]
    position: tuple[float, ...] = parameter(
        "m",
        "p",
        "position of the joint in the frame of the link before",
        bounds=(-100.0, 100.0),
        fitted=False,
        default=(0.0, 0.0, 0.0),
    )
    mass: float = parameter("kg", "m", "mass of the link", bounds=(0.0, 1e5), default=0.0)
    centre: tuple[float, ...] = parameter(
        "m",
        "c",
        "centre of mass in the frame of the link",
        bounds=(-100.0, 100.0),
        default=(0.0, 0.0, 0.0),
    )
    inertia: float = parameter(
        "kg m^2",
        "I_c",
        "moment of inertia about every axis through the centre of mass",
        bounds=(0.0, 1e5),
        default=0.0,
    )
    rotor_inertia: float = parameter(
        "kg m^2",
        "J",
        "moment of inertia that turns with this joint alone, of pulleys, tendons and muscles",
        bounds=(0.0, 1e5),
        default=0.0,
    )
    damping: float = parameter(
        "N m s/rad", "b", "viscous friction of the joint", bounds=(0.0, 1e5), default=0.0
    )
    zero_angle: float = parameter(
        "rad",
        "theta_0",
        "joint angle at which both frames have the same directions",
        bounds=(-10.0, 10.0),
        default=0.0,
    )
    min_angle: float = angle_limit("theta_min", "lower limit of the joint angle", -ops.pi)
    max_angle: float = angle_limit("theta_max", "upper limit of the joint angle", ops.pi)

    def check(self) -> None:
        if self.axis not in AXES:
            raise ParameterError(
                f"SpatialLink: axis is {self.axis}; it must be (1, 0, 0), (0, 1, 0), (0, 0, 1) or"
                " the opposite of one."
            )
        for name in ("position", "centre"):
            if len(getattr(self, name)) != 3:
                raise ParameterError(
                    f"SpatialLink: {name} has {len(getattr(self, name))} numbers; give x, y and z."
                )
        if self.mass == 0.0 and self.rotor_inertia == 0.0:
            raise ParameterError(
                "SpatialLink: mass and rotor_inertia are 0; give at least one of them."
            )


class _Posture(NamedTuple):
    """Unit vectors of the joint axes, origins and centres of mass [m] in the frame of the base."""

    axes: list[Vector]
    origins: list[Vector]
    centres: list[Vector]


@model
class SerialArm(Arm):
    """Serial arm of n links in space: M(theta) theta'' + h(theta, theta') = J^T F - b theta'.

        M_ij = sum_k m_k (a_i x (c_k - o_i)) . (a_j x (c_k - o_j)) + I_k a_i . a_j,   k >= max(i,
            j),   M_ii also + J_i
        h_i  = sum_k m_k (a_i x (c_k - o_i)) . (A_k - g) + I_k a_i . alpha_k,         k >= i

    a_i axis, o_i origin of joint i, c_k centre of mass of link k, all in the frame of the base,
    whose z axis points upwards; A_k acceleration of the centre and alpha_k angular acceleration of
    link k at theta'' = 0. The tensor of inertia of a link is isotropic, so that it has no
    gyroscopic torque; a slender link is a mass at its centre. J the Jacobian of the muscle
    shortenings along the routes. Derivation: virtual power of the forces of inertia.
    """

    links: tuple[SpatialLink, ...]
    routes: tuple[MuscleRoute, ...]
    gravity: float = gravity_parameter()

    def mass_matrix(self, q: Values) -> Matrix:
        return self._mass_matrix(self._posture(q))

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        at = self._posture(q)
        bias = self._torques(at, [v[c.speed] for c in self.coordinates], [0.0] * len(self.links))
        right = [forces[c.name] - torque for c, torque in zip(self.coordinates, bias, strict=True)]
        solved = solve_positive_definite(self._mass_matrix(at), right)
        return {c.name: value for c, value in zip(self.coordinates, solved, strict=True)}

    def inverse_dynamics(self, q: Values, v: Values, accelerations: Values) -> dict[str, Value]:
        """Torque [N m] on each joint that gives it the acceleration [rad/s^2], by the name of its
        angle.
        """
        speeds = [v[c.speed] for c in self.coordinates]
        torques = self._torques(
            self._posture(q), speeds, [accelerations[c.name] for c in self.coordinates]
        )
        return {c.name: torque for c, torque in zip(self.coordinates, torques, strict=True)}

    def bearing_force(
        self, joint: int, q: Values, v: Values, accelerations: Values
    ) -> tuple[Value, Value]:
        """Force [N] across and along the axis of a joint, from 0, that carries and accelerates the
        links beyond it.
        """
        at = self._posture(q)
        total = (0.0, 0.0, 0.0)
        columns = [(v[c.speed], accelerations[c.name]) for c in self.coordinates]
        moving, _ = self._accelerations(at, *map(list, zip(*columns, strict=True)))
        for link, acceleration in zip(self.links[joint:], moving[joint:], strict=True):
            total = _plus(total, _scaled(link.mass, _plus(acceleration, (0.0, 0.0, self.gravity))))
        across = _cross(at.axes[joint], total)
        axis = at.axes[joint]
        return ops.sqrt(_dot(across, across) + ROUNDING**2), ops.absolute_value(_dot(axis, total))

    def _torques(
        self, at: _Posture, speeds: list[Value], joint_accelerations: list[Value]
    ) -> list[Value]:
        """Torques on the joints: inertia, weight and viscous friction."""
        accelerations, spins = self._accelerations(at, speeds, joint_accelerations)
        torques = []
        count = len(self.links)
        for i, link in enumerate(self.links):
            torque = link.rotor_inertia * joint_accelerations[i] + link.damping * speeds[i]
            for k in range(i, count):
                force = _scaled(
                    self.links[k].mass, _plus(accelerations[k], (0.0, 0.0, self.gravity))
                )
                torque += _dot(_lever(at, i, k), force) + self.links[k].inertia * _dot(
                    at.axes[i], spins[k]
                )
            torques.append(torque)
        return torques

    def potential_energy(self, q: Values) -> Value:
        centres = self._posture(q).centres
        return sum(
            link.mass * self.gravity * c[2] for link, c in zip(self.links, centres, strict=True)
        )

    def _posture(self, q: Values) -> _Posture:
        columns: list[Vector] = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        origin: Vector = (0.0, 0.0, 0.0)
        at = _Posture([], [], [])
        for link, angle in zip(self.links, self._angles(q), strict=True):
            at.axes.append(_combined(columns, link.axis))
            origin = _plus(origin, _combined(columns, link.position))
            columns = _turned(columns, link.axis, angle - link.zero_angle)
            at.origins.append(origin)
            at.centres.append(_plus(origin, _combined(columns, link.centre)))
        return at

    def _mass_matrix(self, at: _Posture) -> Matrix:
        count = len(self.links)
        matrix: Matrix = [[0.0] * count for _ in range(count)]
        for k, link in enumerate(self.links):
            levers = [_lever(at, i, k) for i in range(k + 1)]
            for i in range(k + 1):
                for j in range(i + 1):
                    matrix[i][j] += link.mass * _dot(levers[i], levers[j])
                    matrix[i][j] += link.inertia * _dot(at.axes[i], at.axes[j])
        for i, link in enumerate(self.links):
            matrix[i][i] += link.rotor_inertia
            for j in range(i):
                matrix[j][i] = matrix[i][j]
        return matrix

    def _accelerations(
        self, at: _Posture, speeds: list[Value], joint_accelerations: list[Value]
    ) -> tuple[list[Vector], list[Vector]]:
        """Accelerations of the centres of mass and of the rotation of each link."""
        zero: Vector = (0.0, 0.0, 0.0)
        turning = zero
        spin = zero
        moving = zero
        before = zero
        accelerations = []
        spins = []
        for axis, origin, centre, speed, acceleration in zip(
            *at, speeds, joint_accelerations, strict=True
        ):
            moving = _plus(moving, _rigid(turning, spin, _minus(origin, before)))
            own = _scaled(speed, axis)
            spin = _plus(_plus(spin, _cross(turning, own)), _scaled(acceleration, axis))
            turning = _plus(turning, own)
            before = origin
            accelerations.append(_plus(moving, _rigid(turning, spin, _minus(centre, origin))))
            spins.append(spin)
        return accelerations, spins


def _lever(at: _Posture, joint: int, link: int) -> Vector:
    """Speed of the centre of a link per speed of a joint."""
    return _cross(at.axes[joint], _minus(at.centres[link], at.origins[joint]))


def _rigid(turning: Vector, spin: Vector, arm: Vector) -> Vector:
    """Acceleration across an arm of a body that turns."""
    return _plus(_cross(spin, arm), _cross(turning, _cross(turning, arm)))


def _turned(columns: list[Vector], axis: tuple[int, int, int], angle: Value) -> list[Vector]:
    """The unit vectors of a frame after a rotation about one of them."""
    place = next(i for i, component in enumerate(axis) if component)
    first = (place + 1) % 3
    second = (place + 2) % 3
    cosine = ops.cos(angle)
    sine = axis[place] * ops.sin(angle)
    turned = list(columns)
    turned[first] = _plus(_scaled(cosine, columns[first]), _scaled(sine, columns[second]))
    turned[second] = _minus(_scaled(cosine, columns[second]), _scaled(sine, columns[first]))
    return turned


def _combined(columns: list[Vector], components: tuple[Value, ...]) -> Vector:
    x, y, z = (_scaled(s, column) for s, column in zip(components, columns, strict=True))
    return _plus(_plus(x, y), z)


def _plus(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _scaled(s: Value, a: Vector) -> Vector:
    return (s * a[0], s * a[1], s * a[2])


def _dot(a: Vector, b: Vector) -> Value:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
