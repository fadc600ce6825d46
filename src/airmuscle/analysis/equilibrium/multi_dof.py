"""Where several coordinates of a plant are in balance: Newton's method from many places."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.arrays import Array
from .statics import StaticProblem

STARTS = 60
"""Places from which the search begins, spread evenly over what the muscles can take."""
ITERATIONS = 40
BALANCED = 1e-8
"""Imbalance that counts as none, as a share of the greatest at the starts."""
APART = 1e-6
"""Rests closer than this share of a coordinate's nominal size are one."""


def places_of_several(static: StaticProblem) -> list[Array]:
    """Every place of balance that a start leads to, sorted by its coordinates."""
    sizes = np.array([c.nominal for c in static.coordinates])
    begun = [(x, static.accelerations(static.place(x))) for x in starts(static)]
    balance = BALANCED * max((np.abs(f).max() for _, f in begun), default=0.0)
    found: list[Array] = []
    for x, f in begun:
        place = _newton(static, x, f, sizes, balance)
        if place is not None and all(np.abs((place - other) / sizes).max() > APART for other in found):
            found.append(place)
    return sorted(found, key=tuple)


def starts(static: StaticProblem) -> Iterator[Array]:
    """Places within reach, from contractions of the muscles that are spread evenly (an additive recurrence)."""
    low, high = np.array(static.reach).T
    high = np.minimum(high, 0.5)  # further on a muscle is past its greatest volume
    count = low.size
    root = 2.0
    for _ in range(30):
        root = (1.0 + root) ** (1.0 / (count + 1))
    steps = root ** -np.arange(1.0, count + 1)
    for i in range(STARTS):
        target = low + (high - low) * ((0.5 + i * steps) % 1.0)
        x = _place_of(static, target)
        if static.within_reach(static.place(x)) and np.isfinite(static.accelerations(static.place(x))).all():
            yield x


def _place_of(static: StaticProblem, target: Array) -> Array:
    """The coordinates whose contractions are nearest to these."""
    sizes = np.array([c.nominal for c in static.coordinates])
    x = np.zeros(sizes.size)
    for _ in range(4):
        at = np.array(static.contractions(static.place(x)))
        slopes = np.column_stack([
            np.array(static.contractions(static.place(x + 1e-6 * step))) - at for step in np.diag(sizes)
        ]) / 1e-6  # fmt: skip
        x = x + sizes * np.linalg.lstsq(slopes, target - at, rcond=None)[0]
    return np.asarray(x)


def _newton(static: StaticProblem, x: Array, f: Array, sizes: Array, balance: float) -> Array | None:
    """The place of balance that Newton's method finds from x, with steps halved until the imbalance falls."""
    for _ in range(ITERATIONS):
        step = _step(static, x, f, sizes)
        if not np.isfinite(step).all():
            return None
        if np.abs(step / sizes).max() < 1e-13:
            return x if np.abs(f).max() <= balance else None
        for share in 0.5 ** np.arange(12):
            ahead = x + share * step
            after = static.accelerations(static.place(ahead)) if static.within_reach(static.place(ahead)) else None
            if after is not None and np.abs(after).max() < np.abs(f).max():
                break
        else:
            return x if np.abs(f).max() <= balance else None
        x, f = ahead, after
    return None


def _step(static: StaticProblem, x: Array, f: Array, sizes: Array) -> Array:
    width = 1e-5
    slopes = np.empty((f.size, x.size))
    for k, nudge in enumerate(np.diag(width * sizes)):
        ahead, back = (x + sign * nudge for sign in (1.0, -1.0))
        ends = [p if static.within_reach(static.place(p)) else x for p in (ahead, back)]
        span = (ends[0] - ends[1])[k] / sizes[k]
        at = [static.accelerations(static.place(end)) for end in ends]
        slopes[:, k] = (at[0] - at[1]) / span if span else np.nan
    if not np.isfinite(slopes).all():
        return np.full(x.size, np.nan)
    rows = np.abs(slopes).max(axis=1)
    rows[rows == 0] = 1.0
    return np.asarray(-sizes * np.linalg.lstsq(slopes / rows[:, None], f / rows, rcond=1e-14)[0])
