"""Report chapter: a force surface fitted with shape constraints (monotonicity)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core.plotting import DASHES, LINES, legend_outside, new_figure
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
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
    violations = shaped.unconstrained_violations
    title = "Monotonicity violations of the unconstrained surface"
    return Chapter(
        name="shape",
        title="Shape-constrained surface",
        summary=(
            f"Rms error {shaped.rmse:.4g} N with constraints, {shaped.unconstrained_rmse:.4g} N without.",
            "The muscle file contains the constrained surface: within its validity range the force does not decrease "
            f"with pressure and does not increase with contraction{zero}. The unconstrained surface {verdict}. The "
            "uncertainties and bands are those of the unconstrained surface.",
        ),
        values=(NamedValue("rms error", shaped.rmse, "N", brief=False),
                NamedValue("rms error without constraints", shaped.unconstrained_rmse, "N", brief=False)),
        tables=(violation_table(violations, "shape-loose", title),) if violations else (),
        plots=(Plot("shaped", "Solid: constrained. Dashed: unconstrained.",
                    partial(_surface_figure, shaped, unconstrained)),),
        notes=tuple(f"unconstrained: {each}" for each in violations),
    )  # fmt: skip


def violation_table(violations: Sequence[MonotonicityViolation], name: str, title: str) -> Table:
    """Return a table of the regions in which a law is not monotonic, largest first."""
    of_force = all(each.rule.quantity == "force" for each in violations)
    second, units = ("contraction", ("1", "%")) if of_force else ("force", ("N", ""))
    columns: dict[str, Any] = {
        "constraint": [each.rule.description for each in violations],
        "pressure": TableColumn([tuple(each.pressure) for each in violations], "Pa", "kPa"),
        second: TableColumn([tuple(each.second_argument) for each in violations], *units),
        "fraction of the validity range": TableColumn([each.area_fraction for each in violations], "1", "%"),
        "worst at pressure": TableColumn([each.worst_point[0] for each in violations], "Pa", "kPa"),
        f"worst at {second}": TableColumn([each.worst_point[1] for each in violations], *units),
    }
    note = "`airmuscle fit --shape` fits a surface without such regions."
    return Table(name, title, columns, note)


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
