"""The chapter of a report on how sure the parameters are: standard deviation, bootstrap and profile side by side."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.plotting import BLACK, BLUE, RED, legend_below, new_figure
from .chapter import Chapter, Plot, Table

if TYPE_CHECKING:
    from ..identify.bootstrapping import Bootstrap
    from ..identify.profile_likelihood import ProfileLikelihood
    from ..identify.result import Fit

MOST_ROWS = 40
NORMAL = 1.96
MOST_LOST = 0.1
"""Share of refits without an answer from which on the rest are a selection (chosen)."""
REACH = 12.0
"""Standard deviations to which the figure reaches; an interval beyond it ends in an arrow."""


@dataclasses.dataclass(frozen=True, eq=False)
class Uncertainty:
    """What was asked of a fit beyond its standard deviations."""

    fit: Fit
    bootstrap: Bootstrap | None = None
    profiles: tuple[ProfileLikelihood, ...] = ()

    @property
    def asked(self) -> bool:
        """Whether anything was."""
        return self.bootstrap is not None or bool(self.profiles)

    def lines(self) -> list[str]:
        """The same in lines for a terminal."""
        found = [f"profile: {profile}" for profile in self.profiles]
        if self.bootstrap is not None:
            ends, drawn = self.bootstrap.intervals(), self.bootstrap
            found.append(_drawn(drawn))
            found += [
                f"  {e.name}: 95 % of the refits within {low:.6g} to {high:.6g} {e.unit}"
                for e, (low, high) in zip(self.fit.estimates, ends, strict=True)
            ]
        return found

    def as_data(self) -> dict[str, Any]:
        """The same as plain data, SI."""
        found: dict[str, Any] = {}
        if self.profiles:
            found["profiles"] = {p.name: {"low": p.low, "high": p.high, "level": p.level} for p in self.profiles}
        if self.bootstrap is not None:
            found["bootstrap"] = {
                "refits": len(self.bootstrap.values),
                "parts": self.bootstrap.group_count,
                "lost": self.bootstrap.failed_refits,
                "seed": self.bootstrap.seed,
                "deviations": dict(zip(self.fit.names, self.bootstrap.standard_errors.tolist(), strict=True)),
                "intervals": dict(zip(self.fit.names, self.bootstrap.intervals().tolist(), strict=True)),
            }
        return found


def _drawn(drawn: Bootstrap) -> str:
    lost = f"; {drawn.failed_refits} of them did not determine the parameters" if drawn.failed_refits else ""
    if drawn.failed_refits > MOST_LOST * len(drawn.values):
        lost += ", too many to trust the rest: give more runs, or a law with fewer parameters"
    return f"bootstrap: {len(drawn.values)} refits to {drawn.group_count} parts drawn anew, seed {drawn.seed}{lost}"


def uncertainty_chapter(found: Uncertainty) -> Chapter:
    """Intervals of every parameter by each way that was asked for, as a table and a figure."""
    said = ["95 % intervals. The standard deviation supposes independent errors and a law nearly straight in its "
            "parameters."]  # fmt: skip
    if found.bootstrap is not None:
        said.append(f"{_drawn(found.bootstrap).capitalize()}. Wider intervals than those of the standard deviation say "
                    "that rows of one part repeat each other.")  # fmt: skip
    if found.profiles:
        said.append("A profile holds one parameter and finds all others anew; an end that the data do not set is open.")
    return Chapter(
        paper="uncertainty",
        title="How sure the parameters are",
        summary="\n\n".join(said),
        tables=(_table(found),),
        plots=(Plot("intervals", "Intervals in standard deviations of the fit; an arrow goes on.", _figure(found)),),
    )


def _table(found: Uncertainty) -> Table:
    estimates = found.fit.estimates
    half = NORMAL * found.fit.standard_errors
    columns: dict[str, Any] = {
        "parameter": [e.name for e in estimates],
        "value (SI)": [e.value for e in estimates],
        "2.5 %, sd": found.fit.values - half,
        "97.5 %, sd": found.fit.values + half,
    }
    if found.bootstrap is not None:
        ends = found.bootstrap.intervals()
        columns |= {"2.5 %, bootstrap": ends[:, 0], "97.5 %, bootstrap": ends[:, 1]}
    if found.profiles:
        by_name = {profile.name: profile for profile in found.profiles}
        columns["2.5 %, profile"] = [_end(by_name.get(e.name), "low") for e in estimates]
        columns["97.5 %, profile"] = [_end(by_name.get(e.name), "high") for e in estimates]
    columns["unit"] = ["" if e.unit == "1" else e.unit for e in estimates]
    return Table("intervals", "95 % intervals", columns)


def _end(profile: ProfileLikelihood | None, side: str) -> float | str:
    if profile is None:
        return ""
    end = float(getattr(profile, side))
    return end if np.isfinite(end) else "open"


def _figure(found: Uncertainty) -> Any:
    shown = [i for i, e in enumerate(found.fit.estimates) if np.isfinite(e.stderr) and e.stderr > 0][:MOST_ROWS]
    figure, axes = new_figure(width=6.4, height=1.6 + 0.24 * max(len(shown), 3))
    by_name = {profile.name: (profile.low, profile.high) for profile in found.profiles}
    ends = None if found.bootstrap is None else found.bootstrap.intervals()
    for row, i in enumerate(shown):
        estimate = found.fit.estimates[i]
        ways = [((-NORMAL, NORMAL), BLACK, "standard deviation", 0.0)]
        if ends is not None:
            ways.append((tuple((ends[i] - estimate.value) / estimate.stderr), BLUE, "bootstrap", 0.25))
        if estimate.name in by_name:
            pair = (np.array(by_name[estimate.name]) - estimate.value) / estimate.stderr
            ways.append((tuple(pair), RED, "profile", -0.25))
        for ends_of_it, colour, label, shift in ways:
            _interval(axes, ends_of_it, row + shift, colour, label)
    axes.axvline(0.0, color=BLACK, linewidth=0.6)
    axes.set_yticks(range(len(shown)), [found.fit.estimates[i].label for i in shown])
    axes.invert_yaxis()
    axes.set(xlabel="distance from the estimate [standard deviations of the fit]")
    widest = max((abs(v) for line in axes.lines for v in np.atleast_1d(line.get_xdata())), default=1.0)
    axes.set_xlim(-1.1 * max(widest, 2.5), 1.1 * max(widest, 2.5))
    legend_below(figure, axes, 3)
    return figure


def _interval(axes: Any, pair: Any, at: float, colour: str, label: str) -> None:
    known = axes.get_legend_handles_labels()[1]
    low, high = np.clip(np.nan_to_num(np.array(pair, dtype=float), posinf=REACH, neginf=-REACH), -REACH, REACH)
    name = None if label in known else label
    axes.plot([low, high], [at, at], color=colour, linewidth=2.2, solid_capstyle="butt", label=name)
    for end, marker in ((low, "<"), (high, ">")):
        if abs(end) >= REACH:
            axes.plot([end], [at], marker=marker, color=colour, markersize=5)
