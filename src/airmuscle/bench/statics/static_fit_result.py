"""Fit: estimates, standard errors and residual statistics of a static fit."""

import dataclasses
import functools
import textwrap
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, check_known, contraction_text, given_axes, plotting, quantity_text
from ...physics.muscle.characteristic import Characteristic, ValidityRange
from ...recording import Recording
from ...recording.columns import display_scale
from ...report.chapter import Chapter, NamedValue, Plot, Table
from ...report.parameter_tables import estimate_table
from ...report.shown import BRIEF_ROWS
from .. import statics
from ..diagnosis import Diagnosis, Findings, LawMisfit, MisfitCause, Scatter
from ..estimation import CorrelationIndex, Estimate, Loss, ParameterCovariance
from ..reported import Reported
from .fit_problem import FORCE, FitProblem, FittedQuantity, evaluate
from .goodness import WorstPoint

MANY_POINTS = 1000
"""Number of points of a plot from which markers are small."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Fit(Reported):
    """A fitted characteristic with its data and statistics; `print` it, or `.plot()` it.

    Residuals are in the fitted quantity. `rmse` and `correlation_index` are over the uncensored
    rows, `max_error` over all rows; a censored row has a residual only where the law violates its
    bound. `sigma` is over the rows that determine the parameters: uncensored rows where the law is
    not slack, and violated bounds.
    """

    model: Characteristic
    estimates: tuple[Estimate, ...]
    correlations: Array
    """Correlation matrix of the estimates, in their order, shape (P, P)."""
    parameter_covariance: ParameterCovariance
    """How the covariance of the estimates was computed; for a PooledLengthLaw that of its
    population law alone.
    """
    rank: int
    condition: float
    """Condition number of the design matrix at the solution, with columns of unit norm."""
    sigma: float
    """Standard deviation of the residuals with N - P degrees of freedom [SI]."""
    rmse: float
    """Root mean square error of the measured rows [SI]; violations of the bounds of censored rows
    are added.
    """
    max_error: WorstPoint
    """The greatest error of all rows; that of a censored row is the violation of its bound."""
    correlation_index: CorrelationIndex | None
    """IK and R^2; None where the measured values do not vary."""
    rows_censored: int
    rows_dropped: int
    recording: Recording
    """The rows of the fit: pressure, contraction, force."""
    fitted_quantity: FittedQuantity
    censoring: npt.NDArray[np.float64]
    """By row: 0 uncensored, 1 the model may lie below the bound, -1 the model may lie above it."""
    problem: FitProblem
    """The fitted problem, for refits: data, targets, weights and free parameters."""
    loss: Loss
    findings: "Findings | Callable[[Fit], Findings]"
    """What the rules find in the fit and its data, or the examination that gives it, which is made
    when a finding is first asked for.
    """
    effects: "statics.SpecimenEffects | None" = None
    """The effects of the specimens on a PooledLengthLaw. Estimates and problem are those of its
    population law.
    """

    @functools.cached_property
    def _findings(self) -> Findings:
        return self.findings if isinstance(self.findings, Findings) else self.findings(self)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "findings": self._findings}

    @property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """The findings of the rules of recordings, points and fits."""
        return self._findings.diagnoses

    @property
    def notes(self) -> tuple[str, ...]:
        """The texts of the diagnoses, as sentences; the data are examined when they are first
        read.
        """
        return self._findings.notes

    @property
    def misfit(self) -> LawMisfit | None:
        """That the law does not follow the data, with the causes; None if it does. Its text is
        among the notes.
        """
        return self._findings.misfit

    @property
    def causes(self) -> tuple[MisfitCause, ...]:
        """What explains the residuals, the greatest share first, where they are more than noise: of
        a misfit, or of two branches; empty otherwise.
        """
        return self._findings.causes

    @property
    def scatter(self) -> Scatter | None:
        """Noise and repeatability of the measured force; None for laws that give contraction or
        pressure.
        """
        return self._findings.scatter if self.fitted_quantity == FORCE else None

    @property
    def degrees_of_freedom(self) -> int:
        """Number of the uncensored rows minus that of the parameters that are not on a bound;
        negative where fewer.
        """
        return int(np.count_nonzero(self.censoring == 0)) - sum(
            not estimate.on_bound for estimate in self.estimates
        )

    def __getitem__(self, name: str) -> Estimate:
        """An estimate by the path of its parameter, for example `geometry.radius`. Raises
        ParameterError.
        """
        check_known("the fit has no parameter", name, self.names, "it has")
        return self.estimates[self.names.index(name)]

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of the fitted parameters."""
        return tuple(estimate.name for estimate in self.estimates)

    @property
    def values(self) -> Array:
        """Estimated values [SI], shape (P,)."""
        return np.array([estimate.value for estimate in self.estimates])

    @property
    def standard_errors(self) -> Array:
        """Standard errors of the estimates [SI], shape (P,); NaN for a parameter on a bound.

        With correlated errors they contain Student's factor, so that 1.96 of them are the half
        width of a 95 % interval (see `ParameterCovariance`).
        """
        return np.array([estimate.stderr for estimate in self.estimates])

    @property
    def covariance(self) -> Array:
        """Covariance matrix of the estimates, in their order, shape (P, P); NaN for a parameter on
        a bound.
        """
        return np.asarray(self.correlations * np.outer(self.standard_errors, self.standard_errors))

    @property
    def error_basis(self) -> str:
        """What the standard errors and bands were estimated from, and what they do not contain, as
        a phrase.
        """
        if self.effects is not None and self.effects.covariance is not None:
            return self.effects.covariance.describe()
        contained = self.parameter_covariance.parameters
        known = [
            name
            for name, is_contained in zip(self.names, contained, strict=True)
            if not is_contained
        ]
        remark = f"; {', '.join(known)} on the bound counts as known" if known else ""
        return self.parameter_covariance.describe() + remark

    @property
    def rows_used(self) -> int:
        """Number of rows of the fit, including the censored ones."""
        return len(self.recording)

    @property
    def r2(self) -> float | None:
        """Coefficient of determination over the uncensored rows; None where they do not vary."""
        return None if self.correlation_index is None else self.correlation_index.r_squared

    @property
    def ik(self) -> float | None:
        """Correlation index sqrt(R^2), or None where it is undefined."""
        return None if self.correlation_index is None else self.correlation_index.value

    @property
    def modelled(self) -> Array:
        """The fitted quantity of the model at the rows of the fit, clamped as the model is [SI];
        shape (N,).
        """
        quantity = self.fitted_quantity
        return evaluate(self.model, quantity.name, quantity.arguments, self.recording)

    @property
    def residuals(self) -> Array:
        """Model - measured at the rows of the fit, clamped as the model is [SI]; shape (N,)."""
        return self.modelled - self.recording[self.fitted_quantity.name]

    @property
    def data_ranges(self) -> dict[str, tuple[float, float]]:
        """Minimum and maximum of pressure, contraction and force in the data; outside them the fit
        is extrapolated.
        """
        columns = ((name, self.recording[name]) for name in ("pressure", "contraction", "force"))
        return {name: (float(values.min()), float(values.max())) for name, values in columns}

    @property
    def validity_range(self) -> ValidityRange:
        """The range of the data in pressure and contraction. Raises ParameterError where one of
        them did not vary.
        """
        ranges = self.data_ranges
        return ValidityRange(*ranges["pressure"], *ranges["contraction"])

    def plot(self, *, ax: Any = None) -> Any:
        """Plot the modelled against the measured values, and the residuals; censored rows are
        marked.

        `ax` is an Axes for the values, or a sequence of two, also for the residuals, and is
        returned; without it a new figure is returned. Raises ParameterError for another `ax`.
        """
        quantity = self.fitted_quantity.name
        factor, unit = display_scale(quantity)
        x = self.recording[quantity] * factor
        y = self.modelled * factor
        given = None if ax is None else (None, given_axes(ax, 1, "plot of a fit"))
        figure, axes = given or plotting.new_figure(1, 2, width=7.0, height=3.4)
        ends = [min(x.min(), y.min()), max(x.max(), y.max())]
        size = 3.5 if x.size < MANY_POINTS else 1.8
        axes[0].plot(
            ends, ends, color=plotting.BLACK, linewidth=0.8, label="model = measured", zorder=3
        )
        bound = self.censoring != 0
        kinds = (
            (~bound, plotting.BLUE, "o", "measured"),
            (
                bound,
                plotting.RED,
                "x",
                "censored (bound)",
            ),
        )
        for rows, colour, marker, label in kinds:
            style = {
                "color": colour,
                "marker": marker,
                "linestyle": "none",
                "markersize": size,
                "label": label,
            }
            for axis, drawn in zip(axes[:2], (y, y - x), strict=False) if rows.any() else ():
                axis.plot(x[rows], drawn[rows], **style)
        axes[0].set(xlabel=f"measured {quantity} [{unit}]", ylabel=f"modelled {quantity} [{unit}]")
        for axis in axes[1:2]:
            axis.axhline(0.0, color=plotting.BLACK, linewidth=0.8)
            axis.set(
                xlabel=f"measured {quantity} [{unit}]",
                ylabel=f"residual (model - measured) [{unit}]",
            )
        if figure is None:
            axes[0].legend(loc="upper left", frameon=False, fontsize=8)
            return ax
        plotting.legend_below(figure, axes[0], 3)
        figure.suptitle(textwrap.fill(self._title, 90, max_lines=2, placeholder=" …"), fontsize=9)
        return figure

    @property
    def _title(self) -> str:
        return f"{type(self.model).__name__} fitted to {self.recording.origin}"

    def chapter(self) -> Chapter:
        """The description of the fit: goodness of fit, estimates, residuals, remarks on the
        data.
        """
        correlations = {
            "parameter": list(self.names),
            **dict(zip(self.names, self.correlations.T, strict=True)),
        }
        estimates = estimate_table(self.estimates, "parameters", "Parameters", brief=BRIEF_ROWS)
        tables = (estimates, Table("correlations", "Correlations", correlations, shown=False))
        plots = (Plot("errors", "Modelled against measured values, and residuals.", self.plot),)
        misfit = "" if self.misfit is None else str(self.misfit)
        counted = "; the misfit is equal in every repeat and is not contained" if misfit else ""
        return Chapter(
            "fit",
            self._title,
            f"{misfit} Standard errors {self.error_basis}{counted}.".lstrip(),
            values=self.goodness(),
            tables=tables,
            plots=plots,
            notes=tuple(note for note in self.notes if note != misfit),
        )

    def goodness(self) -> tuple[NamedValue, ...]:
        """The goodness of fit."""
        worst = self.max_error
        index = self.correlation_index
        texts = quantity_text(worst.pressure, "Pa", "kPa"), contraction_text(worst.contraction)
        point = f"at {', '.join(texts)}, {quantity_text(worst.force, 'N', 'N')}"
        undefined = "undefined, because the measured values do not vary"
        # The rms error of a robust fit with its residuals limited, as in a comparison.
        residuals = self.residuals[self.censoring == 0]
        limited = ""
        limit = self.loss.limit(residuals)
        if count := int(np.count_nonzero(np.abs(residuals) > limit)):
            rmse = float(np.sqrt(np.mean(np.clip(residuals, -limit, limit) ** 2)))
            rows = "1 row" if count == 1 else f"{count} rows"
            limited = (
                f"({self.format_residual(rmse)} with {rows} limited to"
                f" {self.format_residual(limit)})"
            )
        ranges = self.data_ranges
        return (
            NamedValue(
                "rows used",
                self.rows_used,
                remark=f"{self.rows_censored} of them censored; {self.rows_dropped} dropped",
            ),
            NamedValue("rows censored", self.rows_censored, brief=False),
            NamedValue("rows dropped", self.rows_dropped, brief=False),
            self._residual("rms error", self.rmse, limited),
            *(self.scatter.values() if self.scatter else ()),
            self._residual("maximum error", worst.error, point),
            self._residual("residual standard deviation", self.sigma, brief=False),
            NamedValue("R2", self.r2, "1", digits=6, remark=undefined if self.r2 is None else ""),
            NamedValue(
                "correlation index IK",
                self.ik,
                "1",
                digits=6,
                remark="" if self.ik is not None else undefined if index is None else str(index),
            ),
            NamedValue("rank", self.rank, remark=f"of {len(self.estimates)}"),
            NamedValue("condition", self.condition, "1", digits=3, brief=False),
            *(
                NamedValue(f"{name} of the data", ranges[name], unit, shown, brief=False)
                for name, unit, shown in (
                    ("pressure", "Pa", "kPa"),
                    ("contraction", "1", "%"),
                    ("force", "N", "N"),
                )
            ),
        )

    def _residual(
        self, name: str, value: float, remark: str = "", brief: bool = True
    ) -> NamedValue:
        """A residual in the fitted quantity."""
        quantity = self.fitted_quantity
        shown = {"Pa": "kPa", "1": "%"}.get(quantity.unit, "")
        return NamedValue(name, value, quantity.unit, shown, remark=remark, brief=brief)

    def format_residual(self, residual: float) -> str:
        """A residual [SI] as text in the usual unit of the fitted quantity."""
        unit = self.fitted_quantity.unit
        shown = {"Pa": "kPa"}.get(unit, unit)
        return (
            contraction_text(residual, 4) if unit == "1" else quantity_text(residual, unit, shown)
        )
