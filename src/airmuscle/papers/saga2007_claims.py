"""Claims of Saga et al. 2007, evaluated for any interpretation of their model and for the exact meridian.

Every function takes the model, so that the verdict follows from its fibre sum, projection factor and rubber.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

import airmuscle as am

from ..core.errors import SolveError
from ..physics.muscle.characteristic.saga2007 import RUBBER_TEST_STRAIN
from ..report.chapter import AtLeast, AtMost, Claim, Equal, Kind, PublishedValue
from .saga2007_further_claims import further_claims
from .saga2007_joint import feed_forward_comparisons
from .saga2007_muscle import (
    DEFAULT,
    INTERPRETATIONS,
    LINES,
    PAPER,
    PRESSURE,
    contraction_at,
    exact_mechanics,
    exact_meridian,
    interpretation,
    interpretation_name,
    pressure_along,
    with_rings,
)
from .saga2007_previous import previous_model_claims

LOW_PRESSURE = 0.04e6
"""Limit of a low pressure [Pa]: a quarter of the pressure axis of Fig. 8 (chosen)."""
ACCURACY_LIMIT = 0.15
"""Limit of the relative pressure error of an accurate model (chosen)."""
FIG_2 = (0.05, 0.10, 0.15, 0.20, 0.25)
"""Contractions of the outlines in Fig. 2 [1]."""


def _claim(text: str, printed: PublishedValue, reproduced: float | None, unit: str, name: str, note: str) -> Claim:
    return Claim(PAPER, text, printed, reproduced, unit, note, name)


def contraction_claim(law: am.characteristic.Characteristic, name: str) -> Claim:
    """Return claim 1: contraction above 35 % at 0.11 MPa, evaluated without load."""
    reached = contraction_at(law, PRESSURE, 0.0)
    at_end = reached >= law.contraction_range[1] * (1 - 1e-6)
    note = "The load is not stated; assumed to be zero. "
    note += "The model needs less than 0.11 MPa over its whole range, so the value is its end." if at_end else ""
    note += "Even the exact meridian does not reach 35 %." if isinstance(law, am.characteristic.ExactMeridian) else ""
    text = "1. Without rings, the contraction exceeds 35 % at 0.11 MPa"
    return _claim(text, AtLeast(35.0), 100 * reached, "%", name, note.strip())


def lifting_claim(law: am.characteristic.Characteristic, name: str) -> Claim:
    """Return claim 2: 200 N at 0.11 MPa and a contraction of 35 % or more together, as in the introduction."""
    reached = contraction_at(law, PRESSURE, 200.0)
    note = "Contraction at 0.11 MPa under a load of 200 N."
    note += " As a separate maximum, at small contraction, 200 N is reached." if 0 < reached < 0.1 else ""
    return _claim("2. About 200 N at 0.11 MPa and 35 % or more", AtLeast(35.0), 100 * reached, "%", name, note)


def force_limit_claim() -> Claim:
    """Return claim 2 for the maximum tension of inextensible fibres without rubber."""
    max_tension = PRESSURE * float(exact_meridian(LINES["A"]).geometry.effective_area(0.35))
    note = (
        "Maximum tension of inextensible fibres of 72 mm on ends of 12 mm, by virtual work and without rubber; either "
        "rubber line reduces it. Claims 1 and 2 cannot hold simultaneously."
    )
    case = "tension at 35 %, any rubber"
    return _claim("2. About 200 N at 0.11 MPa and 35 % or more", AtLeast(200.0), max_tension, "N", case, note)


def initial_pressure_claims(law: am.characteristic.Saga2007, name: str) -> tuple[Claim, Claim]:
    """Return claim 3, low initial pressure, and the general sentence on a high initial pressure."""
    first, later = (float(law.equilibrium_pressure(c, 0.0)) for c in (0.01, 0.10))
    needed = max(law.threshold_pressure, first)
    low = _claim(
        "3. Contraction starts at a low pressure",
        AtMost(LOW_PRESSURE / 1e6, chosen=True),
        needed / 1e6,
        "MPa",
        name,
        "Pressure for 1 % without load. The bound is a quarter of the axis of Fig. 8 (chosen). The sentence supports "
        "line B.",
    )
    high = _claim(
        "A high pressure is generally needed at the initial stage",
        AtLeast(1.0, derived=True),
        needed / later,
        "1",
        name,
        "Ratio of the pressures for 1 % and for 10 %, without load. The paper says this of such muscles in general. It "
        "supports line A.",
    )
    return low, high


def ring_claim(law: am.characteristic.Saga2007, name: str, force: float) -> Claim:
    """Return claim 4: rings reduce the contraction at a given pressure, or raise the pressure for a contraction."""
    contraction = np.geomspace(1e-7, 0.35, 200)
    pressures = [np.asarray(pressure_along(with_rings(law, n), contraction, force)) for n in (0, 1, 2)]
    ratio = min(float(np.min(more / fewer)) for fewer, more in itertools.pairwise(pressures))
    note = "Minimum ratio, up to 35 %, of the pressures with one ring more and without it. "
    note += "Equal segments in series are inferred." + (_stability_note(law, force))
    text = "4. The muscle without rings contracts most"
    return _claim(text, AtLeast(1.0, derived=True), ratio, "1", f"{name}, {force:g} N", note)


def _stability_note(law: am.characteristic.Saga2007, force: float) -> str:
    falling = any(with_rings(law, n).snap_through_load > force for n in (1, 2))
    return " Where the pressure falls with contraction, equal segments contract unequally." if falling else ""


def strength_claims(law: am.characteristic.Saga2007, name: str, force: float) -> tuple[Claim, ...]:
    """Return claim 4, second part: rings raise the pressure that the muscle withstands, by strain and fibre tension."""
    text = "4. Rings raise the pressure that the muscle withstands: ratio of the {} with two rings and without"
    case = f"{name}, {force:g} N"
    muscles = [with_rings(law, n) for n in (0, 2)]
    try:
        points = [float(muscle.contraction(PRESSURE, force)) for muscle in muscles]
    except SolveError:
        note = "One of the two muscles has no stable contraction at 0.11 MPa."
        return (_claim(text.format("rubber strains"), AtMost(1.0, derived=True), None, "1", case, note),)
    strains = [float(muscle.middle_strain(c)) for muscle, c in zip(muscles, points, strict=True)]
    tensions = [float(muscle.end_tension(PRESSURE, c, force)) for muscle, c in zip(muscles, points, strict=True)]
    note = "At 0.11 MPa and equal load. The paper gives no strength; the measure is chosen."
    return tuple(
        _claim(text.format(measure), AtMost(1.0, derived=True), pair[1] / pair[0], "1", case, note)
        for measure, pair in (("rubber strains", strains), ("fibre tensions", tensions))
    )


def accuracy_claims() -> tuple[Claim, ...]:
    """Return claim 5, which compares the model with measurements that are lost."""
    note = (
        "The paper compares with its measurements, which are lost. A comparison with the exact meridian follows below."
    )
    cause = (
        "The measurements and the wall thickness at rest and under pressure are lost; the paper suspects this cause."
    )
    return tuple(
        Claim(PAPER, text, None, None, "%", reason, untestable=True)
        for text, reason in (
            ("5. The model is accurate below 20 %", note),
            ("5. The model deviates above 20 %", note),
            ("5. The change of the wall thickness causes the deviation", cause),
        )
    )


def accuracy_findings(law: am.characteristic.Saga2007, name: str) -> tuple[Claim, ...]:
    """Return the errors relative to the exact meridian with the same rubber, up to 20 % and above."""
    reference = exact_meridian(law.rubber, law.geometry.rings)
    low, high = np.linspace(0.01, 0.20, 20), np.linspace(0.25, 0.40, 16)
    below, above = (
        100
        * float(np.max(np.abs(law.equilibrium_pressure(c, 100.0) / reference.shape_at_force(c, 100.0).pressure - 1)))
        for c in (low, high)
    )
    limit, case = 100 * ACCURACY_LIMIT, f"{name}, 100 N"
    text = "5. Maximum pressure error {}, relative to the exact meridian"
    note = "The bound of 15 % is chosen."
    return tuple(
        replace(_claim(text.format(where), printed, value, "%", case, note), kind=Kind.FINDING)
        for where, printed, value in (
            ("up to 20 %", AtMost(limit, chosen=True), below),
            ("from 25 to 40 %", AtLeast(limit, chosen=True), above),
        )
    )


def rubber_test_finding(law: am.characteristic.Saga2007) -> Claim:
    """Return the contraction at which the rubber reaches the end of its test, as a possible cause of claim 5."""
    end = 100 * law.contraction_at_strain(RUBBER_TEST_STRAIN)
    note = "Contraction at which the rubber in the middle reaches a strain of 3, the end of the rubber test, "
    note += "by (10) with (2) and (3). The tolerance is chosen."
    claim = _claim("5. The deviation begins at 20 %", Equal(20.0, 2.0), end, "%", "outline by (2), (3)", note)
    return replace(claim, kind=Kind.FINDING)


def outline_claim(law: am.characteristic.Saga2007) -> Claim:
    """Return claim 6: the outlines of Fig. 2 lie within its axis."""
    radii = [1e3 * float(law.geometry.segment(c).max_radius) for c in FIG_2]
    radii_text = ", ".join(f"{r:.2f}" for r in radii)
    note = f"The curves are lost; the axis is 0 to 0.03 m. Largest radii at 5, 10, 15, 20, 25 %: {radii_text} mm."
    return _claim(
        "6. Fig. 2: all outlines lie within 0.03 m", AtMost(30.0), max(radii), "mm", "outline by (2), (3)", note
    )


def feed_forward_claim(law: am.characteristic.Saga2007, name: str, force: float) -> Claim:
    """Return claim 7: the fraction of target contractions that the pressure of the formula produces from rest."""
    targets = np.linspace(0.01, 0.35, 35)
    pressures = law.equilibrium_pressure(targets, force)
    met = sum(_reaches_target(law, float(p), force, float(c)) for p, c in zip(pressures, targets, strict=True))
    note = "Fraction of the target contractions 1 to 35 % reached from rest, within 10⁻⁹, with the formula's pressure. "
    note += "Where the pressure falls with contraction, the muscle snaps past the target." if met < targets.size else ""
    note += " Our copy describes no control experiment."
    text = "7. The closed form is suitable for feed-forward control"
    return _claim(text, AtLeast(1.0, derived=True), met / targets.size, "1", f"{name}, {force:g} N", note.strip())


def _reaches_target(law: am.characteristic.Saga2007, pressure: float, force: float, target: float) -> bool:
    try:
        return abs(float(law.contraction(pressure, force)) - target) < 1e-9
    except SolveError:
        return False


def axis_claim(law: am.characteristic.Saga2007, name: str, force: float) -> Claim:
    """Return the claim of Fig. 8: pressures up to 0.16 MPa for contractions up to 40 %, at an assumed load."""
    max_pressure = float(np.max(law.equilibrium_pressure(np.linspace(0.0, 0.4, 81), force))) / 1e6
    note = "Maximum pressure of the formula for 0 to 40 %; the load of Fig. 8 is not stated."
    return _claim("Fig. 8 extends to 0.16 MPa", AtLeast(0.16), max_pressure, "MPa", f"{name}, {force:g} N", note)


def claims_of(law: am.characteristic.Saga2007, name: str) -> tuple[Claim, ...]:
    """Return all claims that depend on the model, for one interpretation."""
    return (
        contraction_claim(law, name),
        lifting_claim(law, name),
        *initial_pressure_claims(law, name),
        *(ring_claim(law, name, force) for force in (0.0, 100.0)),
        *strength_claims(law, name, 200.0),
        outline_claim(law),
        feed_forward_claim(law, name, 100.0),
        *(axis_claim(law, name, force) for force in (0.0, 200.0)),
    )


def all_claims() -> tuple[Claim, ...]:
    """Return all claims for the default, and those for which other interpretations or models give other verdicts."""
    default, printed = interpretation_name(2, 1, "B"), interpretation_name(2, 1, "A")
    printed_a = interpretation(LINES["A"], 2.0, 1.0)
    others = {name: law for name, law in INTERPRETATIONS.items() if law != DEFAULT}
    exact_laws = {f"exact meridian, line {name}": exact_meridian(line) for name, line in LINES.items()}
    accuracy_cases = {
        default: DEFAULT,
        printed: printed_a,
        **{f"exact mechanics, line {name}": exact_mechanics(line) for name, line in LINES.items()},
    }
    claims = [
        *claims_of(DEFAULT, default),
        *(contraction_claim(law, name) for name, law in exact_laws.items()),
        *(lifting_claim(law, name) for name, law in (others | exact_laws).items()),
        force_limit_claim(),
        *initial_pressure_claims(printed_a, printed),
        ring_claim(printed_a, printed, 0.0),
        feed_forward_claim(printed_a, printed, 0.0),
        *accuracy_claims(),
        *(finding for name, law in accuracy_cases.items() for finding in accuracy_findings(law, name)),
        rubber_test_finding(DEFAULT),
        *further_claims(),
        *previous_model_claims(),
        *feed_forward_comparisons(),
    ]
    return tuple(sorted(claims, key=lambda claim: claim.claim[:2] if claim.claim[0].isdigit() else "9"))
