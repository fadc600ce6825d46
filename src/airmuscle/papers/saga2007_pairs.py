"""Pairs of outline and closure of the straight-fibre muscle, compared with its exact meridian.

The outline is the shape of the fibres, the closure the balance that determines the force: five
outlines and three closures. The previous model, Ferraresi et al. 2001, is the circle with the
balance at the middle.
"""

import functools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

import airmuscle as am

from ..core import Array, Value, autodiff, model
from ..physics.muscle.characteristic.rubber import RubberIntegral
from ..physics.muscle.geometry.meridian import Segment
from ..physics.muscle.geometry.straight_fibre import FibreTube
from ..report.chapter import Table
from .run import titled
from .saga2007_muscle import DIAMETER, EVEN_SPREAD, LENGTH, LINES, WALL, exact_meridian

OUTLINES: dict[str, FibreTube] = {
    "parabola (3)": am.geometry.StraightFibre(LENGTH, DIAMETER, meridian=am.geometry.Parabola()),
    "parabola, true arc": am.geometry.StraightFibre(
        LENGTH, DIAMETER, meridian=am.geometry.TrueArcParabola()
    ),
    "catenary": am.geometry.StraightFibre(LENGTH, DIAMETER, meridian=am.geometry.Catenary()),
    "circle": am.geometry.StraightFibre(LENGTH, DIAMETER, meridian=am.geometry.CircularArc()),
    "exact without rubber": am.geometry.PleatedTube(LENGTH, DIAMETER),
}
CONTRACTIONS = np.array([0.01, 0.05, 0.10, 0.20, 0.30, 0.40])


