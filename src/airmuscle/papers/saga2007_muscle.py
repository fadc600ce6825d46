"""Muscle of Table 1 of Saga et al. 2007: interpretations of the paper, exact meridian and circular meridian."""

from dataclasses import replace
from typing import Any

import numpy as np

import airmuscle as am

from ..core import SolveError
from ..physics.muscle.characteristic.saga2007 import LINE_A, LINE_B

PAPER = "saga2007"
LENGTH, DIAMETER, WALL = 0.072, 0.012, 0.002
"""Fibre length, end diameter and wall thickness [m] of Table 1."""
PRESSURE = 0.11e6
"""The gauge pressure [Pa] of the paper's claims."""

DEFAULT = am.characteristic.Saga2007(
    am.geometry.StraightFibre(LENGTH, DIAMETER, meridian=am.geometry.Parabola()), LINE_B, WALL
)
"""The printed model (w = 2, q = 1) with the corrected fibre sum and line B."""
LINES = {"A": LINE_A, "B": LINE_B}


def interpretation(
    rubber: am.characteristic.RubberLine, projection_factor: float, slope_factor: float, rings: int = 0
) -> am.characteristic.Saga2007:
    """Return the muscle in one interpretation, with the fibre sum over the half and the rubber along the axis."""
    law = replace(DEFAULT, rubber=rubber, projection_factor=projection_factor, slope_factor=slope_factor)
    return with_rings(law, rings)


def exact_mechanics(rubber: am.characteristic.RubberLine, rings: int = 0) -> am.characteristic.Saga2007:
    """Return the only interpretation that is exact mechanics, except for the parabolic outline itself."""
    return replace(
        interpretation(rubber, 1.0, 2.0, rings),
        fibre_sum=am.geometry.UniformFibreSum(),
        rubber_integral=am.characteristic.ArcIntegral(),
    )


def with_rings(law: am.characteristic.Saga2007, rings: int) -> am.characteristic.Saga2007:
    """Return the same muscle divided by the given number of rings."""
    return replace(law, geometry=replace(law.geometry, rings=rings))


def interpretation_name(w: int, q: int, line: str) -> str:
    """Return the name of an interpretation: projection factor w, slope factor q, rubber line."""
    return rf"\(w = {w}\), \(q = {q}\), line {line}"


INTERPRETATIONS: dict[str, am.characteristic.Saga2007] = {
    interpretation_name(w, q, name): interpretation(line, float(w), float(q))
    for w in (2, 1)
    for q in (1, 2)
    for name, line in LINES.items()
} | {f"exact mechanics, line {name}": exact_mechanics(line) for name, line in LINES.items()}
"""All interpretations by name; the last two have w = 1, q = 2, M = m/pi and the rubber along the arc."""


def exact_meridian(rubber: am.characteristic.RubberLine, rings: int = 0) -> am.characteristic.ExactMeridian:
    """Return the exact meridian of the muscle, without an assumed outline."""
    return am.characteristic.ExactMeridian(am.geometry.PleatedTube(LENGTH, DIAMETER, rings), rubber, WALL)


def circular_meridian(rubber: am.characteristic.RubberLine, rings: int = 0) -> am.characteristic.CircleVirtualWork:
    """Return the muscle with a circular meridian, whose force follows from virtual work."""
    return am.characteristic.CircleVirtualWork(am.geometry.StraightFibre(LENGTH, DIAMETER, rings), rubber, WALL)


def contraction_at(law: am.characteristic.Characteristic, pressure: float, force: float) -> float:
    """Return the contraction [1] at a pressure [Pa] and a load [N]: the largest that requires at most this pressure.

    Zero if the tube remains straight; the end of the law's contraction range if that end is reachable.
    """
    low, high = law.contraction_range
    grid = np.linspace(max(low, 1e-3), high * (1 - 1e-6), 150)
    if isinstance(law, am.characteristic.Saga2007):  # its formula is regular at small contraction
        grid = np.concatenate([np.geomspace(1e-9, grid[0], 60, endpoint=False), grid])
    reachable = np.flatnonzero(pressure_along(law, grid, force) <= pressure)
    if not reachable.size:
        return 0.0
    if reachable[-1] == grid.size - 1:
        return float(high)
    try:
        return float(law.contraction(pressure, force))
    except SolveError:
        return float(grid[reachable[-1]])


def pressure_along(law: am.characteristic.Characteristic, contraction: Any, force: float) -> Any:
    """Return the pressures [Pa] for contractions [1] at a load [N]; NaN where the law is undefined."""
    if isinstance(law, am.characteristic.Saga2007):
        return law.equilibrium_pressure(contraction, force)
    if isinstance(law, am.characteristic.ExactMeridian):
        return np.asarray(law.shape_at_force(contraction, force).pressure)
    return np.asarray(law.pressure(contraction, force))
