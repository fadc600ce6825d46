"""Uncertainty of the parameters of a fit: by bootstrap, profile likelihood and standard errors,
with its chapter.
"""

import dataclasses
from functools import partial
from typing import Any

import numpy as np

from ...core import BLACK, BLUE, RED, Array, legend_below, new_figure, tree
from ...physics.muscle.characteristic.base import Characteristic
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.formatting import to_mathtext
from ...report.formulas import symbol_formula
from ..reported import Reported
from .intervals import ProfileLikelihood
from .static_fit_result import Fit

MIN_GROUPS = 5
"""Minimum number of groups. G groups give (2G - 1)!/(G! (G - 1)!) different samples, 35 with G = 4;
an end of a 95 % interval needs 40. Reference: Hall (1992), The Bootstrap and Edgeworth Expansion,
Springer, appendix I."""
RELIABLE_GROUPS = 12
"""Number of groups from which the intervals need no caution (chosen: in a study of errors that a
run shares, 95 % intervals of a plane held 59 % with 3 runs, 84 % with 5, 89 % with 8, 91 % with 12
and 92 % with 24)."""
MAX_ROWS = 40
MAX_BRIEF = 8
"""Maximum numbers of parameters in the figure and in the brief view (chosen)."""
NORMAL_QUANTILE = 1.96
"""Half width of a 95 % interval in standard deviations."""
MAX_FAILED_SHARE = 0.1
"""Fraction of failed refits above which the remaining ones are a biased selection (chosen)."""
AXIS_LIMIT = 12.0
"""Limit of the figure in standard errors; a longer interval ends in an arrow."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Bootstrap(Reported):
    """Parameters of every refit, shape (refits, P); a row of NaN where the drawn groups do not
    determine them.
    """

    fit: Fit
    values: Array
    group_count: int
    seed: int

    @property
    def standard_errors(self) -> Array:
        """Standard deviation of every parameter over the refits, shape (P,)."""
        return np.asarray(np.nanstd(self.values, axis=0, ddof=1))

    @property
    def caution(self) -> str:
        """What limits the intervals, as a phrase; empty with enough groups."""
        if self.group_count >= RELIABLE_GROUPS:
            return ""
        return (
            f"with fewer than {RELIABLE_GROUPS} groups the intervals hold less often than stated"
            f" (84 % instead of 95 % with {MIN_GROUPS} in a study); the standard errors of the fit"
            " contain the small number"
        )

    @property
    def failed_refits(self) -> int:
        """Number of refits whose groups do not determine the parameters."""
        return int(np.isnan(self.values).any(axis=1).sum())

    def intervals(self, level: float = 0.95) -> Array:
        """Percentile confidence interval of each parameter, lower and upper limit, shape (P, 2)."""
        return np.asarray(np.nanquantile(self.values, [(1 - level) / 2, (1 + level) / 2], axis=0).T)

    def model(self, refit: int) -> Characteristic:
        """The law with the parameters of one refit."""
        law: Characteristic = tree.unflatten(
            self.fit.problem.law, self.fit.problem.leaf_values(self.values[refit])
        )
        return law

    def chapter(self) -> Chapter:
        """The description of the bootstrap: the intervals of every parameter beside those by
        standard error.
        """
        return Uncertainty(self.fit, self).chapter()


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Uncertainty(Reported):
    """Bootstrap and profile likelihood of a fit, if requested."""

    fit: Fit
    bootstrap: Bootstrap | None = None
    profiles: tuple[ProfileLikelihood, ...] = ()
    none_weak: bool = False
    """Whether profiles of the weakly determined parameters were requested and there are none."""

    def chapter(self) -> Chapter:
        """The description: 95 % intervals of every parameter by each requested method."""
        sentences = [
            f"95 % intervals. Standard errors are estimated {self.fit.error_basis}. They hold for a"
            " law that is nearly linear in its parameters."
        ]
        counts = dict[str, int]()
        if (bootstrap := self.bootstrap) is not None:
            refits = len(bootstrap.values)
            groups = bootstrap.group_count
            failed = bootstrap.failed_refits
            text = f"Bootstrap: {refits} refits, {groups} blocks resampled, seed {bootstrap.seed}"
            text += f"; {failed} of them did not determine the parameters" if failed else ""
            if failed > MAX_FAILED_SHARE * refits:
                text += (
                    ", so the intervals are not reliable: add runs, or use a law with fewer"
                    " parameters"
                )
            sentences.insert(0, "; ".join(filter(None, (text, bootstrap.caution))) + ".")
            counts = {
                "refits": refits,
                "resampled groups": groups,
                "failed refits": failed,
                "seed": bootstrap.seed,
            }
        if self.profiles:
            sentences.append(
                "A profile fixes one parameter and estimates all others again; an interval is"
                " unbounded where the data do not limit the parameter."
            )
        caption = (
            "95 % intervals in units of the standard error; an arrow marks an interval beyond the"
            " axis."
        )
        return Chapter(
            "uncertainty",
            "Uncertainty of the parameters",
            tuple(sentences),
            values=tuple(NamedValue(name, count, brief=False) for name, count in counts.items()),
            tables=(_table(self),),
            plots=(Plot("intervals", caption, partial(_figure, self)),),
            notes=(
                ("no parameter is weakly determined; the standard errors are valid",)
                if self.none_weak
                else ()
            ),
        )


def _table(uncertainty: Uncertainty) -> Table:
    fit = uncertainty.fit
    estimates = uncertainty.fit.estimates
    half = NORMAL_QUANTILE * fit.standard_errors
    ends = list(zip((fit.values - half).tolist(), (fit.values + half).tolist(), strict=True))
    columns: dict[str, Any] = {
        "parameter": [e.name for e in estimates],
        "value": TableColumn([e.value for e in estimates], BY_ROW, brief=False),
        "by standard error": TableColumn(ends, BY_ROW, brief=False),
    }
    if uncertainty.bootstrap is not None:
        columns["by bootstrap"] = TableColumn(
            list(map(tuple, uncertainty.bootstrap.intervals().tolist())), BY_ROW
        )
        deviations = uncertainty.bootstrap.standard_errors
        columns["standard error of bootstrap"] = TableColumn(
            deviations, BY_ROW, digits=3, brief=False
        )
    if uncertainty.profiles:
        profiled = {
            profile.name: (float(profile.low), float(profile.high))
            for profile in uncertainty.profiles
        }
        columns["by profile"] = TableColumn([profiled.get(e.name) for e in estimates], BY_ROW)
    columns["unit"] = [e.unit for e in estimates]
    return Table("intervals", "95 % intervals", columns, brief=MAX_BRIEF)


def _figure(uncertainty: Uncertainty) -> Any:
    estimates = uncertainty.fit.estimates
    plotted = [i for i, e in enumerate(estimates) if np.isfinite(e.stderr) and e.stderr > 0][
        :MAX_ROWS
    ]
    figure, axes = new_figure(width=6.4, height=1.6 + 0.24 * max(len(plotted), 3))
    by_name = {profile.name: (profile.low, profile.high) for profile in uncertainty.profiles}
    ends = None if uncertainty.bootstrap is None else uncertainty.bootstrap.intervals()
    for row, i in enumerate(plotted):
        estimate = estimates[i]
        intervals = [((-NORMAL_QUANTILE, NORMAL_QUANTILE), BLACK, "standard error", 0.0)]
        if ends is not None:
            intervals.append(
                (tuple((ends[i] - estimate.value) / estimate.stderr), BLUE, "bootstrap", 0.25)
            )
        if estimate.name in by_name:
            pair = (np.array(by_name[estimate.name]) - estimate.value) / estimate.stderr
            intervals.append((tuple(pair), RED, "profile", -0.25))
        for interval, colour, label, shift in intervals:
            finite = np.nan_to_num(
                np.array(interval, dtype=float), posinf=AXIS_LIMIT, neginf=-AXIS_LIMIT
            )
            low, high = np.clip(finite, -AXIS_LIMIT, AXIS_LIMIT)
            once = None if label in axes.get_legend_handles_labels()[1] else label
            style = {"color": colour, "linewidth": 2.2, "solid_capstyle": "butt", "label": once}
            axes.plot([low, high], [row + shift, row + shift], **style)
            for end, marker in ((low, "<"), (high, ">")):
                if abs(end) >= AXIS_LIMIT:
                    axes.plot([end], [row + shift], marker=marker, color=colour, markersize=5)
    axes.axvline(0.0, color=BLACK, linewidth=0.6)
    axes.set_yticks(
        range(len(plotted)), [to_mathtext(symbol_formula(estimates[i].label)) for i in plotted]
    )
    axes.invert_yaxis()
    axes.set(xlabel="deviation from the estimate [standard errors]")
    widest = max(
        (abs(v) for line in axes.lines for v in np.atleast_1d(line.get_xdata())), default=1.0
    )
    axes.set_xlim(-1.1 * max(widest, 2.5), 1.1 * max(widest, 2.5))
    legend_below(figure, axes, 3)
    return figure
