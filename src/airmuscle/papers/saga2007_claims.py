"""Claims of Saga et al. 2007 as a table, with the models for which each of them is evaluated.

The function of each row takes the model, so that the verdict follows from its fibre sum, projection factor and rubber.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ..physics.muscle.characteristic.saga2007 import RUBBER_TEST_STRAIN
from ..report.claims import AtLeast, AtMost, Claim, ClaimRow, Equal, Kind
from . import saga2007_muscle as values
from .saga2007_joint import FEED_FORWARD
from .saga2007_muscle import DEFAULT, INTERPRETATIONS, LINES, PAPER, PRESSURE, Law, exact_meridian
from .saga2007_previous import PREVIOUS_MODEL

LOW_PRESSURE = 0.04e6
"""Limit of a low pressure [Pa]: a quarter of the pressure axis of Fig. 8 (chosen)."""
ACCURACY_LIMIT = 0.15
"""Limit of the relative pressure error of an accurate model (chosen)."""
LITTLE_CHANGE = 0.25
"""Largest relative change of the pressure that is little (chosen)."""
HIGHER_PRESSURE = 2.0
"""Ratio of the pressure that a muscle with rings withstands to that of the muscle without (chosen)."""
FIRST_PERCENT = 0.01
"""Contraction at which the largest force is taken [1] (chosen): at 0 inextensible fibres hold any force."""

B, A = values.interpretation_name(2, 1, "B"), values.interpretation_name(2, 1, "A")
"""Names of the default, and of the printed model with line A."""
MECHANICS = {f"exact mechanics, line {name}": values.exact_mechanics(line) for name, line in LINES.items()}
EXACT = {f"exact meridian, line {name}": exact_meridian(line) for name, line in LINES.items()}
PRINTED: dict[str, am.characteristic.Saga2007] = {B: DEFAULT, A: values.interpretation(LINES["A"], 2.0, 1.0)}
LAWS: Mapping[str, Law] = {**PRINTED, **MECHANICS, **EXACT}
"""Default, printed model, the two of exact mechanics, and the exact meridian with both rubber lines."""


def _each(laws: Mapping[str, Any], *loads: float) -> dict[str, tuple[Any, ...]]:
    """Return the cases of all laws, each with every load [N] if there are any."""
    if not loads:
        return {name: (law,) for name, law in laws.items()}
    return {f"{name}, {load:g} N": (law, load) for name, law in laws.items() for load in loads}


OUTLINE = "outline by (2), (3)"
RISES, FALLS = AtLeast(1.0, derived=True), AtMost(1.0, derived=True)
"""Criteria of a ratio that must be at least, or at most, 1."""
ACCURATE = 100 * ACCURACY_LIMIT
LIFT = "About 200 N at 0.11 MPa and 35 % or more"
STRENGTH = "Rings raise the pressure that the muscle withstands: ratio of the {} with two rings and without"
STRENGTH_NOTE = "At 0.11 MPa and equal load. The paper gives no strength; the measure is chosen."
LOST = "The paper compares with its measurements, which are lost. A comparison with the exact meridian follows below."

ROWS: Mapping[str, ClaimRow] = {
    "contraction": ClaimRow("Without rings, the contraction exceeds 35 % at 0.11 MPa", AtLeast(35.0), "%",
        values.contraction, "The load is not stated; assumed to be zero.", _each({B: DEFAULT, **EXACT}),
        place="results"),
    "lifting": ClaimRow(LIFT, AtLeast(35.0), "%", values.lifting, "Contraction at 0.11 MPa under a load of 200 N.",
        _each({B: DEFAULT, **INTERPRETATIONS, **EXACT}), place="introduction"),
    "max tension": ClaimRow(LIFT, AtLeast(200.0), "N",
        lambda: PRESSURE * float(exact_meridian(LINES["A"]).geometry.effective_area(0.35)),
        "Maximum tension of inextensible fibres of 72 mm on ends of 12 mm, by virtual work and without rubber; either "
        "rubber line reduces it, so that 200 N and 35 % cannot occur together.", {"tension at 35 %, any rubber": ()},
        place="introduction"),
    "largest force": ClaimRow("About 200 N at 0.11 MPa, as a maximum of its own", AtLeast(200.0), "N",
        lambda law: float(values.tension(law, PRESSURE, FIRST_PERCENT)),
        "Tension at 1 % contraction (chosen). Inextensible fibres hold any tension at zero contraction, so that every "
        "law reaches 200 N: the statement cannot fail.", _each(LAWS), untestable=True, place="introduction"),
    "low start": ClaimRow("Contraction starts at a low pressure", AtMost(LOW_PRESSURE / 1e6, chosen=True), "MPa",
        lambda law: values.initial_pressure(law) / 1e6, "Pressure for 1 % without load. The bound is a quarter of the "
        "axis of Fig. 8 (chosen). The sentence supports line B.", _each(PRINTED), place="text"),
    "rings contract less": ClaimRow("The muscle without rings contracts most", RISES, "1", values.ring_ratio,
        "Minimum ratio, up to 35 %, of the pressures with one ring more and without it. Equal segments in series are "
        "inferred.", _each({B: DEFAULT}, 0.0, 100.0) | _each({A: PRINTED[A]}, 0.0), place="Fig. 8"),
    "strains": ClaimRow(STRENGTH.format("rubber strains"), FALLS, "1",
        lambda law, load: values.strength_ratio(law, load, lambda muscle, c: muscle.middle_strain(c)), STRENGTH_NOTE,
        _each({B: DEFAULT}, 200.0), place="text"),
    "tensions": ClaimRow(STRENGTH.format("fibre tensions"), FALLS, "1",
        lambda law, load: values.strength_ratio(law, load, lambda muscle, c: muscle.end_tension(PRESSURE, c, load)),
        STRENGTH_NOTE, _each({B: DEFAULT}, 200.0), place="text"),
    "ring force": ClaimRow("Rings increase the force", RISES, "1", values.ring_force_ratio,
        "Ratio of the tension with one ring to that without at 0.11 MPa, at 5 % contraction (chosen). The paper gives "
        "as the reason the higher supply pressure that a muscle with rings withstands; it is not printed, twice the "
        "pressure is chosen.",
        {f"{name}, {case}": (law, factor) for name, law in {**PRINTED, **EXACT}.items()
         for factor, case in ((1.0, "equal pressure"), (HIGHER_PRESSURE, f"{HIGHER_PRESSURE:g} times the pressure"))},
        place="text"),
    "accurate": ClaimRow("The model is accurate below 20 %", None, "%", note=LOST, untestable=True, place="text"),
    "deviates": ClaimRow("The model deviates above 20 %", None, "%", note=LOST, untestable=True, place="text"),
    "cause": ClaimRow("The change of the wall thickness causes the deviation", None, "%",
        note="The measurements and the wall thickness at rest and under pressure are lost; the paper suspects this "
        "cause.", untestable=True, place="conclusions"),
    "error below 20 %": ClaimRow("Maximum pressure error up to 20 %, relative to the exact meridian",
        AtMost(ACCURATE, chosen=True), "%", lambda law, load: values.pressure_error(law, load, 0.01, 0.20, 20),
        "The bound of 15 % is chosen.", _each({**PRINTED, **MECHANICS}, 100.0), Kind.FINDING),
    "error above 20 %": ClaimRow("Maximum pressure error from 25 to 40 %, relative to the exact meridian",
        AtLeast(ACCURATE, chosen=True), "%", lambda law, load: values.pressure_error(law, load, 0.25, 0.40, 16),
        "The bound of 15 % is chosen.", _each({**PRINTED, **MECHANICS}, 100.0), Kind.FINDING),
    "rubber test": ClaimRow("The deviation begins at 20 %", Equal(20.0, 2.0), "%",
        lambda: 100 * DEFAULT.contraction_at_strain(RUBBER_TEST_STRAIN),
        "Contraction at which the rubber in the middle reaches a strain of 3, the end of the rubber test, by (10) with "
        "(2) and (3). The tolerance is chosen.", {OUTLINE: ()}, Kind.FINDING),
    "thickness": ClaimRow("The wall thickness changes while the tube expands: thickness relative to that at rest",
        AtMost(0.95, chosen=True), "1", lambda: 1 / (1 + float(DEFAULT.middle_strain(0.20))),
        "Thickness in the middle at 20 % contraction relative to that at rest, for incompressible rubber between "
        "inextensible fibres: t (1 + ε) is constant. The bound is chosen.", {OUTLINE: ()}, place="equation (10)"),
    "thinning": ClaimRow("A thinner wall explains a deviation: decrease of the pressure if the hoop stress is a "
        "true stress", AtLeast(15.0, chosen=True), "%", values.thinning,
        "The stress of the rubber test as a true stress in the thinner wall, instead of a nominal one in the initial "
        "wall, which needs no correction. The bound is chosen.",
        {f"exact mechanics, line B, 100 N, {100 * at:g} %": (at,) for at in (0.20, 0.40)}, Kind.FINDING),
    "outlines": ClaimRow("Fig. 2: all outlines lie within 0.03 m", AtMost(30.0), "mm", values.largest_radius,
        "The curves are lost; the axis is 0 to 0.03 m.", {OUTLINE: (DEFAULT,)}, place="Fig. 2, equations (2), (3)"),
    "feed-forward": ClaimRow("The closed form is suitable for feed-forward control", RISES, "1",
        values.share_reached, "Fraction of the target contractions 1 to 35 % reached from rest, within 10⁻⁹, with the "
        "formula's pressure.", _each({B: DEFAULT}, 100.0) | _each({A: PRINTED[A]}, 0.0), place="equation (19)"),
    "feed-forward of a pair": FEED_FORWARD,
    "high start": ClaimRow("A high pressure is generally needed at the initial stage", RISES, "1",
        lambda law: values.initial_pressure(law) / float(law.equilibrium_pressure(0.10, 0.0)),
        "Ratio of the pressures for 1 % and for 10 %, without load. The paper says this of such "
        "muscles in general. It supports line A.", _each(PRINTED), place="text"),
    "axis": ClaimRow("Fig. 8 extends to 0.16 MPa", AtLeast(0.16), "MPa",
        lambda law, load: float(np.max(law.equilibrium_pressure(np.linspace(0.0, 0.4, 81), load))) / 1e6,
        "Maximum pressure of the formula for 0 to 40 %; the load of Fig. 8 is not stated.",
        _each({B: DEFAULT}, 0.0, 200.0), place="Fig. 8, equation (19)"),
    "expansion": ClaimRow("The tube expands by about 300 %", Equal(300.0, 30.0), "%", values.middle_strain,
        "Hoop strain in the middle. The paper gives no contraction: 20 % is the limit of its accuracy, 35 % the "
        "contraction that it claims (chosen). The tolerance of a tenth is chosen.",
        {f"{name}, {at} %": (exact, at / 100) for at in (20, 35)
         for name, exact in ((OUTLINE, False), ("exact outline without rubber", True))}, place="Fig. 4"),
    "little change": ClaimRow("A large contraction requires little change of the pressure",
        AtMost(100 * LITTLE_CHANGE, chosen=True), "%", values.pressure_change,
        f"Relative change of the pressure from {100 * values.SMALL:g} to {100 * values.LARGE:g} % contraction; the "
        "bound is chosen.",
        _each(LAWS, 0.0, 100.0), place="text"),
    "thick wall": ClaimRow("A thicker wall, to endure pressure, sacrifices contraction at low pressure", RISES, "1",
        values.wall_ratio, "Ratio of the pressures for 5 % without load, with a wall of "
        f"{1e3 * values.THICK_WALL:g} mm (chosen) and with that of Table 1: above 1, the contraction needs a higher "
        "pressure.", _each({**PRINTED, **EXACT}), place="text"),
    "previous model": PREVIOUS_MODEL,
}  # fmt: skip
"""All rows by name, in the order of the report."""


def claim(row: str, *arguments: Any) -> Claim:
    """Return the claim of one row for other arguments than those of its cases."""
    return ROWS[row].claim(PAPER, "", *arguments)
