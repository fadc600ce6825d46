"""Torque of a joint: torque and stiffness of each muscle as traced functions; limits of taut muscles."""

import dataclasses
import functools
from typing import Any

import numpy as np

from ...core import Array, ArrayProgram, ParameterError, Value, Values, make_program
from ...engine.compile.function import LanesFunction
from ..muscle import ElasticSeriesElement, Muscle
from ..plant.plant import Plant
from ..pneumatics.gas import absolute_pressure
from .static_stiffness import enclosed_pressure_slope

QUANTITIES = (
    "torque",
    "stiffness",
    "torque_by_pressure",
    "stiffness_by_pressure",
    "tension",
    "shut_valves",
    "moment_arm",
)
"""Quantities of a muscle of a joint: torque Q [N m], -dQ/dtheta at constant pressure [N m/rad], their derivatives with
respect to the pressure, tension [N], -dQ/dtheta with closed valves, that is, at constant air mass [N m/rad], and moment
arm [m]."""


@dataclasses.dataclass(frozen=True, eq=False)
class TracedRow:
    """Function of one or two arguments with several outputs, evaluated on arrays; `names` are those of the outputs."""

    function: Any
    names: tuple[str, ...]
    programs: dict[tuple[str, ...], ArrayProgram | None] = dataclasses.field(default_factory=dict)

    def __call__(self, *arguments: Array, names: tuple[str, ...] = ()) -> list[Array]:
        """The named outputs, by default all, at arguments that broadcast."""
        names = names or self.names
        columns = [self.names.index(name) for name in names]
        if names not in self.programs:
            self.programs[names] = make_program(self.function, 0, columns)
        broadcast = np.broadcast_arrays(*arguments)
        points = [np.ascontiguousarray(x, dtype=float).reshape(-1) for x in broadcast]
        program = self.programs[names]
        if program is not None:
            table = program.columns(points, (), len(columns)).T
        else:
            table = np.asarray(self.function(*(x[None, :] for x in points)).full())
            table = table.reshape(len(self.names), -1, order="F")[columns]
        return [row.reshape(broadcast[0].shape) for row in table]


@dataclasses.dataclass(frozen=True, eq=False)
class TorqueFunction:
    """Torque of one muscle as a traced function of angle [rad] and gauge pressure [Pa].

    `affine` is whether the torque is affine in the pressure.
    """

    row: TracedRow
    affine: bool

    def __call__(self, angle: Array, pressure: Array, *names: str) -> list[Array]:
        """The named QUANTITIES at angles and pressures that broadcast."""
        return self.row(angle, pressure, names=names)

    @functools.cached_property
    def compiled(self) -> LanesFunction:
        """The first five QUANTITIES, up to the tension, compiled for several points at once."""
        import casadi

        angle, pressure = casadi.SX.sym("angle"), casadi.SX.sym("pressure")
        values = self.row.function(angle, pressure)[: QUANTITIES.index("tension") + 1]
        return LanesFunction({"angle": angle, "pressure": pressure}, {"values": values.T})


def check_joint(plant: Plant) -> None:
    """Raise ParameterError unless a plant is a joint: one angle, two muscles without series springs."""
    coordinates, muscles = plant.mechanism.coordinates, plant.muscles
    owner = type(plant.mechanism).__name__
    if len(coordinates) != 1 or coordinates[0].unit != "rad" or len(muscles) != 2:
        raise ParameterError(
            f"joint_statics: {owner} has {len(coordinates)} coordinates "
            f"({', '.join(c.name for c in coordinates) or 'none'}) and the plant {len(muscles)} muscles; one angle and "
            "two muscles are required, such as an AntagonisticJoint. For other plants use find_equilibria and "
            "stiffness."
        )
    for muscle in muscles:
        if isinstance(muscle.series, ElasticSeriesElement):
            raise ParameterError(
                f"joint_statics: {muscle.name} has a series spring; only muscles with a RigidSeriesElement are "
                "allowed. Use find_equilibria, or replace the series spring."
            )


def torque_functions(plant: Plant, *, limited: bool = True) -> tuple[TorqueFunction, ...]:
    """The torque function of each muscle of a joint; without the limits of the force laws unless `limited`."""
    return tuple(_torque_function(plant, index, limited) for index in range(len(plant.muscles)))


def load_function(plant: Plant) -> TracedRow:
    """The torque [N m] of weights, springs and stops against the angle [rad], and its derivative."""
    import casadi

    angle = casadi.SX.sym("angle")
    energy = casadi.SX(plant.mechanism.potential_energy({plant.mechanism.coordinates[0].name: angle}))
    torque = casadi.jacobian(energy, angle)
    row = casadi.horzcat(torque, casadi.jacobian(torque, angle))
    return TracedRow(casadi.Function("load", [angle], [casadi.densify(row)]), ("torque", "slope"))


