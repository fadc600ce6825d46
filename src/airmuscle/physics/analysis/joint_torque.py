"""Torque of a joint: traced functions of its muscles, limits of taut ones, pressures and angles
that satisfy them.
"""

import dataclasses
import functools
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array, Node, Recorded, Values, nodes, slopes
from ...engine.compile.cache.kernel import Kernel, aligned_array
from ...engine.compile.function import LANES, Function
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
"""Quantities of a muscle of a joint: torque Q [N m], -dQ/dtheta at constant pressure [N m/rad],
their derivatives with respect to the pressure, tension [N], -dQ/dtheta with closed valves, that is,
at constant air mass [N m/rad], and moment arm [m]."""
LEVELS = 129
"""Number of pressures of each muscle at which the reachable stiffnesses are evaluated (chosen)."""
BISECTIONS = 50
"""Bisections of the pressure at which a muscle becomes taut; they reach rounding precision."""
CELLS = 32
"""Number of cells of each pressure in the search for all solutions (chosen)."""
STEPS = 128
"""Number of steps of the angle in the search for equilibria (chosen)."""
CHUNK = 1000
"""Number of points that are searched at once, which limits the memory (chosen)."""
RESIDUAL = 1e-11
"""Relative residual of torque and stiffness at which a solution is accepted (chosen)."""
_MARGIN = 1e-12
"""Fraction of the pressure range by which a solution may exceed it through rounding."""
ROOM = 4
"""Number of solutions of a point for which room is made at first (chosen)."""
MAX_BISECTIONS = 80
AT_PRESSURE = QUANTITIES[:4]
pair_solutions = Kernel("pair_solutions", "newton")
Rows = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
Range = tuple[float, float]


@dataclasses.dataclass(frozen=True, eq=False)
class TracedRow:
    """Function of one or two arguments with several outputs, evaluated on arrays; `names` are those
    of the outputs.

    `affine` is whether the first output of a muscle, its torque, is affine in the pressure.
    """

    arguments: tuple[Node, ...]
    values: tuple[Node, ...]
    names: tuple[str, ...]
    affine: bool = False
    functions: dict[tuple[str, ...], Recorded] = dataclasses.field(default_factory=dict)

    def __call__(self, *arguments: Array | str) -> list[Array]:
        """The outputs whose names follow the arguments, by default all, at arguments that
        broadcast.
        """
        names = tuple(x for x in arguments if isinstance(x, str)) or self.names
        if names not in self.functions:
            by_name = dict(zip(self.names, self.values, strict=True))
            wanted = [by_name[name] for name in names]
            self.functions[names] = Recorded([self.arguments], [wanted])
        arrays = [x for x in arguments if not isinstance(x, str)]
        broadcast = np.broadcast_arrays(*arrays)
        shape = broadcast[0].shape
        points = [np.ascontiguousarray(x, dtype=float).reshape(-1) for x in broadcast]
        (rows,) = self.functions[names].at_points(points)
        # an output that does not depend on the arguments is one number
        count = points[0].shape
        return [np.broadcast_to(row, count).reshape(shape) for row in rows]

    def at(self, *arguments: Node) -> dict[str, Node]:
        """The outputs by name as expressions of other arguments."""
        values = nodes.replaced(self.values, self.arguments, arguments)
        return dict(zip(self.names, values, strict=True))

    @functools.cached_property
    def compiled(self) -> Function:
        """The first five QUANTITIES of a muscle, up to the tension, compiled for several points at
        once.
        """
        angle, pressure = self.arguments
        values = self.values[: QUANTITIES.index("tension") + 1]
        return Function({"angle": [angle], "pressure": [pressure]}, {"values": values}, LANES)


Functions = Sequence[TracedRow]


def load_function(plant: Plant) -> TracedRow:
    """The torque [N m] of weights, springs and stops against the angle [rad], and its
    derivative.
    """
    angle = nodes.symbol("angle")
    coordinate = plant.mechanism.coordinates[0].name
    energy = nodes.as_node(plant.mechanism.potential_energy({coordinate: angle}))
    torque = _slope(energy, angle)
    return TracedRow((angle,), (torque, _slope(torque, angle)), ("torque", "slope"))


