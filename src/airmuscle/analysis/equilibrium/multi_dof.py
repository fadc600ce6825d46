"""Where a plant with several coordinates is in balance: Newton's method from many places at once."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from .statics import Rows, Statics

STARTS = 60
"""Places from which the search begins, spread evenly over what the muscles can take (chosen)."""
ITERATIONS = 40
BALANCED = 1e-8
"""Imbalance that counts as none, relative to the greatest at the starts (chosen)."""
APART = 1e-6
"""Equilibria closer than this part of a coordinate's nominal size are one (chosen)."""


def equilibria_of_several_coordinates(statics: Statics) -> tuple[Rows, Array]:
    """The row of its plant and the place (d,) of every balance that a start leads to, by row and place."""
    rows, places = [], []
    for row in range(len(statics.parameters)):
        found = _places(statics.of(np.array([row])))
        rows += [row] * len(found)
        places += found
    return np.array(rows, dtype=np.intp), np.array(places).reshape(len(rows), len(statics.coordinates))


def _places(one: Statics) -> list[Array]:
    """Every place of balance of one plant that a start leads to, sorted by its coordinates."""
    sizes = one.nominal_sizes()
    x = starts(one)
    if not len(x):
        return []
    f = one.accelerations(x[None])[0]
    found: list[Array] = []
    for place in _newton(one, x, f, sizes, BALANCED * np.abs(f).max()):
        if all(np.abs((place - other) / sizes).max() > APART for other in found):
            found.append(place)
    return sorted(found, key=tuple)


def starts(one: Statics) -> Array:
    """Places (K, d) within reach of one plant, from contractions that are spread evenly (an additive recurrence)."""
    limits = [[float(np.asarray(end).flat[0]) for end in ends] for ends in one.contraction_limits]
    low, high = np.array(limits).T
    high = np.minimum(high, 0.5)  # further on a muscle is past its greatest volume
    root = 2.0
    for _ in range(30):
        root = (1.0 + root) ** (1.0 / (low.size + 1))
    steps = root ** -np.arange(1.0, low.size + 1)
    targets = low + (high - low) * ((0.5 + np.arange(STARTS)[:, None] * steps) % 1.0)
    x = _place_of(one, targets)
    inside = one.within_reach(x[None])[0] & np.isfinite(one.accelerations(x[None])[0]).all(axis=1)
    reached: Array = x[inside]
    return reached


def _contractions(one: Statics, x: Array) -> Array:
    """Contractions (K, muscles) at places (K, d)."""
    return np.stack([eps[0] for eps in one.contractions(x[None])], axis=-1)


def _place_of(one: Statics, targets: Array) -> Array:
    """The coordinates (K, d) whose contractions are nearest to these (K, muscles)."""
    sizes: Array = one.nominal_sizes()
    x: Array = np.zeros((len(targets), sizes.size))
    for _ in range(4):
        at = _contractions(one, x)
        nudged = [_contractions(one, x + 1e-6 * step) for step in np.diag(sizes)]
        slopes = np.stack([(value - at) / 1e-6 for value in nudged], axis=-1)
        x = np.add(x, sizes * _least_squares(slopes, targets - at, 1e-15))
    return x


def _least_squares(matrices: Array, right: Array, rcond: float) -> Array:
    """Least squares solutions (K, d) of matrices (K, r, d); NaN where a matrix is not finite."""
    solution: Array = np.full((len(matrices), matrices.shape[2]), np.nan)
    finite = np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    solution[finite] = np.einsum("kdr,kr->kd", np.linalg.pinv(matrices[finite], rcond=rcond), right[finite])
    return solution


def _newton(one: Statics, x: Array, f: Array, sizes: Array, balance: float) -> list[Array]:
    """The places of balance that Newton's method finds from x (K, d), its steps halved until the imbalance falls."""
    found = []
    for _ in range(ITERATIONS):
        step = _steps(one, x, f, sizes)
        ahead, after, fell = _descend(one, x, f, step)
        ended = (np.abs(step / sizes).max(axis=1) < 1e-13) | ~fell
        found += list(x[ended & np.isfinite(step).all(axis=1) & (np.abs(f).max(axis=1) <= balance)])
        x, f = ahead[~ended], after[~ended]
        if not len(x):
            break
    return found


def _descend(one: Statics, x: Array, f: Array, step: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Places ahead, the imbalance there, and for which of them a part of the step makes it smaller."""
    ahead, after, fell = x.copy(), f.copy(), np.zeros(len(x), dtype=bool)
    waiting = np.flatnonzero(np.isfinite(step).all(axis=1))
    for part in 0.5 ** np.arange(12):
        if not waiting.size:
            break
        trial = x[waiting] + part * step[waiting]
        at = one.accelerations(trial[None])[0]
        with np.errstate(invalid="ignore"):
            better = np.abs(at).max(axis=1) < np.abs(f[waiting]).max(axis=1)
        better &= one.within_reach(trial[None])[0]
        rows = waiting[better]
        ahead[rows], after[rows], fell[rows] = trial[better], at[better], True
        waiting = waiting[~better]
    return ahead, after, fell


def _steps(one: Statics, x: Array, f: Array, sizes: Array) -> Array:
    """Newton's step (K, d) by central differences, one-sided at the ends of the reach; NaN where there is none."""
    slopes = np.empty((len(x), f.shape[1], x.shape[1]))
    for k, nudge in enumerate(np.diag(1e-5 * sizes)):
        ends = [np.where(one.within_reach(p[None])[0][:, None], p, x) for p in (x + nudge, x - nudge)]
        span = (ends[0] - ends[1])[:, k] / sizes[k]
        difference = one.accelerations(ends[0][None])[0] - one.accelerations(ends[1][None])[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes[:, :, k] = difference / span[:, None]
    scale = np.abs(slopes).max(axis=2)
    scale[scale == 0.0] = 1.0
    return np.asarray(-sizes * _least_squares(slopes / scale[:, :, None], f / scale, 1e-14))
