"""Claims of Borzíková et al. on the muscle itself: catalogue, saturation, initial load and averaged branches."""

from __future__ import annotations

import numpy as np

from ..physics.muscle.characteristic.borzikova import PlaneCurves
from ..report.chapter import AtLeast, Claim, Equal
from ..report.formatting import format_number, typographic
from .borzikova_tables import CATALOGUE_TABLE, CATALOGUE_TEXT

PAPER = "borzikova"
MEASURED_DIAMETER = 30
"""Nominal diameter of the measured muscle [mm]."""


def catalogue_claims(curves: PlaneCurves) -> tuple[Claim, ...]:
    """Return the claims of the printed catalogue, compared with the text and the measurements of the same paper."""
    return (*table_claims(), *contraction_claims(curves))


def table_claims() -> tuple[Claim, ...]:
    """Return the rows of the catalogue table, compared with the rows of equal load or diameter in the text."""
    lifted = dict(zip(CATALOGUE_TABLE["diameter [mm]"], CATALOGUE_TABLE["load at 3.5 bar [kg]"], strict=True))
    in_text = dict(zip(CATALOGUE_TEXT["diameter [mm]"], CATALOGUE_TEXT["load [kg]"], strict=True))
    diameters = dict(zip(CATALOGUE_TEXT["load [kg]"], CATALOGUE_TEXT["diameter [mm]"], strict=True))
    note = (
        "The reproduced value is the load in the text of the same paper at 25 % contraction and an unknown pressure; "
    )
    note += "the table gives the force at 3.5 bar. The two cannot be compared."
    size = "The text gives the same length of 150 mm and the same load of 3 kg with this diameter."
    text = "catalogue table: load that the muscle lifts at 3.5 bar"
    return (
        Claim(PAPER, text, Equal(float(lifted[30])), float(in_text[30]), "kg", note, "30 x 290", untestable=True),
        Claim(PAPER, text, Equal(float(lifted[20])), float(in_text[20]), "kg", note, "20 x 210", untestable=True),
        Claim(PAPER, "catalogue table: diameter of the smallest muscle", Equal(6.0), float(diameters[3]), "mm", size),
    )


def contraction_claims(curves: PlaneCurves) -> tuple[Claim, ...]:
    """Return the claim of 25 % contraction for every size in the text; only one size was measured."""
    heaviest = max(curves.curves, key=lambda c: c.force)
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    largest = 100.0 * float(np.max(heaviest.contraction(pressures)))
    measured = (
        f"Maximum of the plane curve at {heaviest.force:g} N, a smaller load, up to "
        f"{curves.max_pressure / 1e5:g} bar. The text gives no pressure: at a higher one it may hold."
    )
    other = "No characteristic of this size is printed; the measured muscle is the 30 x 290."
    claims = []
    for diameter, load in zip(CATALOGUE_TEXT["diameter [mm]"], CATALOGUE_TEXT["load [kg]"], strict=True):
        own = diameter == MEASURED_DIAMETER
        case = f"{load} kg, diameter {diameter} mm"
        value, note = (largest, measured) if own else (None, other)
        claim = Claim(
            PAPER, "text: 25 % contraction under a load", AtLeast(25.0), value, "%", note, case, untestable=True
        )
        claims.append(claim)
    return tuple(claims)


def characteristic_claims(curves: PlaneCurves) -> tuple[Claim, ...]:
    """Return the claims on saturation, load in the initial position, and averaging of filling and emptying."""
    lightest = min(curves.curves, key=lambda c: c.force)
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    largest = 100.0 * float(np.max(lightest.contraction(pressures)))
    start = typographic(format_number(100.0 * float(lightest.contraction(0.0)), 3))
    reached = (
        f"Maximum of the plane curve at {lightest.force:g} N, the smallest load, up to "
        f"{curves.max_pressure / 1e5:g} bar. The tolerance is chosen. The saturation is approached beyond the range."
    )
    needed = (
        f"No characteristic without load is printed. The curve at {lightest.force:g} N begins at {start} %: the "
        "fit places the start below the initial length, which may be its error or an extension by the load."
    )
    averaged = (
        "The two branches are not printed, so that neither the hysteresis nor the error of the mean can be computed."
    )
    saturation = r"the contraction saturates at \(k_\text{max}\) = 40 %: maximum over the pressure range"
    return (
        Claim(PAPER, saturation, Equal(100.0 * lightest.saturation, 0.5), largest, "%", reached),
        Claim(PAPER, "a load is needed in the initial position", None, None, "N", needed, untestable=True),
        Claim(
            PAPER,
            "the characteristic is the mean of filling and emptying",
            None,
            None,
            "%",
            averaged,
            untestable=True,
        ),
    )
