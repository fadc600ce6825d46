"""Force of a law beyond its range: stretched sleeve, slack muscle, greatest force.

Inside its range a law is its formula. Every muscle of a plant, and with it every outlet, traces
`extended_force`; calls of a law with numbers outside its range evaluate the same function.
"""

import dataclasses
from typing import Any

import numpy as np  # noqa: TID251  (whether numbers are inside is not traced)

from ....core import INFINITY, PhysicsError, TraceError, Value, autodiff, ops
from .modes import formula_alone, values_or_nan
from .validity_range import FORCE_BOUNDS, ValidityRange, states_validity_range

OVERLOAD = 1.5
"""Greatest force beyond the range, as a multiple of the rated force (chosen)."""
MIN_RATED_FORCE = 1e-3
"""Least rated force [N], for a law that does not pull at the ends of its range (chosen)."""
STRAIGHT_FIBRES = 1e-4
"""Contraction [1] at which the greatest force of straight fibres is taken, which is infinite at 0
(chosen: the range of the exact meridian begins there)."""
SEARCHED_CONTRACTIONS = (-0.05, 0.6)
"""Contractions [1] between which a law without a range of its own is searched for solutions."""
_STEP = 1e-5
"""Step of the stiffness of a law without derivatives, as a share of its range (chosen)."""


@dataclasses.dataclass(frozen=True)
class ForceRange:
    """Range in which a law is its formula, and the permitted force of its muscle.

    Without a stated validity range it is the contraction range of the law, at any pressure. The
    values are numbers, or symbols of parameters while a muscle is traced.
    """

    min_contraction: Value
    max_contraction: Value
    end: Value
    """Contraction up to which the formula holds: that of the law itself where it reaches further
    than the validity range."""
    pressure: tuple[Value, Value] | None = None
    """Lower and upper limit of the gauge pressure [Pa]; None without a stated validity range."""
    permitted_force: Value = None
    """Force that the maker permits [N], its upper bound if he states none; None without ratings."""

    @classmethod
    def of(
        cls,
        law: Any,
        stated: ValidityRange | None = None,
        permitted_force: Value = None,
    ) -> "ForceRange":
        """The range of a law with this validity range, by default that of its fit."""
        refuses = law.refuses_beyond and not law.begins_at_straight_fibres
        own: tuple[Value, Value] = (-INFINITY, INFINITY) if refuses else law.formula_range
        known: Any = law if stated is None and states_validity_range(law) else stated
        if known is None:
            return cls(own[0], own[1], own[1], None, permitted_force)
        low, high = ops.minimum(known.min_contraction, 0.0), known.max_contraction
        end = high if own is SEARCHED_CONTRACTIONS else ops.maximum(high, own[1])
        return cls(low, high, end, (known.min_pressure, known.max_pressure), permitted_force)

    @property
    def limits_inside(self) -> bool:
        """Whether the force is limited inside as well, by a rating without a validity range."""
        return self.pressure is None and self.permitted_force is not None

    @property
    def stated_force(self) -> float | None:
        """Permitted force [N] as a number; None where the maker states none."""
        if self.permitted_force is None or self.permitted_force >= FORCE_BOUNDS[1]:
            return None
        return float(self.permitted_force)

    def contains(self, pressure: Value, contraction: Value) -> Value:
        """Whether points are inside, limits included; arrays broadcast."""
        inside = (contraction >= self.min_contraction) & (contraction <= self.max_contraction)
        if self.pressure is None:
            return inside & (pressure == pressure)
        return inside & (pressure >= self.pressure[0]) & (pressure <= self.pressure[1])

    def greatest_force(self, law: Any, zero: Value = 0.0) -> Value:
        """Greatest force of the law at the corners of its range [N]."""
        begin = self.min_contraction
        pressures = (self.pressure or law.pressure_range)[::-1]
        if law.begins_at_straight_fibres:
            begin = ops.maximum(begin, STRAIGHT_FIBRES)
            pressures = pressures[:1]  # where the force is greatest
        greatest: Value = MIN_RATED_FORCE
        for pressure in pressures:
            for contraction in (begin, self.end):
                force = formula_or_slack(law, zero + pressure, zero + contraction, begin)
                greatest = ops.maximum(greatest, force)
        return greatest

    def rated_force(self, greatest: Value) -> Value:
        """Permitted force of the maker [N]; where he states none, the greatest inside the range."""
        if self.permitted_force is None:
            return greatest
        is_stated = self.permitted_force < FORCE_BOUNDS[1]
        return ops.where(is_stated, ops.maximum(self.permitted_force, MIN_RATED_FORCE), greatest)

    def limited(self, force: Value, rated: Value, greatest: Value) -> Value:
        """The force up to 1.5 times the rated one, where a range or a rating is stated."""
        if self.pressure is not None:
            return ops.minimum(force, ops.maximum(OVERLOAD * rated, greatest))
        if self.permitted_force is None:
            return force
        is_stated = self.permitted_force < FORCE_BOUNDS[1]
        return ops.minimum(force, ops.where(is_stated, OVERLOAD * rated, 1e3 * FORCE_BOUNDS[1]))


def formula_or_slack(law: Any, pressure: Value, contraction: Value, begin: Value) -> Value:
    """Force of the formula [N]; zero for a law that is solved for the pressure or the contraction
    where it has no solution above the beginning of the range, because there the muscle is slack.
    """
    try:
        force = law.force(pressure, contraction)
    except PhysicsError:
        p, c = np.broadcast_arrays(pressure, contraction)
        force = values_or_nan(law.force, p.ravel(), c.ravel()).reshape(p.shape)
        if (np.isnan(force) & (c <= begin)).any():
            raise
    if ops.is_traced(pressure, contraction, force) or not np.isnan(force).any():
        return force
    return np.where(np.isnan(force) & (contraction > begin), 0.0 * pressure, force)[()]


