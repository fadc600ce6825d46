"""Report chapter: Saga, Nakamura and Yaegashi 2007, the straight-fibre muscle, with a verdict on every claim."""

from __future__ import annotations

from ..physics.muscle.geometry.meridian import SAGA_2007
from ..physics.muscle.geometry.meridian_shapes import FERRARESI_2001
from ..physics.muscle.geometry.pleated import DAERDEN_LEFEBER_2001
from ..report.chapter import Chapter
from .run import chapter_texts
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

CHOSEN = (
    ("wall thickness, fibres, fibre length, end diameter", "2 mm, 16, 72 mm, 12 mm", "Table 1"),
    ("rubber, line A", r"\(0.1263\,\varepsilon + 0.3\) MPa", "text; the unit MPa is inferred from the axes of Fig. 4"),
    ("rubber, line B", r"\(0.3\,\varepsilon + 0.1263\) MPa", "chosen: slope and intercept exchanged"),
    ("fibre sum", "5.126", "chosen: (15) without the fibre beyond the half; the printed limit gives 4.931"),
    ("rings", r"equal segments in series, width 0, diameter \(d_0\)", "chosen: not printed"),
    ("loads", "0, 50, 100, 200 N", "chosen: Fig. 8 states none"),
    ("limit of a low pressure", f"{LOW_PRESSURE / 1e6:g} MPa", "chosen: a quarter of the axis of Fig. 8"),
    ("limit of accuracy in the comparisons", f"{100 * ACCURACY_LIMIT:g} % of the pressure", "chosen"),
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
        PAPER,
        claims=all_claims(),
        tables=tables(),
        plots=plots(),
        references=(SAGA_2007, FERRARESI_2001, DAERDEN_LEFEBER_2001),
        chosen=CHOSEN,
        **chapter_texts(PAPER),
    )
