"""Diagnostics of a plant: extrapolation, geometry limits, components beyond their validity, assumptions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..core.arrays import Array
from ..core.diagnostics import Columns, Diagnostic, DiagnosticCode
from ..core.errors import ParameterError
from ..core.variables import select_prefix
from ..friction import NoFriction
from ..muscle import INNER_CONTRACTION, ElasticSeriesElement, Muscle

MARGIN = 1e-3
"""Part of a geometry's contraction range within which a muscle counts as at its limit (chosen)."""
_TOLERANCE = 1e-9
"""Part of a range by which a column may exceed it through rounding."""


def describe_friction(muscles: Sequence[Muscle]) -> str:
    """The friction of the muscles; the default is none, which a reader should know."""
    if all(isinstance(m.friction, NoFriction) for m in muscles):
        return "friction: off"
    if len(muscles) == 1:
        return f"friction: {muscles[0].friction}"
    parts = [f"{m.name} {'none' if isinstance(m.friction, NoFriction) else m.friction}" for m in muscles]
    return f"friction: {', '.join(parts)}"


class ColumnLimit(NamedTuple):
    """The lower and upper limit of a column of a run, of one muscle."""

    muscle: str
    code: DiagnosticCode
    column: str
    quantity: str
    bounds: tuple[float, float]


def column_limits(muscles: Sequence[Muscle], prefixes: Sequence[str]) -> tuple[ColumnLimit, ...]:
    """All limits of the columns of muscles: validity ranges of characteristics, ranges of the data of frictions, and
    contraction ranges of geometries."""
    return tuple(
        ColumnLimit(muscle.name, *limit)
        for prefix, muscle in zip(prefixes, muscles, strict=True)
        for limit in _limits(muscle, prefix)
    )


def extrapolation(limits: Sequence[ColumnLimit], columns: Columns) -> list[Diagnostic]:
    """When and how far a run left the validity range of a characteristic or of a friction, or the contraction range of
    a geometry."""
    found = []
    for muscle, code, column, quantity, bounds in limits:
        if column in columns and columns["time"].size and _exceeds(columns.limits(column), bounds):
            found.append(_excess(columns["time"], columns[column], muscle, code, quantity, bounds))
    return found


def _exceeds(limits: tuple[float, float], bounds: tuple[float, float]) -> bool:
    (smallest, largest), (low, high) = limits, bounds
    slack = _TOLERANCE * (high - low)
    return smallest < low - slack or largest > high + slack


def _limits(muscle: Muscle, prefix: str) -> Iterator[tuple[DiagnosticCode, str, str, tuple[float, float]]]:
    """The columns of a muscle that have limits: kind of the limit, column, quantity, lower and upper limit."""
    stated = muscle.validity_range or getattr(muscle.contractile, "validity_range", None)
    if stated is not None:
        yield DiagnosticCode.EXTRAPOLATION, f"{prefix}pressure", "pressure", stated.pressure
        yield DiagnosticCode.EXTRAPOLATION, f"{prefix}contraction", "contraction", stated.contraction
    identified = muscle.friction.identified_range
    if identified is not None:
        yield DiagnosticCode.FRICTION_EXTRAPOLATION, f"{prefix}pressure", "pressure", identified.pressure
        yield DiagnosticCode.FRICTION_EXTRAPOLATION, f"{prefix}shortening_speed", "speed", identified.speed
    own = INNER_CONTRACTION if isinstance(muscle.series, ElasticSeriesElement) else "contraction"
    yield DiagnosticCode.GEOMETRY_LIMIT, f"{prefix}{own}", own, muscle.geometry.contraction_range


def _excess(
    time: Array, values: Array, subject: str, code: DiagnosticCode, quantity: str, bounds: tuple[float, float]
) -> Diagnostic:
    """The diagnostic of a column of pressure, speed or contraction that exceeds its limits."""
    low, high = bounds
    excess = np.maximum(low - values, values - high)
    scale, unit = {"pressure": (1e3, "kPa"), "speed": (1.0, "m/s")}.get(quantity, (0.01, "%"))
    worst, rows = int(np.argmax(excess)), int(np.count_nonzero(excess > 0))
    where, meaning = {
        DiagnosticCode.EXTRAPOLATION: ("the validity range of its characteristic", "values there are extrapolated"),
        DiagnosticCode.FRICTION_EXTRAPOLATION: (
            "the range of the data of its friction",
            "the friction there is extrapolated",
        ),
        DiagnosticCode.GEOMETRY_LIMIT: ("the contraction range of its geometry", "no real muscle can do this"),
    }[code]
    text = (
        f"{subject} was outside {where} in {quantity.replace('_', ' ')} ({low / scale:.4g} to {high / scale:.4g} "
        f"{unit}) in {rows / values.size:.0%} of the rows, by at most {excess[worst] / scale:.4g} {unit} at "
        f"{time[worst]:.4g} s; {meaning}"
    )
    return Diagnostic(code, subject, text, rows)


class Enclosure(NamedTuple):
    """A muscle, its contraction [1], that of its contractile part [1], and its volume [m3]."""

    muscle: Muscle
    contraction: float
    inner_contraction: float
    volume: float


def enclosures(
    muscles: Sequence[Muscle], prefixes: Sequence[str], contractions: Sequence[float], state: Mapping[str, float]
) -> list[Enclosure]:
    """Every muscle at a state in which the mechanism gives it a contraction."""
    found = []
    for muscle, prefix, contraction in zip(muscles, prefixes, contractions, strict=True):
        own = select_prefix(prefix, state)
        inner = muscle.inner_contraction(contraction, own)
        found.append(Enclosure(muscle, contraction, inner, muscle.volume(inner, own)))
    return found


def check_enclosures(found: Sequence[Enclosure]) -> None:
    """Raise GeometryLimitError for an impossible contraction, ParameterError for a volume that is not positive."""
    for muscle, contraction, inner, volume in found:
        muscle.geometry.check_contraction(inner)
        if not volume > 0.0:
            raise ParameterError(
                f"the initial state: the volume of {muscle.name} is {volume:.4g} m3 at a contraction of "
                f"{contraction:.2%}; choose a contraction further within its range."
            )


def geometry_limit_hint(enclosure: Enclosure) -> str:
    """What to do about a muscle that is at a limit of its geometry; empty where it is not."""
    muscle, inner = enclosure.muscle, float(enclosure.inner_contraction)
    low, high = muscle.geometry.contraction_range
    margin = MARGIN * (high - low)
    if low + margin < inner < high - margin:
        return ""
    return (
        f"{muscle.name} reached a contraction of {inner:.2%}, a limit of its geometry ({low:.2%} to {high:.2%}). Keep "
        "the load from moving it so far: wrap the mechanism in WithEndStops, or choose a higher pressure or a smaller "
        "load."
    )
