"""What a fit returns: the fitted law, how sure its parameters are, how well it meets the data, and where."""

from __future__ import annotations

import dataclasses
import html
from typing import Any

import numpy as np
import numpy.typing as npt

from ..characteristic.base import Characteristic
from ..characteristic.validity_range import ValidityRange
from ..core.arrays import Array
from ..core.errors import ParameterError, suggestion
from ..recording import Recording
from .correlation_index import CorrelationIndex
from .loss import Loss
from .problem import CONTRACTION, FORCE, FitProblem, FittedQuantity, evaluate


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A fitted parameter: value and standard deviation, NaN where it stands on a bound or no point is to spare."""

    name: str
    label: str
    value: float
    stderr: float
    unit: str
    meaning: str
    on_bound: bool


@dataclasses.dataclass(frozen=True)
class WorstPoint:
    """The greatest error, model less measured, and the point where it occurs, all SI."""

    error: float
    pressure: float
    contraction: float
    force: float


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """A fitted characteristic with its pedigree; `print` it, or `.plot()` it.

    Errors are compared in the quantity that the law gives. `rmse`, `index` and `sigma` are over the rows that
    were measured, `max_error` over all rows: those cut off at the ends of the range of force have an error
    only where the law contradicts them.
    """

    model: Characteristic
    estimates: tuple[Estimate, ...]
    correlations: Array
    """Of the estimates, in their order, shape (P, P)."""
    rank: int
    condition: float
    """Of the design at the solution, its columns brought to length 1."""
    sigma: float
    """Standard deviation of the errors, N - P in the denominator."""
    rmse: float
    max_error: WorstPoint
    correlation_index: CorrelationIndex | None
    """1 - SSE/SST and its root; None where the measured values do not vary."""
    rows_censored: int
    rows_dropped: int
    recording: Recording
    """The rows that were used: pressure, contraction, force."""
    fitted_quantity: FittedQuantity
    censoring: npt.NDArray[np.float64]
    """By row: 0 measured, else cut off: the model may lie below (1) or above (-1)."""
    problem: FitProblem
    """What was posed, for refits: points, goals, weights and the free parameters."""
    loss: Loss
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Estimate:
        """An estimate by its parameter's name, `geometry.radius`."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        raise ParameterError(
            f"the fit has no parameter '{name}'; there are {', '.join(self.names)}.{suggestion(name, self.names)}"
        )

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(estimate.name for estimate in self.estimates)

    @property
    def values(self) -> Array:
        return np.array([estimate.value for estimate in self.estimates])

    @property
    def standard_errors(self) -> Array:
        return np.array([estimate.stderr for estimate in self.estimates])

    @property
    def covariance(self) -> Array:
        """Of the estimates, in their order, shape (P, P); NaN for a parameter on a bound."""
        return np.asarray(self.correlations * np.outer(self.standard_errors, self.standard_errors))

    @property
    def rows_used(self) -> int:
        """Rows that took part, those cut off among them."""
        return len(self.recording)

    @property
    def r2(self) -> float | None:
        """1 - SSE/SST over the measured rows; None where they do not vary."""
        return None if self.correlation_index is None else self.correlation_index.r_squared

    @property
    def ik(self) -> float | None:
        """sqrt(R2), or None where it does not exist."""
        return None if self.correlation_index is None else self.correlation_index.value

    @property
    def modelled(self) -> Array:
        """What the fitted model gives at the rows that were used, as a user of it sees it: clamped."""
        return evaluate(self.model, self.fitted_quantity.name, self.fitted_quantity.arguments, self.recording)

    @property
    def residuals(self) -> Array:
        """Model less measured by row, clamped as the model is."""
        return self.modelled - self.recording[self.fitted_quantity.name]

    @property
    def data_ranges(self) -> dict[str, tuple[float, float]]:
        """Where there was data, in pressure, contraction and force: outside the fit says nothing."""
        columns = ((name, self.recording[name]) for name in ("pressure", "contraction", "force"))
        return {name: (float(values.min()), float(values.max())) for name, values in columns}

    @property
    def validity_range(self) -> ValidityRange:
        """The validity range of validity in pressure and contraction. Raises ParameterError where either did not vary."""
        ranges = self.data_ranges
        return ValidityRange(*ranges["pressure"], *ranges["contraction"])

    def plot(self) -> Any:
        """Model against measurement, and the errors over it; a Matplotlib figure."""
        from .plot import plot_fit

        return plot_fit(self)

    def __str__(self) -> str:
        rows = [("parameter", "", "value", "2 sd", "unit", "meaning")]
        rows += [(e.name, e.label, f"{e.value:.6g}", _two_stderr(e), e.unit, e.meaning) for e in self.estimates]
        widths = [max(len(row[i]) for row in rows) for i in range(5)]
        table = ["  ".join([*(c.ljust(w) for c, w in zip(row, widths, strict=False)), row[5]]).rstrip() for row in rows]
        notes = [f"note: {note}" for note in self.notes]
        head = f"{type(self.model).__name__} fitted to {self.recording.origin}"
        return "\n".join([head, "", *table, "", *(f"{name:<18}{text}" for name, text in self.summary()), *notes])

    def summary(self) -> list[tuple[str, str]]:
        """The figures of the fit as lines of name and text with units."""
        worst = self.max_error
        place = f"at {worst.pressure / 1e3:.4g} kPa, {worst.contraction:.2%}, {worst.force:.4g} N"
        index = (
            "not defined: the measured values do not vary"
            if self.correlation_index is None
            else str(self.correlation_index)
        )
        r2 = f"{self.r2:.6f}" if self.r2 is not None else "not defined"
        ranges = self.data_ranges
        (p0, p1), (c0, c1), (f0, f1) = ranges["pressure"], ranges["contraction"], ranges["force"]
        return [
            ("rows", f"{self.rows_used} used, {self.rows_censored} of them cut off; {self.rows_dropped} dropped"),
            ("rms error", self.format_residual(self.rmse)),
            ("greatest error", f"{self.format_residual(worst.error)} {place}"),
            ("sigma", self.format_residual(self.sigma)),
            ("R2", r2),
            ("correlation index", index),
            ("rank, condition", f"{self.rank} of {len(self.estimates)}, {self.condition:.3g}"),
            ("valid for", f"{p0 / 1e3:.4g} to {p1 / 1e3:.4g} kPa, {c0:.2%} to {c1:.2%}, {f0:.4g} to {f1:.4g} N"),
        ]

    def format_residual(self, error: float) -> str:
        """An error of the fitted quantity with the unit that people use for it."""
        if self.fitted_quantity is FORCE:
            return f"{error:.4g} N"
        return f"{error:.4%}" if self.fitted_quantity is CONTRACTION else f"{error / 1e3:.4g} kPa"

    def _repr_html_(self) -> str:
        cells = "".join(
            f"<tr><td>{html.escape(e.name)}</td><td>{html.escape(e.label)}</td>"
            f"<td>{e.value:.6g} &plusmn; {_two_stderr(e)}</td>"
            f"<td>{html.escape(e.unit)}</td><td>{html.escape(e.meaning)}</td></tr>"
            for e in self.estimates
        )
        lines = "<br>".join(f"{name}: {html.escape(text)}" for name, text in self.summary())
        notes = "".join(f"<br>{html.escape(note)}" for note in self.notes)
        head = f"<b>{type(self.model).__name__} fitted to {html.escape(self.recording.origin)}</b>"
        titles = "<tr><th>parameter</th><th></th><th>value &plusmn; 2 sd</th><th>unit</th><th>meaning</th></tr>"
        return f"{head}<table>{titles}{cells}</table>{lines}{notes}"


def _two_stderr(estimate: Estimate) -> str:
    if estimate.on_bound:
        return "on bound"
    return f"{2 * estimate.stderr:.3g}" if np.isfinite(estimate.stderr) else "unknown"
