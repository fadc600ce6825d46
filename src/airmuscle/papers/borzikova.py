"""Report chapter: Borzíková, Balara and Piteľ, contraction of the Shadow Air Muscle, with its
claims as a table.

The measurements and figures of the paper are lost; its three printed plane curves serve as data.
"""

import numpy as np

import airmuscle as am

from ..bench.statics import (
    Chebyshev,
    LoadRange,
    SurfaceProblem,
    conditioning,
    fit_linearised,
    fit_nonlinear,
)
from ..bench.statics.exponential_surface import SurfaceFit
from ..core import STANDARD_GRAVITY, Array
from ..physics.muscle.characteristic.borzikova import BORZIKOVA, SAM_30X290, PlaneCurves
from ..report.chapter import Chapter
from ..report.claims import AtLeast, Claim, Equal, claims_of
from ..report.formatting import format_number, typographic
from . import borzikova_surfaces as drawn
from .borzikova_surfaces import Laws, index_on_curves, plots, round_contraction, sample, surfaces
from .borzikova_tables import CATALOGUE_TABLE, CATALOGUE_TEXT, tables
from .run import chapter_texts, claim_row

PAPER = "borzikova"
MAX_LINEARISATIONS = 50
"""Maximum number of steps of the repeated linearisation (chosen)."""
MEASURED_DIAMETER = 30
"""Nominal diameter of the measured muscle [mm]."""
SATURATION = SAM_30X290.curves[0].saturation
SURFACES = (
    drawn.AS_EXPONENT,
    drawn.PRINTED,
    drawn.MISPRINT_CORRECTED,
    drawn.CORRECTED,
    drawn.EXPONENTIAL,
)
"""Surfaces that are compared with the printed correlation indices."""


def chapter() -> Chapter:
    """Return the chapter of the report."""
    subject = SAM_30X290, surfaces(SAM_30X290)
    return Chapter(
        PAPER,
        claims=claims(*subject),
        tables=tables(*subject),
        plots=plots(*subject),
        references=(BORZIKOVA,),
        **chapter_texts(PAPER),
    )


def surface_index(curves: PlaneCurves, laws: Laws, name: str) -> tuple[float, str]:
    """Return the correlation index of a surface on the plane curves [1], or 1 - SSE/SST where it
    does not exist.
    """
    index = index_on_curves(laws[name], curves)
    if index.value is None:
        value = typographic(format_number(index.r_squared))
        note = (
            r"The index does not exist as SSE > SST; the value is \(1 -"
            rf" \text{{SSE}}/\text{{SST}}\) = {value}."
        )
        return index.r_squared, note
    return (
        index.value,
        (
            f"Index at 15 evenly spaced pressures of each curve, 0 to {curves.max_pressure / 1e5:g}"
            " bar."
        ),
    )


def linearised_ratio(recording: am.Recording, repeated: bool) -> tuple[float, str]:
    """Return the rms error of a linearised fit of equation (1) relative to that of least squares on
    k [1].
    """
    fitted = (
        fit_gauss_newton(recording, SATURATION)
        if repeated
        else fit_linearised(recording, SATURATION)
    )
    least = fit_nonlinear(recording, SATURATION).rmse
    weights = r"the logarithm gives points near \(k_\text{max}\) too much weight."
    reason = r"every step is a linear fit of the change of \(k\)." if repeated else weights
    errors = (
        f"rms error {100 * fitted.rmse:.4g} % linearised, {100 * least:.4g} % by least squares on "
    )
    return fitted.rmse / least, f"{errors}\\(k\\); {reason} The tolerance is chosen."


def fit_gauss_newton(recording: am.Recording, saturation: float) -> SurfaceFit:
    """Fit k by repeated linearisation in the coefficients. Raises IdentificationError if they are
    not determined.
    """
    problem = SurfaceProblem.from_recording(recording, saturation, 4, 2)
    coefficients: Array = np.asarray(
        np.linalg.lstsq(*problem.linear_system(), rcond=None)[0], dtype=float
    )
    for _ in range(MAX_LINEARISATIONS):
        error = problem.target - problem.predict(coefficients)
        jacobian = problem.jacobian(coefficients)
        step = np.asarray(np.linalg.lstsq(jacobian, error, rcond=None)[0], dtype=float)
        coefficients = coefficients + step
        if np.abs(step).max() <= 1e-12 * np.abs(coefficients).max():
            break
    return problem.build_fit(coefficients, "repeated linearisation")


