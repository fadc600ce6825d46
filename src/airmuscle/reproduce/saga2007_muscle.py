"""The muscle of Table 1 of Saga et al. 2007, in the readings of the paper and as better models have it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..characteristic.base import Characteristic
from ..characteristic.circle_virtual_work import CircleVirtualWork
from ..characteristic.exact_meridian import ExactMeridian
from ..characteristic.rubber import AlongArc, RubberLine
from ..characteristic.saga2007 import LINE_A, LINE_B, Saga2007
from ..core.errors import SolveError
from ..geometry.fibre_sum import EvenSpread
from ..geometry.parabola import Parabola
from ..geometry.pleated import PleatedTube
from ..geometry.straight_fibre import StraightFibre

LENGTH, DIAMETER, WALL = 0.072, 0.012, 0.002
"""Fibre length, end diameter and wall [m] of Table 1."""
PRESSURE = 0.11e6
"""The gauge pressure [Pa] of the paper's claims."""

DEFAULT = Saga2007(StraightFibre(LENGTH, DIAMETER, meridian=Parabola()), LINE_B, WALL)
"""As printed (w = 2, q = 1) with the mended fibre sum and line B."""
LINES = {"A": LINE_A, "B": LINE_B}


def interpretation(rubber: RubberLine, projection_factor: float, slope_factor: float, rings: int = 0) -> Saga2007:
    """Table 1 in one reading, with the fibre sum over the half and the rubber along the axis."""
    law = replace(DEFAULT, rubber=rubber, projection_factor=projection_factor, slope_factor=slope_factor)
    return with_rings(law, rings)


def exact_mechanics(rubber: RubberLine, rings: int = 0) -> Saga2007:
    """The only reading that is exact mechanics, short of the parabola itself."""
    return replace(interpretation(rubber, 1.0, 2.0, rings), fibre_sum=EvenSpread(), rubber_integral=AlongArc())


def with_rings(law: Saga2007, rings: int) -> Saga2007:
    """The same muscle divided by so many rings."""
    return replace(law, geometry=replace(law.geometry, rings=rings))


INTERPRETATIONS: dict[str, Saga2007] = {
    f"w {w}, q {q}, line {name}": interpretation(line, float(w), float(q))
    for w in (2, 1)
    for q in (1, 2)
    for name, line in LINES.items()
} | {f"exact mechanics, line {name}": exact_mechanics(line) for name, line in LINES.items()}
"""The readings side by side, w projection, q slope; the last two have w 1, q 2, M = m/pi and rubber along the arc."""


def exact_meridian(rubber: RubberLine, rings: int = 0) -> ExactMeridian:
    """The muscle without an assumed outline."""
    return ExactMeridian(PleatedTube(LENGTH, DIAMETER, rings), rubber, WALL)


def circular_meridian(rubber: RubberLine, rings: int = 0) -> CircleVirtualWork:
    """The muscle with a circular meridian and virtual work."""
    return CircleVirtualWork(StraightFibre(LENGTH, DIAMETER, rings), rubber, WALL)


def contraction_at(law: Characteristic, pressure: float, force: float) -> float:
    """The contraction [1] that a pressure [Pa] reaches under a load [N]: the greatest that needs no more than it.

    Zero where the tube stays straight, the end of the law's reach where the muscle runs away.
    """
    low, high = law.contraction_range
    grid = np.linspace(max(low, 1e-3), high * (1 - 1e-6), 150)
    needed = pressure_along(law, grid, force)
    enough = np.flatnonzero(needed <= pressure)
    if not enough.size:
        return 0.0
    if enough[-1] == grid.size - 1:
        return float(high)
    try:
        return float(law.contraction(pressure, force))
    except SolveError:
        return float(grid[enough[-1]])


def pressure_along(law: Characteristic, contraction: Any, force: float) -> Any:
    """Pressures [Pa] over contractions, NaN where the law has none."""
    if isinstance(law, Saga2007):
        return law.balancing_pressure(contraction, force)
    if isinstance(law, ExactMeridian):
        return np.asarray(law.balance_at(contraction, force).pressure)
    return np.asarray(law.pressure(contraction, force))
