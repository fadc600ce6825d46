"""Muscle of Saga et al. 2007: interpretations of the paper, meridians, and the values that the
claims concern.
"""

import contextlib
import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import airmuscle as am

from ..core import SolveError
from ..physics.muscle.characteristic.saga2007 import LINE_A, LINE_B

PAPER = "saga2007"
EVEN_SPREAD = 1 / np.pi
"""M/m of evenly distributed fibres, as required for every outline of revolution."""
LENGTH = 0.072
DIAMETER = 0.012
WALL = 0.002
"""Fibre length, end diameter and wall thickness [m] of Table 1."""
PRESSURE = 0.11e6
"""The gauge pressure [Pa] of the paper's claims."""

DEFAULT = am.characteristic.Saga2007(
    am.geometry.StraightFibre(LENGTH, DIAMETER, meridian=am.geometry.Parabola()), LINE_B, WALL
)
"""The printed model (w = 2, q = 1) with the corrected fibre sum and line B."""
LINES = {"A": LINE_A, "B": LINE_B}


def interpretation(
    rubber: am.characteristic.RubberLine,
    projection_factor: float,
    slope_factor: float,
    rings: int = 0,
) -> am.characteristic.Saga2007:
    """Return the muscle in one interpretation, with the fibre sum over the half and the rubber
    along the axis.
    """
    law = replace(
        DEFAULT, rubber=rubber, projection_factor=projection_factor, slope_factor=slope_factor
    )
    return with_rings(law, rings)


def exact_mechanics(
    rubber: am.characteristic.RubberLine, rings: int = 0
) -> am.characteristic.Saga2007:
    """Return the only interpretation that is exact mechanics, except for the parabolic outline
    itself.
    """
    law = interpretation(rubber, 1.0, 2.0, rings)
    along = am.characteristic.ArcIntegral()
    return replace(law, fibre_sum=am.geometry.UniformFibreSum(), rubber_integral=along)


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
"""All interpretations by name; the last two have w = 1, q = 2, M = m/pi and the rubber along the
arc.
"""


def exact_meridian(
    rubber: am.characteristic.RubberLine, rings: int = 0
) -> am.characteristic.ExactMeridian:
    """Return the exact meridian of the muscle, without an assumed outline."""
    return am.characteristic.ExactMeridian(
        am.geometry.PleatedTube(LENGTH, DIAMETER, rings), rubber, WALL
    )


def circular_meridian(
    rubber: am.characteristic.RubberLine, rings: int = 0
) -> am.characteristic.CircleVirtualWork:
    """Return the muscle with a circular meridian, whose force follows from virtual work."""
    return am.characteristic.CircleVirtualWork(
        am.geometry.StraightFibre(LENGTH, DIAMETER, rings), rubber, WALL
    )


