"""Regions where a law has a slope of the wrong sign, and their table."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import Array, autodiff, check_whole
from ...physics.muscle.characteristic import ForceLaw, ValidityRange
from ...physics.muscle.characteristic.base import ContractionLaw
from ...report.chapter import Table, TableColumn
from .. import statics
from .static_fit_result import Fit

_ROUNDING = 1e-9
"""Slopes below this fraction of the maximum slope are rounding errors (chosen)."""


@dataclasses.dataclass(frozen=True)
class MonotonicityRule:
    """A forbidden sign of the slope of the `quantity` that a law gives, with respect to one of its
    arguments.
    """

    description: str
    """A violation of the rule in words."""
    quantity: str
    argument: int
    """0 pressure, 1 the second argument."""
    sign: float
    """Sign of a slope that violates the rule."""


@dataclasses.dataclass(frozen=True)
class MonotonicityViolation:
    """One connected region of a validity range where a law violates a rule."""

    rule: MonotonicityRule
    pressure: tuple[float, float]
    """Limits of the region in gauge pressure [Pa]."""
    second_argument: tuple[float, float]
    """Limits of the region in contraction [1], or in force [N] for a law that gives contraction."""
    area_fraction: float
    """Fraction of the validity range that the region covers [1]."""
    worst_point: tuple[float, float]
    """Gauge pressure [Pa] and second argument at the maximum violation."""
    worst_slope: float
    """The slope there [SI]."""

    def __str__(self) -> str:
        p0, p1 = self.pressure
        low, high = (self._format_second(v) for v in self.second_argument)
        share = (
            f"{100 * self.area_fraction:.1f} %" if self.area_fraction >= 5e-4 else "less than 0.1 %"
        )
        return (
            f"{self.rule.description} between {p0 / 1e3:.4g} and {p1 / 1e3:.4g} kPa, {low} and"
            f" {high} ({share} of the validity range), most at {self.worst_point[0] / 1e3:.4g} kPa"
            f" and {self._format_second(self.worst_point[1])}"
        )

    def _format_second(self, value: float) -> str:
        return f"{100 * value:.2f} %" if self.rule.quantity == "force" else f"{value:.0f} N"


def find_violations(
    law: Any, rules: Sequence[MonotonicityRule], pressure: Array, second_argument: Array
) -> tuple[MonotonicityViolation, ...]:
    """The regions where exact slopes at grid points violate one of the rules, largest first.
    `pressure` [Pa] and `second_argument` (contraction [1] or force [N]) are grids, shape (N, M)
    each."""
    from scipy import ndimage

    violations: list[MonotonicityViolation] = []
    for rule in rules:
        slope = np.asarray(
            autodiff.derivative(law, rule.quantity, pressure, second_argument, wrt=rule.argument)
        )
        excess = rule.sign * slope
        labels, count = ndimage.label((excess > 0.0) & (excess > _ROUNDING * np.abs(excess).max()))
        for inside in (labels == label for label in range(1, count + 1)):
            worst = np.unravel_index(
                int(np.argmax(np.where(inside, excess, -np.inf))), excess.shape
            )
            arguments = pressure, second_argument
            first, second = (
                (float(values[inside].min()), float(values[inside].max())) for values in arguments
            )
            point = (float(pressure[worst]), float(second_argument[worst]))
            share = float(inside.mean())
            violations.append(
                MonotonicityViolation(rule, first, second, share, point, float(slope[worst]))
            )
    return tuple(sorted(violations, key=lambda v: -v.area_fraction))


RISES_WITH_FORCE = MonotonicityRule("contraction rises with force", "contraction", 1, 1.0)
CONTRACTION_FALLS = MonotonicityRule("contraction falls with pressure", "contraction", 0, -1.0)
RISES_WITH_CONTRACTION = MonotonicityRule("force rises with contraction", "force", 1, 1.0)
FORCE_FALLS = MonotonicityRule("force falls with pressure", "force", 0, -1.0)


def find_monotonicity_violations(
    law: ContractionLaw,
    validity_range: "statics.LoadRange | None" = None,
    points: tuple[int, int] = (201, 201),
) -> tuple[MonotonicityViolation, ...]:
    """The regions of a validity range where k rises with F or falls with p, largest first.
    `validity_range` is by default that of the law. Exact slopes are evaluated on an even grid of
    `points` pressures and forces, edges included."""
    validity_range = validity_range or statics.LoadRange.from_law(law)
    return find_violations(
        law, (RISES_WITH_FORCE, CONTRACTION_FALLS), *validity_range.grid(*points)
    )


LEAST_SHARE = 1e-3
"""Share of the validity range below which a region that violates the shape of a fitted law is not
named (chosen).
"""


def find_shape_violations(
    law: ForceLaw, validity_range: ValidityRange, *, points: int = 101
) -> tuple[MonotonicityViolation, ...]:
    """The regions of a validity range where a force falls with pressure or rises with contraction,
    largest first. Exact slopes are evaluated on an even grid of `points` pressures and
    contractions."""
    check_whole("find_shape_violations", "points", points, 2)
    sides = (
        np.linspace(*validity_range.pressure, points),
        np.linspace(*validity_range.contraction, points),
    )
    return find_violations(
        law, (FORCE_FALLS, RISES_WITH_CONTRACTION), *np.meshgrid(*sides, indexing="ij")
    )


def shape_violations_of_fit(fit: Fit) -> tuple[MonotonicityViolation, ...]:
    """The shape violations of a fitted law in the range of its data; none for laws that are no
    closed-form force.
    """
    law = fit.model
    varies = all(low < high for low, high in fit.data_ranges.values())
    if not isinstance(law, ForceLaw) or not law.traceable or not varies:
        return ()
    violations = find_shape_violations(law, fit.validity_range)
    return tuple(violation for violation in violations if violation.area_fraction >= LEAST_SHARE)


def violation_table(violations: Sequence[MonotonicityViolation], name: str, title: str) -> Table:
    """Return a table of the regions in which a force is not monotonic, largest first."""
    columns: dict[str, Any] = {
        "constraint": [violation.rule.description for violation in violations],
        "pressure": TableColumn([violation.pressure for violation in violations], "Pa", "kPa"),
        "contraction": TableColumn(
            [violation.second_argument for violation in violations], "1", "%"
        ),
        "fraction of the validity range": TableColumn(
            [violation.area_fraction for violation in violations], "1", "%"
        ),
        "worst at pressure": TableColumn(
            [violation.worst_point[0] for violation in violations], "Pa", "kPa"
        ),
        "worst at contraction": TableColumn(
            [violation.worst_point[1] for violation in violations], "1", "%"
        ),
    }
    return Table(
        name, title, columns, "`airmuscle fit --shape` fits a surface without such regions."
    )
