"""Connected places of a grid at which something is above zero."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .loss import Array

Range = tuple[float, float]


class Place(NamedTuple):
    """One connected place: its range along both axes, its part of the grid, and where it is worst."""

    first: Range
    second: Range
    share: float
    worst: tuple[float, float]
    height: float
    """The value there."""


def places(heights: Array, first: Array, second: Array) -> list[Place]:
    """The connected places where `heights` (N, M) are above zero; `first` and `second` (N, M) are the grid's axes."""
    from scipy import ndimage

    labels, count = ndimage.label(heights > 0)
    found = []
    for label in range(1, count + 1):
        here = labels == label
        at = np.unravel_index(int(np.argmax(np.where(here, heights, -np.inf))), heights.shape)
        along, across = ((float(v[here].min()), float(v[here].max())) for v in (first, second))
        worst = (float(first[at]), float(second[at]))
        found.append(Place(along, across, float(here.mean()), worst, float(heights[at])))
    return found
