"""Scores of a comparison of controllers: ratios of errors to the smallest one, over runs and
plants.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Array


class Spread(NamedTuple):
    """Median, smallest and largest value of a number over searches and truths."""

    median: float
    low: float
    high: float


def spread(values: Array) -> Spread:
    """Median, smallest and largest of some numbers; NaN where one of them is NaN."""
    return Spread(float(np.median(values)), float(values.min()), float(values.max()))


def mean_ratios(names: Sequence[str], errors: Array) -> dict[str, Array]:
    """The geometric mean over tasks of the ratio of each error to the smallest of all controllers.

    errors  (controllers, tasks, ...); the result of each controller has the shape (...). 1 is best
            in every task; infinite is a controller with a run that ended early, and NaN never
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithms = np.log(errors / errors.min(axis=0))
    means = np.exp(np.where(np.isfinite(errors), logarithms, np.inf).mean(axis=1))
    return dict(zip(names, means, strict=True))


def order_columns(names: Sequence[str], ratios: Mapping[str, Array]) -> dict[str, list[object]]:
    """On how many truths each controller is better than another one in every search, as columns.

    ratios  (searches, truths) of each controller
    """
    columns: dict[str, list[object]] = {"better": list(names)}
    for other in names:
        least = ratios[other].min(axis=0)
        columns[f"than {other}"] = [
            None if name == other else int((ratios[name].max(axis=0) < least).sum())
            for name in names
        ]
    return columns
