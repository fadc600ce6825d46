"""Statics of an antagonistic joint: pressures from angle, stiffness and load, the inverse of each,
and their figure.
"""

import dataclasses
from typing import Any

import numpy as np

from ...core import BLUE, RED, Array, ParameterError, ShortRepr, SolveError, new_figure
from ...recording import Recording
from ..muscle import ElasticSeriesElement
from ..plant.plant import Plant
from ..pneumatics.gas import gauge_pressure
from . import joint_torque
from .joint_torque import (
    LEVELS,
    RESIDUAL,
    TracedRow,
    affine_candidates,
    general_candidates,
    torque_functions,
)

ANGLES = 121
"""Number of angles of the reachable region (chosen)."""
PRESSURES = 25
"""Number of pressures of each muscle for the contour lines (chosen)."""
RESULTS = ("torque", "stiffness", "tension", "shut_valves")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class JointPoints(ShortRepr):
    """Static states of a joint, arrays (N, S): S solutions for each of N points, NaN where there
    are fewer.

    angle              joint angle [rad]
    pressures          (N, S, 2) gauge pressures [Pa] of the first and the second muscle
    tensions           (N, S, 2) tensions [N]
    constant_pressure  stiffness -dQ/dtheta of the muscles at constant pressure [N m/rad]
    shut_valves        the same with closed valves, at constant air mass [N m/rad]
    cocontraction      part of the torques of the two muscles that cancels [N m]: the smaller of
                       their magnitudes
    stable             1 where the joint is stable at constant pressure, with its weights and
                       springs, else 0
    """

    angle: Array
    pressures: Array
    tensions: Array
    constant_pressure: Array
    shut_valves: Array
    cocontraction: Array
    stable: Array

    @property
    def count(self) -> Array:
        """Number of solutions of each point (N,)."""
        return np.asarray(np.isfinite(self.angle).sum(axis=1))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class JointStatics(ShortRepr):
    """Statics of a plant with one angle and two muscles; made by `joint_statics`.

    The muscles carry the load and the torque dV/dtheta of the weights, springs and end stops of the
    mechanism, friction is relaxed. Stiffness is that of the muscles, as in
    `airmuscle.physics.stiffness`.
    """

    plant: Plant
    pressure_range: tuple[float, float]
    """Minimum and maximum gauge pressure [Pa] of both muscles."""
    torques: tuple[TracedRow, ...]
    unlimited: tuple[TracedRow, ...]
    load: TracedRow

    def pressures(self, angle: Any, stiffness: Any, load: Any = 0.0) -> JointPoints:
        """All pressures that give an angle [rad] and a stiffness at constant pressure [N m/rad]
        under a load [N m].

        The load is an external torque against the angle. The arguments are numbers or arrays (N,)
        that broadcast. Both muscles are taut: a slack muscle determines no pressure. A point
        without a solution has only NaN; `explain` states the reason. If the force laws are affine
        in the pressure there is at most one solution, in closed form; otherwise the plane of
        pressures is searched in 32 x 32 cells, so that two solutions within one cell may count as
        one, and refined by Newton's method to rounding. Raises ParameterError for values that are
        not finite.
        """
        angle, stiffness, load = _as_points("angle, stiffness and load", angle, stiffness, load)
        torque = self.load(angle, "torque")[0] + load
        affine = all(function.affine for function in self.unlimited)
        solve, functions = (
            (affine_candidates, self.unlimited) if affine else (general_candidates, self.torques)
        )
        pairs = solve(functions, self.pressure_range, angle, torque, stiffness)
        angles = np.broadcast_to(angle[:, None], pairs.shape[:2])
        return self._points(angles, pairs, torque[:, None], stiffness[:, None])

    def angles(self, pressures: tuple[Any, Any], load: Any = 0.0) -> JointPoints:
        """All equilibria at gauge pressures [Pa] of both muscles under a load [N m], by ascending
        angle.

        The arguments are numbers or arrays (N,) that broadcast. The angles of the mechanism at
        which both geometries are defined are searched in 128 steps and refined by bisection to
        rounding.
        """
        first, second, load = _as_points("pressures and load", *pressures, load)
        balanced = joint_torque.balanced_angles(
            self.torques, self.load, self.angle_range, (first, second), load
        )
        both = np.stack(
            [np.broadcast_to(p[:, None], balanced.shape) for p in (first, second)], axis=2
        )
        return self._points(balanced, np.where(np.isnan(balanced)[..., None], np.nan, both))

    def with_columns(self, recording: Recording) -> Recording:
        """A recording of the plant with torque, stiffness, shut_valves_stiffness and cocontraction
        as further columns.

        The torque is that of the recorded tensions, with damping and friction; the stiffnesses are
        those of the laws at the recorded angle and pressures, friction relaxed. Raises ColumnError
        without angle, pressures and forces.
        """
        angle = recording[self.plant.mechanism.coordinates[0].name]
        muscles = []
        torques = []
        for prefix, function in zip(self.plant.prefixes, self.torques, strict=True):
            pressure = recording[f"{prefix}pressure"]
            stiffness, shut, arm = function(
                angle, pressure, "stiffness", "shut_valves", "moment_arm"
            )
            muscles.append((stiffness, shut))
            torques.append(arm * recording[f"{prefix}force"])
        constant, shut = (sum(values) for values in zip(*muscles, strict=True))
        return recording.with_columns(
            torque=torques[0] + torques[1],
            stiffness=constant,
            shut_valves_stiffness=shut,
            cocontraction=np.minimum(np.abs(torques[0]), np.abs(torques[1])),
        )

    def check_reachable(self, angle: Any, stiffness: Any, load: Any = 0.0) -> JointPoints:
        """The result of `pressures`. Raises SolveError, with what is reachable, for the first point
        without one.
        """
        points = self.pressures(angle, stiffness, load)
        values = _as_points("angle, stiffness and load", angle, stiffness, load)
        for row in np.flatnonzero(points.count == 0):
            raise SolveError(self.explain(*(float(v[row]) for v in values)))
        return points

    def torque_limits(self, angle: Any) -> tuple[Array, Array]:
        """Minimum and maximum load [N m] that both muscles can carry at an angle [rad], arrays
        (N,).
        """
        (angle,) = _as_points("angle", angle)
        levels = np.linspace(*self.pressure_range, LEVELS)
        first, second = (function(angle[:, None], levels, "torque")[0] for function in self.torques)
        weight = self.load(angle, "torque")[0]
        return (
            first.min(axis=1) + second.min(axis=1) - weight,
            first.max(axis=1) + second.max(axis=1) - weight,
        )

    def stiffness_limits(self, angle: Any, load: Any = 0.0) -> tuple[Array, Array]:
        """Minimum and maximum stiffness at constant pressure [N m/rad] at an angle [rad] under a
        load [N m].

        Arrays (N,); NaN where taut muscles cannot balance the load. Linear interpolation between
        129 pressures of each muscle; exact for laws that are affine in the pressure. An upper limit
        of the force of such a law is ignored.
        """
        angle, load = _as_points("angle and load", angle, load)
        torque = self.load(angle, "torque")[0] + load
        functions = self.unlimited if all(f.affine for f in self.unlimited) else self.torques
        levels = np.linspace(*self.pressure_range, LEVELS)
        pairs = [joint_torque.taut_branch(function, angle, levels) for function in functions]
        limits = np.full((2, angle.size), np.nan)
        for row in range(angle.size):
            sums = []
            for (first, first_k), (second, second_k) in (pairs, pairs[::-1]):
                order = np.argsort(second[row])
                x = second[row][order]
                k = second_k[row][order]
                needed = torque[row] - first[row]
                inside = (needed >= x[0]) & (needed <= x[-1])
                sums.append(first_k[row][inside] + np.interp(needed[inside], x, k))
            if (both := np.concatenate(sums)).size:
                limits[:, row] = both.min(), both.max()
        return limits[0], limits[1]

    def explain(self, angle: float, stiffness: float, load: float = 0.0) -> str:
        """Reason why no pressures give an angle and a stiffness under a load, with what is
        reachable.
        """
        where = f"joint_statics: at an angle of {angle:.4g} rad under a load of {load:.4g} N m"
        low, high = self.pressure_range
        limits = f"at pressures of {low / 1e3:.4g} to {high / 1e3:.4g} kPa"
        softest, stiffest = (float(v[0]) for v in self.stiffness_limits(angle, load))
        if np.isnan(softest):
            least, most = (float(v[0]) for v in self.torque_limits(angle))
            return (
                f"{where} no pressures balance the joint with two taut muscles; allowed range of"
                f" the load {limits}: {least:.4g} to {most:.4g} N m. Choose another load, angle or"
                " supply pressure."
            )
        return (
            f"{where} no pressures give a stiffness of {stiffness:.4g} N m/rad; allowed range"
            f" {limits}: {softest:.4g} to {stiffest:.4g} N m/rad. Choose a stiffness in this range,"
            " or another supply pressure."
        )

    @property
    def angle_range(self) -> tuple[float, float]:
        """Angles [rad] between the limits of the mechanism at which both geometries and laws are
        defined.
        """
        coordinate = self.plant.mechanism.coordinates[0]
        grid = np.linspace(coordinate.lower_limit, coordinate.upper_limit, 2049)
        contractions = self.plant.mechanism.contractions(
            {coordinate.name: grid}, self.plant.resting_lengths
        )
        inside = np.ones(grid.size, dtype=bool)
        for muscle, contraction in zip(self.plant.muscles, contractions, strict=True):
            for low, high in (
                muscle.geometry.contraction_range,
                muscle.contractile.contraction_range,
            ):
                inside &= (contraction > low) & (contraction < high)
        if not inside.any():
            raise ParameterError(
                "joint_statics: there is no angle at which both muscles are within their"
                " contraction ranges; change the offset, the radius or the range of angles of the"
                " joint."
            )
        return float(grid[inside][0]), float(grid[inside][-1])

    def _points(
        self,
        angle: Array,
        pressures: Array,
        torque: Array | None = None,
        stiffness: Array | None = None,
    ) -> JointPoints:
        """The states at angles (N, S) and pressures (N, S, 2); only those of this torque and
        stiffness if given.
        """
        first, second = (f(angle, pressures[..., i], *RESULTS) for i, f in enumerate(self.torques))
        q, k, tension, shut = first
        other_q, other_k, other_tension, other_shut = second
        with np.errstate(invalid="ignore"):
            known = np.isfinite(angle) & np.isfinite(pressures).all(axis=2)
            if torque is not None and stiffness is not None:
                scale = np.abs(q) + np.abs(other_q) + np.abs(torque)
                rigid = np.abs(k) + np.abs(other_k) + np.abs(stiffness)
                known &= np.abs(q + other_q - torque) <= RESIDUAL * scale
                known &= np.abs(k + other_k - stiffness) <= RESIDUAL * rigid
                known &= (tension > 0.0) & (other_tension > 0.0)  # both are taut
            restoring = k + other_k + self.load(angle, "slope")[0]
            stable = np.where(restoring > 0.0, 1.0, 0.0)
        # the torque that both muscles balance between them
        cocontraction = np.minimum(np.abs(q), np.abs(other_q))
        columns = (angle, k + other_k, shut + other_shut, cocontraction, stable)
        angle, constant, shut, cocontraction, stable = (
            np.where(known, value, np.nan) for value in columns
        )
        rows = known[..., None]
        tensions = np.stack([tension, other_tension], axis=2)
        both, tensions = (np.where(rows, v, np.nan) for v in (pressures, tensions))
        return JointPoints(angle, both, tensions, constant, shut, cocontraction, stable)


