"""Display of a muscle: chart of its isobars, and tables of its components and parameters."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.display import contraction_text, in_display_unit, quantity_text
from ...core.plotting import given_axes, legend_outside, new_figure
from ...core.tree import continues_list, leaves
from .characteristic.base import Characteristic
from .characteristic.validity_range import ValidityRange, validity_range_of
from .isobars import compute_isobars, draw_isobars

PARAMETERS = ("parameter", "symbol", "value", "unit", "meaning")
"""Header of a table of parameters."""
CHART_PRESSURES = 6
"""Number of isobars in the chart of a law without a validity range."""
CHART_MAX_PRESSURE = 6e5
"""Maximum gauge pressure [Pa] in the chart of a law without a validity range (chosen)."""


def plot_isobars(
    law: Characteristic,
    title: str,
    validity_range: ValidityRange | None = None,
    *,
    pressures: Any = None,
    ax: Any = None,
) -> Any:
    """Plot the tension of a law over the contraction at constant gauge pressures [Pa], by default round ones.

    `ax` is a Matplotlib Axes and is returned; without it a new figure is returned. Raises ParameterError.
    """
    known = validity_range_of(law, validity_range)
    if pressures is None and known is None:
        pressures = np.linspace(0.0, CHART_MAX_PRESSURE, CHART_PRESSURES + 1)[1:]
    given: Array | None = None if pressures is None else np.atleast_1d(np.asarray(pressures, dtype=float))
    curves = compute_isobars(law, known, pressures=given)
    if ax is None:
        shown, axes = new_figure(height=3.0)
        title = textwrap.shorten(title, 90, placeholder=" …")
    else:
        shown, axes = ax, given_axes(ax, 1, "plot of a muscle")[0]
    draw_isobars(axes, curves, title)
    legend_outside(axes, title="gauge pressure")
    return shown


def parameter_rows(parts: dict[str, Any], last: Sequence[str] = ()) -> list[tuple[str, ...]]:
    """Rows of a table of the parameters of several components, in display units; those named in `last` follow."""
    order = [*(part for part in parts if part not in last), *(part for part in parts if part in last)]
    rows: list[tuple[str, ...]] = []
    for part in order:
        for leaf in leaves(parts[part]):
            value, unit = in_display_unit(leaf.value, leaf.declared.unit)
            name = f"{part}.{leaf.path}".lstrip(".")
            rows.append(
                (name, leaf.declared.symbol, f"{value:.4g}", "" if unit == "1" else unit, leaf.declared.meaning)
            )
    continued = continues_list([row[0] for row in rows])
    return [(*row[:-1], "") if further else row for row, further in zip(rows, continued, strict=True)]


def component_rows(muscle: Any) -> list[tuple[str, ...]]:
    """Rows with the components of a muscle: its law with its range, its size, and the optional elements it has."""
    rows: list[tuple[str, ...]] = [("contractile element", type(muscle.contractile).__name__)]
    rows.append(("geometry", type(muscle.geometry).__name__))
    rows.append(("resting length", quantity_text(muscle.geometry.resting_length, "m", "mm")))
    if (known := validity_range_of(muscle.contractile, muscle.validity_range)) is not None:
        (low, high), (least, most) = known.pressure, known.contraction
        rows.append(("valid gauge pressure", " to ".join(quantity_text(p, "Pa", "kPa") for p in (low, high))))
        rows.append(("valid contraction", " to ".join(contraction_text(c) for c in (least, most))))
    default = {f.name: f.default for f in dataclasses.fields(muscle)}
    for name in ("spring", "damper", "friction", "wall", "series", "stop", "creep"):
        if (part := getattr(muscle, name)) != default[name]:
            rows.append((name, textwrap.shorten(str(part), 100, placeholder=" …")))
    return rows
