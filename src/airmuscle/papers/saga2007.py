"""Report chapter: Saga, Nakamura and Yaegashi 2007, the straight-fibre muscle, its tables and its verdict."""

from typing import Any

import numpy as np

import airmuscle as am

from ..core import autodiff
from ..physics.muscle.characteristic.saga2007 import RUBBER_TEST_STRAIN
from ..physics.muscle.geometry.meridian import FERRARESI_2001, SAGA_2007
from ..physics.muscle.geometry.pleated import DAERDEN_LEFEBER_2001
from ..report.chapter import Chapter, Table
from ..report.claims import claims_of
from . import saga2007_muscle as values
from . import saga2007_pairs
from .run import chapter_texts, titled
from .saga2007_claims import ROWS
from .saga2007_figures import plots
from .saga2007_joint import feed_forward_table
from .saga2007_muscle import DEFAULT, INTERPRETATIONS, LINES, exact_meridian, with_rings
from .saga2007_previous import previous_model_table

CONTRACTIONS = np.array([0.001, 0.01, 0.05, 0.10, 0.20, 0.35])
LOADS = (0.0, 100.0, 200.0)
"""Loads of the tables [N] (chosen)."""


def chapter() -> Chapter:
    """Return the chapter of the report: claims with verdicts, tables, figures, and the sources of all values."""
    return Chapter(
        values.PAPER,
        claims=claims_of(ROWS.values(), values.PAPER),
        tables=(
            interpretation_table(),
            exact_table(),
            outline_table(),
            limit_table(),
            virtual_work_table(),
            curve_table(),
            previous_model_table(),
            *saga2007_pairs.tables(),
            feed_forward_table(),
        ),
        plots=plots(),
        references=(SAGA_2007, FERRARESI_2001, DAERDEN_LEFEBER_2001),
        **chapter_texts(values.PAPER),
    )


def interpretation_table() -> Table:
    """Return the pressures of every interpretation at three loads."""
    rows = [(name, force, np.array([law.equilibrium_pressure(c, force) for c in CONTRACTIONS]))
            for name, law in INTERPRETATIONS.items() for force in LOADS]  # fmt: skip
    return saga2007_pairs.pressure_table("saga2007_readings", rows, CONTRACTIONS, "interpretation", 4)


def exact_table() -> Table:
    """Return the pressures of the exact meridian and of the circular meridian with virtual work."""
    contraction = saga2007_pairs.CONTRACTIONS
    models = {"exact meridian": exact_meridian, "circular meridian, virtual work": values.circular_meridian}
    rows = [
        (f"{model}, line {name}", force, values.pressure_along(law(line), contraction, force))
        for name, line in LINES.items()
        for force in LOADS
        for model, law in models.items()
    ]
    return saga2007_pairs.pressure_table("saga2007_exact", rows)


def outline_table() -> Table:
    """Return the largest radii and volumes of Fig. 2, and the exact ones without rubber."""
    printed, exact = ([geometry.segment(c) for c in values.FIG_2]
                      for geometry in (DEFAULT.geometry, exact_meridian(LINES["A"]).geometry))  # fmt: skip
    columns: dict[str, Any] = {
        "contraction [%]": [100 * c for c in values.FIG_2],
        "largest radius by (2), (3) [mm]": [round(1e3 * parabola.max_radius, 2) for parabola in printed],
        "largest radius, exact [mm]": [round(1e3 * each.max_radius, 2) for each in exact],
        "arc by (2), (3) [mm]": [round(1e3 * parabola.arc, 3) for parabola in printed],
        "volume by (2), (3) [cm3]": [round(1e6 * parabola.volume, 3) for parabola in printed],
        "volume, exact [cm3]": [round(1e6 * each.volume, 3) for each in exact],
    }
    return titled("saga2007_outlines", columns)


def limit_table() -> Table:
    """Return the limits of every interpretation: snap-through, pole, strain of the rubber test."""
    rows = [(name, n, with_rings(law, n)) for name, law in INTERPRETATIONS.items() for n in (0, 1, 2)]
    laws, exact = [law for *_, law in rows], [exact_meridian(LINES["A"], n).geometry for _, n, _ in rows]
    columns: dict[str, Any] = {
        "interpretation": [name for name, *_ in rows],
        "rings": [n for _, n, _ in rows],
        "initial pressure [MPa]": [round(law.threshold_pressure / 1e6, 4) for law in laws],
        "load of snap-through [N]": [round(law.snap_through_load, 1) for law in laws],
        "pole of the pressure at [%]": [round(100 * law.pole, 1) for law in laws],
        "strain 3 at [%]": [round(100 * law.contraction_at_strain(RUBBER_TEST_STRAIN), 1) for law in laws],
        "largest exact volume at [%]": [round(100 * tube.free_contraction, 1) for tube in exact],
    }
    return titled("saga2007_limits", columns)


def virtual_work_table() -> Table:
    """Return the tension of the balances and of virtual work, -p dV/dL - dU/dL, for the same outlines."""
    contraction, pressure, line = saga2007_pairs.CONTRACTIONS, values.PRESSURE, LINES["B"]
    forces = {
        values.interpretation_name(2, 1, "B"): DEFAULT.force(pressure, contraction),
        "exact mechanics, line B": values.exact_mechanics(line).force(pressure, contraction),
        "parabola, virtual work": virtual_work(DEFAULT, pressure, contraction),
        "circular meridian, virtual work": values.circular_meridian(line).force(pressure, contraction),
        "exact meridian": exact_meridian(line).shape_at_pressure(pressure, contraction).force,
    }
    columns = {f"{name} [N]": np.round(force, 2) for name, force in forces.items()}
    return titled("saga2007_virtual_work", {"contraction [%]": 100 * contraction, **columns})


def virtual_work(law: am.characteristic.Saga2007, pressure: float, contraction: Any) -> Any:
    """Return (p dV/deps - dU/deps)/L_0 [N] with the volume and the rubber energy of the law's outline."""
    tube = law.geometry
    energy = saga2007_pairs.SegmentEnergy(tube, law.rubber)
    per_segment = autodiff.derivative(energy, "energy", contraction)
    return (pressure * tube.volume_derivative(contraction) - tube.segments * per_segment) / values.LENGTH


def curve_table() -> Table:
    """Return the curves of Fig. 8 at assumed loads; only written to a file."""
    contraction = np.linspace(0.0, 0.4, 81)
    columns: dict[str, Any] = {"contraction [1]": contraction}
    for n in (0, 1, 2):
        for force in LOADS:
            header = f"pressure, {n} rings, {force:g} N [MPa]"
            columns[header] = with_rings(DEFAULT, n).equilibrium_pressure(contraction, force) / 1e6
    return titled("saga2007_curves", columns, shown=False)
