"""Report chapter: Saga, Nakamura and Yaegashi 2007, the straight-fibre muscle, its claims and
tables.

The function of each claim takes the model: the verdict follows from its fibre sum, projection
factor and rubber.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ..core import autodiff
from ..physics.muscle.characteristic.saga2007 import RUBBER_TEST_STRAIN
from ..physics.muscle.geometry.meridian import FERRARESI_2001, SAGA_2007
from ..physics.muscle.geometry.straight_fibre import DAERDEN_LEFEBER_2001
from ..report.chapter import Chapter, Table
from ..report.claims import Claim, claims_of
from . import saga2007_muscle as values
from . import saga2007_pairs
from .run import chapter_texts, claim_row, titled
from .saga2007_figures import plots
from .saga2007_joint import feed_forward_table, models, relative_angle_error
from .saga2007_muscle import (
    DEFAULT,
    INTERPRETATIONS,
    LINES,
    PAPER,
    PRESSURE,
    exact_meridian,
    with_rings,
)
from .saga2007_previous import FIG_1_LOAD, previous_model_table, radii_at_contraction, radii_at_load

HIGHER_PRESSURE = 2.0
"""Ratio of the pressure that a muscle with rings withstands to that of the muscle without
(chosen).
"""
FIRST_PERCENT = 0.01
"""Contraction at which the largest force is taken [1] (chosen): at 0 inextensible fibres hold any
force.
"""

B = values.interpretation_name(2, 1, "B")
A = values.interpretation_name(2, 1, "A")
"""Names of the default, and of the printed model with line A."""
MECHANICS = {
    f"exact mechanics, line {name}": values.exact_mechanics(line) for name, line in LINES.items()
}
EXACT = {f"exact meridian, line {name}": exact_meridian(line) for name, line in LINES.items()}
PRINTED: dict[str, am.characteristic.Saga2007] = {
    B: DEFAULT,
    A: values.interpretation(LINES["A"], 2.0, 1.0),
}
LAWS: Mapping[str, values.Law] = {**PRINTED, **MECHANICS, **EXACT}
"""Default, printed model, the two of exact mechanics, and the exact meridian with both rubber
lines.
"""


def _each(laws: Mapping[str, Any], *loads: float) -> dict[str, tuple[Any, ...]]:
    """Return the cases of all laws, each with every load [N] if there are any."""
    if not loads:
        return {name: (law,) for name, law in laws.items()}
    return {f"{name}, {load:g} N": (law, load) for name, law in laws.items() for load in loads}


OUTLINE = "outline by (2), (3)"
_REPRODUCED: Mapping[str, tuple[Any, ...]] = {
    "contraction": (values.contraction, _each({B: DEFAULT, **EXACT})),
    "lifting": (values.lifting, _each({B: DEFAULT, **INTERPRETATIONS, **EXACT})),
    "max tension": (
        lambda: PRESSURE * float(exact_meridian(LINES["A"]).geometry.effective_area(0.35)),
        {"tension at 35 %, any rubber": ()},
    ),
    "largest force": (lambda law: float(values.tension(law, PRESSURE, FIRST_PERCENT)), _each(LAWS)),
    "low start": (lambda law: values.initial_pressure(law) / 1e6, _each(PRINTED)),
    "rings contract less": (
        values.ring_ratio,
        _each({B: DEFAULT}, 0.0, 100.0) | _each({A: PRINTED[A]}, 0.0),
    ),
    "strains": (
        lambda law, load: values.strength_ratio(
            law, load, lambda muscle, c: muscle.middle_strain(c)
        ),
        _each({B: DEFAULT}, 200.0),
    ),
    "tensions": (
        lambda law, load: values.strength_ratio(
            law, load, lambda muscle, c: muscle.end_tension(PRESSURE, c, load)
        ),
        _each({B: DEFAULT}, 200.0),
    ),
    "ring force": (
        values.ring_force_ratio,
        {
            f"{name}, {case}": (law, factor)
            for name, law in {**PRINTED, **EXACT}.items()
            for factor, case in (
                (1.0, "equal pressure"),
                (HIGHER_PRESSURE, f"{HIGHER_PRESSURE:g} times the pressure"),
            )
        },
    ),
    "accurate": (),
    "deviates": (),
    "cause": (),
    "error below 20 %": (
        lambda law, load: values.pressure_error(law, load, 0.01, 0.20, 20),
        _each({**PRINTED, **MECHANICS}, 100.0),
    ),
    "error above 20 %": (
        lambda law, load: values.pressure_error(law, load, 0.25, 0.40, 16),
        _each({**PRINTED, **MECHANICS}, 100.0),
    ),
    "rubber test": (lambda: 100 * DEFAULT.contraction_at_strain(RUBBER_TEST_STRAIN), {OUTLINE: ()}),
    "thickness": (lambda: 1 / (1 + float(DEFAULT.middle_strain(0.20))), {OUTLINE: ()}),
    "thinning": (
        values.thinning,
        {f"exact mechanics, line B, 100 N, {100 * at:g} %": (at,) for at in (0.20, 0.40)},
    ),
    "outlines": (values.largest_radius, {OUTLINE: (DEFAULT,)}),
    "feed-forward": (
        values.share_reached,
        _each({B: DEFAULT}, 100.0) | _each({A: PRINTED[A]}, 0.0),
    ),
    "feed-forward of a pair": (
        relative_angle_error,
        {
            f"{name}, line {line}": (name, line)
            for line in LINES
            for name in list(models(LINES[line]))[:-1]
        },
    ),
    "high start": (
        lambda law: values.initial_pressure(law) / float(law.equilibrium_pressure(0.10, 0.0)),
        _each(PRINTED),
    ),
    "axis": (
        lambda law, load: (
            float(np.max(law.equilibrium_pressure(np.linspace(0.0, 0.4, 81), load))) / 1e6
        ),
        _each({B: DEFAULT}, 0.0, 200.0),
    ),
    "expansion": (
        values.middle_strain,
        {
            f"{name}, {at} %": (exact, at / 100)
            for at in (20, 35)
            for name, exact in ((OUTLINE, False), ("exact outline without rubber", True))
        },
    ),
    "little change": (values.pressure_change, _each(LAWS, 0.0, 100.0)),
    "thick wall": (values.wall_ratio, _each({**PRINTED, **EXACT})),
    "previous model": (
        lambda radii: radii(),
        {
            f"line A, constant load of {FIG_1_LOAD:g} N": (radii_at_load,),
            "line A, constant contraction": (radii_at_contraction,),
        },
    ),
}
"""The function of each claim and its cases, by the names in claims.toml and in the order of the
report.
"""
ROWS = {name: claim_row(PAPER, name, *given) for name, given in _REPRODUCED.items()}
"""All rows by name."""


def claim(row: str, *arguments: Any) -> Claim:
    """Return the claim of one row for other arguments than those of its cases."""
    return ROWS[row].claim("", *arguments)


CONTRACTIONS = np.array([0.001, 0.01, 0.05, 0.10, 0.20, 0.35])
LOADS = (0.0, 100.0, 200.0)
"""Loads of the tables [N] (chosen)."""


def chapter() -> Chapter:
    """Return the chapter of the report: claims with verdicts, tables, figures, and the sources of
    all values.
    """
    return Chapter(
        PAPER,
        claims=claims_of(ROWS.values()),
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
        **chapter_texts(PAPER),
    )


def interpretation_table() -> Table:
    """Return the pressures of every interpretation at three loads."""
    rows = [
        (name, force, np.array([law.equilibrium_pressure(c, force) for c in CONTRACTIONS]))
        for name, law in INTERPRETATIONS.items()
        for force in LOADS
    ]
    return saga2007_pairs.pressure_table(
        "saga2007_readings", rows, CONTRACTIONS, "interpretation", 4
    )


def exact_table() -> Table:
    """Return the pressures of the exact meridian and of the circular meridian with virtual work."""
    contraction = saga2007_pairs.CONTRACTIONS
    models = {
        "exact meridian": exact_meridian,
        "circular meridian, virtual work": values.circular_meridian,
    }
    rows = [
        (f"{model}, line {name}", force, values.pressure_along(law(line), contraction, force))
        for name, line in LINES.items()
        for force in LOADS
        for model, law in models.items()
    ]
    return saga2007_pairs.pressure_table("saga2007_exact", rows)


def outline_table() -> Table:
    """Return the largest radii and volumes of Fig. 2, and the exact ones without rubber."""
    printed, exact = (
        [geometry.segment(c) for c in values.FIG_2]
        for geometry in (DEFAULT.geometry, exact_meridian(LINES["A"]).geometry)
    )
    columns: dict[str, Any] = {
        "contraction [%]": [100 * c for c in values.FIG_2],
        "largest radius by (2), (3) [mm]": [
            round(1e3 * parabola.max_radius, 2) for parabola in printed
        ],
        "largest radius, exact [mm]": [round(1e3 * each.max_radius, 2) for each in exact],
        "arc by (2), (3) [mm]": [round(1e3 * parabola.arc, 3) for parabola in printed],
        "volume by (2), (3) [cm3]": [round(1e6 * parabola.volume, 3) for parabola in printed],
        "volume, exact [cm3]": [round(1e6 * each.volume, 3) for each in exact],
    }
    return titled("saga2007_outlines", columns)


def limit_table() -> Table:
    """Return the limits of every interpretation: snap-through, pole, strain of the rubber test."""
    rows = [
        (name, n, with_rings(law, n)) for name, law in INTERPRETATIONS.items() for n in (0, 1, 2)
    ]
    laws = [law for *_, law in rows]
    exact = [exact_meridian(LINES["A"], n).geometry for _, n, _ in rows]
    columns: dict[str, Any] = {
        "interpretation": [name for name, *_ in rows],
        "rings": [n for _, n, _ in rows],
        "initial pressure [MPa]": [round(law.threshold_pressure / 1e6, 4) for law in laws],
        "load of snap-through [N]": [round(law.snap_through_load, 1) for law in laws],
        "pole of the pressure at [%]": [round(100 * law.pole, 1) for law in laws],
        "strain 3 at [%]": [
            round(100 * law.contraction_at_strain(RUBBER_TEST_STRAIN), 1) for law in laws
        ],
        "largest exact volume at [%]": [round(100 * tube.free_contraction, 1) for tube in exact],
    }
    return titled("saga2007_limits", columns)


def virtual_work_table() -> Table:
    """Return the tension of the balances and of virtual work, -p dV/dL - dU/dL, for the same
    outlines.
    """
    contraction = saga2007_pairs.CONTRACTIONS
    pressure = PRESSURE
    line = LINES["B"]
    forces = {
        values.interpretation_name(2, 1, "B"): DEFAULT.force(pressure, contraction),
        "exact mechanics, line B": values.exact_mechanics(line).force(pressure, contraction),
        "parabola, virtual work": virtual_work(DEFAULT, pressure, contraction),
        "circular meridian, virtual work": (
            values.circular_meridian(line).force(pressure, contraction)
        ),
        "exact meridian": exact_meridian(line).shape_at_pressure(pressure, contraction).force,
    }
    columns = {f"{name} [N]": np.round(force, 2) for name, force in forces.items()}
    return titled("saga2007_virtual_work", {"contraction [%]": 100 * contraction, **columns})


def virtual_work(law: am.characteristic.Saga2007, pressure: float, contraction: Any) -> Any:
    """Return (p dV/deps - dU/deps)/L_0 [N] with the volume and the rubber energy of the law's
    outline.
    """
    tube = law.geometry
    energy = saga2007_pairs.SegmentEnergy(tube, law.rubber)
    per_segment = autodiff.derivative(energy, "energy", contraction)
    return (
        pressure * tube.volume_derivative(contraction) - tube.segments * per_segment
    ) / values.LENGTH


def curve_table() -> Table:
    """Return the curves of Fig. 8 at assumed loads; only written to a file."""
    contraction = np.linspace(0.0, 0.4, 81)
    columns: dict[str, Any] = {"contraction [1]": contraction}
    for n in (0, 1, 2):
        for force in LOADS:
            header = f"pressure, {n} rings, {force:g} N [MPa]"
            columns[header] = with_rings(DEFAULT, n).equilibrium_pressure(contraction, force) / 1e6
    return titled("saga2007_curves", columns, shown=False)
