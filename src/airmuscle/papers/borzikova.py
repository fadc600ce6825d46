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
from .run import chapter_texts

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
        PAPER,
        claims=claims(curves, laws),
        tables=tables(curves, laws),
        plots=plots(curves, laws),
        references=(BORZIKOVA,),
        chosen=CHOSEN,
        **chapter_texts(PAPER),
    )
