"""Displacement of the muscle end: shortening or elongation from the resting length, converted to a contraction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..core.errors import Hint, HintedText

MOVED = ("contraction", "length", "shortening", "position")
"""Columns of the motion of the muscle end; the first one of a recording is used."""
PROPOSALS = ("weg", "hub", "stroke", "travel", "extension", "displacement", "verschiebung", "traverse", "crosshead")
"""Beginnings of headings of displacements, whose zero and direction the heading does not state."""

ZERO_NOT_STATED = HintedText(
    "A displacement has no stated zero and direction.",
    Hint(
        "If it is the shortening from the resting length",
        "columns",
        {"displacement": "shortening [mm]"},
        "ColumnMapping",
    ),
    Hint("If it is the elongation", "columns", {"displacement": "elongation [mm]"}, "ColumnMapping"),
    Hint("To state its reading at the resting length", "displacement_zero", "12 mm", "ColumnMapping"),
)
"""Reason and remedies where a contraction is needed and only a displacement was recorded."""


def displacement_columns(
    columns: Mapping[str, Any], constants: Mapping[str, float | str]
) -> tuple[dict[str, Any], list[str]]:
    """The columns [SI] with a shortening x = L0 - L for a displacement, or its contraction x/L0; notes on each.

    columns    `shortening` x, or `elongation` u = -x; also `position` y = x if its zero is stated
    constants  displacement_zero: the reading [m] at the resting length, subtracted from each of them (default: 0);
               resting_length L0 [m]

    Without the resting length, the column is `shortening` [m]. A contraction or length in the columns is kept.
    """
    stated = constants.get("displacement_zero")
    zero = float(stated) if isinstance(stated, float | int) else None
    source = next((name for name in ("shortening", "elongation") if name in columns), "")
    if not source and zero is not None and "position" in columns:
        source = "position"
    if not source:
        return dict(columns), []
    sign = -1.0 if source == "elongation" else 1.0
    shortening = sign * (columns[source] - (zero or 0.0))
    kept = {name: values for name, values in columns.items() if name not in ("shortening", "elongation")}
    origin = "the resting length" if zero is None else f"the reading at the resting length, {1e3 * zero:.4g} mm"
    length = constants.get("resting_length")
    if "contraction" in kept or "length" in kept or not isinstance(length, float | int):
        return {**kept, "shortening": shortening}, [f"The {source} counts from {origin}."]
    note = f"The {source} counts from {origin}, and is converted to a contraction with the resting length."
    return {**kept, "contraction": shortening / length}, [note]


def proposal(heading: str) -> str:
    """A sentence that proposes quantities for a heading such as `Weg` or `stroke`; empty for others."""
    if not heading.lower().startswith(PROPOSALS):
        return ""
    return (
        " If it is the displacement of the muscle, map it to 'shortening [mm]' (from the resting length, positive as "
        "the muscle contracts) or to 'elongation [mm]'."
    )
