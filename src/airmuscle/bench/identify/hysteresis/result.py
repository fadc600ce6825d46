"""HysteresisFit: fitted friction, reduction of the error, tests whether the data justify it, and its figures."""

import dataclasses
import itertools
from typing import Any

import numpy as np

from ....core import DASHES, LINES, Array, given_axes, leaves, legend_below, new_figure, relabel_in_display_units
from ....physics.muscle.friction import Friction
from ....report.chapter import BY_ROW, Chapter, Plot, Table, TableColumn
from ...reported import Reported
from ..identifiability import UndeterminedCombination
from ..model_evidence import (
    aicc,
    describe_reduction,
    effective_sample_size,
    f_test_p_value,
    format_p_value,
    reduction_of_aicc,
)
from .limits import MILLIMETRES, Axis, limit_reservations, parameters_on_bounds, undetermined_parameters
from .search import LoopSeries, branch_gap, repeat_difference

TURNING_POINTS = (2.0, -2.0, -0.6, -1.1, -0.6, 0.5, -0.3, 0.5, 2.0)
"""Turning points of the path of `plot_loops`, as multiples of the presliding distance of the law (chosen)."""
INNER_LOOPS = ((3, 5), (6, 8))
"""Legs of the path that form the inner loops, first and last plus one."""
ROWS_PER_LEG = 200
"""Rows between two turning points."""


def loop_path(distance: float) -> Array:
    """A path [m] from rest around an outer loop with two inner loops, scaled by a distance [m]."""
    turning_points = itertools.pairwise((0.0, *TURNING_POINTS))
    legs = [np.linspace(a, b, ROWS_PER_LEG, endpoint=False) for a, b in turning_points]
    return distance * np.concatenate([*legs, [TURNING_POINTS[-1]]])


def plot_loops(friction: Friction, axis: Axis = MILLIMETRES) -> Any:
    """Friction force over displacement: from rest, around the outer loop, through two inner loops.

    Returns a Matplotlib figure.
    """
    path = loop_path(friction.presliding_distance or 1e-3)
    force = friction.force_along(path)
    parts = [("outer loop", ROWS_PER_LEG, len(path)), ("from rest", 0, ROWS_PER_LEG + 1)]
    parts += [
        ("inner loops" if i == 0 else "", a * ROWS_PER_LEG, b * ROWS_PER_LEG + 1)
        for i, (a, b) in enumerate(INNER_LOOPS)
    ]
    outer = force.copy()
    for a, b in INNER_LOOPS:
        outer[a * ROWS_PER_LEG + 1 : b * ROWS_PER_LEG] = np.nan
    figure, axes = new_figure(width=5.6, height=3.9)
    for (name, first, last), style in zip(parts, (0, 1, 2, 2), strict=True):
        rows, label = slice(first, last), name or None
        values = force if style else outer
        axes.plot(path[rows] * axis.factor, values[rows], color=LINES[style], linestyle=DASHES[style], label=label)
    axes.set(xlabel=axis.label, ylabel="friction [N]", title=type(friction).__name__)
    legend_below(figure, axes, 3)
    return figure


def plot_hysteresis(series: LoopSeries, friction: Friction, coefficients: Array, title: str, *, ax: Any = None) -> Any:
    """Measured force minus static curve over the path, with the friction force; and the residuals below.

    `coefficients` are those of the static curve. `ax` is an Axes, or a sequence of two, also for the residuals.
    Returns `ax`, or a new Matplotlib figure if it is None. Raises ParameterError for another `ax`.
    """
    measured = series.target - series.design_matrix @ coefficients
    if ax is None:
        figure, axes = new_figure(2, 1, width=6.0, height=5.6, sharex=True)
    else:
        figure, axes = None, given_axes(ax, 1, "plot of a loop")
    upper, lower = axes[0], axes[1] if len(axes) > 1 else None
    path, rows = series.path * series.axis.factor, series.fitted_rows
    force = -series.friction_force(friction)
    points: dict[str, Any] = {"marker": "o", "markersize": 3, "linestyle": "none", "color": LINES[0], "alpha": 0.5}
    upper.plot(path[rows], measured[rows], **points, label="measured - static curve")
    upper.plot(path, force, color=LINES[1], label=f"{type(friction).__name__}, whole path")
    upper.set_ylabel("force [N]")
    if lower is not None:
        lower.plot(path[rows], (force - measured)[rows], **points)
        lower.axhline(0.0, color=LINES[1])
        lower.set_ylabel("residual (model - measured) [N]")
    (upper if lower is None else lower).set_xlabel(series.axis.label)
    relabel_in_display_units([upper] if lower is None else [upper, lower])
    if figure is None:
        upper.legend(loc="best", frameon=False, fontsize=8)
        return ax
    upper.set_title(title)
    legend_below(figure, upper, 2)
    return figure


