"""The force that a law of any direction gives, at every point: 0 where it is slack, the ceiling where it asks more."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..characteristic.base import ContractionLaw, ForceLaw
from ..core.arrays import Array

FORCE_GRID_POINTS = 801
"""Forces tried between zero and the ceiling; between two of them the law is taken as straight."""


def evaluate_force(law: Any, pressure: Array, contraction: Array, ceiling: float) -> Array:
    """Forces [N] at N points, none left out. A comparison must judge every law on the same rows.

    `ceiling` [N] bounds the answer of laws that are given in contraction or pressure. What those ask for more
    pressure at zero load than there is, is slack.
    """
    with np.errstate(all="ignore"):
        if isinstance(law, ForceLaw):
            found = np.asarray(law.force(pressure, contraction), dtype=float) + np.zeros(pressure.size)
        else:
            found = _invert_on_grid(law, pressure, contraction, ceiling)
    return np.asarray(np.nan_to_num(found, nan=0.0, posinf=ceiling, neginf=-ceiling))


def _invert_on_grid(law: Any, pressure: Array, contraction: Array, ceiling: float) -> Array:
    forces = np.linspace(0.0, ceiling, FORCE_GRID_POINTS)
    if isinstance(law, ContractionLaw):
        lack = contraction[:, None] - np.asarray(law.contraction(pressure[:, None], forces))
    else:
        lack = np.asarray(law.pressure(contraction[:, None], forces)) - pressure[:, None]
    reached = np.asarray(lack >= 0)
    first = np.where(reached.any(axis=1), reached.argmax(axis=1), FORCE_GRID_POINTS - 1)
    rows = np.arange(pressure.size)
    before = np.maximum(first - 1, 0)
    high, low = lack[rows, first], lack[rows, before]
    with np.errstate(all="ignore"):
        share = np.where((first > 0) & reached.any(axis=1), -low / (high - low), 1.0)
    return np.asarray(np.where(first == 0, 0.0, forces[before] + share * (forces[first] - forces[before])))
