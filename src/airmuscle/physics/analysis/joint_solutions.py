"""Solutions of the statics of a joint: pressures for torque and stiffness, angles for pressures."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array
from ...engine.compile.cache.kernel import Kernel
from ...engine.compile.function import LANES, lanes_array
from .joint_torque import QUANTITIES, TorqueFunction, TracedRow

CELLS = 32
"""Number of cells of each pressure in the search for all solutions (chosen)."""
STEPS = 128
"""Number of steps of the angle in the search for equilibria (chosen)."""
CHUNK = 1000
"""Number of points that are searched at once, which limits the memory (chosen)."""
_RESIDUAL = 1e-11
"""Relative residual of torque and stiffness at which a solution is accepted (chosen)."""
_MARGIN = 1e-12
"""Fraction of the pressure range by which a solution may exceed it through rounding."""
ROOM = 4
"""Number of solutions of a point for which room is made at first (chosen)."""
MAX_BISECTIONS = 80
AT_PRESSURE = QUANTITIES[:4]

pair_solutions = Kernel("pair_solutions", "newton")

Functions = Sequence[TorqueFunction]
Rows = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
Range = tuple[float, float]


def affine_candidates(unlimited: Functions, pressures: Range, angle: Array, torque: Array, stiffness: Array) -> Array:
    """The pressures (N, 1, 2) for laws that are affine in the pressure; NaN where they are out of range.

    A law without its limits is solved; a muscle at a limit of its law, such as a slack one, is no solution.
    """
    zero = np.zeros(1)
    (q, k, a, c), (other_q, other_k, b, d) = (function(angle, zero, *AT_PRESSURE) for function in unlimited)
    x, y = torque - q - other_q, stiffness - k - other_k
    with np.errstate(all="ignore"):
        determinant = a * d - b * c
        pairs = np.stack([(d * x - b * y) / determinant, (a * y - c * x) / determinant], axis=1)
        inside = _within(pairs, pressures)
    return np.asarray(np.where(inside[:, None], np.clip(pairs, *pressures), np.nan)[:, None, :])


def general_candidates(limited: Functions, pressures: Range, angle: Array, torque: Array, stiffness: Array) -> Array:
    """All pressures (N, S, 2) of any force laws, by a search in cells and Newton's method, by ascending first pressure;
    S is the maximum number of solutions of a point, at least 1.

    The torques and stiffnesses at the boundaries of CELLS cells of each pressure exclude most of the CELLS^2 cells; as
    they need not be monotonic in a cell, its range is widened by half on both sides. Newton's method starts from the
    centre of each cell that is left. All this is compiled, several levels or cells at once.
    """
    first, second = (function.compiled for function in limited)
    levels = np.linspace(*pressures, CELLS + 1)
    padded = np.append(levels, np.full(-levels.size % LANES, levels[-1])).reshape(-1, LANES)
    counts, room = np.zeros(angle.size, dtype=np.int64), ROOM
    work = lanes_array(3), lanes_array(5), lanes_array(5), np.zeros((2, 3, 2, CELLS))
    cells, points = np.zeros(CELLS**2 + LANES, dtype=np.int64), [np.array(v) for v in (angle, torque, stiffness)]
    while True:
        pairs = np.full((angle.size, room, 2), np.nan)
        pair_solutions(
            first.address, second.address, float(pressures[0]), float(pressures[1]), *points, padded, pairs, counts,
            *work, cells,
        )  # fmt: skip
        most = int(counts.max(initial=1))
        if most <= room:
            break
        room = most
    pairs = pairs[:, : max(most, 1)]
    order = np.argsort(pairs[..., 0], axis=1)
    return np.asarray(np.take_along_axis(pairs, order[..., None], axis=1))


def balanced_angles(
    torques: Functions, load_torque: TracedRow, angles: Range, pressures: tuple[Array, Array], load: Array
) -> Array:
    """All angles (N, S) at which the muscles balance weight and load, in ascending order; NaN where there are fewer."""

    def excess(angle: Array, rows: Rows) -> Array:
        carried = sum(f(angle, p[rows], "torque")[0] for f, p in zip(torques, pressures, strict=True))
        return np.asarray(carried - load_torque(angle, names=("torque",))[0] - load[rows])

    def slope(angle: Array, rows: Rows) -> Array:
        stiffness = sum(f(angle, p[rows], "stiffness")[0] for f, p in zip(torques, pressures, strict=True))
        return np.asarray(-stiffness - load_torque(angle, names=("slope",))[0])

    grid = np.linspace(*angles, STEPS + 1)
    values = np.concatenate([
        excess(np.broadcast_to(grid, (part.size, grid.size)), part[:, None])
        for part in np.array_split(np.arange(load.size), 1 + load.size // CHUNK)
    ])  # fmt: skip
    row, step = np.nonzero((values[:, :-1] > 0.0) != (values[:, 1:] > 0.0))
    roots = _bracketed_root(excess, slope, row, grid[step], grid[step + 1], values[row, step] > 0.0)
    count = np.bincount(row, minlength=load.size)
    table = np.full((load.size, max(1, int(count.max(initial=0)))), np.nan)
    table[row, np.arange(row.size) - np.searchsorted(row, row)] = roots
    return table


def _bracketed_root(
    excess: Callable[[Array, Rows], Array], slope: Callable[[Array, Rows], Array], row: Rows, low: Array, high: Array,
    positive: Mask,
) -> Array:  # fmt: skip
    """Roots by Newton's method, with bisection where a step would leave its interval."""
    x = 0.5 * (low + high)
    for _ in range(MAX_BISECTIONS):
        value = excess(x, row)
        same = (value > 0.0) == positive
        low, high = np.where(same, x, low), np.where(same, high, x)
        with np.errstate(all="ignore"):
            newton = x - value / slope(x, row)
        inside = (newton > low) & (newton < high)
        following = np.where(value == 0.0, x, np.where(inside, newton, 0.5 * (low + high)))
        done = np.abs(following - x) <= 4e-16 * (1.0 + np.abs(x))
        x = following
        if done.all():
            break
    return x


def _within(pairs: Array, pressures: Range) -> Mask:
    margin = _MARGIN * (pressures[1] - pressures[0])
    return np.asarray(((pairs >= pressures[0] - margin) & (pairs <= pressures[1] + margin)).all(axis=1))


def are_balanced(first: Sequence[Array], second: Sequence[Array], torque: Array, stiffness: Array) -> Mask:
    """Whether torque and stiffness are balanced by two taut muscles, each given by torque, stiffness and tension."""
    (q, k, tension), (other_q, other_k, other_tension) = first, second
    scale = np.abs(q) + np.abs(other_q) + np.abs(torque)
    rigid = np.abs(k) + np.abs(other_k) + np.abs(stiffness)
    balanced = np.abs(q + other_q - torque) <= _RESIDUAL * scale
    stiff = np.abs(k + other_k - stiffness) <= _RESIDUAL * rigid
    return np.asarray(balanced & stiff & (tension > 0.0) & (other_tension > 0.0))
