"""Claims of Saga et al. 2007, each with its function and the models for which it is evaluated.

The function of each row takes the model, so that the verdict follows from its fibre sum, projection factor and rubber.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ..physics.muscle.characteristic.saga2007 import RUBBER_TEST_STRAIN
from ..report.claims import Claim
from . import saga2007_muscle as values
from .run import claim_row
from .saga2007_joint import models, relative_angle_error
from .saga2007_muscle import DEFAULT, INTERPRETATIONS, LINES, PAPER, PRESSURE, Law, exact_meridian
from .saga2007_previous import FIG_1_LOAD, radii_at_contraction, radii_at_load

HIGHER_PRESSURE = 2.0
"""Ratio of the pressure that a muscle with rings withstands to that of the muscle without (chosen)."""
FIRST_PERCENT = 0.01
"""Contraction at which the largest force is taken [1] (chosen): at 0 inextensible fibres hold any force."""

B, A = values.interpretation_name(2, 1, "B"), values.interpretation_name(2, 1, "A")
"""Names of the default, and of the printed model with line A."""
MECHANICS = {f"exact mechanics, line {name}": values.exact_mechanics(line) for name, line in LINES.items()}
EXACT = {f"exact meridian, line {name}": exact_meridian(line) for name, line in LINES.items()}
PRINTED: dict[str, am.characteristic.Saga2007] = {B: DEFAULT, A: values.interpretation(LINES["A"], 2.0, 1.0)}
LAWS: Mapping[str, Law] = {**PRINTED, **MECHANICS, **EXACT}
"""Default, printed model, the two of exact mechanics, and the exact meridian with both rubber lines."""


def _each(laws: Mapping[str, Any], *loads: float) -> dict[str, tuple[Any, ...]]:
    """Return the cases of all laws, each with every load [N] if there are any."""
    if not loads:
        return {name: (law,) for name, law in laws.items()}
    return {f"{name}, {load:g} N": (law, load) for name, law in laws.items() for load in loads}


OUTLINE = "outline by (2), (3)"
_REPRODUCED: Mapping[str, tuple[Any, ...]] = {
    "contraction": (values.contraction, _each({B: DEFAULT, **EXACT})),
    "lifting": (values.lifting, _each({B: DEFAULT, **INTERPRETATIONS, **EXACT})),
    "max tension": (lambda: PRESSURE * float(exact_meridian(LINES["A"]).geometry.effective_area(0.35)),
                    {"tension at 35 %, any rubber": ()}),
    "largest force": (lambda law: float(values.tension(law, PRESSURE, FIRST_PERCENT)), _each(LAWS)),
    "low start": (lambda law: values.initial_pressure(law) / 1e6, _each(PRINTED)),
    "rings contract less": (values.ring_ratio, _each({B: DEFAULT}, 0.0, 100.0) | _each({A: PRINTED[A]}, 0.0)),
    "strains": (lambda law, load: values.strength_ratio(law, load, lambda muscle, c: muscle.middle_strain(c)),
                _each({B: DEFAULT}, 200.0)),
    "tensions": (
        lambda law, load: values.strength_ratio(law, load, lambda muscle, c: muscle.end_tension(PRESSURE, c, load)),
        _each({B: DEFAULT}, 200.0)),
    "ring force": (values.ring_force_ratio, {
        f"{name}, {case}": (law, factor) for name, law in {**PRINTED, **EXACT}.items()
        for factor, case in ((1.0, "equal pressure"), (HIGHER_PRESSURE, f"{HIGHER_PRESSURE:g} times the pressure"))}),
    "accurate": (),
    "deviates": (),
    "cause": (),
    "error below 20 %": (lambda law, load: values.pressure_error(law, load, 0.01, 0.20, 20),
                         _each({**PRINTED, **MECHANICS}, 100.0)),
    "error above 20 %": (lambda law, load: values.pressure_error(law, load, 0.25, 0.40, 16),
                         _each({**PRINTED, **MECHANICS}, 100.0)),
    "rubber test": (lambda: 100 * DEFAULT.contraction_at_strain(RUBBER_TEST_STRAIN), {OUTLINE: ()}),
    "thickness": (lambda: 1 / (1 + float(DEFAULT.middle_strain(0.20))), {OUTLINE: ()}),
    "thinning": (values.thinning,
                 {f"exact mechanics, line B, 100 N, {100 * at:g} %": (at,) for at in (0.20, 0.40)}),
    "outlines": (values.largest_radius, {OUTLINE: (DEFAULT,)}),
    "feed-forward": (values.share_reached, _each({B: DEFAULT}, 100.0) | _each({A: PRINTED[A]}, 0.0)),
    "feed-forward of a pair": (relative_angle_error, {
        f"{name}, line {line}": (name, line) for line in LINES for name in list(models(LINES[line]))[:-1]}),
    "high start": (lambda law: values.initial_pressure(law) / float(law.equilibrium_pressure(0.10, 0.0)),
                   _each(PRINTED)),
    "axis": (lambda law, load: float(np.max(law.equilibrium_pressure(np.linspace(0.0, 0.4, 81), load))) / 1e6,
             _each({B: DEFAULT}, 0.0, 200.0)),
    "expansion": (values.middle_strain, {
        f"{name}, {at} %": (exact, at / 100) for at in (20, 35)
        for name, exact in ((OUTLINE, False), ("exact outline without rubber", True))}),
    "little change": (values.pressure_change, _each(LAWS, 0.0, 100.0)),
    "thick wall": (values.wall_ratio, _each({**PRINTED, **EXACT})),
    "previous model": (lambda radii: radii(), {
        f"line A, constant load of {FIG_1_LOAD:g} N": (radii_at_load,),
        "line A, constant contraction": (radii_at_contraction,)}),
}  # fmt: skip
"""The function of each claim and its cases, by the names in claims.toml and in the order of the report."""
ROWS = {name: claim_row(PAPER, name, *given) for name, given in _REPRODUCED.items()}
"""All rows by name."""


def claim(row: str, *arguments: Any) -> Claim:
    """Return the claim of one row for other arguments than those of its cases."""
    return ROWS[row].claim(PAPER, "", *arguments)
