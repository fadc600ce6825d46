"""Sheet of a sizing: ranked muscles for a lift or a joint with their charts and scenarios, for the tab Size."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ...core.arrays import Array
from ...core.errors import AirmuscleError, ParameterError, UnitError
from ...core.units import quantity
from ...design.sizing.sizing_chapter import choice_row
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobars import compute_isobars

FIELDS = (
    "kind", "load", "stroke", "stiffness", "torque", "angle", "inertia", "supply", "safety", "cycle_time",
    "max_length", "max_diameter", "max_count", "sort",
)  # fmt: skip
"""Fields of a request; each is a text as a user types it, and may be empty where it is optional."""
MAX_CHOICES = 30
"""Maximum number of choices that the page receives (chosen)."""
MAX_FIELD = 60
"""Maximum length of a field (chosen)."""
POINTS = 81
"""Points of a curve (chosen)."""


def size_sheet(text: str) -> dict[str, Any]:
    """The sheet of a request in JSON. Raises ParameterError, UnitError, or SolveError with what is reachable."""
    given = read_request(text)
    requirement, conditions = _requirement(given), _conditions(given)
    result = am.design.size_muscles(requirement, conditions, sort=am.design.SORT_KEYS[given["sort"]])
    result.check_reachable()
    sheet: dict[str, Any] = {
        "tab": "size",
        "name": "sizing",
        "title": requirement.describe(),
        "provenance": "the library",
        "request": given,
        "own_text": text,
        "choices": [_choice(choice) for choice in result.choices[:MAX_CHOICES]],
        "left_out": max(0, len(result.choices) - MAX_CHOICES),
        "unsuitable": [{"name": item.name, "count": item.count, "reason": item.reason} for item in result.unsuitable],
    }
    sheet["id"] = hashlib.sha256(json.dumps(sheet).encode()).hexdigest()[:32]
    return {**sheet, "script": '"use strict";\n'}


def read_request(text: str) -> dict[str, str]:
    """The fields of a request. Raises ParameterError for another form."""
    try:
        given = json.loads(text)
    except (ValueError, RecursionError):
        raise ParameterError("the request is not JSON.") from None
    if not isinstance(given, dict) or set(given) - set(FIELDS):
        raise ParameterError(f"the request must have the fields {', '.join(FIELDS)} and no others.")
    if not all(isinstance(value, str) and len(value) <= MAX_FIELD for value in given.values()):
        raise ParameterError(f"the fields of the request must be texts of at most {MAX_FIELD} characters.")
    fields = {name: given.get(name, "").strip() for name in FIELDS}
    if fields["kind"] not in ("lift", "joint"):
        raise ParameterError("kind must be lift or joint.")
    if fields["sort"] not in am.design.SORT_KEYS:
        raise ParameterError(f"sort must be one of {', '.join(am.design.SORT_KEYS)}.")
    return fields


def _read(given: Mapping[str, str], name: str, unit: str, default: float | None = None) -> float:
    """A quantity; the default where the field is empty."""
    label = name.replace("_", " ")
    if not given[name]:
        if default is None:
            raise ParameterError(f"{label} is missing; give a number with its unit.")
        return default
    return quantity(given[name], unit, where=label)


def _requirement(given: Mapping[str, str]) -> am.design.Requirement:
    if given["kind"] == "joint":
        inertia = _read(given, "inertia", "kg m^2", 0.0)
        return am.design.JointRequirement(_read(given, "angle", "rad"), _read(given, "torque", "N m"), inertia)
    try:
        load = {"mass": _read(given, "load", "kg")}
    except UnitError:
        load = {"force": _read(given, "load", "N")}
    return am.design.LiftRequirement(
        _read(given, "stroke", "m"), stiffness=_read(given, "stiffness", "N/m", 0.0), **load
    )


def _conditions(given: Mapping[str, str]) -> am.design.SizingConditions:
    default = am.design.SizingConditions
    count = given["max_count"] or str(default.max_count)
    if not count.isascii() or not count.isdecimal():
        raise ParameterError(f"the maximum number of muscles is '{count}'; give a whole number.")
    return am.design.SizingConditions(
        _read(given, "supply", "Pa"),
        _read(given, "safety", "1", default.safety_factor),
        _read(given, "cycle_time", "s", default.cycle_time),
        _read(given, "max_length", "m", default.max_length),
        _read(given, "max_diameter", "m", default.max_diameter),
        max_count=int(count),
    )


def _choice(choice: am.design.MuscleChoice) -> dict[str, Any]:
    """A choice with its row of the table, its chart and its scenario, or the reason why it has none."""
    try:
        scenario, reason = am.design.scenario_text(choice), ""
    except AirmuscleError as error:
        scenario, reason = "", str(error.message)
    return {
        "name": choice.entry.name,
        "title": choice.entry.title,
        "row": {header: _number(value) for header, value in choice_row(choice).items()},
        "chart": _chart(choice),
        "scenario": scenario,
        "reason": reason,
    }


def _chart(choice: am.design.MuscleChoice) -> dict[str, Any]:
    """Isobars of one muscle, its capacity, the load and both end points; contractions as ratios, forces in N."""
    entry, muscle, design = choice.entry, choice.muscle, choice.design
    curves = compute_isobars(entry.characteristic, validity_range_of(entry.characteristic, entry.validity_range))
    grid = np.linspace(*muscle.contraction_range, POINTS)
    points = [point._asdict() for point in (design.extended, design.contracted)]
    chart = {
        "pressures": curves.pressures.tolist(),
        "contractions": _rounded(curves.contractions),
        "forces": [_rounded(row) for row in curves.forces],
        "capacity": {"contractions": _rounded(grid), "forces": _rounded(muscle.capacity(grid))},
        "points": [{key: float(value) for key, value in point.items()} for point in points],
        "load": None,
    }
    if isinstance(choice.requirement, am.design.LiftRequirement):
        displacement, load = choice.requirement.path
        contractions = design.extended.contraction + displacement / choice.length
        chart["load"] = {"contractions": _rounded(contractions), "forces": _rounded(load / choice.count),
                         "factor": choice.conditions.safety_factor}  # fmt: skip
    return chart


def _number(value: Any) -> Any:
    return float(value) if isinstance(value, float | np.floating) else value


def _rounded(values: Array) -> list[float | None]:
    """Numbers for a chart: seven digits, None where there is no value."""
    return [float(f"{value:.7g}") if np.isfinite(value) else None for value in np.asarray(values, dtype=float)]
