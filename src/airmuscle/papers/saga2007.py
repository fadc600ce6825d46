"""Report chapter: Saga, Nakamura and Yaegashi 2007, the straight-fibre muscle, with a verdict on every claim."""

from __future__ import annotations

from ..physics.muscle.geometry.meridian import SAGA_2007
from ..physics.muscle.geometry.meridian_shapes import FERRARESI_2001
from ..physics.muscle.geometry.pleated import DAERDEN_LEFEBER_2001
from ..report.chapter import Chapter
from .saga2007_claims import (
    ACCURACY_LIMIT,
    FIRST_PERCENT,
    HIGHER_PRESSURE,
    LITTLE_CHANGE,
    LOW_PRESSURE,
    all_claims,
)
from .saga2007_figures import plots
from .saga2007_joint import LIMIT
from .saga2007_muscle import PAPER
from .saga2007_tables import tables
from .saga2007_values import THICK_WALL

SUMMARY = r"""The paper gives a closed-form model of a rubber tube with fibres along its axis. The printed equations are
inconsistent in four places. The pressure force on the half shell is twice the integral of its own integrand (factor
\(w\)). The end slope of the fibres is \(l/a\), whereas the outline has the slope \(l/(2a)\) (factor \(q\)). The fibre
sum includes one fibre beyond the half. The hoop stress is integrated along the axis instead of the arc. All
interpretations are evaluated. The default is the printed model with the corrected fibre sum and with slope and
intercept of the rubber line exchanged (line B).

Only the interpretation \(w = 2\), \(q = 2\) reaches the claimed 200 N at 35 % and 0.11 MPa, but mechanics limits the
tension of any muscle of this size to 88.9 N there. Compared with the exact meridian with the same rubber, the only
interpretation that is exact mechanics for its outline is within 11 % (line A) and 17 % (line B) up to 20 % contraction,
and 61 and 64 % low at 40 %. The paper's own assessment, accurate below 20 %, concerns measurements that are lost and
is not testable. A circular meridian with virtual work is equally simple, conserves energy, and is within 0.7 % of the
exact meridian at 100 N and more up to 30 %. The force balances are not conservative. In feed-forward control of an
antagonistic pair with the exact meridian, the pressures of the printed model leave both muscles slack, whereas those
of the circular meridian with virtual work place the angle within 1 %."""

CHOSEN = (
    ("wall thickness, fibres, fibre length, end diameter", "2 mm, 16, 72 mm, 12 mm", "Table 1"),
    ("rubber, line A", r"\(0.1263\,\varepsilon + 0.3\) MPa", "text; the unit MPa is inferred from the axes of Fig. 4"),
    ("rubber, line B", r"\(0.3\,\varepsilon + 0.1263\) MPa", "chosen: slope and intercept exchanged"),
    ("fibre sum", "5.126", "chosen: (15) without the fibre beyond the half; the printed limit gives 4.931"),
    ("rings", r"equal segments in series, width 0, diameter \(d_0\)", "chosen: not printed"),
    ("loads", "0, 50, 100, 200 N", "chosen: Fig. 8 states none"),
    ("limit of low pressure in claim 3", f"{LOW_PRESSURE / 1e6:g} MPa", "chosen: a quarter of the axis of Fig. 8"),
    ("limit of accuracy in the comparisons on claim 5", f"{100 * ACCURACY_LIMIT:g} % of the pressure", "chosen"),
    ("contraction at which 200 N is a maximum of its own", f"{100 * FIRST_PERCENT:g} %", "chosen"),
    ("little change of the pressure", f"{100 * LITTLE_CHANGE:g} % from 10 to 30 % contraction", "chosen"),
    ("thicker wall", f"{1e3 * THICK_WALL:g} mm", "chosen"),
    ("pressure that a muscle with rings withstands", f"{HIGHER_PRESSURE:g} times that without", "chosen"),
    ("pressures and load of Fig. 1", "0.11 and 0.16 MPa, 100 N", "chosen"),
    ("pair of muscles under feed-forward control", "radius 12 mm, 8 % at angle 0, 50 N, to 15 degrees", "chosen"),
    ("error of the angle of this pair", f"{LIMIT:g} % of the greatest angle", "chosen"),
    ("initial radius in the table of the previous model", r"\(r_i = r_0\) and \(r_i = 0.9\,r_0\)", "chosen"),
)


def chapter() -> Chapter:
    """Return the chapter of the report: claims with verdicts, tables, figures, and the sources of all values."""
    return Chapter(
        paper=PAPER,
        title="Saga, Nakamura, Yaegashi 2007: muscle reinforced by straight fibres",
        summary=SUMMARY,
        claims=all_claims(),
        tables=tables(),
        plots=plots(),
        references=(SAGA_2007, FERRARESI_2001, DAERDEN_LEFEBER_2001),
        chosen=CHOSEN,
    )