def contraction_at(law: am.characteristic.Characteristic, pressure: float, force: float) -> float:
    """Return the contraction [1] at a pressure [Pa] and a load [N]: the largest that requires at
    most this pressure.

    Zero if the tube remains straight; the end of the law's contraction range if that end is
    reachable.
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
    """Return the pressures [Pa] for contractions [1] at a load [N]; NaN where the law is
    undefined.
    """
    if isinstance(law, am.characteristic.Saga2007):
        return law.equilibrium_pressure(contraction, force)
    if isinstance(law, am.characteristic.ExactMeridian):
        return np.asarray(law.shape_at_force(contraction, force).pressure)
    return np.asarray(law.pressure(contraction, force))


Law = am.characteristic.Saga2007 | am.characteristic.ExactMeridian

FIG_2 = (0.05, 0.10, 0.15, 0.20, 0.25)
"""Contractions of the outlines in Fig. 2 [1]."""
SMALL = 0.10
LARGE = 0.30
"""Contractions between which the pressure should change little [1] (chosen)."""
THICK_WALL = 1.5 * WALL
"""Thicker wall [m], to endure a higher pressure (chosen)."""


def contraction(law: am.characteristic.Characteristic) -> tuple[float, str]:
    """Return the contraction [%] at 0.11 MPa without load."""
    reached = contraction_at(law, PRESSURE, 0.0)
    at_end = reached >= law.contraction_range[1] * (1 - 1e-6)
    note = (
        "The model needs less than 0.11 MPa over its whole range, so the value is its end."
        if at_end
        else ""
    )
    note += (
        "Even the exact meridian does not reach 35 %."
        if isinstance(law, am.characteristic.ExactMeridian)
        else ""
    )
    return 100 * reached, note


def lifting(law: am.characteristic.Characteristic) -> tuple[float, str]:
    """Return the contraction [%] at 0.11 MPa and 200 N."""
    reached = contraction_at(law, PRESSURE, 200.0)
    return 100 * reached, "As a separate maximum, at small contraction, 200 N is reached." * (
        0 < reached < 0.1
    )


def initial_pressure(law: am.characteristic.Saga2007) -> float:
    """Return the pressure [Pa] for 1 % contraction without load."""
    return float(law.equilibrium_pressure(0.01, 0.0))


def ring_ratio(law: am.characteristic.Saga2007, force: float) -> tuple[float, str]:
    """Return the minimum ratio [1], up to 35 %, of the pressures with one ring more and without
    it.
    """
    contraction = np.geomspace(1e-7, 0.35, 200)
    pressures = [
        np.asarray(pressure_along(with_rings(law, n), contraction, force)) for n in (0, 1, 2)
    ]
    falling = any(with_rings(law, n).snap_through_load > force for n in (1, 2))
    note = (
        "Where the pressure falls with contraction, equal segments contract unequally."
        if falling
        else ""
    )
    return min(float(np.min(more / fewer)) for fewer, more in itertools.pairwise(pressures)), note


def strength_ratio(
    law: am.characteristic.Saga2007, force: float, measure: Callable[[Any, float], Any]
) -> Any:
    """Return the ratio of a measure of the load of the muscle with two rings and without at 0.11
    MPa [1].
    """
    muscles = [with_rings(law, n) for n in (0, 2)]
    try:
        plain, ringed = (
            float(measure(muscle, float(muscle.contraction(PRESSURE, force)))) for muscle in muscles
        )
    except SolveError:
        return None, "One of the two muscles has no stable contraction at 0.11 MPa."
    return ringed / plain


def pressure_error(
    law: am.characteristic.Saga2007, force: float, low: float, high: float, points: int
) -> float:
    """Return the maximum pressure error [%] relative to the exact meridian with the same rubber."""
    exact = exact_meridian(law.rubber, law.geometry.rings)
    at = np.linspace(low, high, points)
    errors = law.equilibrium_pressure(at, force) / exact.shape_at_force(at, force).pressure - 1
    return 100 * float(np.max(np.abs(errors)))


def largest_radius(law: am.characteristic.Saga2007) -> tuple[float, str]:
    """Return the largest radius of the outlines of Fig. 2 [mm]."""
    radii = [1e3 * float(law.geometry.segment(c).max_radius) for c in FIG_2]
    return (
        max(radii),
        f"Largest radii at 5, 10, 15, 20, 25 %: {', '.join(f'{r:.2f}' for r in radii)} mm.",
    )


def share_reached(law: am.characteristic.Saga2007, force: float) -> tuple[float, str]:
    """Return the fraction [1] of target contractions that the pressure of the formula produces from
    rest.
    """
    targets = np.linspace(0.01, 0.35, 35)
    pressures = law.equilibrium_pressure(targets, force)
    met = 0
    for pressure, target in zip(pressures.tolist(), targets.tolist(), strict=True):
        with contextlib.suppress(SolveError):
            met += abs(float(law.contraction(pressure, force)) - target) < 1e-9
    note = "Where the pressure falls with contraction, the muscle snaps past the target. " * (
        met < targets.size
    )
    return met / targets.size, note + "Our copy describes no control experiment."


def tension(law: Law, pressure: float, contraction: np.ndarray | float) -> np.ndarray:
    """Return the tension [N] at a gauge pressure [Pa] and contractions [1]."""
    if isinstance(law, am.characteristic.Saga2007):
        return np.asarray(law.force(pressure, contraction))
    return np.asarray(law.shape_at_pressure(pressure, contraction).force)


def ring_force_ratio(law: Law, factor: float) -> float:
    """Return the tension with one ring at a multiple of 0.11 MPa relative to that without at 0.11
    MPa, at 5 % [1].
    """
    ringed = (
        with_rings(law, 1)
        if isinstance(law, am.characteristic.Saga2007)
        else exact_meridian(law.rubber, 1)
    )
    return float(tension(ringed, factor * PRESSURE, 0.05)) / float(tension(law, PRESSURE, 0.05))


def pressure_change(law: Law, force: float) -> float:
    """Return the relative change of the pressure [%] between two contractions."""
    low, high = pressure_along(law, np.array([SMALL, LARGE]), force)
    return 100 * abs(float(high / low) - 1)


def wall_ratio(law: Law) -> float:
    """Return the pressure for 5 % without load with the thick wall, relative to that of the muscle
    of Table 1 [1].
    """
    other: Law = replace(law, wall_thickness=THICK_WALL)
    return float(
        pressure_along(other, np.array([0.05]), 0.0)[0]
        / pressure_along(law, np.array([0.05]), 0.0)[0]
    )


def middle_strain(exact: bool, contraction: float) -> Any:
    """Return the hoop strain [%] in the middle of the exact outline without rubber, or of that of
    the paper.
    """
    if exact:
        radius = exact_meridian(LINES["A"]).geometry.segment(contraction).max_radius
        return 100 * float(radius / (DIAMETER / 2) - 1)
    note = f"300 % is reached at {100 * DEFAULT.contraction_at_strain(3.0):.3g} %."
    return 100 * float(DEFAULT.middle_strain(contraction)), note


def thinning(contraction: float) -> float:
    """Return the decrease of the pressure [%] if the hoop stress is a true stress in the thinner
    wall, at 100 N.
    """
    nominal, thinned = (
        pressure_with_wall(exact_mechanics(LINES["B"]), contraction, 100.0, thinned)
        for thinned in (False, True)
    )
    return 100 * (1 - thinned / nominal)


def pressure_with_wall(
    law: am.characteristic.Saga2007, contraction: float, force: float, thinned: bool
) -> float:
    """Return the pressure [Pa] of the interpretation of exact mechanics, with the initial or the
    thinned wall.
    """
    segment = law.geometry.segment(contraction)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    x = 0.5 * segment.length * nodes
    curvature = 2 * segment.end_slope / segment.length
    radius = segment.max_radius - 0.5 * curvature * x**2
    arc = 0.5 * segment.length * weights * np.hypot(1.0, curvature * x)
    wall = law.wall_thickness * (segment.end_radius / radius if thinned else 1.0)
    hoop = float(np.sum(law.rubber.stress(radius / segment.end_radius - 1) * wall * arc))
    lever = EVEN_SPREAD * segment.end_slope
    return float(
        (hoop + lever * force) / (segment.half_section - lever * np.pi * segment.end_radius**2)
    )
