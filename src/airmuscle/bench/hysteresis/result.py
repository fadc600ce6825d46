"""FrictionFit and HysteresisFit: fitted friction, tests whether the data justify it, and its
figures.
"""

import abc
import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...core import (
    LINES,
    Array,
    given_axes,
    leaves,
    legend_below,
    new_figure,
    relabel_in_display_units,
)
from ...physics.muscle.friction import Friction
from ...report.chapter import BY_ROW, Chapter, Plot, Table, TableColumn
from ..estimation import SolvedProblem, UndeterminedCombination, model_evidence
from ..reported import Reported
from .loop_data import DataLimits, limit_reservations, undetermined_parameters
from .search import (
    LoopSeries,
    branch_gap,
    free_parameters,
    repeat_difference,
    solved_friction,
)

SIGNIFICANCE_LEVEL = 0.01
"""p-value below which an F test is significant (chosen)."""
MAX_TRANSIENT_RATIO = 0.1
MIN_BRANCH_RATIO = 0.1
"""Maximum part of the fitted rows in which the pressure may change quickly, and minimum ratio of
the rows of the two branches, for a friction to be justified (chosen)."""


class Misfit(NamedTuple):
    """Residuals of runs with one friction, or without: their mean square [N^2], effective number,
    and parameters.
    """

    mean_square: float
    sample_size: float
    parameters: int

    @classmethod
    def of(cls, friction: Friction | None, runs: Sequence[LoopSeries]) -> "Misfit":
        """The misfit of runs that have one friction and a static curve each."""
        parts = [run.fitted_residuals(friction) for run in runs]
        friction_count = 0 if friction is None else free_parameters(friction)
        count = friction_count + sum(int(run.design_matrix.shape[1]) for run in runs)
        return cls(
            mean_square(parts), float(sum(map(model_evidence.effective_sample_size, parts))), count
        )

    def reduction_of_aicc(self, smaller: "Misfit") -> float:
        """AICc of a smaller model minus that of this one, for the effective number of these
        residuals.
        """
        models = (smaller, self)
        criteria = (
            model_evidence.aicc(model.mean_square, self.sample_size, model.parameters)
            for model in models
        )
        return model_evidence.reduction_of_aicc(*criteria)

    def p_value(self, smaller: "Misfit") -> float:
        """p-value of the F test of the parameters that this model has beyond a smaller one."""
        before = smaller.mean_square
        after = self.mean_square
        added = self.parameters - smaller.parameters
        return model_evidence.f_test_p_value(
            before, after, self.sample_size, self.parameters, added
        )


def mean_square(parts: Sequence[Array]) -> float:
    """The mean square of all residuals; NaN without any."""
    values = np.concatenate([np.zeros(0), *parts])
    return float(np.mean(values**2)) if values.size else float("nan")


@dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FrictionFit(Reported):
    """A friction law fitted to runs, compared with the same static curves without friction; forces
    in N. `repeat_rmse` and `repeat_rmse_without_friction` are the errors on second runs, where only
    the static coefficients are fitted again, because the level may shift between runs; NaN without
    a second run."""

    friction: Friction
    rmse: float
    rmse_without_friction: float
    effective_sample_size: float
    aicc_reduction: float
    """AICc without friction minus AICc with friction; positive where the friction is the better
    model.
    """
    p_value: float
    """p-value of the F test of the friction parameters."""
    repeat_rmse: float
    repeat_rmse_without_friction: float
    weak_combinations: tuple[UndeterminedCombination, ...] = ()
    """Combinations of parameters that the data determine poorly or not at all."""

    @property
    def law(self) -> Friction:
        """The friction law, without its force scale."""
        return self.friction

    @property
    def name(self) -> str:
        """Name of the law."""
        return type(self.law).__name__

    @property
    @abc.abstractmethod
    def limits(self) -> DataLimits:
        """Maximum force and range of the speed of the data."""

    @property
    @abc.abstractmethod
    def reservations(self) -> tuple[str, ...]:
        """The reasons, as sentences, why the data cannot justify a friction whatever the
        statistical tests say.
        """

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Paths of the parameters that the data do not determine: on a bound, or with a large
        standard error.
        """
        return undetermined_parameters(self.friction, self.limits, self.weak_combinations)

    @property
    def justified(self) -> bool:
        """Whether AICc, the F test and any second runs favour the friction, without
        reservations.
        """
        confirmed = not self.repeat_rmse >= self.repeat_rmse_without_friction
        is_significant = self.aicc_reduction > 0 and self.p_value < SIGNIFICANCE_LEVEL
        return is_significant and confirmed and not self.reservations

    def _judged(self, text: str, what: str, repeats: str, further: str = "") -> str:
        """A text with the statistical tests, the reservations, what is not determined, and whether
        it is justified.
        """
        reduction = model_evidence.describe_reduction(self.aicc_reduction)
        p_value = model_evidence.format_p_value(self.p_value)
        tests = f"effective sample size {self.effective_sample_size:.0f}; F test {p_value}"
        sentences = [f"{text} {reduction}, {tests}."]
        if np.isfinite(self.repeat_rmse):
            sentences.append(
                f"On the {repeats} the rms error changes from"
                f" {self.repeat_rmse_without_friction:.3g} to {self.repeat_rmse:.3g} N{further}."
            )
        sentences += self.reservations
        sentences += (
            [f"Not determined: {', '.join(self.undetermined)}."] if self.undetermined else []
        )
        verdict = f"The data {'justify' if self.justified else 'do not justify'} {what}."
        return " ".join([*sentences, *map(str, self.weak_combinations), verdict])


def evidence(
    friction: Friction, runs: Sequence[LoopSeries], repeats: Sequence[LoopSeries]
) -> dict[str, Any]:
    """The numbers of a `FrictionFit` of runs, and of second runs, by field."""
    fitted, plain = (Misfit.of(candidate, runs) for candidate in (friction, None))
    again = [
        mean_square([run.fitted_residuals(candidate) for run in repeats])
        for candidate in (friction, None)
    ]
    return {
        "friction": friction,
        "rmse": float(np.sqrt(fitted.mean_square)),
        "repeat_rmse": float(np.sqrt(again[0])),
        "rmse_without_friction": float(np.sqrt(plain.mean_square)),
        "p_value": fitted.p_value(plain),
        "repeat_rmse_without_friction": float(np.sqrt(again[1])),
        "effective_sample_size": fitted.sample_size,
        "aicc_reduction": fitted.reduction_of_aicc(plain),
    }


AnyFit = TypeVar("AnyFit", bound=FrictionFit)
SIMILAR_RMSE = 1.02
"""Maximum ratio of the rms errors of two laws that describe the data equally well (chosen)."""


def preferred_fit(fits: Sequence[AnyFit]) -> AnyFit | None:
    """The fit to use of several laws, lowest AICc first; None where the data justify none. It is
    the justified one with the lowest AICc. Where the data do not determine all of its parameters,
    or do not judge them one by one because it consists of elements, it is the one with the fewest
    parameters among those whose rms error is at most 2 % greater."""
    justified = [fit for fit in fits if fit.justified]
    if not justified:
        return None
    if not justified[0].undetermined and not any(
        "[" in leaf.path for leaf in leaves(justified[0].friction)
    ):
        return justified[0]
    similar = [fit for fit in justified if fit.rmse <= SIMILAR_RMSE * justified[0].rmse]
    return min(similar, key=lambda fit: free_parameters(fit.friction))


@dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class HysteresisFit(FrictionFit):
    """A friction law fitted to a loop, compared with the same static curve without friction; forces
    in N.

    `gap` is the rms difference of the two branches, `residual_gap` the part that
    the friction does not explain. `repeatability` is the standard deviation of one run about the
    mean of it and a second one; an error below it means overfitting. It is NaN without a second
    run.
    """

    coefficients: Array
    """Coefficients of the static curve."""
    gap: float
    residual_gap: float
    repeatability: float
    series: LoopSeries

    @property
    def solved(self) -> SolvedProblem:
        """The problem with the fitted law: covariance, profiles, bootstrap."""
        return solved_friction(self.friction, [self.series])

    @property
    def limits(self) -> DataLimits:
        return self.series.limits

    @property
    def reservations(self) -> tuple[str, ...]:
        reasons = list(self.reservations_of_rows)
        if self.rmse < self.repeatability:
            reasons.append("The error is below the repeatability, which indicates overfitting.")
        return (
            *reasons,
            *limit_reservations(
                self.friction, self.limits, self.weak_combinations, self.series.axis
            ),
        )

    @property
    def reservations_of_rows(self) -> tuple[str, ...]:
        """The reasons, as sentences, that follow from the fitted rows of the loop and hold for
        every law.
        """
        direction = self.series.direction[self.series.fitted_rows]
        transient = self.series.transient_rows
        fewer, many = sorted(int(np.count_nonzero(direction == sign)) for sign in (1, -1))
        conditions = (
            (
                fewer < MIN_BRANCH_RATIO * many,
                (
                    f"One branch has very few rows ({fewer} against {many}); measure the loop more"
                    " slowly."
                ),
            ),
            (
                not np.isfinite(self.gap),
                "The branches have no common part of the path in the fitted rows.",
            ),
            (
                transient > MAX_TRANSIENT_RATIO * direction.size,
                (
                    f"The pressure changes quickly in {transient} of {direction.size} fitted rows;"
                    " there the pulses of valves and the dynamics of the gas appear as friction."
                ),
            ),
        )
        return tuple(reason for holds, reason in conditions if holds)

    @property
    def verdict(self) -> str:
        """Whether the data justify this friction, as sentences with the numbers."""
        text = (
            f"{self.name} reduces the rms error from {self.rmse_without_friction:.3g} to"
            f" {self.rmse:.3g} N"
        )
        if np.isfinite(self.gap):
            text += (
                f" and the gap between the branches from {self.gap:.3g} to"
                f" {self.residual_gap:.3g} N"
            )
        further = f"; the repeatability of the runs is {self.repeatability:.3g} N"
        return self._judged(f"{text}.", "this friction", "second run", further)

    def plot(self, *, ax: Any = None) -> Any:
        """Plot the measured force minus the static curve over the path, with the friction force,
        and the residuals. `ax` is an Axes for the loop, or a sequence of two, also for the
        residuals, and is returned; without it a new figure is returned. Raises ParameterError for
        another `ax`."""
        series = self.series
        figure = None
        if ax is None:
            figure, axes = new_figure(2, 1, width=6.0, height=5.6, sharex=True)
        else:
            axes = given_axes(ax, 1, "plot of a loop")[:2]
        measured = series.target - series.design_matrix @ self.coefficients
        force = -series.friction_force(self.friction)
        path = series.path * series.axis.factor
        rows = series.fitted_rows
        points: dict[str, Any] = {
            "marker": "o",
            "markersize": 3,
            "linestyle": "none",
            "color": LINES[0],
            "alpha": 0.5,
        }
        axes[0].plot(path[rows], measured[rows], **points, label="measured - static curve")
        axes[0].plot(path, force, color=LINES[1], label=f"{self.name}, whole path")
        axes[0].set_ylabel("force [N]")
        for lower in axes[1:]:
            lower.plot(path[rows], (force - measured)[rows], **points)
            lower.axhline(0.0, color=LINES[1])
            lower.set_ylabel("residual (model - measured) [N]")
        axes[-1].set_xlabel(series.axis.label)
        relabel_in_display_units(axes)
        if figure is None:
            axes[0].legend(loc="best", frameon=False, fontsize=8)
            return ax
        rms = f"{self.rmse_without_friction:.3g} N without, {self.rmse:.3g} N with friction"
        axes[0].set_title(f"{series.origin}: rms error {rms}")
        legend_below(figure, axes[0], 2)
        return figure

    def chapter(self) -> Chapter:
        """The description of the fit: verdict, parameters in units of the driving quantity, such as
        N/Pa of a stiffness with the pressure, and the loop with the friction force."""
        rows = [
            (leaf, *self.series.axis.display(leaf.value, leaf.declared.unit))
            for leaf in leaves(self.friction)
        ]
        columns: dict[str, Any] = {
            "parameter": [leaf.path for leaf, _, _ in rows],
            "symbol": [leaf.declared.symbol for leaf, _, _ in rows],
            "value": TableColumn([value for _, value, _ in rows], BY_ROW),
            "unit": [unit for _, _, unit in rows],
            "meaning": TableColumn([leaf.declared.meaning for leaf, _, _ in rows], brief=False),
        }
        table = Table("parameters", f"Parameters of {self.name}", columns, brief=len(rows))
        title = f"{self.name} fitted to {self.series.origin}"
        caption = f"Loop and hysteresis described by {self.name}."
        plots = (Plot("friction", caption, self.plot),)
        references = self.friction.references
        return Chapter(
            "friction", title, self.verdict, tables=(table,), plots=plots, references=references
        )


def assess_fit(
    friction: Friction,
    weak: tuple[UndeterminedCombination, ...],
    run: LoopSeries,
    repeat: LoopSeries | None,
) -> HysteresisFit:
    """The statistics of a fitted friction with its poorly determined combinations, compared with
    the static curve.
    """
    (coefficients, residuals), (static, plain) = (
        run.fitted_curve(candidate) for candidate in (friction, None)
    )
    repeatability = float("nan")
    first = [column[run.fitted_rows] for column in (run.path, plain, run.direction)]
    if repeat is not None:
        values = repeat.target - repeat.design_matrix @ static
        second = [column[repeat.fitted_rows] for column in (repeat.path, values, repeat.direction)]
        repeatability = repeat_difference(*first, *second).rms / np.sqrt(2)
    path, _, direction = first
    gap = branch_gap(*first).rms
    left = branch_gap(path, residuals[run.fitted_rows], direction).rms
    numbers = evidence(friction, (run,), () if repeat is None else (repeat,))
    return HysteresisFit(
        **numbers,
        weak_combinations=weak,
        coefficients=coefficients,
        gap=gap,
        residual_gap=left,
        repeatability=repeatability,
        series=run,
    )
