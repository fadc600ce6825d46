"""Where a law does what no muscle does: force or contraction with a slope of the wrong sign."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import autodiff
from ...core.arrays import Array

Range = tuple[float, float]
_ROUNDING = 1e-9
"""Slopes below this part of the greatest are rounding; chosen."""


@dataclasses.dataclass(frozen=True)
class MonotonicityRule:
    """What the `quantity` that a law gives must not do along one of its arguments."""

    description: str
    quantity: str
    argument: int
    """0 pressure, 1 the other one."""
    sign: float
    """That of a slope which breaks the rule."""


@dataclasses.dataclass(frozen=True)
class MonotonicityViolation:
    """One connected place of a validity range where a law breaks a rule."""

    rule: MonotonicityRule
    pressure: Range
    """Gauge pressures [Pa] between which it lies."""
    second_argument: Range
    """Contractions [1], or forces [N] of a law in contraction, between which it lies."""
    area_fraction: float
    """Its part of the validity range [1]."""
    worst_point: tuple[float, float]
    """Gauge pressure [Pa] and contraction or force where the rule is broken most."""
    worst_slope: float
    """The slope there [SI]."""

    def __str__(self) -> str:
        (p0, p1), (low, high, worst) = (
            self.pressure,
            (self._format_second(v) for v in (*self.second_argument, self.worst_point[1])),
        )
        return (
            f"{self.rule.description} between {p0 / 1e3:.4g} and {p1 / 1e3:.4g} kPa, {low} and {high} "
            f"({self.area_fraction:.1%} of the validity range), most at {self.worst_point[0] / 1e3:.4g} kPa and {worst}"
        )

    def _format_second(self, value: float) -> str:
        return f"{value:.2%}" if self.rule.quantity == "force" else f"{value:.0f} N"


def find_violations(
    law: Any, rules: Sequence[MonotonicityRule], pressure: Array, across: Array
) -> tuple[MonotonicityViolation, ...]:
    """The places on a grid, both shape (N, M), where exact slopes break one of the rules, largest first."""
    found: list[MonotonicityViolation] = []
    for rule in rules:
        against = rule.sign * np.asarray(autodiff.derivative(law, rule.quantity, pressure, across, wrt=rule.argument))
        felt = np.where(against > _ROUNDING * np.abs(against).max(), against, 0.0)
        found += _connected_regions(rule, felt, pressure, across)
    return tuple(sorted(found, key=lambda b: -b.area_fraction))


def _connected_regions(
    rule: MonotonicityRule, heights: Array, pressure: Array, across: Array
) -> list[MonotonicityViolation]:
    """The connected places where `heights` are above zero."""
    from scipy import ndimage

    labels, count = ndimage.label(heights > 0)
    found = []
    for label in range(1, count + 1):
        here = labels == label
        at = np.unravel_index(int(np.argmax(np.where(here, heights, -np.inf))), heights.shape)
        along, beside = ((float(v[here].min()), float(v[here].max())) for v in (pressure, across))
        worst = (float(pressure[at]), float(across[at]))
        found.append(
            MonotonicityViolation(rule, along, beside, float(here.mean()), worst, rule.sign * float(heights[at]))
        )
    return found
