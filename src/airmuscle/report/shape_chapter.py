"""The chapter of a report on the shape that a muscle's force must have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.plotting import DASHES, LINES, legend_outside, new_figure
from .chapter import Chapter, Plot, Table
from .levels import levels_of

if TYPE_CHECKING:
    from ..identify.result import Fit
    from ..identify.surface.monotonicity import MonotonicityViolation
    from ..identify.surface.shape import ShapeConstrainedFit

CURVES = 5
POINTS = 161


def shape_chapter(shaped: ShapeConstrainedFit, loose: Fit, free: int) -> Chapter:
    """What the conditions changed, and what they cost; `free` counts the points of free contraction."""
    zero = f", and is zero at {free} points of free contraction" if free else ""
    verdict = (
        "breaks none of these rules" if not shaped.unconstrained_violations else "breaks them where the table says"
    )
    return Chapter(
        paper="shape",
        title="A force that keeps a muscle's shape",
        summary=f"The muscle file holds this surface: its force nowhere falls with pressure nor rises with contraction "
        f"on its validity range{zero}. Its rms error is {shaped.rmse:.4g} N, against {shaped.unconstrained_rmse:.4g} N of the surface "
        f"without conditions, which {verdict}. Uncertainties and bands below are of the surface without conditions.",
        tables=(
            breaks_table(
                shaped.unconstrained_violations,
                "shape-loose",
                "Where the surface without conditions behaves as no muscle",
            ),
        )
        if shaped.unconstrained_violations
        else (),
        plots=(Plot("shaped", "Solid: with conditions. Dashed: without.", _both(shaped, loose)),),
    )


def breaks_table(found: Sequence[MonotonicityViolation], name: str, title: str) -> Table:
    """The places where a law breaks a rule, largest first."""
    return Table(
        name,
        title,
        {
            "rule": [each.rule.description for each in found],
            "from [kPa]": [each.pressure[0] / 1e3 for each in found],
            "to [kPa]": [each.pressure[1] / 1e3 for each in found],
            "from [%]": [100 * each.second_argument[0] for each in found],
            "to [%]": [100 * each.second_argument[1] for each in found],
            "share of the validity range [%]": [100 * each.area_fraction for each in found],
            "worst at [kPa]": [each.worst_point[0] / 1e3 for each in found],
            "worst at [%]": [100 * each.worst_point[1] for each in found],
        },
        "Gauge pressure and contraction. airmuscle fit --shape fits a surface without such places.",
    )


def _both(shaped: ShapeConstrainedFit, loose: Fit) -> Any:
    figure, axes = new_figure(width=6.6, height=3.9)
    contraction = np.linspace(*loose.data_ranges["contraction"], POINTS)
    for i, pressure in enumerate(levels_of(loose.recording["pressure"], CURVES)):
        colour = LINES[i % len(LINES)]
        rows = np.full(POINTS, pressure)
        shown = {"color": colour, "label": f"{pressure / 1e3:.4g} kPa"}
        axes.plot(100 * contraction, shaped.model.force(rows, contraction), **shown)
        axes.plot(100 * contraction, loose.model.force(rows, contraction), color=colour, linestyle=DASHES[1])
    axes.set(xlabel="contraction [%]", ylabel="force [N]")
    legend_outside(axes, title="gauge pressure")
    return figure