def _slope(value: Node, by: Node) -> Node:
    return slopes.jacobian([value], [by])[0][0]


def torque_functions(plant: Plant, *, limited: bool = True) -> tuple[TracedRow, ...]:
    """The QUANTITIES of each muscle of a joint as functions of angle [rad] and gauge pressure [Pa].

    Unless `limited`, they are those of the static tension before the limits of law and slackness
    are applied.
    """
    angle = nodes.symbol("angle")
    pressure = nodes.symbol("pressure")
    contractions = plant.mechanism.contractions(
        {plant.mechanism.coordinates[0].name: angle}, plant.resting_lengths
    )
    functions = []
    for muscle, contraction in zip(plant.muscles, contractions, strict=True):
        length = muscle.geometry.resting_length
        arm = _slope(nodes.as_node(length * contraction), angle)
        tension = nodes.as_node(
            muscle.tension(pressure, contraction)
            if limited
            else muscle.unlimited_static_force(pressure, contraction)
        )
        torque = arm * tension
        stiffness = -_slope(torque, angle)
        by_pressure = _slope(torque, pressure)
        steady_states: Values = muscle.steady_state(pressure, contraction)
        volume = muscle.volume(contraction, steady_states)
        content = plant.gas.state_at(
            absolute_pressure(pressure, plant.ambient), volume, plant.ambient
        )
        air = plant.gas.air(content, volume, plant.ambient)
        by_contraction = enclosed_pressure_slope(plant, muscle, contraction, volume, air, content)
        squeezed = by_pressure * by_contraction * arm / length
        values = (
            torque,
            stiffness,
            by_pressure,
            _slope(stiffness, pressure),
            tension,
            stiffness - squeezed,
            arm,
        )
        affine = not any(nodes.occurring([by_pressure], [pressure]))
        functions.append(TracedRow((angle, pressure), values, QUANTITIES, affine))
    return tuple(functions)


def taut_branch(function: TracedRow, angle: Array, levels: Array) -> tuple[Array, Array]:
    """Torque and stiffness (N, LEVELS) at pressures from that at which the muscle becomes taut, to
    the maximum.
    """
    (tension,) = function(angle[:, None], levels, "tension")
    taut = tension > 0.0
    slack = np.where(taut.any(axis=1), taut.argmax(axis=1), 0)
    low = levels[np.maximum(slack - 1, 0)]
    start = levels[slack]
    for _ in range(
        BISECTIONS
    ):  # to a pressure on the taut side, because the stiffness of a slack muscle is zero
        middle = 0.5 * (low + start)
        pulls = function(angle, middle, "tension")[0] > 0.0
        low = np.where(pulls, low, middle)
        start = np.where(pulls, middle, start)
    inner = start[:, None] + np.linspace(0.0, 1.0, LEVELS) * (levels[-1] - start)[:, None]
    torque, stiffness = function(angle[:, None], inner, "torque", "stiffness")
    invalid = (~taut.any(axis=1)).reshape(-1, 1)
    return np.where(invalid, np.nan, torque), np.where(invalid, np.nan, stiffness)


def affine_candidates(
    unlimited: Functions, pressures: Range, angle: Array, torque: Array, stiffness: Array
) -> Array:
    """The pressures (N, 1, 2) for laws that are affine in the pressure; NaN where they are out of
    range.

    A law without its limits is solved; a muscle at a limit of its law, such as a slack one, is no
    solution.
    """
    zero = np.zeros(1)
    (q, k, a, c), (other_q, other_k, b, d) = (
        function(angle, zero, *AT_PRESSURE) for function in unlimited
    )
    x = torque - q - other_q
    y = stiffness - k - other_k
    with np.errstate(all="ignore"):
        determinant = a * d - b * c
        pairs = np.stack([(d * x - b * y) / determinant, (a * y - c * x) / determinant], axis=1)
        margin = _MARGIN * (pressures[1] - pressures[0])
        inside = np.asarray(
            ((pairs >= pressures[0] - margin) & (pairs <= pressures[1] + margin)).all(axis=1)
        )
    return np.asarray(np.where(inside[:, None], np.clip(pairs, *pressures), np.nan)[:, None, :])


