"""Report chapter: Borzíková, Balara and Piteľ, contraction of the Shadow Air Muscle SAM 30 x 290.

The measurements and figures of the paper are lost; its three printed plane curves serve as data.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import airmuscle as am

from ..bench.identify.surface.basis import Chebyshev, LoadRange, conditioning
from ..bench.identify.surface.exponential import SurfaceFit, SurfaceProblem, fit_linearised, fit_nonlinear
from ..core.arrays import Array
from ..core.constants import STANDARD_GRAVITY
from ..physics.muscle.characteristic.borzikova import BORZIKOVA, SAM_30X290, PlaneCurves
from ..report.chapter import AtLeast, Chapter, Claim, Equal, Kind
from ..report.formatting import format_number, typographic
from .borzikova_figures import plots
from .borzikova_muscle_claims import PAPER, catalogue_claims, characteristic_claims
from .borzikova_surfaces import (
    AS_EXPONENT,
    CORRECTED,
    EXPONENTIAL,
    MISPRINT_CORRECTED,
    PRINTED,
    index_on_curves,
    round_contraction,
    sample,
    surfaces,
)
from .borzikova_tables import tables

MAX_LINEARISATIONS = 50
"""Maximum number of steps of the repeated linearisation (chosen)."""

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
            "correlation index of the plane curve",
            Equal(curve.printed_index, 0.0005),
            None,
            "1",
            "The index compares the curve with the measured points, which are lost, so it cannot be computed.",
            case=f"{curve.force:g} N",
            untestable=True,
        )
        for curve in curves.curves
    )


def surface_claim(name: str, law: am.characteristic.ContractionLaw, curves: PlaneCurves) -> Claim:
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
        "correlation index of the surface on the three plane curves, not below the minimum printed for these",
        AtLeast(min(c.printed_index for c in curves.curves), 0.0005, derived=True),
        index.r_squared if index.value is None else index.value,
        "1",
        note,
        case=name,
    )


def rank_claim(recording: am.Recording) -> Claim:
    """Return the claim that the data determine the coefficients of equation (1)."""
    design = conditioning(recording, Chebyshev(LoadRange.from_recording(recording)))
    loads = np.unique(recording["force"]).size
    return Claim(
        PAPER,
        rf"{loads} loads determine the coefficients of equation (1), of degree 4 in \(p\) and 2 in \(F\)",
        Equal(15.0, derived=True),
        float(design.rank),
        "1",
        r"Rank of the design matrix. Three loads determine a quadratic in \(F\) exactly, so no load can be left out "
        "for validation.",
        kind=Kind.CHECK,
    )


def procedure_claims(recording: am.Recording, saturation: float) -> tuple[Claim, ...]:
    """Return the claim that the linearised fit minimises the sum of squares S(A), in both meanings of "linearised"."""
    by_logarithm, by_contraction = fit_linearised(recording, saturation), fit_nonlinear(recording, saturation)
    iterated = fit_gauss_newton(recording, saturation)
    text = (
        r"the linearised fit of equation (1) minimises \(S(A)\): ratio of its rms error to that of least squares on "
        r"\(k\)"
    )
    data = "Plane curves rounded to 0.5 %: rms error {:.4g} % linearised, {:.4g} % by least squares on "
    data += r"\(k\); {} The tolerance is chosen."
    least, expected = 100 * by_contraction.rmse, Equal(1.0, 0.005, derived=True)
    weights = r"the logarithm gives points near \(k_\text{max}\) too much weight."
    steps = r"every step is a linear fit of the change of \(k\)."
    return tuple(
        Claim(PAPER, text, expected, fitted.rmse / by_contraction.rmse, "1",
              data.format(100 * fitted.rmse, least, reason), case)
        for fitted, reason, case in (
            (by_logarithm, weights, r"linear fit of \(\ln(1 - k/k_\text{max})\)"),
            (iterated, steps, r"repeated linearisation of \(f\) (Gauss-Newton)"),
        )
    )  # fmt: skip


def fit_gauss_newton(recording: am.Recording, saturation: float) -> SurfaceFit:
    """Fit k by repeated linearisation of f in its coefficients, from the linear fit of the logarithm.

    Raises IdentificationError if the coefficients are not determined.
    """
    problem = SurfaceProblem.from_recording(recording, saturation, 4, 2)
    targets, weights = problem.linear_targets()
    coefficients: Array = np.asarray(
        np.linalg.lstsq(weights[:, None] * problem.design_matrix, weights * targets, rcond=None)[0], dtype=float
    )
    for _ in range(MAX_LINEARISATIONS):
        error = problem.contraction - problem.predict(coefficients)
        step = np.asarray(np.linalg.lstsq(problem.jacobian(coefficients), error, rcond=None)[0], dtype=float)
        coefficients = coefficients + step
        if np.abs(step).max() <= 1e-12 * np.abs(coefficients).max():
            break
    return problem.build_fit(coefficients, "repeated linearisation")


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


def claims(curves: PlaneCurves, laws: Mapping[str, am.characteristic.ContractionLaw]) -> tuple[Claim, ...]:
    """Return all claims of the paper for these curves and surfaces."""
    evaluated = (AS_EXPONENT, PRINTED, MISPRINT_CORRECTED, CORRECTED, EXPONENTIAL)
    return (
        *curve_claims(curves),
        *(surface_claim(name, laws[name], curves) for name in evaluated),
        rank_claim(sample(curves)),
        *procedure_claims(round_contraction(sample(curves)), curves.curves[0].saturation),
        load_claim(),
        *catalogue_claims(curves),
        *characteristic_claims(curves),
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