SIGNIFICANCE_LEVEL = 0.01
"""p-value below which an F test is significant (chosen)."""

MAX_TRANSIENT_RATIO = 0.1
"""Maximum part of the fitted rows in which the pressure may change quickly for a friction to be justified (chosen)."""

MIN_BRANCH_RATIO = 0.1
"""Minimum ratio of the rows of the two branches for a friction to be justified (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class HysteresisFit(Reported):
    """A friction law fitted to a loop, compared with the same static curve without friction; forces in N.

    `gap` is the rms difference of the falling and the rising branch, `residual_gap` the part that the friction does not
    explain. `repeat_rmse` and `repeat_rmse_without_friction` are the errors on a second run, where only the static
    coefficients are fitted again, because the level may shift between runs. `repeatability` is the standard deviation
    of one run about the mean of the two; an error below it means overfitting. These three are NaN without a second run.
    """

    friction: Friction
    coefficients: Array
    """Coefficients of the static curve."""
    rmse: float
    rmse_without_friction: float
    gap: float
    residual_gap: float
    effective_sample_size: float
    aicc_reduction: float
    """AICc without friction minus AICc with friction; positive where the friction is the better model."""
    p_value: float
    """p-value of the F test of the friction parameters."""
    repeat_rmse: float
    repeat_rmse_without_friction: float
    repeatability: float
    series: LoopSeries
    weak_combinations: tuple[UndeterminedCombination, ...] = ()
    """Combinations of parameters that the data determine poorly or not at all."""

    @property
    def on_bounds(self) -> tuple[str, ...]:
        """Paths of the parameters that the search moved to a bound, declared or set by the data."""
        return parameters_on_bounds(self.friction, self.series.limits)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Paths of the parameters that the data do not determine: on a bound, or with a large standard error."""
        return undetermined_parameters(self.friction, self.series.limits, self.weak_combinations)

    @property
    def justified(self) -> bool:
        """Whether AICc, the F test and, if there is one, the second run favour the friction, without reservations."""
        confirmed = not self.repeat_rmse >= self.repeat_rmse_without_friction
        is_significant = self.aicc_reduction > 0 and self.p_value < SIGNIFICANCE_LEVEL
        return is_significant and confirmed and not self.reservations

    @property
    def reservations(self) -> tuple[str, ...]:
        """The reasons, as sentences, why this loop cannot justify a friction whatever the statistical tests say."""
        reasons = list(self.reservations_of_rows)
        if self.rmse < self.repeatability:
            reasons.append("The error is below the repeatability, which indicates overfitting.")
        series = self.series
        return (*reasons, *limit_reservations(self.friction, series.limits, self.weak_combinations, series.axis))

    @property
    def reservations_of_rows(self) -> tuple[str, ...]:
        """The reasons, as sentences, that follow from the fitted rows of the loop and hold for every law."""
        reasons = []
        direction = self.series.direction[self.series.fitted_rows]
        up, down = int(np.count_nonzero(direction > 0)), int(np.count_nonzero(direction < 0))
        if MIN_BRANCH_RATIO * max(up, down) > min(up, down):
            reasons.append(
                f"One branch has very few rows ({min(up, down)} against {max(up, down)}); measure the loop more slowly."
            )
        if not np.isfinite(self.gap):
            reasons.append("The branches have no common part of the path in the fitted rows.")
        transient = self.series.transient_rows
        if transient > MAX_TRANSIENT_RATIO * direction.size:
            reasons.append(
                f"The pressure changes quickly in {transient} of {direction.size} fitted rows; there the pulses of "
                "valves and the dynamics of the gas appear as friction."
            )
        return tuple(reasons)

    @property
    def verdict(self) -> str:
        """Whether the data justify this friction, as sentences with the numbers."""
        text = (
            f"{type(self.friction).__name__} reduces the rms error from {self.rmse_without_friction:.3g} to "
            f"{self.rmse:.3g} N{self._gap_text}. {describe_reduction(self.aicc_reduction)}, effective sample size "
            f"{self.effective_sample_size:.0f}; F test {format_p_value(self.p_value)}."
        )
        if np.isfinite(self.repeat_rmse):
            text += (
                f" On the second run the rms error changes from {self.repeat_rmse_without_friction:.3g} to "
                f"{self.repeat_rmse:.3g} N; the repeatability of the runs is {self.repeatability:.3g} N."
            )
        return judged(text, self, "this friction")

    @property
    def _gap_text(self) -> str:
        if not np.isfinite(self.gap):
            return ""
        return f" and the gap between the branches from {self.gap:.3g} to {self.residual_gap:.3g} N"

    @property
    def parameter_table(self) -> Table:
        """The parameters in units of the driving quantity: N/Pa of a stiffness, Pa/s of a speed with the pressure."""
        rows = [(leaf, *self.series.axis.display(leaf.value, leaf.declared.unit)) for leaf in leaves(self.friction)]
        columns: dict[str, Any] = {
            "parameter": [leaf.path for leaf, _, _ in rows],
            "symbol": [leaf.declared.symbol for leaf, _, _ in rows],
            "value": TableColumn([value for _, value, _ in rows], BY_ROW),
            "unit": [unit for _, _, unit in rows],
            "meaning": TableColumn([leaf.declared.meaning for leaf, _, _ in rows], brief=False),
        }
        return Table("parameters", f"Parameters of {type(self.friction).__name__}", columns, brief=len(rows))

    def plot(self, *, ax: Any = None) -> Any:
        """Plot the loop with the friction force, and the residuals.

        `ax` is an Axes for the loop, or a sequence of two, also for the residuals, and is returned; without it a new
        figure is returned. Raises ParameterError for another `ax`.
        """
        rms = f"{self.rmse_without_friction:.3g} N without, {self.rmse:.3g} N with friction"
        title = f"{self.series.origin}: rms error {rms}"
        return plot_hysteresis(self.series, self.friction, self.coefficients, title, ax=ax)

    def chapter(self) -> Chapter:
        """The description of the fit: verdict, parameters, and the loop with the friction force."""
        law = type(self.friction).__name__
        return Chapter(
            name="friction",
            title=f"{law} fitted to {self.series.origin}",
            summary=self.verdict,
            tables=(self.parameter_table,),
            plots=(Plot("friction", f"Loop and hysteresis described by {law}.", self.plot),),
            references=self.friction.references,
        )


