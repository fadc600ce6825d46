"""Report chapters: uncertainty by standard errors, bootstrap and profile likelihood; constrained surfaces."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, DASHES, LINES, RED, legend_below, legend_outside, new_figure
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.formatting import symbol_formula, to_mathtext
from . import Bootstrap, Fit, LengthError, ProfileLikelihood, ShapeConstrainedFit
from .cross_validation import levels_of
from .length_errors import PRIOR_STD
from .surface.shape import MonotonicityViolation

MAX_ROWS, MAX_BRIEF = 40, 8
"""Maximum numbers of parameters in the figure and in the brief view (chosen)."""
NORMAL_QUANTILE = 1.96
"""Half width of a 95 % interval in standard deviations."""
MAX_FAILED_SHARE = 0.1
"""Fraction of failed refits above which the remaining ones are a biased selection (chosen)."""
AXIS_LIMIT = 12.0
"""Limit of the figure in standard errors; a longer interval ends in an arrow."""


@dataclasses.dataclass(frozen=True, eq=False)
class Uncertainty:
    """Bootstrap and profile likelihood of a fit, if requested."""

    fit: Fit
    bootstrap: Bootstrap | None = None
    profiles: tuple[ProfileLikelihood, ...] = ()
    none_weak: bool = False
    """Whether profiles of the weakly determined parameters were requested and there are none."""

    @property
    def requested(self) -> bool:
        """Whether a bootstrap or a profile was requested."""
        return self.bootstrap is not None or bool(self.profiles) or self.none_weak


def uncertainty_chapter(uncertainty: Uncertainty) -> Chapter:
    """Return the chapter of the 95 % intervals of every parameter by each requested method."""
    sentences = [
        f"95 % intervals. Standard errors are estimated {uncertainty.fit.error_basis}. They hold for a law that is "
        "nearly linear in its parameters."
    ]
    values: tuple[NamedValue, ...] = ()
    if (bootstrap := uncertainty.bootstrap) is not None:
        refits, groups, failed = len(bootstrap.values), bootstrap.group_count, bootstrap.failed_refits
        text = f"Bootstrap: {refits} refits, {groups} blocks resampled, seed {bootstrap.seed}"
        text += f"; {failed} of them did not determine the parameters" if failed else ""
        if failed > MAX_FAILED_SHARE * refits:
            text += ", so the intervals are not reliable: add runs, or use a law with fewer parameters"
        text += f"; {bootstrap.caution}" if bootstrap.caution else ""
        sentences.insert(0, f"{text}.")
        counts = {"refits": refits, "resampled groups": groups, "failed refits": failed, "seed": bootstrap.seed}
        values = tuple(NamedValue(name, count, brief=False) for name, count in counts.items())
    if uncertainty.profiles:
        sentences.append(
            "A profile fixes one parameter and estimates all others again; an interval is unbounded where the data do "
            "not limit the parameter."
        )
    caption = "95 % intervals in units of the standard error; an arrow marks an interval beyond the axis."
    return Chapter(
        "uncertainty", "Uncertainty of the parameters", summary=tuple(sentences), values=values,
        tables=(_table(uncertainty),), plots=(Plot("intervals", caption, partial(_figure, uncertainty)),),
        notes=("no parameter is weakly determined; the standard errors are valid",) if uncertainty.none_weak else (),
    )  # fmt: skip


def _table(uncertainty: Uncertainty) -> Table:
    fit, estimates = uncertainty.fit, uncertainty.fit.estimates
    half = NORMAL_QUANTILE * fit.standard_errors
    ends = list(zip((fit.values - half).tolist(), (fit.values + half).tolist(), strict=True))
    columns: dict[str, Any] = {
        "parameter": [e.name for e in estimates],
        "value": TableColumn([e.value for e in estimates], BY_ROW, brief=False),
        "by standard error": TableColumn(ends, BY_ROW, brief=False),
    }
    if uncertainty.bootstrap is not None:
        columns["by bootstrap"] = TableColumn(list(map(tuple, uncertainty.bootstrap.intervals().tolist())), BY_ROW)
        deviations = uncertainty.bootstrap.standard_errors
        columns["standard error of bootstrap"] = TableColumn(deviations, BY_ROW, digits=3, brief=False)
    if uncertainty.profiles:
        profiled = {profile.name: (float(profile.low), float(profile.high)) for profile in uncertainty.profiles}
        columns["by profile"] = TableColumn([profiled.get(e.name) for e in estimates], BY_ROW)
    columns["unit"] = [e.unit for e in estimates]
    return Table("intervals", "95 % intervals", columns, brief=MAX_BRIEF)


def length_error_chapter(errors: Sequence[LengthError]) -> Chapter:
    """Return the chapter of the estimated errors of recorded resting lengths."""
    columns: dict[str, Any] = {
        "specimen": [each.specimen for each in errors],
        "resting length": TableColumn([each.resting_length for each in errors], "m", "mm"),
        "offset": TableColumn([each.offset for each in errors], "m", "mm", digits=2),
        "standard error": TableColumn([each.standard_error for each in errors], "m", "mm", digits=1),
        "rms residual before": [each.rmse_before for each in errors],
        "rms residual after": [each.rmse_after for each in errors],
    }
    return Chapter(
        "length-errors", "Errors of recorded resting lengths",
        summary=f"As if {', or '.join(map(str, errors))}. Normal prior with a standard deviation of "
        f"{PRIOR_STD * 1e3:g} mm (chosen).",
        tables=(Table("resting-lengths", "Resting lengths", columns, "Residuals in SI units.", brief=len(errors)),),
    )  # fmt: skip


def _figure(uncertainty: Uncertainty) -> Any:
    estimates = uncertainty.fit.estimates
    plotted = [i for i, e in enumerate(estimates) if np.isfinite(e.stderr) and e.stderr > 0][:MAX_ROWS]
    figure, axes = new_figure(width=6.4, height=1.6 + 0.24 * max(len(plotted), 3))
    by_name = {profile.name: (profile.low, profile.high) for profile in uncertainty.profiles}
    ends = None if uncertainty.bootstrap is None else uncertainty.bootstrap.intervals()
    for row, i in enumerate(plotted):
        estimate = estimates[i]
        intervals = [((-NORMAL_QUANTILE, NORMAL_QUANTILE), BLACK, "standard error", 0.0)]
        if ends is not None:
            intervals.append((tuple((ends[i] - estimate.value) / estimate.stderr), BLUE, "bootstrap", 0.25))
        if estimate.name in by_name:
            pair = (np.array(by_name[estimate.name]) - estimate.value) / estimate.stderr
            intervals.append((tuple(pair), RED, "profile", -0.25))
        for interval, colour, label, shift in intervals:
            finite = np.nan_to_num(np.array(interval, dtype=float), posinf=AXIS_LIMIT, neginf=-AXIS_LIMIT)
            low, high = np.clip(finite, -AXIS_LIMIT, AXIS_LIMIT)
            once = None if label in axes.get_legend_handles_labels()[1] else label
            style = {"color": colour, "linewidth": 2.2, "solid_capstyle": "butt", "label": once}
            axes.plot([low, high], [row + shift, row + shift], **style)
            for end, marker in ((low, "<"), (high, ">")):
                if abs(end) >= AXIS_LIMIT:
                    axes.plot([end], [row + shift], marker=marker, color=colour, markersize=5)
    axes.axvline(0.0, color=BLACK, linewidth=0.6)
    axes.set_yticks(range(len(plotted)), [to_mathtext(symbol_formula(estimates[i].label)) for i in plotted])
    axes.invert_yaxis()
    axes.set(xlabel="deviation from the estimate [standard errors]")
    widest = max((abs(v) for line in axes.lines for v in np.atleast_1d(line.get_xdata())), default=1.0)
    axes.set_xlim(-1.1 * max(widest, 2.5), 1.1 * max(widest, 2.5))
    legend_below(figure, axes, 3)
    return figure


MAX_CURVES = 5
POINTS = 161


def shape_chapter(shaped: ShapeConstrainedFit, unconstrained: Fit, free: int) -> Chapter:
    """Return the chapter of a constrained fit and its cost; `free` is the number of points of free contraction."""
    zero = f", and it is zero at {free} points of free contraction" if free else ""
    violations = shaped.unconstrained_violations
    verdict = "violates them in the regions of the table" if violations else "satisfies these constraints too"
    title = "Monotonicity violations of the unconstrained surface"
    return Chapter(
        "shape", "Shape-constrained surface",
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
    """Return a table of the regions in which a force is not monotonic, largest first."""
    columns: dict[str, Any] = {
        "constraint": [each.rule.description for each in violations],
        "pressure": TableColumn([each.pressure for each in violations], "Pa", "kPa"),
        "contraction": TableColumn([each.second_argument for each in violations], "1", "%"),
        "fraction of the validity range": TableColumn([each.area_fraction for each in violations], "1", "%"),
        "worst at pressure": TableColumn([each.worst_point[0] for each in violations], "Pa", "kPa"),
        "worst at contraction": TableColumn([each.worst_point[1] for each in violations], "1", "%"),
    }
    return Table(name, title, columns, "`airmuscle fit --shape` fits a surface without such regions.")


def _surface_figure(shaped: ShapeConstrainedFit, unconstrained: Fit) -> Any:
    figure, axes = new_figure(width=6.6, height=3.9)
    contraction = np.linspace(*unconstrained.data_ranges["contraction"], POINTS)
    for i, pressure in enumerate(levels_of(unconstrained.recording["pressure"], MAX_CURVES)):
        colour, rows = LINES[i % len(LINES)], np.full(POINTS, pressure)
        solid, dashed = {"label": f"{pressure / 1e3:.4g} kPa"}, {"linestyle": DASHES[1]}
        for law, style in ((shaped.model, solid), (unconstrained.model, dashed)):
            axes.plot(100 * contraction, law.force(rows, contraction), color=colour, **style)
    axes.set(xlabel="contraction [%]", ylabel="force [N]")
    legend_outside(axes, title="gauge pressure")
    return figure
