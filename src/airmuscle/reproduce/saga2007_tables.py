"""The tables of the chapter on Saga et al. 2007."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..characteristic.saga2007 import RUBBER_TEST_STRAIN, Saga2007
from ..core import autodiff
from ..report.chapter import Table
from . import saga2007_pairs
from .saga2007_claims import FIG_2
from .saga2007_muscle import (
    DEFAULT,
    LENGTH,
    LINES,
    PRESSURE,
    INTERPRETATIONS,
    WALL,
    circular_meridian,
    exact_meridian,
    exact_mechanics,
    pressure_along,
    with_rings,
)

CONTRACTIONS = np.array([0.001, 0.01, 0.05, 0.10, 0.20, 0.35])


def tables() -> tuple[Table, ...]:
    """All tables, in the order of the report."""
    return (interpretation_table(), exact_table(), outline_table(), limit_table(), virtual_work_table(), curve_table(), *saga2007_pairs.tables())


def interpretation_table() -> Table:
    """The pressure of every reading under three loads."""
    rows = [(name, force, law) for name, law in INTERPRETATIONS.items() for force in (0.0, 100.0, 200.0)]
    columns: dict[str, Any] = {"reading": [r[0] for r in rows], "load [N]": [r[1] for r in rows]}
    for c in CONTRACTIONS:
        columns[f"pressure at {c:.1%} [MPa]"] = [round(law.balancing_pressure(c, f) / 1e6, 4) for _, f, law in rows]
    note = "No ring. Printed are w 2, q 1; M = 5.12583; exact mechanics is w 1, q 2, M = m/pi, rubber along the arc."
    return Table("saga2007_readings", "Pressure by equation (19) in its readings", columns, note)


def exact_table() -> Table:
    """What the exact meridian asks for, and the circle with virtual work."""
    contraction = saga2007_pairs.CONTRACTIONS
    rows: list[tuple[str, float, Any]] = []
    for name, line in LINES.items():
        for force in (0.0, 100.0, 200.0):
            rows.append((f"exact meridian, line {name}", force, pressure_along(exact_meridian(line), contraction, force)))
            rows.append((f"circle, virtual work, line {name}", force, circular_meridian(line).pressure(contraction, force)))
    columns: dict[str, Any] = {"model": [r[0] for r in rows], "load [N]": [r[1] for r in rows]}
    for i, c in enumerate(contraction):
        columns[f"pressure at {c:.0%} [MPa]"] = [round(float(r[2][i]) / 1e6, 6) for r in rows]
    note = "nan: line A without load draws the tube in below its end rings at 1 %, of which it says nothing."
    return Table("saga2007_exact", "Pressure of the exact meridian and of the circle", columns, note)


def outline_table() -> Table:
    """The largest radii and volumes of Fig. 2, beside the exact ones without rubber."""
    truth = exact_meridian(LINES["A"]).geometry
    pairs = [(DEFAULT.geometry.segment(c), truth.segment(c)) for c in FIG_2]
    columns: dict[str, Any] = {
        "contraction [%]": [100 * c for c in FIG_2],
        "largest radius by (2), (3) [mm]": [round(1e3 * ours.largest_radius, 2) for ours, _ in pairs],
        "largest radius, exact [mm]": [round(1e3 * theirs.largest_radius, 2) for _, theirs in pairs],
        "arc by (2), (3) [mm]": [round(1e3 * ours.arc, 3) for ours, _ in pairs],
        "volume by (2), (3) [cm3]": [round(1e6 * ours.volume, 3) for ours, _ in pairs],
        "volume, exact [cm3]": [round(1e6 * theirs.volume, 3) for _, theirs in pairs],
    }
    return Table("saga2007_outlines", "Outlines of Fig. 2; the fibre is 72 mm long", columns)


def limit_table() -> Table:
    """Where each reading ends: snap-through, pole, strain of the rubber test."""
    rows = [(name, n, with_rings(law, n)) for name, law in INTERPRETATIONS.items() for n in (0, 1, 2)]
    columns: dict[str, Any] = {
        "reading": [r[0] for r in rows],
        "rings": [r[1] for r in rows],
        "starting pressure [MPa]": [round(r[2].starting_pressure / 1e6, 4) for r in rows],
        "pressure falls at first below [N]": [round(r[2].snapping_load, 1) for r in rows],
        "pressure infinite at [%]": [round(100 * r[2].pole, 1) for r in rows],
        "strain 3 at [%]": [round(100 * r[2].contraction_at_strain(RUBBER_TEST_STRAIN), 1) for r in rows],
        "largest volume, exact [%]": [round(100 * exact_meridian(LINES["A"], r[1]).geometry.free_contraction, 1) for r in rows],
    }
    note = "A negative load: pressure rises from the start under any pull. 50 %: the parabola never strains it so far."
    return Table("saga2007_limits", "Limits of each reading", columns, note)


def virtual_work_table() -> Table:
    """By how much the balances break virtual work: their tension against (p dV - dU)/dL of the same outline."""
    contraction = saga2007_pairs.CONTRACTIONS
    laws = {"w 2, q 1, line B": DEFAULT, "exact mechanics, line B": exact_mechanics(LINES["B"])}
    columns: dict[str, Any] = {"contraction [%]": 100 * contraction}
    for name, law in laws.items():
        columns[f"{name} [N]"] = np.round(law.force(PRESSURE, contraction), 2)
    columns["parabola, virtual work [N]"] = np.round(virtual_work(DEFAULT, PRESSURE, contraction), 2)
    columns["circle, virtual work [N]"] = np.round(circular_meridian(LINES["B"]).force(PRESSURE, contraction), 2)
    columns["exact meridian [N]"] = np.round(exact_meridian(LINES["B"]).balance_under(PRESSURE, contraction).force, 2)
    note = (
        "At 0.11 MPa; where the tension is negative it must be pushed, nan has no outline. A balance that differs from "
        "its own outline's virtual work makes or loses energy on a closed path; circle and exact are that work."
    )
    return Table("saga2007_virtual_work", "Tension of the balances and virtual work -p dV/dL - dU/dL", columns, note)


def virtual_work(law: Saga2007, pressure: float, contraction: Any) -> Any:
    """(p dV/deps - dU/deps)/L_0 [N] with the volume and the rubber's energy of the law's own outline."""
    tube = law.geometry
    stored = saga2007_pairs.SegmentEnergy(tube, law.rubber)
    per_segment = autodiff.derivative(stored, "energy", contraction)
    return (pressure * tube.volume_growth(contraction) - tube.segments * per_segment) / LENGTH


def curve_table() -> Table:
    """The curves of Fig. 8 at stated loads, for the file only."""
    contraction = np.linspace(0.0, 0.4, 81)
    columns: dict[str, Any] = {"contraction [1]": contraction}
    for n in (0, 1, 2):
        for force in (0.0, 100.0, 200.0):
            header = f"pressure, {n} rings, {force:g} N [MPa]"
            columns[header] = with_rings(DEFAULT, n).balancing_pressure(contraction, force) / 1e6
    note = f"w 2, q 1, line B, wall {1e3 * WALL:g} mm."
    return Table("saga2007_curves", "Pressure over contraction, rings and loads", columns, note, shown=False)
