"""Solutions of the statics of a joint: pressures for torque and stiffness, angles for pressures."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
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
_ITERATIONS = 30
MAX_BISECTIONS = 80
AT_PRESSURE = QUANTITIES[:4]
BALANCE = ("torque", "stiffness", "tension")

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
        found = np.stack([(d * x - b * y) / determinant, (a * y - c * x) / determinant], axis=1)
        inside = _within(found, pressures)
    return np.asarray(np.where(inside[:, None], np.clip(found, *pressures), np.nan)[:, None, :])


def general_candidates(limited: Functions, pressures: Range, angle: Array, torque: Array, stiffness: Array) -> Array:
    """All pressures (N, S, 2) of any force laws, by a search in cells and Newton's method, by ascending first pressure;
    S is the maximum number of solutions of a point, at least 1."""
    rows, found = [], []
    for start in range(0, angle.size, CHUNK):
        part = slice(start, start + CHUNK)
        row, guess = _cells(limited, pressures, angle[part], torque[part], stiffness[part])
        row = row + start
        at = (angle[row], torque[row], stiffness[row])
        result = _newton(limited, pressures, guess, *at)
        first, second = (f(angle[row], result[:, i], *BALANCE) for i, f in enumerate(limited))
        with np.errstate(all="ignore"):
            accepted = _within(result, pressures) & are_balanced(first, second, *at[1:])
        rows.append(row[accepted])
        found.append(np.clip(result[accepted], *pressures))
    return _table(np.concatenate(rows), np.concatenate(found), angle.size, pressures)


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
    found = _bracketed_root(excess, slope, row, grid[step], grid[step + 1], values[row, step] > 0.0)
    count = np.bincount(row, minlength=load.size)
    table = np.full((load.size, max(1, int(count.max(initial=0)))), np.nan)
    table[row, np.arange(row.size) - np.searchsorted(row, row)] = found
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


def _within(found: Array, pressures: Range) -> Mask:
    margin = _MARGIN * (pressures[1] - pressures[0])
    return np.asarray(((found >= pressures[0] - margin) & (found <= pressures[1] + margin)).all(axis=1))


def are_balanced(first: Sequence[Array], second: Sequence[Array], torque: Array, stiffness: Array) -> Mask:
    """Whether torque and stiffness are balanced by two taut muscles, each given by torque, stiffness and tension."""
    (q, k, tension), (other_q, other_k, other_tension) = first, second
    scale = np.abs(q) + np.abs(other_q) + np.abs(torque)
    rigid = np.abs(k) + np.abs(other_k) + np.abs(stiffness)
    balanced = np.abs(q + other_q - torque) <= _RESIDUAL * scale
    stiff = np.abs(k + other_k - stiffness) <= _RESIDUAL * rigid
    return np.asarray(balanced & stiff & (tension > 0.0) & (other_tension > 0.0))


def _cells(functions: Functions, pressures: Range, angle: Array, torque: Array, stiffness: Array) -> tuple[Rows, Array]:
    """Point and central pressures (M, 2) of every cell in which torque and stiffness may both be balanced."""
    levels = np.linspace(*pressures, CELLS + 1)
    ends = []
    for function in functions:
        torques, stiffnesses, tensions = function(angle[:, None], levels, *BALANCE)
        taut = np.maximum(tensions[:, :-1], tensions[:, 1:]) > 0.0
        for values in (torques, stiffnesses):
            both = values[:, :-1], values[:, 1:]
            ends.append((np.where(taut, np.minimum(*both), np.inf), np.where(taut, np.maximum(*both), -np.inf)))
    possible = np.ones((angle.size, CELLS, CELLS), dtype=bool)
    for (low, high), (other_low, other_high), wanted in zip(ends[:2], ends[2:], (torque, stiffness), strict=True):
        # The values need not be monotonic in a cell, so that its range is widened by half on both sides.
        widened, other_widened = (
            0.5 * np.where(np.isfinite(a), b - a, 0.0) for a, b in ((low, high), (other_low, other_high))
        )
        most, least = wanted[:, None] - low + widened, wanted[:, None] - high - widened
        possible &= (other_low - other_widened)[:, None, :] <= most[:, :, None]
        possible &= (other_high + other_widened)[:, None, :] >= least[:, :, None]
    row, first, second = np.nonzero(possible)
    centres = 0.5 * (levels[:-1] + levels[1:])
    return row, np.stack([centres[first], centres[second]], axis=1)


def _newton(
    functions: Functions, pressures: Range, guess: Array, angle: Array, torque: Array, stiffness: Array
) -> Array:
    """Newton's method from each guess (M, 2), kept within the pressure range; it may end without a solution."""
    x, span = guess, pressures[1] - pressures[0]
    for _ in range(_ITERATIONS):
        (q, k, a, c), (other_q, other_k, b, d) = (f(angle, x[:, i], *AT_PRESSURE) for i, f in enumerate(functions))
        residual = q + other_q - torque, k + other_k - stiffness
        with np.errstate(all="ignore"):
            determinant = a * d - b * c
            step = np.stack([b * residual[1] - d * residual[0], c * residual[0] - a * residual[1]], axis=1)
            step = np.nan_to_num(step / determinant[:, None], nan=0.0, posinf=0.0, neginf=0.0)
        x = np.clip(x + np.clip(step, -0.2 * span, 0.2 * span), *pressures)
        if (np.abs(step) <= 1e-15 * span).all():
            break
    return x


def _table(rows: Rows, found: Array, count: int, pressures: Range) -> Array:
    """Solutions (M, 2) of points as a table (count, S, 2) without repetitions."""
    order = np.lexsort((found[:, 1], found[:, 0], rows))
    rows, found = rows[order], found[order]
    near = 1e-7 * (pressures[1] - pressures[0])
    new = np.ones(rows.size, dtype=bool)
    new[1:] = (rows[1:] != rows[:-1]) | (np.abs(np.diff(found, axis=0)) > near).any(axis=1)
    rows, found = rows[new], found[new]
    size = np.bincount(rows, minlength=count)
    table = np.full((count, max(1, int(size.max(initial=0))), 2), np.nan)
    table[rows, np.arange(rows.size) - np.searchsorted(rows, rows)] = found
    return table
