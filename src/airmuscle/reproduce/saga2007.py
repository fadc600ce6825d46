"""Saga, Nakamura and Yaegashi 2007, the straight-fibre muscle: what their paper claims, judged."""

from __future__ import annotations

from ..geometry.circular_arc import FERRARESI_2001
from ..geometry.meridian import SAGA_2007
from ..geometry.pleated import DAERDEN_LEFEBER_2001
from ..report.chapter import Chapter
from .saga2007_claims import ACCURACY_LIMIT, LOW_PRESSURE, PAPER, all_claims
from .saga2007_figures import plots
from .saga2007_tables import tables

SUMMARY = """A closed formula for a rubber tube with fibres along its axis. As printed it contradicts itself: the
pressure on the half shell is twice what its own integrand gives (w), the end slope is l/a where the
outline's is l/(2a) (q), one fibre past the half is summed, and the rubber is integrated along the
axis instead of the arc. Every reading is carried; the default is the printed one with the fibre sum
mended and the rubber's slope and intercept exchanged (line B). Only w 2, q 2 meets the paper's
claim of 200 N at 35 % and 0.11 MPa, and mechanics allows no muscle of this size more than 88.9 N
there. Against the exact meridian with the same rubber, the one reading that is exact mechanics is
within 11 % up to 20 % contraction and 61 % low at 40 %, which is the paper's own verdict on itself,
from a second side. The circle closed by virtual work is as simple, keeps energy, and is within 0.7
% from 100 N up to 30 %; the balances keep no energy."""

CHOSEN = (
    ("wall, fibres, fibre length, end diameter", "2 mm, 16, 72 mm, 12 mm", "Table 1"),
    ("rubber, line A", "0.1263 eps + 0.3 MPa", "text; MPa inferred from the axes of Fig. 4"),
    ("rubber, line B", "0.3 eps + 0.1263 MPa", "chosen: the same numbers exchanged"),
    ("fibre sum", "5.12583", "chosen: (15) without the fibre past the half; printed limit gives 4.93074"),
    ("rings", "equal segments in series, width 0, diameter d_0", "chosen: not printed"),
    ("loads", "0, 50, 100, 200 N", "chosen: Fig. 8 states none"),
    ("low pressure in claim 3", f"{LOW_PRESSURE / 1e6:g} MPa", "chosen: a quarter of the axis of Fig. 8"),
    ("accurate in claim 5", f"{ACCURACY_LIMIT:.0%} of the pressure", "chosen"),
)


def chapter() -> Chapter:
    """The chapter of the report: claims with their verdicts, tables, figures, and where every number is from."""
    return Chapter(
        paper=PAPER,
        title="Saga, Nakamura, Yaegashi 2007: a muscle reinforced by straight fibres",
        summary=SUMMARY.replace("\n", " "),
        claims=all_claims(),
        tables=tables(),
        plots=plots(),
        references=(SAGA_2007, FERRARESI_2001, DAERDEN_LEFEBER_2001),
        chosen=CHOSEN,
    )
