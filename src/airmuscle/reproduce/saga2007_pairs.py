"""Five outlines by three closures of the straight-fibre muscle, each held against its exact meridian.

The outline says what shape the fibres take, the closure which balance gives the force; the previous model, of
Ferraresi et al. 2001, is the circle with the balance at the middle.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from ..characteristic.rubber import AlongArc, RubberIntegral, RubberLine
from ..core import autodiff
from ..core.arrays import Array
from ..core.declaration import model
from ..core.ops import Value
from ..geometry.catenary import Catenary
from ..geometry.circular_arc import CircularArc
from ..geometry.meridian import Segment
from ..geometry.parabola import Parabola, TrueArcParabola
from ..geometry.pleated import PleatedTube
from ..geometry.straight_fibre import FibreTube, StraightFibre
from ..report.chapter import Table
from .saga2007_muscle import DIAMETER, LENGTH, LINES, WALL, exact_meridian

OUTLINES: dict[str, FibreTube] = {
    "parabola (3)": StraightFibre(LENGTH, DIAMETER, meridian=Parabola()),
    "parabola, true arc": StraightFibre(LENGTH, DIAMETER, meridian=TrueArcParabola()),
    "catenary": StraightFibre(LENGTH, DIAMETER, meridian=Catenary()),
    "circle": StraightFibre(LENGTH, DIAMETER, meridian=CircularArc()),
    "exact without rubber": PleatedTube(LENGTH, DIAMETER),
}
CONTRACTIONS = np.array([0.01, 0.05, 0.10, 0.20, 0.30, 0.40])
EVEN_SPREAD = 1 / np.pi
"""M/m of evenly spread fibres, which every outline of revolution needs."""


class ForceBalance(NamedTuple):
    """F = p area - rubber."""

    area: Array
    """F/p without rubber [m2]."""
    rubber: Array
    """What the rubber takes [N]."""


@model
class SegmentEnergy:
    """The rubber's energy of one segment over contraction, to be differentiated."""

    tube: StraightFibre
    rubber: RubberLine

    def energy(self, contraction: Value) -> Value:
        segment = self.tube.segment(contraction)
        return WALL * self.rubber.energy(segment.arc_excess, segment.arc_excess_squared, segment.end_radius)


def _energy_derivative(tube: FibreTube, rubber: RubberLine, contraction: Array) -> Array:
    """dU/deps [J] of one segment; the exact outline, which has no formula, by differences."""
    if isinstance(tube, StraightFibre):
        return np.asarray(autodiff.derivative(SegmentEnergy(tube, rubber), "energy", contraction))

    if not (rubber.slope or rubber.intercept):
        return np.zeros_like(contraction)

    def energy(at: Array) -> Array:
        segment = tube.segment(at)
        return np.asarray(WALL * rubber.energy(segment.arc_excess, segment.arc_excess_squared, tube.end_radius))

    step = 1e-3 * contraction
    wide, narrow = (energy(contraction + n * step) - energy(contraction - n * step) for n in (2, 1))
    return (8 * narrow - wide) / (12 * step)


def _moment_balance(segment: Segment, sine_or_slope: Value, radius: Value, rubber: Value) -> ForceBalance:
    lever = EVEN_SPREAD * sine_or_slope
    return ForceBalance(segment.half_section / lever - np.pi * radius**2, rubber / lever)


def force_balances(
    tube: FibreTube, rubber: RubberLine, contraction: Array, along: RubberIntegral = AlongArc()
) -> dict[str, ForceBalance]:
    """The three closures of one outline over contraction, w = 1 and M = m/pi; the rubber of the balances `along`."""
    segment = tube.segment(contraction)
    hoop = WALL * along.hoop_stress(rubber, segment)
    growth = tube.volume_growth(contraction) / tube.resting_length
    return {
        "end balance": _moment_balance(segment, segment.end_slope, segment.end_radius, hoop),
        "middle balance": _moment_balance(segment, segment.end_sine, segment.largest_radius, hoop),
        "virtual work": ForceBalance(growth, _energy_derivative(tube, rubber, contraction) / tube.fibre_length),
    }


def balance_pressure(share: ForceBalance, force: float) -> Array:
    """(F + rubber)/area [Pa]; NaN where the area is not positive: past the pole nothing balances."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(share.area > 0, (force + share.rubber) / share.area, np.nan)


@functools.lru_cache(maxsize=16)
def _all_balances(rubber: RubberLine, contraction: tuple[float, ...]) -> dict[tuple[str, str], ForceBalance]:
    """All 15 pairs (outline, closure), kept for the loads that ask for them."""
    at = np.array(contraction)
    return {
        (outline, closure): share
        for outline, tube in OUTLINES.items()
        for closure, share in force_balances(tube, rubber, at).items()
    }


def pressures(rubber: RubberLine, force: float, contraction: Array) -> dict[tuple[str, str], Array]:
    """The pressure [Pa] of each of the 15 pairs (outline, closure)."""
    return {pair: balance_pressure(share, force) for pair, share in _all_balances(rubber, tuple(contraction)).items()}


def ideal_errors(contraction: Array) -> dict[tuple[str, str], Array]:
    """Error of F/p of each pair against the exact meridian, both without rubber [1]."""
    truth = np.asarray(PleatedTube(LENGTH, DIAMETER).area(contraction))
    found = _all_balances(RubberLine(0.0, 0.0), tuple(contraction))
    return {pair: share.area / truth - 1 for pair, share in found.items()}


def errors(rubber: RubberLine, force: float, contraction: Array) -> dict[tuple[str, str], Array]:
    """Error of the pressure of each pair against the exact meridian with rubber [1]; NaN where either has none."""
    truth = np.asarray(exact_meridian(rubber).balance_at(contraction, force).pressure)
    return {pair: found / truth - 1 for pair, found in pressures(rubber, force, contraction).items()}


def tables() -> tuple[Table, ...]:
    """The 15 pairs without rubber, and with it under two loads."""
    found = [_table("ideal", "tension over pressure, no rubber", ideal_errors(CONTRACTIONS))]
    for name, line in LINES.items():
        for force in (0.0, 100.0):
            title = f"pressure with rubber line {name} at {force:g} N"
            found.append(_table(f"{name}_{force:g}N".lower(), title, errors(line, force, CONTRACTIONS)))
    return tuple(found)


def _table(name: str, title: str, rows: dict[tuple[str, str], Array]) -> Table:
    columns: dict[str, list[Any]] = {
        "outline": [outline for outline, _ in rows],
        "closure": [closure for _, closure in rows],
    }
    for i, c in enumerate(CONTRACTIONS):
        columns[f"error at {c:.0%} [%]"] = [round(100 * float(row[i]), 2) for row in rows.values()]
    note = (
        "Against the exact meridian of the same muscle. w = 1, M = m/pi, rubber along the arc. nan: past the pole, "
        "or no exact shape (line A unloaded at 1 %). The previous model is the circle with the middle balance."
    )
    return Table(f"saga2007_pairs_{name}", f"Error of outline and closure: {title}", columns, note)


if __name__ == "__main__":
    for table in tables():
        print(f"\n{table.title}")
        for row in zip(*table.columns.values(), strict=True):
            print("  ".join(f"{cell!s:>22}" if isinstance(cell, str) else f"{cell:9.2f}" for cell in row))
