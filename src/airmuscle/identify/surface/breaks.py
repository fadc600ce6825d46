"""Where a law does what no muscle does: force or contraction with a slope of the wrong sign."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import autodiff
from ...core.arrays import Array

Range = tuple[float, float]
_LEVEL = 1e-9
"""Slopes below this part of the greatest are rounding; chosen."""


@dataclasses.dataclass(frozen=True)
class Rule:
    """What the `quantity` that a law gives must not do along one of its arguments."""

    words: str
    quantity: str
    argument: int
    """0 pressure, 1 the other one."""
    sign: float
    """That of a slope which breaks the rule."""


@dataclasses.dataclass(frozen=True)
class MonotonicityViolation:
    """One connected place of a validity range where a law breaks a rule."""

    rule: Rule
    pressure: Range
    """Gauge pressures [Pa] between which it lies."""
    across: Range
    """Contractions [1], or forces [N] of a law in contraction, between which it lies."""
    share: float
    """Its part of the validity range [1]."""
    worst: tuple[float, float]
    """Gauge pressure [Pa] and contraction or force where the rule is broken most."""
    worst_slope: float
    """The slope there [SI]."""

    def __str__(self) -> str:
        (p0, p1), (low, high, worst) = self.pressure, (self._said(v) for v in (*self.across, self.worst[1]))
        return (
            f"{self.rule.words} between {p0 / 1e3:.4g} and {p1 / 1e3:.4g} kPa, {low} and {high} "
            f"({self.share:.1%} of the validity range), most at {self.worst[0] / 1e3:.4g} kPa and {worst}"
        )

    def _said(self, value: float) -> str:
        return f"{value:.2%}" if self.rule.quantity == "force" else f"{value:.0f} N"


def breaks_of(law: Any, rules: Sequence[Rule], pressure: Array, across: Array) -> tuple[MonotonicityViolation, ...]:
    """The places on a grid, both shape (N, M), where exact slopes break one of the rules, largest first."""
    found: list[MonotonicityViolation] = []
    for rule in rules:
        against = rule.sign * np.asarray(autodiff.derivative(law, rule.quantity, pressure, across, wrt=rule.argument))
        felt = np.where(against > _LEVEL * np.abs(against).max(), against, 0.0)
        found += _places(rule, felt, pressure, across)
    return tuple(sorted(found, key=lambda b: -b.share))


def _places(rule: Rule, heights: Array, pressure: Array, across: Array) -> list[MonotonicityViolation]:
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