class ForceBalance(NamedTuple):
    """Force balance F = p area - rubber: the area is F/p without rubber [m2], the rubber its force
    [N].
    """

    area: Array
    rubber: Array

    def pressure(self, force: float) -> Array:
        """(F + rubber)/area [Pa]; NaN where the area is not positive: beyond the pole there is no
        equilibrium.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.area > 0, (force + self.rubber) / self.area, np.nan)


@model
class SegmentEnergy:
    """Elastic energy of the rubber of one segment as a function of contraction."""

    tube: am.geometry.StraightFibre
    rubber: am.characteristic.RubberLine

    def energy(self, contraction: Value) -> Value:
        segment = self.tube.segment(contraction)
        return WALL * self.rubber.energy(
            segment.arc_excess, segment.arc_excess_squared, segment.end_radius
        )


def _energy_derivative(
    tube: FibreTube, rubber: am.characteristic.RubberLine, contraction: Array
) -> Array:
    """Return dU/deps [J] of one segment; for the exact outline, which is not closed-form, by finite
    differences.
    """
    if isinstance(tube, am.geometry.StraightFibre):
        return np.asarray(autodiff.derivative(SegmentEnergy(tube, rubber), "energy", contraction))

    if not (rubber.slope or rubber.intercept):
        return np.zeros_like(contraction)

    def energy(values: Array) -> Array:
        segment = tube.segment(values)
        return np.asarray(
            WALL * rubber.energy(segment.arc_excess, segment.arc_excess_squared, tube.end_radius)
        )

    step = 1e-3 * contraction
    wide, narrow = (energy(contraction + n * step) - energy(contraction - n * step) for n in (2, 1))
    return (8 * narrow - wide) / (12 * step)


def _moment_balance(
    segment: Segment, sine_or_slope: Value, radius: Value, rubber: Value
) -> ForceBalance:
    lever = EVEN_SPREAD * sine_or_slope
    return ForceBalance(segment.half_section / lever - np.pi * radius**2, rubber / lever)


def force_balances(
    tube: FibreTube,
    rubber: am.characteristic.RubberLine,
    contraction: Array,
    along: RubberIntegral = am.characteristic.ArcIntegral(),
) -> dict[str, ForceBalance]:
    """Return the three closures of one outline, w = 1 and M = m/pi; `along` is the rubber integral
    of the balances.
    """
    segment = tube.segment(contraction)
    hoop = WALL * along.hoop_stress(rubber, segment)
    growth = tube.volume_derivative(contraction) / tube.resting_length
    return {
        "end balance": _moment_balance(segment, segment.end_slope, segment.end_radius, hoop),
        "middle balance": _moment_balance(segment, segment.end_sine, segment.max_radius, hoop),
        "virtual work": ForceBalance(
            growth, _energy_derivative(tube, rubber, contraction) / tube.fibre_length
        ),
    }


Pair = tuple[str, str]
"""Names of an outline and a closure."""


@functools.lru_cache(maxsize=16)
def _all_balances(
    rubber: am.characteristic.RubberLine, contraction: tuple[float, ...]
) -> dict[Pair, ForceBalance]:
    """Return the balances of all 15 pairs; cached, as they do not depend on the load."""
    return {
        (outline, closure): balance
        for outline, tube in OUTLINES.items()
        for closure, balance in force_balances(tube, rubber, np.array(contraction)).items()
    }


def pressures(
    rubber: am.characteristic.RubberLine, force: float, contraction: Array
) -> dict[Pair, Array]:
    """Return the pressure [Pa] of each of the 15 pairs."""
    balances = _all_balances(rubber, tuple(contraction))
    return {pair: balance.pressure(force) for pair, balance in balances.items()}


def ideal_errors(contraction: Array) -> dict[Pair, Array]:
    """Return the relative error of F/p of each pair, compared with the exact meridian, both without
    rubber [1].
    """
    reference = np.asarray(am.geometry.PleatedTube(LENGTH, DIAMETER).effective_area(contraction))
    balances = _all_balances(am.characteristic.RubberLine(0.0, 0.0), tuple(contraction))
    return {pair: balance.area / reference - 1 for pair, balance in balances.items()}


def errors(
    rubber: am.characteristic.RubberLine, force: float, contraction: Array
) -> dict[Pair, Array]:
    """Return the relative pressure errors [1] to the exact meridian with rubber; NaN where one is
    undefined.
    """
    reference = np.asarray(exact_meridian(rubber).shape_at_force(contraction, force).pressure)
    return {
        pair: value / reference - 1 for pair, value in pressures(rubber, force, contraction).items()
    }


def pressure_table(
    name: str,
    rows: Sequence[tuple[str, float, Array]],
    contraction: Array = CONTRACTIONS,
    kind: str = "model",
    digits: int = 6,
) -> Table:
    """Return a table of pressures [Pa] over contraction by model and load [N]."""
    columns: dict[str, list[Any]] = {kind: [r[0] for r in rows], "load [N]": [r[1] for r in rows]}
    for i, c in enumerate(contraction):
        columns[f"pressure at {100 * c:g} % [MPa]"] = [
            round(float(r[2][i]) / 1e6, digits) for r in rows
        ]
    return titled(name, columns)


NOTE = (
    r"Compared with the exact meridian of the same muscle; \(w = 1\), \(M = m/\pi\), rubber along"
    r" the arc. No "
    "value: beyond the pole, or no exact outline (line A without load at 1 %). The previous model"
    " is the circle "
    "with the middle balance; its printed sum over the fibres is 1.3 % smaller than that used here."
)


def tables() -> Iterator[Table]:
    """Yield the errors of the 15 pairs without rubber, and with rubber at two loads."""
    found = {"ideal": ("tension per pressure, without rubber", ideal_errors(CONTRACTIONS))}
    for name, line in LINES.items():
        for force in (0.0, 100.0):
            what = f"pressure with rubber line {name} at {force:g} N"
            found[f"{name}_{force:g}N".lower()] = what, errors(line, force, CONTRACTIONS)
    for key, (what, rows) in found.items():
        columns: dict[str, list[Any]] = {"outline": [outline for outline, _ in rows]}
        columns["closure"] = [closure for _, closure in rows]
        for i, c in enumerate(CONTRACTIONS):
            columns[f"error at {100 * c:g} % [%]"] = [
                round(100 * float(row[i]), 2) for row in rows.values()
            ]
        yield Table(
            f"saga2007_pairs_{key}",
            f"Error of the pairs of outline and closure: {what}",
            columns,
            NOTE,
        )