def general_candidates(
    limited: Functions, pressures: Range, angle: Array, torque: Array, stiffness: Array
) -> Array:
    """All pressures (N, S, 2) of any force laws, by a search in cells and Newton's method, by
    ascending first pressure; S is the maximum number of solutions of a point, at least 1.

    The torques and stiffnesses at the boundaries of CELLS cells of each pressure exclude most of
    the CELLS^2 cells; as they need not be monotonic in a cell, its range is widened by half on both
    sides. Newton's method starts from the centre of each cell that is left. All this is compiled,
    several levels or cells at once.
    """
    first, second = (function.compiled for function in limited)
    levels = np.linspace(*pressures, CELLS + 1)
    padded = np.append(levels, np.full(-levels.size % LANES, levels[-1])).reshape(-1, LANES)
    counts = np.zeros(angle.size, dtype=np.int64)
    room = ROOM
    work = {
        "arguments": aligned_array((3, LANES)),
        "values": aligned_array((5, LANES)),
        "other_values": aligned_array((5, LANES)),
        "ends": np.zeros((2, 3, 2, CELLS)),
        "cells": np.zeros(CELLS**2 + LANES, dtype=np.int64),
    }
    while True:
        pairs = np.full((angle.size, room, 2), np.nan)
        pair_solutions(
            first=first.address,
            second=second.address,
            low=float(pressures[0]),
            high=float(pressures[1]),
            point=np.array(angle),
            wanted_q=np.array(torque),
            wanted_k=np.array(stiffness),
            levels=padded,
            solutions=pairs,
            counts=counts,
            **work,
        )
        most = int(counts.max(initial=1))
        if most <= room:
            break
        room = most
    pairs = pairs[:, : max(most, 1)]
    order = np.argsort(pairs[..., 0], axis=1)
    return np.asarray(np.take_along_axis(pairs, order[..., None], axis=1))


def balanced_angles(
    torques: Functions,
    load_torque: TracedRow,
    angles: Range,
    pressures: tuple[Array, Array],
    load: Array,
) -> Array:
    """All angles (N, S) at which the muscles balance weight and load, in ascending order; NaN where
    there are fewer.
    """

    def excess(angle: Array, rows: Rows) -> Array:
        carried = sum(
            f(angle, p[rows], "torque")[0] for f, p in zip(torques, pressures, strict=True)
        )
        return np.asarray(carried - load_torque(angle, "torque")[0] - load[rows])

    def slope(angle: Array, rows: Rows) -> Array:
        stiffness = sum(
            f(angle, p[rows], "stiffness")[0] for f, p in zip(torques, pressures, strict=True)
        )
        return np.asarray(-stiffness - load_torque(angle, "slope")[0])

    grid = np.linspace(*angles, STEPS + 1)
    values = np.concatenate(
        [
            excess(np.broadcast_to(grid, (part.size, grid.size)), part[:, None])
            for part in np.array_split(np.arange(load.size), 1 + load.size // CHUNK)
        ]
    )
    row, step = np.nonzero((values[:, :-1] > 0.0) != (values[:, 1:] > 0.0))
    roots = _bracketed_root(excess, slope, row, grid[step], grid[step + 1], values[row, step] > 0.0)
    count = np.bincount(row, minlength=load.size)
    table = np.full((load.size, max(1, int(count.max(initial=0)))), np.nan)
    table[row, np.arange(row.size) - np.searchsorted(row, row)] = roots
    return table


def _bracketed_root(
    excess: Callable[[Array, Rows], Array],
    slope: Callable[[Array, Rows], Array],
    row: Rows,
    low: Array,
    high: Array,
    positive: Mask,
) -> Array:
    """Roots by Newton's method, with bisection where a step would leave its interval."""
    x = 0.5 * (low + high)
    for _ in range(MAX_BISECTIONS):
        value = excess(x, row)
        same = (value > 0.0) == positive
        low = np.where(same, x, low)
        high = np.where(same, high, x)
        with np.errstate(all="ignore"):
            newton = x - value / slope(x, row)
        inside = (newton > low) & (newton < high)
        following = np.where(value == 0.0, x, np.where(inside, newton, 0.5 * (low + high)))
        done = np.abs(following - x) <= 4e-16 * (1.0 + np.abs(x))
        x = following
        if done.all():
            break
    return x