def judged(text: str, fit: Any, what: str) -> str:
    """A text on a fit, with its reservations, what it does not determine, and whether the data justify it."""
    undetermined = [f"Not determined: {', '.join(fit.undetermined)}."] if fit.undetermined else []
    weak = [str(each) for each in fit.weak_combinations]
    verdict = f"The data {'justify' if fit.justified else 'do not justify'} {what}."
    return " ".join([text, *fit.reservations, *undetermined, *weak, verdict])


def assess_fit(
    friction: Friction, weak: tuple[UndeterminedCombination, ...], run: LoopSeries, repeat: LoopSeries | None
) -> HysteresisFit:
    """The statistics of a fitted friction with its poorly determined combinations, compared with the static curve."""
    free = sum(leaf.declared.fitted for leaf in leaves(friction))
    coefficients, static = run.coefficients(friction), run.coefficients(None)
    rows = run.fitted_rows
    residuals, plain = run.residuals(friction, coefficients)[rows], run.residuals(None, static)[rows]
    square, plain_square = float(np.mean(residuals**2)), float(np.mean(plain**2))
    sample_size, base = effective_sample_size(residuals), run.design_matrix.shape[1]
    path, direction = run.path[rows], run.direction[rows]
    repeat_rmse = plain_repeat_rmse = repeatability = float("nan")
    if repeat is not None:
        repeat_rmse = _rms(repeat.fitted_residuals(friction))
        plain_repeat_rmse = _rms(repeat.fitted_residuals(None))
        values = repeat.residuals(None, static)[repeat.fitted_rows]
        second_run = (repeat.path[repeat.fitted_rows], values, repeat.direction[repeat.fitted_rows])
        repeatability = repeat_difference(path, plain, direction, *second_run).rms / np.sqrt(2)
    return HysteresisFit(
        friction=friction,
        coefficients=coefficients,
        rmse=float(np.sqrt(square)),
        rmse_without_friction=float(np.sqrt(plain_square)),
        gap=branch_gap(path, plain, direction).rms,
        residual_gap=branch_gap(path, residuals, direction).rms,
        effective_sample_size=sample_size,
        aicc_reduction=reduction_of_aicc(aicc(plain_square, sample_size, base), aicc(square, sample_size, base + free)),
        p_value=f_test_p_value(plain_square, square, sample_size, base + free, free),
        repeat_rmse=repeat_rmse,
        repeat_rmse_without_friction=plain_repeat_rmse,
        repeatability=repeatability,
        series=run,
        weak_combinations=weak,
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