def joint_statics(plant: Plant, pressure_range: tuple[float, float] | None = None) -> JointStatics:
    """The statics of a joint with two muscles, with traced force laws.

    `pressure_range` are the minimum and maximum gauge pressure [Pa]; by default 0 to the lowest
    pressure of the supplies of the plant. Raises ParameterError for a plant that is not a joint
    with two muscles without series springs, and for an empty pressure range.
    """
    coordinates = plant.mechanism.coordinates
    muscles = plant.muscles
    if len(coordinates) != 1 or coordinates[0].unit != "rad" or len(muscles) != 2:
        raise ParameterError(
            f"joint_statics: {type(plant.mechanism).__name__} has {len(coordinates)} coordinates"
            f" ({', '.join(c.name for c in coordinates) or 'none'}) and the plant {len(muscles)}"
            " muscles; one angle and two muscles are required, such as an AntagonisticJoint. For"
            " other plants use find_equilibria and stiffness."
        )
    for muscle in muscles:
        if isinstance(muscle.series, ElasticSeriesElement):
            raise ParameterError(
                f"joint_statics: {muscle.name} has a series spring; only muscles with a"
                " RigidSeriesElement are allowed. Use find_equilibria, or replace the series"
                " spring."
            )
    supplies = [circuit.supply for circuit in plant.circuits]
    air_states = [
        supply.air(supply.steady_state(plant.ambient), plant.ambient) for supply in supplies
    ]
    lowest = min(float(gauge_pressure(air.pressure, plant.ambient)) for air in air_states)
    low, high = (0.0, lowest) if pressure_range is None else pressure_range
    if not (np.isfinite([low, high]).all() and low < high):
        raise ParameterError(
            f"joint_statics: pressure_range is {low:g} to {high:g} Pa; the minimum must be less"
            " than the maximum. Give gauge pressures, such as (0.0, 6e5)."
        )
    limited = torque_functions(plant)
    unlimited = torque_functions(plant, limited=False)
    return JointStatics(
        plant, (float(low), float(high)), limited, unlimited, joint_torque.load_function(plant)
    )


