"""Diagnostics of a plant: extrapolation, geometry limits, components beyond their validity,
assumptions.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from ...core import Array, describe_model
from ...core.diagnostics import ColumnLimit, Columns, Diagnostic, DiagnosticCode
from ..muscle import INNER_CONTRACTION, ElasticSeriesElement, Muscle, RatedRange
from ..muscle.characteristic import values_or_nan
from ..muscle.friction import NoFriction

MARGIN = 1e-3
"""Fraction of the contraction range of a geometry within which a muscle is at its limit
(chosen).
"""
SINGULAR_FACTOR = 1e3
"""Ratio of the force at an end of the range to that at the margin from which it counts as singular
(chosen).
"""
_TOLERANCE = 1e-9
"""Fraction of a range by which a column may exceed it through rounding."""
_MEANINGS = {
    DiagnosticCode.RATING: ("the range that its maker permits", "the muscle may be damaged there"),
    DiagnosticCode.EXTRAPOLATION: (
        "the validity range of its characteristic",
        "values there are extrapolated",
    ),
    DiagnosticCode.FRICTION_EXTRAPOLATION: (
        "the range of the data of its friction",
        "the friction there is extrapolated",
    ),
    DiagnosticCode.GEOMETRY_LIMIT: (
        "the contraction range of its geometry",
        "such contractions are not physical",
    ),
}
"""The range that a column has left, and what that means."""


def friction(muscles: Sequence[Muscle]) -> Diagnostic:
    """The friction of the muscles; also stated if there is none, which is the default."""
    texts = [
        "none" if isinstance(m.friction, NoFriction) else describe_model(m.friction)
        for m in muscles
    ]
    text = (
        texts[0]
        if len(muscles) == 1
        else ", ".join(f"{m.name} {t}" for m, t in zip(muscles, texts, strict=True))
    )
    text = "off" if set(texts) == {"none"} else text
    return Diagnostic(DiagnosticCode.MODEL, "friction", f"friction of the muscles: {text}")


def with_tolerance(limits: Sequence[ColumnLimit]) -> tuple[tuple[ColumnLimit, float, float], ...]:
    """Each limit of a column, with the bounds that the column may reach through rounding."""
    widened = []
    for limit in limits:
        low, high = limit.bounds
        slack = _TOLERANCE * (
            high - low if np.isfinite(high - low) else abs(high if np.isfinite(high) else low)
        )
        widened.append((limit, low - slack, high + slack))
    return tuple(widened)


def extrapolation(
    limits: Sequence[tuple[ColumnLimit, float, float]], columns: Columns
) -> list[Diagnostic]:
    """Diagnostics of a run that left the validity range of a characteristic, the range of the data
    of a friction, or the contraction range of a geometry; `limits` are those of
    `with_tolerance`."""
    diagnostics = list[Diagnostic]()
    time = columns["time"]
    for limit, low, high in limits if time.size else ():
        if limit.column not in columns:
            continue
        smallest, largest = columns.limits(limit.column)
        if smallest < low or largest > high:
            values = columns[limit.column]
            scale, unit = _shown_unit(limit.quantity)
            excess = np.maximum(limit.bounds[0] - values, values - limit.bounds[1])
            worst = int(np.argmax(excess))
            rows = int(np.count_nonzero(excess > 0))
            where, meaning = _outside(limit)
            text = (
                f"{limit.subject} was {where} in {percent_of_rows(rows / values.size)} of the rows,"
                f" by at most {excess[worst] / scale:.4g} {unit} at {time[worst]:.4g} s; {meaning}"
            )
            diagnostics.append(Diagnostic(limit.code, limit.subject, text, rows))
    return diagnostics


def limits_of(
    muscle: Muscle, prefix: str
) -> Iterator[tuple[DiagnosticCode, str, str, tuple[float, float]]]:
    """All limits of the columns of a muscle: kind of the limit, column, quantity, lower and upper
    limit.

    They are the validity range of the characteristic, the range of the data of the friction, the
    contraction range of the geometry and the ratings.
    """
    for rated in muscle.ratings.ranges() if muscle.ratings else ():
        if rated.quantity in ("force", "pressure", "contraction"):
            yield (
                DiagnosticCode.RATING,
                f"{prefix}{rated.quantity}",
                rated.quantity,
                (rated.low, rated.high),
            )
    stated = muscle.validity_range or getattr(muscle.contractile, "validity_range", None)
    if stated is not None:
        yield DiagnosticCode.EXTRAPOLATION, f"{prefix}pressure", "pressure", stated.pressure
        yield (
            DiagnosticCode.EXTRAPOLATION,
            f"{prefix}contraction",
            "contraction",
            stated.contraction,
        )
    identified = muscle.friction.identified_range
    if identified is not None:
        yield (
            DiagnosticCode.FRICTION_EXTRAPOLATION,
            f"{prefix}pressure",
            "pressure",
            identified.pressure,
        )
        yield (
            DiagnosticCode.FRICTION_EXTRAPOLATION,
            f"{prefix}shortening_speed",
            "speed",
            identified.speed,
        )
    limited_column = (
        INNER_CONTRACTION if isinstance(muscle.series, ElasticSeriesElement) else "contraction"
    )
    yield (
        DiagnosticCode.GEOMETRY_LIMIT,
        f"{prefix}{limited_column}",
        limited_column,
        muscle.geometry.contraction_range,
    )


def percent_of_rows(share: float) -> str:
    """A share of the rows that is not 0 as text, with one digit below one percent."""
    return f"{100 * share:.0f} %" if share >= 0.01 else f"{100 * share:.1g} %"


def describe_limit(limit: ColumnLimit) -> str:
    """Text that says which range a column has left; without the values of a run."""
    return f"{limit.subject}: {'; '.join(_outside(limit))}"


def _outside(limit: ColumnLimit) -> tuple[str, str]:
    """Text that says which range is left, and what that means."""
    where, meaning = _MEANINGS[limit.code]
    span = RatedRange(limit.quantity.replace("_", " "), *limit.bounds, *_shown_unit(limit.quantity))
    return f"outside {where} in {span.quantity} ({span})", meaning


def _shown_unit(quantity: str) -> tuple[float, str]:
    """Factor and name of the unit in which a quantity is shown."""
    return {"pressure": (1e3, "kPa"), "speed": (1.0, "m/s"), "force": (1.0, "N")}.get(
        quantity, (0.01, "%")
    )


def _forces_at(muscle: Muscle, contractions: Array) -> Array:
    """Forces of the contractile element at 1 bar, NaN where it has none."""
    return values_or_nan(muscle.contractile.force, np.full(contractions.shape, 1e5), contractions)


def geometry_limit_hint(muscle: Muscle, contraction: float) -> str:
    """Remedy for a muscle whose contractile part is at a limit of its geometry; empty if it is not
    at a limit.

    The force is singular there if at 1 bar it grows beyond all bounds towards this end of the
    range, or is not finite.
    """
    inner = float(contraction)
    low, high = muscle.geometry.contraction_range
    margin = MARGIN * (high - low)
    if low + margin < inner < high - margin:
        return ""
    inside = float(np.clip(inner, low + margin, high - margin))
    there, near = (abs(float(force)) for force in _forces_at(muscle, np.array([inner, inside])))
    if not there <= SINGULAR_FACTOR * max(near, 1.0):
        return (
            f"At a contraction of {100 * inner:.2f} %, an end of the geometry of {muscle.name}, the"
            f" force of {type(muscle.contractile).__name__} is singular: no run begins there or"
            f" passes through. Begin inside the range, {100 * low:.2f} % to {100 * high:.2f} %, at"
            f" a distance of {100 * margin:.2g} % or more, and keep the load there: wrap the"
            " mechanism in WithEndStops, or choose a higher pressure or a smaller load."
        )
    return (
        f"{muscle.name} reached a contraction of {100 * inner:.2f} %, a limit of its geometry"
        f" ({100 * low:.2f} % to {100 * high:.2f} %). Keep the load from moving it so far: wrap the"
        " mechanism in WithEndStops, or choose a higher pressure or a smaller load."
    )
