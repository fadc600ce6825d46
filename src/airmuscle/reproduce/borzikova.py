"""Report chapter: Borzíková, Balara and Piteľ, contraction of the Shadow Air Muscle SAM 30 x 290.

The measurements and figures of the paper are lost; its three printed plane curves serve as data.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..characteristic.base import ContractionLaw
from ..characteristic.borzikova import BORZIKOVA, SAM_30X290, PlaneCurves
from ..core.constants import STANDARD_GRAVITY
from ..identify.surface.basis import Chebyshev, LoadRange, conditioning
from ..identify.surface.exponential import fit_linearised, fit_nonlinear
from ..recording import Recording
from ..report.chapter import AtLeast, Chapter, Claim, Equal
from ..report.formatting import format_number, typographic
from .borzikova_figures import plots
from .borzikova_surfaces import (
    AS_EXPONENT,
    CORRECTED,
    EXPONENTIAL,
    MISPRINT_CORRECTED,
    PRINTED,
    index_on_curves,
    round_contraction,
    surfaces,
)
from .borzikova_tables import CATALOGUE_TABLE, CATALOGUE_TEXT, tables

PAPER = "borzikova"
GRAVITY = 9.80665
"""Standard gravity [m/s2]; the paper uses 10."""


SUMMARY = (
    r"The paper describes the contraction by \(k = k_\text{max}\,(1 - \text{e}^{v})\) with the exponent "
    r"\(v = \sum_{i=0}^{4} \sum_{j=0}^{2} a_{ij}\,p^i F^j\), equation (1), where \(p\) is in bar and \(F\) in N. "
    "Its measurements are lost; its three printed plane curves are used instead.\n\n"
    r"The printed matrix cannot be the exponent \(v\). It is the direct polynomial "
    r"\(k = \sum a_{ij}\,p^i F^j\) in per cent, with one misprinted exponent and two coefficients with too few "
    "digits. Equation (1), fitted here, reproduces the curves exactly with both fitting procedures, because "
    "three loads determine a quadratic in the force. Between the loads both surfaces violate the monotonicity "
    "of a muscle, so a monotone surface is given as well."
)

CHOSEN = (
    ("maximum pressure", "3.5 bar", "inferred: the catalogue pressure; the range is not printed"),
    ("loads", "45, 130, 260 N", "printed for 4.5, 13, 26 kg"),
    (r"\(k_\text{max}\)", "40 %", "printed"),
    ("pressures sampled on each curve", "15, evenly spaced", "chosen: the number of measured points is lost"),
    (
        "disturbances",
        "rounding to 0.5 %; normally distributed noise, standard deviation 0.5 %, seeds 0 to 99",
        "chosen",
    ),
    (
        r"\(a_{02}\), \(a_{12}\), \(a_{22}\) of the corrected matrix",
        "−7.55 × 10⁻⁵, 0.002404, −0.002259",
        "misprint; within rounding of the print",
    ),
    ("minimum slope of the monotone fit", "10⁻⁹, scaled", "chosen"),
)


def curve_claims(curves: PlaneCurves) -> tuple[Claim, ...]:
    """Return the claims of the three printed correlation indices, which cannot be verified."""
    return tuple(
        Claim(
            PAPER,
            f"correlation index of the plane curve at {curve.force:g} N",
            Equal(curve.printed_index, 0.0005),
            None,
            "1",
            "The index compares the curve with the measured points, which are lost, so it cannot be computed.",
        )
        for curve in curves.curves
    )


def surface_claim(name: str, law: ContractionLaw, curves: PlaneCurves) -> Claim:
    """Return the claim that a surface fits the plane curves as well as these fit the measurements (minimum index).

    The paper prints no index for the surface. If the index does not exist, the claim contains 1 - SSE/SST and says so.
    """
    index = index_on_curves(law, curves)
    if index.value is None:
        value = typographic(format_number(index.r_squared))
        note = rf"The index does not exist as SSE > SST; the value is \(1 - \text{{SSE}}/\text{{SST}}\) = {value}."
    else:
        note = f"Index at 15 evenly spaced pressures of each curve, 0 to {curves.max_pressure / 1e5:g} bar."
    return Claim(
        PAPER,
        f"{name}: correlation index on the three plane curves, not below the minimum printed for these",
        AtLeast(min(c.printed_index for c in curves.curves), 0.0005),
        index.r_squared if index.value is None else index.value,
        "1",
        note,
    )


def rank_claim(recording: Recording) -> Claim:
    """Return the claim that the data determine the coefficients of equation (1)."""
    design = conditioning(recording, Chebyshev(LoadRange.from_recording(recording)))
    loads = np.unique(recording["force"]).size
    return Claim(
        PAPER,
        rf"{loads} loads determine the coefficients of equation (1), of degree 4 in \(p\) and 2 in \(F\)",
        Equal(15.0),
        float(design.rank),
        "1",
        r"Rank of the design matrix. Three loads determine a quadratic in \(F\) exactly, so no load can be left out "
        "for validation.",
    )


def procedure_claim(recording: Recording, saturation: float) -> Claim:
    """Return the claim that the linearised fit minimises the sum of squares S(A), as the paper assumes."""
    by_logarithm, by_contraction = fit_linearised(recording, saturation), fit_nonlinear(recording, saturation)
    return Claim(
        PAPER,
        r"the linearised fit of equation (1) minimises \(S(A)\): ratio of its rms error to that of least squares on "
        r"\(k\)",
        Equal(1.0, 0.005),
        by_logarithm.rmse / by_contraction.rmse,
        "1",
        f"Plane curves rounded to 0.5 %: rms error {100 * by_logarithm.rmse:.4g} % linearised, "
        rf"{100 * by_contraction.rmse:.4g} % by least squares on \(k\); the logarithm gives points near "
        r"\(k_\text{max}\) too much weight. The tolerance is chosen.",
    )


def load_claim() -> Claim:
    """Return the claim that the loads in kilograms and newtons agree."""
    return Claim(
        PAPER,
        "a load of 26 kg is 260 N",
        Equal(260.0, 0.5),
        26.0 * STANDARD_GRAVITY,
        "N",
        r"The paper uses \(g\) = 10 m/s²; with standard gravity the loads are 44.1, 127.5 and 255.0 N. The printed "
        "values are used.",
    )


def catalogue_claims(curves: PlaneCurves) -> tuple[Claim, ...]:
    """Return the claims of the printed catalogue, compared with the text and the measurements of the same paper."""
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
            "The reproduced value is the one in the text of the same paper.",
        ),
        Claim(
            PAPER,
            "text: 25 % contraction at 30 kg",
            AtLeast(25.0),
            100.0 * float(np.max(heaviest.contraction(pressures))),
            "%",
            f"Maximum of the plane curve at {heaviest.force:g} N, a smaller load, up to "
            f"{curves.max_pressure / 1e5:g} bar. The text does not give the pressure.",
        ),
    )


def claims(curves: PlaneCurves, laws: Mapping[str, ContractionLaw]) -> tuple[Claim, ...]:
    """Return all claims of the paper for these curves and surfaces."""
    evaluated = (AS_EXPONENT, PRINTED, MISPRINT_CORRECTED, CORRECTED, EXPONENTIAL)
    return (
        *curve_claims(curves),
        *(surface_claim(name, laws[name], curves) for name in evaluated),
        rank_claim(curves.sample()),
        procedure_claim(round_contraction(curves.sample()), curves.curves[0].saturation),
        load_claim(),
        *catalogue_claims(curves),
    )


def chapter() -> Chapter:
    """Return the chapter of the report."""
    curves = SAM_30X290
    laws = surfaces(curves)
    return Chapter(
        paper=PAPER,
        title="Borzíková, Balara, Piteľ: contraction of the Shadow Air Muscle SAM 30 × 290",
        summary=SUMMARY,
        claims=claims(curves, laws),
        tables=tables(curves, laws),
        plots=plots(curves, laws),
        references=(BORZIKOVA,),
        chosen=CHOSEN,
    )
