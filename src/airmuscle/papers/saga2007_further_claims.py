"""Further claims of Saga et al. 2007: force, expansion, wall thickness and diameter, change of pressure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

import airmuscle as am

from ..report.chapter import AtLeast, AtMost, Claim, Equal, Kind
from .saga2007_muscle import (
    DEFAULT,
    DIAMETER,
    LINES,
    PAPER,
    PRESSURE,
    WALL,
    exact_mechanics,
    exact_meridian,
    interpretation,
    interpretation_name,
    pressure_along,
    with_rings,
)
from .saga2007_pairs import EVEN_SPREAD

Law = am.characteristic.Saga2007 | am.characteristic.ExactMeridian

LAWS: Mapping[str, Law] = {
    interpretation_name(2, 1, "B"): DEFAULT,
    interpretation_name(2, 1, "A"): interpretation(LINES["A"], 2.0, 1.0),
    **{f"exact mechanics, line {name}": exact_mechanics(line) for name, line in LINES.items()},
    **{f"exact meridian, line {name}": exact_meridian(line) for name, line in LINES.items()},
}
"""Default, printed model, the two of exact mechanics, and the exact meridian with both rubber lines."""
SMALL, LARGE = 0.10, 0.30
"""Contractions between which the pressure should change little [1] (chosen)."""
LITTLE_CHANGE = 0.25
"""Largest relative change of the pressure that is little (chosen)."""
HIGHER_PRESSURE = 2.0
"""Ratio of the pressure that a muscle with rings withstands to that of the muscle without (chosen)."""
THICK_WALL = 1.5 * WALL
"""Thicker wall [m], to endure a higher pressure (chosen)."""
FIRST_PERCENT = 0.01
"""Contraction at which the largest force is taken [1] (chosen): at 0 inextensible fibres hold any force."""


def further_claims() -> tuple[Claim, ...]:
    """Return all claims of this module."""
    return (
        *largest_force_claims(),
        *expansion_claims(),
        *ring_force_claims(),
        *small_pressure_claims(),
        *wall_claims(),
        *thickness_claims(),
    )


def tension(law: Law, pressure: float, contraction: np.ndarray | float) -> np.ndarray:
    """Return the tension [N] at a gauge pressure [Pa] and contractions [1]."""
    if isinstance(law, am.characteristic.Saga2007):
        return np.asarray(law.force(pressure, contraction))
    return np.asarray(law.shape_at_pressure(pressure, contraction).force)


def largest_force_claims() -> tuple[Claim, ...]:
    """Return the claim of 200 N at 0.11 MPa as a maximum of its own, at small contraction."""
    note = (
        "Tension at 1 % contraction (chosen). Inextensible fibres hold any tension at zero contraction, so that every "
    )
    note += "law reaches 200 N: the statement cannot fail."
    text = "2. About 200 N at 0.11 MPa, as a maximum of its own"
    return tuple(
        Claim(
            PAPER, text, AtLeast(200.0), float(tension(law, PRESSURE, FIRST_PERCENT)), "N", note, name, untestable=True
        )
        for name, law in LAWS.items()
    )


def expansion_claims() -> tuple[Claim, ...]:
    """Return the claim that the tube expands by about 300 %, at two contractions: the paper gives none."""
    note = (
        "Hoop strain in the middle. The paper gives no contraction: 20 % is the limit of its accuracy, 35 % its claim "
    )
    note += "1 (chosen). The tolerance of a tenth is chosen. "
    reached = f"300 % is reached at {100 * DEFAULT.contraction_at_strain(3.0):.3g} %."
    return tuple(
        Claim(PAPER, "The tube expands by about 300 %", Equal(300.0, 30.0), 100 * value, "%", text, f"{case}, {at} %")
        for at in (20, 35)
        for case, value, text in (
            ("outline by (2), (3)", float(DEFAULT.middle_strain(at / 100)), note + reached),
            ("exact outline without rubber", _exact_strain(at / 100), note.strip()),
        )
    )


def _exact_strain(contraction: float) -> float:
    radius = exact_meridian(LINES["A"]).geometry.segment(contraction).max_radius
    return float(radius / (DIAMETER / 2) - 1)


def ring_force_claims() -> tuple[Claim, ...]:
    """Return the claim that rings increase the force, at equal pressure and at the higher one that they permit."""
    note = (
        "Ratio of the tension with one ring to that without at 0.11 MPa, at 5 % contraction (chosen). The paper gives "
    )
    note += "as the reason the higher supply pressure that a muscle with rings withstands; it is not "
    note += "printed, twice the pressure is chosen."
    claims = []
    for name, law in LAWS.items():
        if "exact mechanics" in name:
            continue
        ringed = with_rings(law, 1) if isinstance(law, am.characteristic.Saga2007) else exact_meridian(law.rubber, 1)
        plain = float(tension(law, PRESSURE, 0.05))
        text, bound = "4. Rings increase the force", AtLeast(1.0, derived=True)
        for factor, case in ((1.0, "equal pressure"), (HIGHER_PRESSURE, f"{HIGHER_PRESSURE:g} times the pressure")):
            ratio = float(tension(ringed, factor * PRESSURE, 0.05)) / plain
            claims.append(Claim(PAPER, text, bound, ratio, "1", note, f"{name}, {case}"))
    return tuple(claims)


def small_pressure_claims() -> tuple[Claim, ...]:
    """Return the claim of large contractions with little change of the pressure."""
    note = (
        f"Relative change of the pressure from {100 * SMALL:g} to {100 * LARGE:g} % contraction; the bound is chosen."
    )
    claims = []
    for name, law in LAWS.items():
        for force in (0.0, 100.0):
            low, high = pressure_along(law, np.array([SMALL, LARGE]), force)
            text = "A large contraction requires little change of the pressure"
            bound = AtMost(100 * LITTLE_CHANGE, chosen=True)
            claims.append(
                Claim(PAPER, text, bound, 100 * abs(float(high / low) - 1), "%", note, f"{name}, {force:g} N")
            )
    return tuple(claims)


def wall_claims() -> tuple[Claim, ...]:
    """Return the claim that a thicker wall costs contraction at low pressure: ratio of the pressures for 5 %."""
    note = "Ratio of the pressures for 5 % without load, with a wall of "
    note += (
        f"{1e3 * THICK_WALL:g} mm (chosen) and with that of Table 1: above 1, the contraction needs a higher pressure."
    )
    text = "A thicker wall, to endure pressure, sacrifices contraction at low pressure"
    bound = AtLeast(1.0, derived=True)
    return tuple(
        Claim(PAPER, text, bound, _pressure_ratio(law, THICK_WALL), "1", note, name)
        for name, law in LAWS.items()
        if "exact mechanics" not in name
    )


def _pressure_ratio(law: Law, wall: float) -> float:
    """Return the pressure for 5 % without load with another wall, relative to that of the muscle of Table 1."""
    other: Law = replace(law, wall_thickness=wall)
    return float(pressure_along(other, np.array([0.05]), 0.0)[0] / pressure_along(law, np.array([0.05]), 0.0)[0])


def thickness_claims() -> tuple[Claim, ...]:
    """Return the change of the wall thickness, and its effect on the pressure for a true hoop stress."""
    strain = float(DEFAULT.middle_strain(0.20))
    note = (
        "Thickness in the middle at 20 % contraction relative to that at rest, for incompressible rubber between "
        "inextensible fibres: t (1 + ε) is constant. The bound is chosen."
    )
    text = "5. The wall thickness changes while the tube expands: thickness relative to that at rest"
    claim = Claim(PAPER, text, AtMost(0.95, chosen=True), 1 / (1 + strain), "1", note, "outline by (2), (3)")
    return (claim, *(_thinning_finding(c) for c in (0.20, 0.40)))


def _thinning_finding(contraction: float) -> Claim:
    law = exact_mechanics(LINES["B"])
    nominal, thinned = (pressure_with_wall(law, contraction, 100.0, thinned) for thinned in (False, True))
    text = "5. A thinner wall explains a deviation: decrease of the pressure if the hoop stress is a true stress"
    note = (
        "The stress of the rubber test as a true stress in the thinner wall, instead of a nominal one in the initial "
    )
    note += "wall, which needs no correction. The bound is chosen."
    case = f"exact mechanics, line B, 100 N, {100 * contraction:g} %"
    return Claim(PAPER, text, AtLeast(15.0, chosen=True), 100 * (1 - thinned / nominal), "%", note, case, Kind.FINDING)


def pressure_with_wall(law: am.characteristic.Saga2007, contraction: float, force: float, thinned: bool) -> float:
    """Return the pressure [Pa] of the interpretation of exact mechanics, with the initial or the thinned wall."""
    segment = law.geometry.segment(contraction)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    x = 0.5 * segment.length * nodes
    curvature = 2 * segment.end_slope / segment.length
    radius = segment.max_radius - 0.5 * curvature * x**2
    arc = 0.5 * segment.length * weights * np.hypot(1.0, curvature * x)
    wall = law.wall_thickness * (segment.end_radius / radius if thinned else 1.0)
    hoop = float(np.sum(law.rubber.stress(radius / segment.end_radius - 1) * wall * arc))
    lever = EVEN_SPREAD * segment.end_slope
    return float((hoop + lever * force) / (segment.half_section - lever * np.pi * segment.end_radius**2))