def _as_points(label: str, *values: Any) -> list[Array]:
    try:
        arrays = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(value, dtype=float)) for value in values)
        )
    except (TypeError, ValueError):
        raise ParameterError(
            f"joint_statics: {label} must be numbers or arrays (N,) of one length."
        ) from None
    if any(a.ndim != 1 or not np.isfinite(a).all() for a in arrays):
        raise ParameterError(
            f"joint_statics: {label} must be finite numbers or arrays (N,) of one length."
        )
    return list(arrays)


def plot_reachable_region(statics: JointStatics, load: float = 0.0) -> Any:
    """Return a Matplotlib figure of the reachable region of a joint under a load [N m].

    Left: the stiffnesses at constant pressure that are reachable at each angle with two taut
    muscles. Right: the plane of the pressures of both muscles with lines of equal stiffness and of
    equal angle; where there are several equilibria, the lowest stable angle is drawn.
    """
    figure, (region, plane) = new_figure(1, 2, width=7.2, height=3.4)
    angle = np.linspace(*statics.angle_range, ANGLES)
    low, high = statics.stiffness_limits(angle, load)
    region.fill_between(np.degrees(angle), low, high, color=BLUE, alpha=0.2, linewidth=0.0)
    for limit in (low, high):
        region.plot(np.degrees(angle), limit, color=BLUE)
    title = f"Reachable region, load {load:.4g} N m"
    region.set(xlabel="angle [deg]", ylabel="stiffness at constant pressure [N m/rad]", title=title)

    levels = np.linspace(*statics.pressure_range, PRESSURES)
    first, second = (p.reshape(-1) for p in np.meshgrid(levels, levels))
    points = statics.angles((first, second), load)
    usable = (points.stable == 1.0) & (points.tensions > 0.0).all(axis=2)
    column = np.argmax(usable, axis=1)
    rows = np.arange(first.size)

    def table(values: Array) -> Array:
        chosen = np.where(usable.any(axis=1), values[rows, column], np.nan)
        return np.asarray(chosen.reshape(PRESSURES, PRESSURES))

    first_name, second_name = (muscle.name for muscle in statics.plant.muscles)
    grid = levels / 1e5
    for values, colour, style, text in (
        (points.constant_pressure, BLUE, "solid", "%.3g"),
        (np.degrees(points.angle), RED, "dashed", "%.3g°"),
    ):
        lines = plane.contour(
            grid, grid, table(values), levels=7, colors=[colour], linestyles=style, linewidths=1.0
        )
        plane.clabel(lines, fmt=text, fontsize=7)
    plane.set(xlabel=f"pressure of {first_name} [bar]", ylabel=f"pressure of {second_name} [bar]")
    plane.set_title("Solid: stiffness [N m/rad], dashed: angle")
    return figure
