"""Report chapter: a force surface fitted with shape constraints (monotonicity)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.plotting import DASHES, LINES, legend_outside, new_figure
from ...report.chapter import Chapter, Plot, Table
from . import Fit, ShapeConstrainedFit
from .levels import levels_of
from .surface.monotonicity import MonotonicityViolation

MAX_CURVES = 5
POINTS = 161


def shape_chapter(shaped: ShapeConstrainedFit, unconstrained: Fit, free: int) -> Chapter:
    """Return the chapter of a constrained fit and its cost; `free` is the number of points of free contraction."""
    zero = f", and it is zero at {free} points of free contraction" if free else ""
    verdict = (
        "satisfies these constraints too"
        if not shaped.unconstrained_violations
        else "violates them in the regions of the table"
    )
    return Chapter(
        paper="shape",
        title="Shape-constrained surface",
        summary="The muscle file contains the constrained surface: within its validity range the force does not "
        f"decrease with pressure and does not increase with contraction{zero}. Its rms error is {shaped.rmse:.4g} N, "
        f"compared with {shaped.unconstrained_rmse:.4g} N of the unconstrained surface, which {verdict}. The "
        "uncertainties and bands below are those of the unconstrained surface.",
        tables=(
            violation_table(
                shaped.unconstrained_violations, "shape-loose", "Monotonicity violations of the unconstrained surface"
            ),
        )
        if shaped.unconstrained_violations
        else (),
        plots=(Plot("shaped", "Solid: constrained. Dashed: unconstrained.", _surface_figure(shaped, unconstrained)),),
    )


def violation_table(violations: Sequence[MonotonicityViolation], name: str, title: str) -> Table:
    """Return a table of the regions in which a law is not monotonic, largest first."""
    return Table(
        name,
        title,
        {
            "constraint": [each.rule.description for each in violations],
            "from [kPa]": [each.pressure[0] / 1e3 for each in violations],
            "to [kPa]": [each.pressure[1] / 1e3 for each in violations],
            "from [%]": [100 * each.second_argument[0] for each in violations],
            "to [%]": [100 * each.second_argument[1] for each in violations],
            "fraction of the validity range [%]": [100 * each.area_fraction for each in violations],
            "worst at [kPa]": [each.worst_point[0] / 1e3 for each in violations],
            "worst at [%]": [100 * each.worst_point[1] for each in violations],
        },
        "Gauge pressure and contraction. `airmuscle fit --shape` fits a surface without such regions.",
    )


def _surface_figure(shaped: ShapeConstrainedFit, unconstrained: Fit) -> Any:
    figure, axes = new_figure(width=6.6, height=3.9)
    contraction = np.linspace(*unconstrained.data_ranges["contraction"], POINTS)
    for i, pressure in enumerate(levels_of(unconstrained.recording["pressure"], MAX_CURVES)):
        colour = LINES[i % len(LINES)]
        rows = np.full(POINTS, pressure)
        style = {"color": colour, "label": f"{pressure / 1e3:.4g} kPa"}
        axes.plot(100 * contraction, shaped.model.force(rows, contraction), **style)
        axes.plot(100 * contraction, unconstrained.model.force(rows, contraction), color=colour, linestyle=DASHES[1])
    axes.set(xlabel="contraction [%]", ylabel="force [N]")
    legend_outside(axes, title="gauge pressure")
    return figure
