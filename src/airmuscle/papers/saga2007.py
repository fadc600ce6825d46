"""Report chapter: Saga, Nakamura and Yaegashi 2007, the straight-fibre muscle, its tables and its verdict."""

from typing import Any

import numpy as np

import airmuscle as am

from ..core import autodiff
from ..physics.muscle.characteristic.saga2007 import RUBBER_TEST_STRAIN
from ..physics.muscle.geometry.meridian import SAGA_2007
from ..physics.muscle.geometry.meridian_shapes import FERRARESI_2001
from ..physics.muscle.geometry.pleated import DAERDEN_LEFEBER_2001
from ..report.chapter import Chapter, Table
from . import saga2007_pairs
from .run import chapter_texts
from .saga2007_claims import ACCURACY_LIMIT, FIRST_PERCENT, HIGHER_PRESSURE, LITTLE_CHANGE, LOW_PRESSURE, all_claims
from .saga2007_figures import plots
from .saga2007_joint import LIMIT, feed_forward_table
from .saga2007_muscle import (
    DEFAULT,
    FIG_2,
    INTERPRETATIONS,
    LENGTH,
    LINES,
    PAPER,
    PRESSURE,
    THICK_WALL,
    WALL,
    circular_meridian,
    exact_mechanics,
    exact_meridian,
    interpretation_name,
    pressure_along,
    with_rings,
)
from .saga2007_previous import previous_model_table

CONTRACTIONS = np.array([0.001, 0.01, 0.05, 0.10, 0.20, 0.35])
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


def tables() -> tuple[Table, ...]:
    """Return all tables in the order of the report."""
    return (
        interpretation_table(),
        exact_table(),
        outline_table(),
        limit_table(),
        virtual_work_table(),
        curve_table(),
        previous_model_table(),
        *saga2007_pairs.tables(),
        feed_forward_table(),
    )


def interpretation_table() -> Table:
    """Return the pressures of every interpretation at three loads."""
    rows = [(name, force, np.array([law.equilibrium_pressure(c, force) for c in CONTRACTIONS]))
            for name, law in INTERPRETATIONS.items() for force in (0.0, 100.0, 200.0)]  # fmt: skip
    note = (
        r"Without rings. The paper prints \(w = 2\), \(q = 1\); \(M = 5.126\). Exact mechanics: \(w = 1\), "
        r"\(q = 2\), \(M = m/\pi\), rubber along the arc."
    )
    title = "Pressure by equation (19) in all interpretations"
    options: dict[str, Any] = {"contraction": CONTRACTIONS, "kind": "interpretation", "digits": 4}
    return saga2007_pairs.pressure_table("saga2007_readings", title, rows, note, **options)


def exact_table() -> Table:
    """Return the pressures of the exact meridian and of the circular meridian with virtual work."""
    contraction = saga2007_pairs.CONTRACTIONS
    models = {"exact meridian": exact_meridian, "circular meridian, virtual work": circular_meridian}
    rows = [
        (f"{model}, line {name}", force, pressure_along(law(line), contraction, force))
        for name, line in LINES.items()
        for force in (0.0, 100.0, 200.0)
        for model, law in models.items()
    ]
    note = (
        "No value: at 1 % the unloaded tube with line A would be narrower in the middle than at its ends, which the "
        "model does not cover."
    )
    title = "Pressure of the exact and of the circular meridian"
    return saga2007_pairs.pressure_table("saga2007_exact", title, rows, note)


def outline_table() -> Table:
    """Return the largest radii and volumes of Fig. 2, and the exact ones without rubber."""
    reference = exact_meridian(LINES["A"]).geometry
    pairs = [(DEFAULT.geometry.segment(c), reference.segment(c)) for c in FIG_2]
    columns: dict[str, Any] = {
        "contraction [%]": [100 * c for c in FIG_2],
        "largest radius by (2), (3) [mm]": [round(1e3 * parabola.max_radius, 2) for parabola, _ in pairs],
        "largest radius, exact [mm]": [round(1e3 * exact.max_radius, 2) for _, exact in pairs],
        "arc by (2), (3) [mm]": [round(1e3 * parabola.arc, 3) for parabola, _ in pairs],
        "volume by (2), (3) [cm3]": [round(1e6 * parabola.volume, 3) for parabola, _ in pairs],
        "volume, exact [cm3]": [round(1e6 * exact.volume, 3) for _, exact in pairs],
    }
    return Table("saga2007_outlines", "Outlines of Fig. 2; length of the fibre 72 mm", columns)


