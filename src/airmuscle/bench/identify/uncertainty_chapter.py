"""Report chapter: uncertainty of the parameters by standard errors, bootstrap and profile likelihood."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...core.plotting import BLACK, BLUE, RED, legend_below, new_figure
from ...report.chapter import Chapter, Plot, Table
from ...report.formatting import MISSING, format_number, format_unit
from ...report.formula import symbol_formula, to_mathtext
from . import Bootstrap, Fit, ProfileLikelihood

MAX_ROWS = 40
"""Maximum number of parameters in the figure."""
NORMAL_QUANTILE = 1.96
"""Half width of a 95 % interval in standard deviations."""
UNBOUNDED = "unbounded"
"""End of an interval that the data do not limit."""
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

    @property
    def requested(self) -> bool:
        """Whether there is a bootstrap or a profile."""
        return self.bootstrap is not None or bool(self.profiles)

    def lines(self) -> list[str]:
        """Return the intervals as lines of text for a terminal."""
        lines = [f"profile: {profile}" for profile in self.profiles]
        if self.bootstrap is not None:
            lines.append(_describe_bootstrap(self.bootstrap))
            lines += [
                f"  {e.name}: 95 % {format_number(low)} to {format_number(high)} {format_unit(e.unit)}".rstrip()
                for e, (low, high) in zip(self.fit.estimates, self.bootstrap.intervals(), strict=True)
            ]
        return lines

    def as_data(self) -> dict[str, Any]:
        """Return the intervals as plain data, all SI."""
        data: dict[str, Any] = {}
        if self.profiles:
            data["profiles"] = {p.name: {"low": p.low, "high": p.high, "level": p.level} for p in self.profiles}
        if self.bootstrap is not None:
            data["bootstrap"] = {
                "refits": len(self.bootstrap.values),
                "parts": self.bootstrap.group_count,
                "lost": self.bootstrap.failed_refits,
                "seed": self.bootstrap.seed,
                "deviations": dict(zip(self.fit.names, self.bootstrap.standard_errors.tolist(), strict=True)),
                "intervals": dict(zip(self.fit.names, self.bootstrap.intervals().tolist(), strict=True)),
            }
        return data


def _describe_bootstrap(bootstrap: Bootstrap) -> str:
    failed = f"; {bootstrap.failed_refits} of them did not determine the parameters" if bootstrap.failed_refits else ""
    if bootstrap.failed_refits > MAX_FAILED_SHARE * len(bootstrap.values):
        failed += ", so the intervals are not reliable: add runs, or use a law with fewer parameters"
    groups = f"{bootstrap.group_count} blocks resampled, seed {bootstrap.seed}"
    caution = f"; {bootstrap.caution}" if bootstrap.caution else ""
    return f"bootstrap: {len(bootstrap.values)} refits, {groups}{failed}{caution}"


def uncertainty_chapter(uncertainty: Uncertainty) -> Chapter:
    """Return the chapter of the 95 % intervals of every parameter by each requested method."""
    sentences = [
        f"95 % intervals. Standard errors are estimated {uncertainty.fit.error_basis}. They hold for a law that is "
        "nearly linear in its parameters."
    ]
    if uncertainty.bootstrap is not None:
        sentences.append(f"{_describe_bootstrap(uncertainty.bootstrap).capitalize()}.")
    if uncertainty.profiles:
        sentences.append(
            "A profile fixes one parameter and estimates all others again; an interval is unbounded where the data do "
            "not limit the parameter."
        )
    return Chapter(
        paper="uncertainty",
        title="Uncertainty of the parameters",
        summary="\n\n".join(sentences),
        tables=(_table(uncertainty),),
        plots=(Plot("intervals", _CAPTION, _figure(uncertainty)),),
    )


_CAPTION = "95 % intervals in units of the standard error; an arrow marks an interval beyond the axis."


def _table(uncertainty: Uncertainty) -> Table:
    fit, estimates = uncertainty.fit, uncertainty.fit.estimates
    half = NORMAL_QUANTILE * fit.standard_errors
    columns: dict[str, Any] = {
        "parameter": [e.name for e in estimates],
        "value (SI)": [e.value for e in estimates],
        "2.5 %, standard error": fit.values - half,
        "97.5 %, standard error": fit.values + half,
    }
    if uncertainty.bootstrap is not None:
        ends = uncertainty.bootstrap.intervals()
        columns |= {"2.5 %, bootstrap": ends[:, 0], "97.5 %, bootstrap": ends[:, 1]}
    if uncertainty.profiles:
        by_name = {profile.name: profile for profile in uncertainty.profiles}
        columns["2.5 %, profile"] = [_interval_end(by_name.get(e.name), "low") for e in estimates]
        columns["97.5 %, profile"] = [_interval_end(by_name.get(e.name), "high") for e in estimates]
    columns["unit"] = ["" if e.unit == "1" else e.unit for e in estimates]
    return Table("intervals", "95 % intervals", columns)


def _interval_end(profile: ProfileLikelihood | None, side: str) -> float | str:
    if profile is None:
        return MISSING
    end = float(getattr(profile, side))
    return end if np.isfinite(end) else UNBOUNDED


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
            _draw_interval(axes, interval, row + shift, colour, label)
    axes.axvline(0.0, color=BLACK, linewidth=0.6)
    axes.set_yticks(range(len(plotted)), [to_mathtext(symbol_formula(estimates[i].label)) for i in plotted])
    axes.invert_yaxis()
    axes.set(xlabel="deviation from the estimate [standard errors]")
    widest = max((abs(v) for line in axes.lines for v in np.atleast_1d(line.get_xdata())), default=1.0)
    axes.set_xlim(-1.1 * max(widest, 2.5), 1.1 * max(widest, 2.5))
    legend_below(figure, axes, 3)
    return figure


def _draw_interval(axes: Any, interval: Any, row: float, colour: str, label: str) -> None:
    labels = axes.get_legend_handles_labels()[1]
    low, high = np.clip(
        np.nan_to_num(np.array(interval, dtype=float), posinf=AXIS_LIMIT, neginf=-AXIS_LIMIT), -AXIS_LIMIT, AXIS_LIMIT
    )
    label_once = None if label in labels else label
    axes.plot([low, high], [row, row], color=colour, linewidth=2.2, solid_capstyle="butt", label=label_once)
    for end, marker in ((low, "<"), (high, ">")):
        if abs(end) >= AXIS_LIMIT:
            axes.plot([end], [row], marker=marker, color=colour, markersize=5)