def extended_force(law: Any, limits: ForceRange, pressure: Value, contraction: Value) -> Value:
    """Force of a law [N] at any gauge pressure [Pa] and contraction [1]; inside the range its
    formula, to the last bit.

    Below the range the muscle is a stretched sleeve, with the stiffness of the law at the beginning
    of the range and at this pressure; above it, and above the own range of the law, the force falls
    with the mean stiffness, the rated force over the width of the range, to zero and below, where
    the muscle is slack. In pressure
    the formula continues. The force is at most 1.5 times the rated one; without a stated range, the
    sleeve adds at most 0.5 times the rated force.
    """
    with formula_alone():
        if law.begins_at_straight_fibres:
            return _bounded_at_straight_fibres(law, limits, pressure, contraction)
        if not ops.is_traced(pressure, contraction, limits.min_contraction) and np.all(
            limits.contains(pressure, contraction)
        ):
            force = law.force(pressure, contraction)
            if not limits.limits_inside:
                return force
            greatest = limits.greatest_force(law)
            return limits.limited(force, limits.rated_force(greatest), greatest)
        inner = ops.clip(contraction, limits.min_contraction, limits.end)
        force = formula_or_slack(law, pressure, inner, limits.min_contraction)
        # a constant of the kind of the arguments, as which a traced law is evaluated at a number
        zero = 0.0 * contraction if ops.is_traced(contraction) else 0.0
        greatest = limits.greatest_force(law, zero)
        rated = limits.rated_force(greatest)
        slackening = rated / (limits.end - limits.min_contraction)
        stretch = inner - contraction
        sleeve = _sleeve_force(law, limits, pressure, stretch, force)
        added = ops.where(stretch > 0.0, sleeve, slackening * stretch)
        if limits.pressure is None:
            added = ops.minimum(added, (OVERLOAD - 1.0) * rated)
        extended = force + added
        if hasattr(law, "max_force"):  # its own limit holds everywhere
            extended = ops.minimum(extended, law.max_force)
        return limits.limited(extended, rated, greatest)


def unlimited_force(law: Any, limits: ForceRange, pressure: Value, contraction: Value) -> Value:
    """Force of a law [N] before the limits of law and range are applied, in which inverses and the
    statics of joints search: the formula, continued as in `extended_force` and by its tangent below
    the range, so that it is affine in the pressure where the law is; negative where the muscle
    would push. Laws that refuse what lies beyond their range are their formula.
    """
    with formula_alone():
        if law.refuses_beyond:
            return law.unclamped_force(pressure, contraction)
        inner = ops.clip(contraction, limits.min_contraction, limits.end)
        force = law.unclamped_force(pressure, inner)
        if not ops.is_traced(contraction, limits.min_contraction) and np.all(inner == contraction):
            return force
        zero = 0.0 * contraction if ops.is_traced(contraction) else 0.0
        rated = limits.rated_force(limits.greatest_force(law, zero))
        slackening = rated / (limits.end - limits.min_contraction)
        stretch = inner - contraction
        slope = _slope_at_begin(law, limits, pressure, stretch)
        return force + ops.where(stretch > 0.0, -slope, slackening) * stretch


def _sleeve_force(
    law: Any, limits: ForceRange, pressure: Value, stretch: Value, force: Value
) -> Value:
    """Force [N] that a stretch [1] adds to that at the beginning of the range; where the law is
    slack there, after the stretch that tightens it."""
    begin = limits.min_contraction
    # a stretch never relieves the sleeve, whatever the law does at the beginning of its range
    stiffness = ops.maximum(-_slope_at_begin(law, limits, pressure, stretch), 0.0)
    if not law.has_limits:
        return stiffness * stretch
    slack = ops.maximum(force - law.unclamped_force(pressure, begin), 0.0)
    return ops.maximum(stiffness * stretch - slack, 0.0)


def _slope_at_begin(law: Any, limits: ForceRange, pressure: Value, stretch: Value) -> Value:
    """Slope dF/deps of the law [N] at the beginning of its range, where a point is below it."""
    begin = limits.min_contraction
    name = "unclamped_force" if law.has_limits else "force"
    if ops.is_traced(pressure, begin, stretch):
        return autodiff.derivative(law, name, pressure, begin, wrt=1)
    if not np.any(stretch > 0.0):
        return 0.0
    if not law.traceable:
        step = _STEP * (limits.max_contraction - begin)
        return (law.force(pressure, begin + step) - law.force(pressure, begin)) / step
    try:
        return autodiff.derivative(law, name, pressure, begin, wrt=1)
    except TraceError:  # a law that is solved for the pressure or the contraction
        return law.slopes(pressure, begin).by_contraction


def _bounded_at_straight_fibres(
    law: Any, limits: ForceRange, pressure: Value, contraction: Value
) -> Value:
    """The formula up to 1.5 times the rated force: nothing stretches straight fibres, so that a run
    ends where their geometry ends."""
    zero = 0.0 * contraction if ops.is_traced(contraction) else 0.0
    rated = limits.rated_force(limits.greatest_force(law, zero))
    return ops.minimum(law.force(pressure, contraction), OVERLOAD * rated)
