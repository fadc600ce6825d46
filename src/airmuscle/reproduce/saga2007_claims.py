"""What Saga et al. 2007 claim, judged for any reading of their model and for the exact meridian.

Each function takes the model, so that another fibre sum or projection factor may earn another verdict.
"""

from __future__ import annotations

import itertools

import numpy as np

from ..characteristic.base import Characteristic
from ..characteristic.exact_meridian import ExactMeridian
from ..characteristic.saga2007 import RUBBER_TEST_STRAIN, Saga2007
from ..core.errors import SolveError
from ..report.chapter import AtLeast, AtMost, Claim, Equal, PublishedValue
from .saga2007_muscle import (
    DEFAULT,
    LINES,
    PRESSURE,
    INTERPRETATIONS,
    exact_meridian,
    exact_mechanics,
    pressure_along,
    contraction_at,
    interpretation,
    with_rings,
)

PAPER = "saga2007"
LOW_PRESSURE = 0.04e6
"""What counts as low [Pa]: a quarter of the pressure axis of Fig. 8; chosen."""
ACCURACY_LIMIT = 0.15
"""The error of the pressure that counts as accurate; chosen."""
FIG_2 = (0.05, 0.10, 0.15, 0.20, 0.25)
"""The contractions that Fig. 2 shows."""


def _claim(text: str, printed: PublishedValue, found: float, unit: str, name: str, note: str) -> Claim:
    return Claim(PAPER, f"{text} [{name}]", printed, found, unit, note)


def contraction_claim(law: Characteristic, name: str) -> Claim:
    """Claim 1: more than 35 % at 0.11 MPa, taken as unloaded."""
    found = contraction_at(law, PRESSURE, 0.0)
    end = found >= law.contraction_range[1] * (1 - 1e-6)
    note = "No load is stated; taken as none. "
    note += "The model asks for less than 0.11 MPa over all its reach and runs away." if end else ""
    note += "Even the exact meridian stays below." if isinstance(law, ExactMeridian) else ""
    text = "1. Without ring, contraction exceeds 35 % at 0.11 MPa"
    return _claim(text, AtLeast(35.0), 100 * found, "%", name, note.strip())


def lifting_claim(law: Characteristic, name: str) -> Claim:
    """Claim 2: 200 N at 0.11 MPa by a contraction of 35 % or more, both at once as the introduction has it."""
    found = contraction_at(law, PRESSURE, 200.0)
    note = "The contraction at 0.11 MPa under 200 N."
    note += " As a maximum of its own, at small contraction, 200 N is met." if 0 < found < 0.1 else ""
    return _claim("2. About 200 N at 0.11 MPa by 35 % or more", AtLeast(35.0), 100 * found, "%", name, note)


def force_limit_claim() -> Claim:
    """Claim 2 against mechanics: what fibres that do not stretch can pull at all, without any rubber."""
    found = PRESSURE * float(exact_meridian(LINES["A"]).geometry.area(0.35))
    note = (
        "The most that inextensible fibres of 72 mm on ends of 12 mm can pull, by virtual work and without rubber; "
        "either rubber line lowers it. Claims 1 and 2 cannot hold together."
    )
    return _claim("2. 200 N at 0.11 MPa and 35 %", AtLeast(200.0), found, "N", "any rubber", note)


def initial_pressure_claims(law: Saga2007, name: str) -> tuple[Claim, Claim]:
    """Claim 3 and the sentence that speaks against it: low pressure at the start, or high."""
    first, later = (float(law.balancing_pressure(c, 0.0)) for c in (0.01, 0.10))
    needed = max(law.starting_pressure, first)
    low = _claim(
        "3. Contraction starts at low pressure",
        AtMost(LOW_PRESSURE / 1e6, chosen=True),
        needed / 1e6,
        "MPa",
        name,
        "Pressure to pass 1 % unloaded. Low is a quarter of the axis of Fig. 8, chosen. It speaks for line B.",
    )
    high = _claim(
        "High pressure is generally needed at the initial stage",
        AtLeast(1.0),
        needed / later,
        "1",
        name,
        "Pressure to pass 1 % over that at 10 %, unloaded. It speaks for line A, against claim 3.",
    )
    return low, high


def ring_claim(law: Saga2007, name: str, force: float) -> Claim:
    """Claim 4: rings lower the contraction at a given pressure, so that they raise the pressure for one."""
    contraction = np.geomspace(1e-7, 0.35, 200)
    runs = [np.asarray(pressure_along(with_rings(law, n), contraction, force)) for n in (0, 1, 2)]
    ratio = min(float(np.min(more / fewer)) for fewer, more in itertools.pairwise(runs))
    where = f"{name}, {force:g} N"
    note = "Least ratio, up to 35 %, of the pressure with a ring more to that without. "
    note += "Rings as equal segments in series are inferred." + (_stability_note(law, force))
    return _claim("4. No ring contracts most", AtLeast(1.0), ratio, "1", where, note)


def _stability_note(law: Saga2007, force: float) -> str:
    falling = any(with_rings(law, n).snapping_load > force for n in (1, 2))
    return " Where pressure falls, equal segments are unstable: they do not contract alike." if falling else ""


def strength_claims(law: Saga2007, name: str, force: float) -> tuple[Claim, ...]:
    """Claim 4, second half: rings raise the pressure that the muscle bears, measured by strain and by fibre tension."""
    text, where = "4. Rings raise the pressure borne: {} with two rings over none", f"{name}, {force:g} N"
    runs = [with_rings(law, n) for n in (0, 2)]
    try:
        points = [float(run.contraction(PRESSURE, force)) for run in runs]
    except SolveError:
        note = "One of the two has no stable contraction at 0.11 MPa."
        return (Claim(PAPER, f"{text.format('strain')} [{where}]", AtMost(1.0), None, "1", note),)
    strains = [float(run.middle_strain(c)) for run, c in zip(runs, points, strict=True)]
    tensions = [float(run.end_tension(PRESSURE, c, force)) for run, c in zip(runs, points, strict=True)]
    note = "At 0.11 MPa and equal load. No strength is printed; the measure is chosen."
    return tuple(
        _claim(text.format(measure), AtMost(1.0), pair[1] / pair[0], "1", where, note)
        for measure, pair in (("strain of the rubber", strains), ("tension of a fibre", tensions))
    )


