"""Borzikova, Balara and Pitel on the Shadow Air Muscle SAM 30 x 290: what their paper claims, judged.

Its measurements are lost and its figures too; the three plane curves that it prints are the data here.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..characteristic.base import ContractionLaw
from ..characteristic.borzikova import BORZIKOVA, SAM_30X290, PlaneCurves
from ..identify.surface.basis import Chebyshev, LoadRange, conditioning
from ..identify.surface.exponential import linearised, nonlinear
from ..recording import Recording
from ..report.chapter import AtLeast, Chapter, Claim, Equal
from .borzikova_figures import plots
from .borzikova_surfaces import (
    AS_EXPONENT,
    EXPONENTIAL,
    MISPRINT_CORRECTED,
    PRINTED,
    CORRECTED,
    index_on_curves,
    round_contraction,
    surfaces,
)
from .borzikova_tables import CATALOGUE_TABLE, CATALOGUE_TEXT, tables

PAPER = "borzikova"
GRAVITY = 9.80665
"""Standard fall [m/s2], which the paper takes as 10."""


def curve_claims(curves: PlaneCurves) -> tuple[Claim, ...]:
    """The three printed indices, which nothing that is left can confirm or refute."""
    return tuple(
        Claim(
            PAPER,
            f"correlation index of the plane curve under {curve.force:g} N",
            Equal(curve.printed_index, 0.0005),
            None,
            "1",
            "The index compares the curve with the measured points, which are lost; it cannot be computed again.",
        )
        for curve in curves.curves
    )


def surface_claim(name: str, law: ContractionLaw, curves: PlaneCurves) -> Claim:
    """Whether a surface follows the plane curves as well as these, by their least index, follow the measurements.

    No index is printed for the surface. Where it does not exist the claim carries 1 - SSE/SST, and says so.
    """
    found = index_on_curves(law, curves)
    if found.value is None:
        note = f"No index exists: SSE > SST, and 1 - SSE/SST = {found.explained:.4g} stands in its place."
    else:
        note = f"Index over 15 even pressures of each curve, 0 to {curves.max_pressure / 1e5:g} bar."
    return Claim(
        PAPER,
        f"{name}: correlation index on the three plane curves, against the least that is printed for these",
        AtLeast(min(c.printed_index for c in curves.curves), 0.0005),
        found.explained if found.value is None else found.value,
        "1",
        note,
    )


def rank_claim(recording: Recording) -> Claim:
    """Whether the data determine the coefficients of equation (1)."""
    found = conditioning(recording, Chebyshev(LoadRange.of_recording(recording)))
    loads = np.unique(recording["force"]).size
    return Claim(
        PAPER,
        f"{loads} loads determine the coefficients of equation (1), fourth degree in p and second in F",
        Equal(15.0),
        float(found.rank),
        "1",
        "Rank of the design. Three loads fix a quadratic in F exactly, so none can be left out for a test.",
    )


def procedure_claim(recording: Recording, saturation: float) -> Claim:
    """Whether the spreadsheet's linearisation gives the least S(A), as the paper takes it to."""
    by_logarithm, by_contraction = linearised(recording, saturation), nonlinear(recording, saturation)
    return Claim(
        PAPER,
        "the linearised fit of equation (1) gives the least S(A): its rms over that of least squares on k",
        Equal(1.0, 0.005),
        by_logarithm.rms / by_contraction.rms,
        "1",
        f"Plane curves rounded to 0.5 %: rms {by_logarithm.rms:.4%} linearised, {by_contraction.rms:.4%} by least "
        "squares on k; the logarithm weighs points near k_max too heavily. Tolerance chosen.",
    )


def load_claim() -> Claim:
    """Whether the loads in kilogram and newton agree."""
    return Claim(
        PAPER,
        "a load of 26 kg is 260 N",
        Equal(260.0, 0.5),
        26.0 * GRAVITY,
        "N",
        "The paper takes g as 10 m/s2; true are 44.1, 127.5 and 255.0 N. Its numbers are kept.",
    )


def catalogue_claims(curves: PlaneCurves) -> tuple[Claim, ...]:
    """The catalogue that the paper prints, against its own text and its own measurements."""
    heaviest = max(curves.curves, key=lambda c: c.force)
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    in_table = dict(zip(CATALOGUE_TABLE["diameter [mm]"], CATALOGUE_TABLE["load at 3.5 bar [kg]"], strict=True))
    in_text = dict(zip(CATALOGUE_TEXT["diameter [mm]"], CATALOGUE_TEXT["load [kg]"], strict=True))
    return (
        Claim(
            PAPER,
            "catalogue table: the 30 x 290 lifts 35 kg at 3.5 bar",
            Equal(float(in_table[30])),
            float(in_text[30]),
            "kg",
            "Reproduced is what the text of the same paper gives for it; both are kept.",
        ),
        Claim(
            PAPER,
            "text: 25 % contraction under 30 kg",
            AtLeast(25.0),
            100.0 * float(np.max(heaviest.contraction(pressures))),
            "%",
            f"The paper's own curve under {heaviest.force:g} N, a smaller load, at the best pressure up to "
            f"{curves.max_pressure / 1e5:g} bar. The pressure meant in the text is not printed.",
        ),
    )


def claims(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> tuple[Claim, ...]:
    """All claims of the paper, judged with these curves and surfaces."""
    judged = (AS_EXPONENT, PRINTED, MISPRINT_CORRECTED, CORRECTED, EXPONENTIAL)
    return (
        *curve_claims(curves),
        *(surface_claim(name, laws[name], curves) for name in judged),
        rank_claim(curves.sample()),
        procedure_claim(round_contraction(curves.sample()), curves.curves[0].saturation),
        load_claim(),
        *catalogue_claims(curves),
    )


def chapter() -> Chapter:
    """The chapter of the report."""
    curves = SAM_30X290
    laws = surfaces(curves)
    return Chapter(
        paper=PAPER,
        title="Borzikova, Balara, Pitel: contraction of the Shadow Air Muscle SAM 30 x 290",
        summary=(
            "The paper's three plane curves stand for its measurements, which are lost. Its matrix cannot be the "
            "exponent of its equation (1): it is a direct polynomial with one misprinted exponent and two "
            "coefficients with too few digits. Equation (1) itself, fitted here, passes through the curves "
            "exactly, whichever procedure is used, because three loads fix a quadratic in force. Between the "
            "loads both surfaces break what a muscle must keep, so a monotone one is given beside them."
        ),
        claims=claims(curves, laws),
        tables=tables(curves, laws),
        plots=plots(curves, laws),
        references=(BORZIKOVA,),
        chosen=(
            ("greatest pressure", "3.5 bar", "inferred: the catalogue pressure; the paper's range is not printed"),
            ("loads", "45, 130, 260 N", "printed for 4.5, 13, 26 kg"),
            ("k_max", "40 %", "printed"),
            ("pressures sampled on each curve", "15, even", "chosen; the number of measured points is lost"),
            ("disturbances", "rounded to 0.5 %; normal, sd 0.5 %, seeds 0 to 99", "chosen"),
            ("a_02, a_12, a_22 of the repaired matrix", "-7.55e-5, 0.002404, -0.002259", "misprint; within rounding"),
            ("least slope of the monotone fit", "1e-9, scaled", "chosen"),
        ),
    )
