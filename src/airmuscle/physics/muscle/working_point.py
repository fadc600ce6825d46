"""Working points of a muscle: pressure, contraction and tension."""

from typing import NamedTuple

from ...core import contraction_text, quantity_text


class WorkingPoint(NamedTuple):
    """A working point: gauge pressure [Pa], contraction [1], tension [N]."""

    pressure: float
    contraction: float
    force: float


def describe_point(point: WorkingPoint) -> str:
    """Return a working point as text in display units."""
    texts = (quantity_text(point.pressure, "Pa", "kPa"), contraction_text(point.contraction))
    return f"{', '.join(texts)}, {quantity_text(point.force, 'N', 'N')}"