def limit_table() -> Table:
    """Return the limits of every interpretation: snap-through, pole, strain of the rubber test."""
    rows = [(name, n, with_rings(law, n)) for name, law in INTERPRETATIONS.items() for n in (0, 1, 2)]
    columns: dict[str, Any] = {
        "interpretation": [r[0] for r in rows],
        "rings": [r[1] for r in rows],
        "initial pressure [MPa]": [round(r[2].threshold_pressure / 1e6, 4) for r in rows],
        "load of snap-through [N]": [round(r[2].snap_through_load, 1) for r in rows],
        "pole of the pressure at [%]": [round(100 * r[2].pole, 1) for r in rows],
        "strain 3 at [%]": [round(100 * r[2].contraction_at_strain(RUBBER_TEST_STRAIN), 1) for r in rows],
        "largest exact volume at [%]": [
            round(100 * exact_meridian(LINES["A"], r[1]).geometry.free_contraction, 1) for r in rows
        ],
    }
    note = (
        "Below the load of snap-through the pressure initially falls with contraction; a negative value means that it "
        "rises under any tension. The value 50 % for strain 3 means that the parabola never reaches this strain."
    )
    return Table("saga2007_limits", "Limits of all interpretations", columns, note)


def virtual_work_table() -> Table:
    """Return the tension of the balances and of virtual work, -p dV/dL - dU/dL, for the same outlines."""
    contraction = saga2007_pairs.CONTRACTIONS
    laws = {interpretation_name(2, 1, "B"): DEFAULT, "exact mechanics, line B": exact_mechanics(LINES["B"])}
    columns: dict[str, Any] = {"contraction [%]": 100 * contraction}
    for name, law in laws.items():
        columns[f"{name} [N]"] = np.round(law.force(PRESSURE, contraction), 2)
    columns["parabola, virtual work [N]"] = np.round(virtual_work(DEFAULT, PRESSURE, contraction), 2)
    circle, exact = circular_meridian(LINES["B"]), exact_meridian(LINES["B"])
    columns["circular meridian, virtual work [N]"] = np.round(circle.force(PRESSURE, contraction), 2)
    columns["exact meridian [N]"] = np.round(exact.shape_at_pressure(PRESSURE, contraction).force, 2)
    note = (
        "At 0.11 MPa. A negative tension is a push; no value: there is no outline. A balance that differs from the "
        "virtual work of its own outline generates or dissipates energy on a closed path; the tensions of the circular "
        "and of the exact meridian are equal to the virtual work."
    )
    return Table("saga2007_virtual_work", _VIRTUAL_WORK_TITLE, columns, note)


_VIRTUAL_WORK_TITLE = (
    r"Tension of the force balances and virtual work "
    r"\(-p\,\frac{\text{d}V}{\text{d}L} - \frac{\text{d}U}{\text{d}L}\)"
)


def virtual_work(law: am.characteristic.Saga2007, pressure: float, contraction: Any) -> Any:
    """Return (p dV/deps - dU/deps)/L_0 [N] with the volume and the rubber energy of the law's outline."""
    tube = law.geometry
    energy = saga2007_pairs.SegmentEnergy(tube, law.rubber)
    per_segment = autodiff.derivative(energy, "energy", contraction)
    return (pressure * tube.volume_derivative(contraction) - tube.segments * per_segment) / LENGTH


def curve_table() -> Table:
    """Return the curves of Fig. 8 at assumed loads; only written to a file."""
    contraction = np.linspace(0.0, 0.4, 81)
    columns: dict[str, Any] = {"contraction [1]": contraction}
    for n in (0, 1, 2):
        for force in (0.0, 100.0, 200.0):
            header = f"pressure, {n} rings, {force:g} N [MPa]"
            columns[header] = with_rings(DEFAULT, n).equilibrium_pressure(contraction, force) / 1e6
    note = rf"\(w = 2\), \(q = 1\), line B, wall {1e3 * WALL:g} mm."
    return Table("saga2007_curves", "Pressure over contraction for rings and loads", columns, note, shown=False)
