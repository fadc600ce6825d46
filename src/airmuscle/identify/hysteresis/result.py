"""HysteresisFit: fitted friction, reduction of the error, and the tests whether the data justify it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.tree import leaves
from ...friction import Friction
from ..model_evidence import aicc, effective_sample_size, f_test_p_value, format_p_value
from . import branches
from .plot import plot_hysteresis
from .series import LoopSeries

SIGNIFICANCE_LEVEL = 0.01
"""p-value below which an F test is significant (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class HysteresisFit:
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

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Paths of the parameters that the search moved to a bound: the data do not determine them."""
        free = [leaf for leaf in leaves(self.friction) if leaf.declared.fitted and leaf.declared.bounds[0] > 0]
        return tuple(
            leaf.path
            for leaf in free
            if not 1.01 * leaf.declared.bounds[0] < leaf.value < 0.99 * leaf.declared.bounds[1]
        )

    @property
    def justified(self) -> bool:
        """Whether AICc, the F test and, if there is one, the second run all favour the friction."""
        confirmed = not self.repeat_rmse >= self.repeat_rmse_without_friction
        return self.aicc_reduction > 0 and self.p_value < SIGNIFICANCE_LEVEL and confirmed

    @property
    def verdict(self) -> str:
        """Whether the data justify this friction, as sentences with the numbers."""
        text = (
            f"{type(self.friction).__name__} reduces the rms error from {self.rmse_without_friction:.3g} to "
            f"{self.rmse:.3g} N{self._gap_text}. Difference in AICc {-self.aicc_reduction:.4g}, effective sample size "
            f"{self.effective_sample_size:.0f}; F test {format_p_value(self.p_value)}."
        )
        if np.isfinite(self.repeat_rmse):
            text += (
                f" On the second run the rms error changes from {self.repeat_rmse_without_friction:.3g} to "
                f"{self.repeat_rmse:.3g} N; the repeatability of the runs is {self.repeatability:.3g} N."
            )
        if self.rmse < self.repeatability:
            text += " The error is below the repeatability, which indicates overfitting."
        if self.undetermined:
            text += f" Not determined: {', '.join(self.undetermined)}."
        return f"{text} The data {'justify' if self.justified else 'do not justify'} this friction."

    @property
    def _gap_text(self) -> str:
        if not np.isfinite(self.gap):
            return "; the branches have no common part of the path in the fitted rows"
        return f" and the gap between the branches from {self.gap:.3g} to {self.residual_gap:.3g} N"

    def plot(self) -> Any:
        """The loop, the friction force and the residuals; a Matplotlib figure."""
        rms = f"{self.rmse_without_friction:.3g} N without, {self.rmse:.3g} N with friction"
        title = f"{self.series.origin}: rms error {rms}"
        return plot_hysteresis(self.series, self.friction, self.coefficients, title)

    def __str__(self) -> str:
        lines = [
            f"{leaf.path:<16}{leaf.declared.symbol:<9}{leaf.value:<12.6g}"
            f"{'' if leaf.declared.unit == '1' else leaf.declared.unit}".rstrip()
            for leaf in leaves(self.friction)
        ]
        return "\n".join([f"{type(self.friction).__name__} fitted to {self.series.origin}", *lines, self.verdict])


def assess_fit(friction: Friction, free: int, run: LoopSeries, repeat: LoopSeries | None) -> HysteresisFit:
    """The statistics of a fitted friction with `free` fitted parameters, compared with the static curve alone."""
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
        repeatability = _rms(branches.repeat_difference(path, plain, direction, *second_run)) / np.sqrt(2)
    return HysteresisFit(
        friction=friction,
        coefficients=coefficients,
        rmse=float(np.sqrt(square)),
        rmse_without_friction=float(np.sqrt(plain_square)),
        gap=_rms(branches.branch_gap(path, plain, direction)),
        residual_gap=_rms(branches.branch_gap(path, residuals, direction)),
        effective_sample_size=sample_size,
        aicc_reduction=aicc(plain_square, sample_size, base) - aicc(square, sample_size, base + free),
        p_value=f_test_p_value(plain_square, square, sample_size, base + free, free),
        repeat_rmse=repeat_rmse,
        repeat_rmse_without_friction=plain_repeat_rmse,
        repeatability=repeatability,
        series=run,
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