def _torque_function(plant: Plant, index: int, limited: bool) -> TorqueFunction:
    import casadi

    angle, pressure = casadi.SX.sym("angle"), casadi.SX.sym("pressure")
    q = {plant.mechanism.coordinates[0].name: angle}
    muscle, contraction = plant.muscles[index], plant.mechanism.contractions(q, plant.resting_lengths)[index]
    length = muscle.geometry.resting_length
    arm = casadi.jacobian(casadi.SX(length * contraction), angle)
    tension = casadi.SX(muscle.tension(pressure, contraction) if limited else _unlimited(muscle, pressure, contraction))
    torque = arm * tension
    stiffness = -casadi.jacobian(torque, angle)
    by_pressure = casadi.jacobian(torque, pressure)
    squeezed = by_pressure * _pressure_slope(plant, muscle, pressure, contraction) * arm / length
    row = casadi.horzcat(
        torque, stiffness, by_pressure, casadi.jacobian(stiffness, pressure), tension, stiffness - squeezed, arm
    )
    function = casadi.Function("torque", [angle, pressure], [casadi.densify(casadi.cse(row))])
    affine = not any(casadi.which_depends(by_pressure, pressure, 1, False))
    return TorqueFunction(TracedRow(function, QUANTITIES), affine)


def _unlimited(muscle: Muscle, pressure: Value, contraction: Value) -> Value:
    """Static tension [N] before limits of the law and of slackness are applied."""
    length = muscle.geometry.resting_length
    return (
        muscle.contractile.unclamped_force(pressure, contraction)
        - muscle.spring.force(pressure, contraction, length)
        - muscle.stop.force(contraction, 0.0, length)
    )


def _pressure_slope(plant: Plant, muscle: Muscle, pressure: Value, contraction: Value) -> Value:
    """dp/deps [Pa] of the air that is enclosed at a pressure, with the wall in steady state."""
    own: Values = muscle.steady_state(pressure, contraction)
    volume = muscle.volume(contraction, own)
    content = plant.gas.state_at(absolute_pressure(pressure, plant.ambient), volume, plant.ambient)
    air = plant.gas.air(content, volume, plant.ambient)
    return enclosed_pressure_slope(plant, muscle, contraction, volume, air, content)


LEVELS = 129
"""Number of pressures of each muscle at which the reachable stiffnesses are evaluated (chosen)."""
BISECTIONS = 50
"""Bisections of the pressure at which a muscle becomes taut; they reach rounding precision."""


def taut_branch(function: TorqueFunction, angle: Array, levels: Array) -> tuple[Array, Array]:
    """Torque and stiffness (N, LEVELS) at pressures from that at which the muscle becomes taut, to the maximum."""
    (tension,) = function(angle[:, None], levels, "tension")
    taut = tension > 0.0
    slack = np.where(taut.any(axis=1), taut.argmax(axis=1), 0)
    start = _first_taut(function, angle, levels[np.maximum(slack - 1, 0)], levels[slack])
    inner = start[:, None] + np.linspace(0.0, 1.0, LEVELS) * (levels[-1] - start)[:, None]
    torque, stiffness = function(angle[:, None], inner, "torque", "stiffness")
    invalid = (~taut.any(axis=1)).reshape(-1, 1)
    return np.where(invalid, np.nan, torque), np.where(invalid, np.nan, stiffness)


def _first_taut(function: TorqueFunction, angle: Array, low: Array, high: Array) -> Array:
    """Least pressure (N,) at which a muscle is taut, by bisection from a slack one to a taut one.

    It is on the taut side, because the stiffness of a slack muscle is zero.
    """
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        taut = function(angle, middle, "tension")[0] > 0.0
        low, high = np.where(taut, low, middle), np.where(taut, middle, high)
    return high


def stiffness_range(pairs: list[tuple[Array, Array]], row: int, torque: float) -> tuple[float, float]:
    """Extreme stiffnesses along the pressures of two taut muscles whose torques sum to `torque`; NaN without one."""
    sums = []
    for (own, own_k), (other, other_k) in (pairs, pairs[::-1]):
        order = np.argsort(other[row])
        x, k = other[row][order], other_k[row][order]
        needed = torque - own[row]
        inside = (needed >= x[0]) & (needed <= x[-1])
        sums.append(own_k[row][inside] + np.interp(needed[inside], x, k))
    both = np.concatenate(sums)
    return (float(both.min()), float(both.max())) if both.size else (np.nan, np.nan)