def largest_contraction(curves: PlaneCurves, load: str) -> tuple[float, str]:
    """Return the maximum [%] of the curve at the smallest or largest load."""
    curve = {"smallest": min, "largest": max}[load](curves.curves, key=lambda c: c.force)
    pressures = np.linspace(0.0, curves.max_pressure, 351)
    which, rest = {
        "smallest": (
            "the smallest",
            "The tolerance is chosen. The saturation is approached beyond the range.",
        ),
        "largest": ("a smaller", "The text gives no pressure: at a higher one it may hold."),
    }[load]
    place = f"{curve.force:g} N, {which} load, up to {curves.max_pressure / 1e5:g} bar"
    note = f"Maximum of the plane curve at {place}. {rest}"
    return 100.0 * float(np.max(curve.contraction(pressures))), note


def largest_of_size(curves: PlaneCurves, diameter: int) -> tuple[float | None, str]:
    """Return the maximum contraction [%] of a muscle of the text at the largest load; only one size
    was measured.
    """
    if diameter == MEASURED_DIAMETER:
        return largest_contraction(curves, "largest")
    return None, "No characteristic of this size is printed; the measured muscle is the 30 x 290."


def initial_load(curves: PlaneCurves) -> tuple[None, str]:
    """Return no value, and the contraction at which the curve of the smallest load begins."""
    lightest = min(curves.curves, key=lambda c: c.force)
    start = typographic(format_number(100.0 * float(lightest.contraction(0.0)), 3))
    return (
        None,
        (
            f"No characteristic without load is printed. The curve at {lightest.force:g} N begins"
            f" at {start} %: the fit places the start below the initial length, which may be its"
            " error or an extension by the load."
        ),
    )


_TABLE, _TEXT = (
    dict(zip(each.columns["diameter [mm]"], each.columns[load], strict=True))
    for each, load in ((CATALOGUE_TABLE, "load at 3.5 bar [kg]"), (CATALOGUE_TEXT, "load [kg]"))
)
_DIAMETERS = {load: diameter for diameter, load in _TEXT.items()}

CURVES = tuple(
    claim_row(
        PAPER, "index of a curve", None, {f"{c.force:g} N": ()}, Equal(c.printed_index, 0.0005)
    )
    for c in SAM_30X290.curves
)
_LEAST_INDEX = AtLeast(min(c.printed_index for c in SAM_30X290.curves), 0.0005, derived=True)
SURFACE = claim_row(
    PAPER, "index of a surface", surface_index, {name: (name,) for name in SURFACES}, _LEAST_INDEX
)
RANK = claim_row(
    PAPER,
    "rank",
    lambda data: float(conditioning(data, Chebyshev(LoadRange.from_recording(data))).rank),
)
PROCEDURE = claim_row(
    PAPER,
    "procedure",
    linearised_ratio,
    {
        r"linear fit of \(\ln(1 - k/k_\text{max})\)": (False,),
        r"repeated linearisation of \(f\) (Gauss-Newton)": (True,),
    },
)
LOAD = claim_row(PAPER, "load", lambda: 26.0 * STANDARD_GRAVITY)
CATALOGUE = (
    *(
        claim_row(
            PAPER,
            "lifted load",
            lambda size: float(_TEXT[size]),
            {case: (size,)},
            Equal(float(_TABLE[size])),
        )
        for size, case in ((30, "30 x 290"), (20, "20 x 210"))
    ),
    claim_row(PAPER, "smallest muscle", lambda: float(_DIAMETERS[3])),
)
_SIZES = {f"{load} kg, diameter {size} mm": (size,) for size, load in _TEXT.items()}
MUSCLE = (
    claim_row(PAPER, "contraction under a load", largest_of_size, _SIZES),
    claim_row(PAPER, "saturation", lambda curves: largest_contraction(curves, "smallest")),
    claim_row(PAPER, "initial position", initial_load),
    claim_row(PAPER, "mean of the branches", lambda curves: None),
)


def claims(curves: PlaneCurves, laws: Laws) -> tuple[Claim, ...]:
    """Return all claims of the paper for these curves and surfaces."""
    data = sample(curves)
    return (
        *claims_of(CURVES),
        *SURFACE.claims(curves, laws),
        *RANK.claims(data),
        *PROCEDURE.claims(round_contraction(data)),
        *claims_of((LOAD, *CATALOGUE)),
        *claims_of(MUSCLE, curves),
    )
