"""Report chapter: Borzíková, Balara and Piteľ, contraction of the Shadow Air Muscle SAM 30 x 290.

The measurements and figures of the paper are lost; its three printed plane curves serve as data.
"""

from __future__ import annotations

from ..physics.muscle.characteristic.borzikova import BORZIKOVA, SAM_30X290
from ..report.chapter import Chapter
from .borzikova_claims import PAPER, claims
from .borzikova_figures import plots
from .borzikova_surfaces import surfaces
from .borzikova_tables import tables

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