def accuracy_claims(law: Saga2007, name: str) -> tuple[Claim, ...]:
    """Claim 5, with the exact meridian in place of the lost measurements, and where the rubber test ends."""
    truth = exact_meridian(law.rubber, law.geometry.rings)
    low, high = np.linspace(0.01, 0.20, 20), np.linspace(0.25, 0.40, 16)
    below, above = (
        100 * float(np.max(np.abs(law.balancing_pressure(c, 100.0) / truth.balance_at(c, 100.0).pressure - 1)))
        for c in (low, high)
    )
    note = "Largest error of the pressure at 100 N against the exact meridian; the measurements are lost. "
    note += "15 % counts as accurate, chosen."
    end = 100 * law.contraction_at_strain(RUBBER_TEST_STRAIN)
    strain_note = "Where the rubber in the middle passes a strain of 3, the end of the rubber test; (10) with (2), (3)."
    return (
        _claim("5. Accurate below 20 %", AtMost(100 * ACCURACY_LIMIT, chosen=True), below, "%", f"{name}, 100 N", note),
        _claim("5. Departs above 20 %", AtLeast(100 * ACCURACY_LIMIT, chosen=True), above, "%", f"{name}, 100 N", note),
        _claim("5. The model departs at 20 %", Equal(20.0, 2.0), end, "%", "outline (2), (3)", strain_note),
    )


def outline_claim(law: Saga2007) -> Claim:
    """Claim 6: the outlines of Fig. 2 lie within its axis."""
    radii = [1e3 * float(law.geometry.segment(c).largest_radius) for c in FIG_2]
    printed = ", ".join(f"{r:.2f}" for r in radii)
    note = f"The curves are lost, the axis is 0 to 0.03 m. Largest radii at 5, 10, 15, 20, 25 %: {printed} mm."
    return _claim("6. Fig. 2: all outlines lie within 0.03 m", AtMost(30.0), max(radii), "mm", "(2), (3)", note)


def feed_forward_claim(law: Saga2007, name: str, force: float) -> Claim:
    """Claim 7: the share of wanted contractions that the pressure of the formula brings about, starting from rest."""
    wanted = np.linspace(0.01, 0.35, 35)
    pressures = law.balancing_pressure(wanted, force)
    met = sum(_reaches_target(law, float(p), force, float(c)) for p, c in zip(pressures, wanted, strict=True))
    note = "Share of the contractions 1 to 35 % that the formula's pressure leads to, from rest and to 1e-9. "
    note += "Where pressure falls with contraction the muscle snaps past what was wanted." if met < wanted.size else ""
    text = "7. The closed form serves feed-forward control"
    return _claim(text, AtLeast(1.0), met / wanted.size, "1", f"{name}, {force:g} N", note.strip())


def _reaches_target(law: Saga2007, pressure: float, force: float, wanted: float) -> bool:
    try:
        return abs(float(law.contraction(pressure, force)) - wanted) < 1e-9
    except SolveError:
        return False


def axis_claim(law: Saga2007, name: str, force: float) -> Claim:
    """Fig. 8 shows pressures up to 0.16 MPa for contractions up to 0.4: what load would that take?"""
    found = float(np.max(law.balancing_pressure(np.linspace(0.0, 0.4, 81), force))) / 1e6
    note = "Greatest pressure of the formula for 0 to 40 %; the load of Fig. 8 is not stated."
    return _claim("Fig. 8 spans 0.16 MPa", AtLeast(0.16), found, "MPa", f"{name}, {force:g} N", note)


def claims_of(law: Saga2007, name: str) -> tuple[Claim, ...]:
    """All claims that depend on the model, for one reading of it."""
    return (
        contraction_claim(law, name),
        lifting_claim(law, name),
        *initial_pressure_claims(law, name),
        *(ring_claim(law, name, force) for force in (0.0, 100.0)),
        *strength_claims(law, name, 200.0),
        *accuracy_claims(law, name),
        outline_claim(law),
        feed_forward_claim(law, name, 100.0),
        *(axis_claim(law, name, force) for force in (0.0, 200.0)),
    )


def all_claims() -> tuple[Claim, ...]:
    """The default reading in full, and the other readings and the exact meridian where they decide otherwise."""
    default = "w 2, q 1, line B"
    printed_a = interpretation(LINES["A"], 2.0, 1.0)
    others = {name: law for name, law in INTERPRETATIONS.items() if law != DEFAULT}
    truths = {f"exact meridian, line {name}": exact_meridian(line) for name, line in LINES.items()}
    found = [
        *claims_of(DEFAULT, default),
        *(contraction_claim(law, name) for name, law in truths.items()),
        *(lifting_claim(law, name) for name, law in (others | truths).items()),
        force_limit_claim(),
        *initial_pressure_claims(printed_a, "w 2, q 1, line A"),
        ring_claim(printed_a, "w 2, q 1, line A", 0.0),
        *accuracy_claims(exact_mechanics(LINES["A"]), "exact mechanics, line A")[:2],
        feed_forward_claim(printed_a, "w 2, q 1, line A", 0.0),
    ]
    return tuple(sorted(found, key=lambda claim: claim.claim[:2] if claim.claim[0].isdigit() else "9"))
