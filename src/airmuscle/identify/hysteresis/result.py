"""A fitted friction: how much of a loop it explains, and whether the data justify it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.tree import leaves
from ...friction import Friction
from ..model_evidence import aicc, effective_sample_size, f_test_p_value
from . import branches

SIGNIFICANCE_LEVEL = 0.01
"""Probability below which an F test counts (chosen)."""


@dataclasses.dataclass(frozen=True)
class Axis:
    """How a path [m] is drawn: what the axis says, and its unit in one metre."""

    label: str
    factor: float


MILLIMETRES = Axis("displacement [mm]", 1e3)


@dataclasses.dataclass(frozen=True, eq=False)
class LoopSeries:
    """One run as the fit sees it: the path, the force that the static columns and the friction shall explain."""

    origin: str
    path: Array
    time: Array | None
    target: Array
    design_matrix: Array
    fitted_rows: npt.NDArray[np.bool_]
    """Where errors count."""
    direction: Array
    """1 where the path rises, -1 where it falls."""
    axis: Axis = MILLIMETRES

    def coefficients(self, friction: Friction | None) -> Array:
        """Of the static columns, best beside this friction, or without any."""
        goal = self.target if friction is None else self.target + friction.force_along(self.path, self.time)
        return np.asarray(np.linalg.lstsq(self.design_matrix[self.fitted_rows], goal[self.fitted_rows], rcond=None)[0])

    def residuals(self, friction: Friction | None, coefficients: Array) -> Array:
        """Measured less modelled force [N], every row."""
        missing = self.target - self.design_matrix @ coefficients
        return missing if friction is None else missing + friction.force_along(self.path, self.time)

    def fitted_residuals(self, friction: Friction | None) -> Array:
        """Errors of the chosen rows, with the best static coefficients."""
        return self.residuals(friction, self.coefficients(friction))[self.fitted_rows]


@dataclasses.dataclass(frozen=True, eq=False)
class HysteresisFit:
    """A friction law fitted to a loop, against the same static curve without friction; forces in N.

    `gap` is the rms distance of the deflating from the inflating branch, `gap_left` what the friction leaves of it.
    `repeat_rmse` and `plain_repeat_rmse` are errors on a second run, with this friction and without any, where the
    static coefficients are found anew (the level of runs may shift); `repeatability` is the scatter of one run about
    the mean of the two, the floor below which a fit follows chance. All three are NaN without a second run.
    """

    friction: Friction
    coefficients: Array
    rmse: float
    rmse_without_friction: float
    gap: float
    residual_gap: float
    effective_sample_size: float
    aicc_gain: float
    p_value: float
    """Probability that idle parameters would do as well (F test)."""
    repeat_rmse: float
    repeat_rmse_without_friction: float
    repeatability: float
    series: LoopSeries

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters that the search drove to the end of what is allowed: the data do not determine them."""
        free = [leaf for leaf in leaves(self.friction) if leaf.declared.fitted and leaf.declared.bounds[0] > 0]
        return tuple(
            leaf.path
            for leaf in free
            if not 1.01 * leaf.declared.bounds[0] < leaf.value < 0.99 * leaf.declared.bounds[1]
        )

    @property
    def justified(self) -> bool:
        """Whether AICc, the F test and, where there is one, the second run agree that there is friction."""
        carries_over = not self.repeat_rmse >= self.repeat_rmse_without_friction
        return self.aicc_gain > 0 and self.p_value < SIGNIFICANCE_LEVEL and carries_over

    @property
    def verdict(self) -> str:
        """Whether the data justify this friction, in words with the numbers."""
        name = type(self.friction).__name__
        text = (
            f"{name} lowers the rms error from {self.rmse_without_friction:.3g} to {self.rmse:.3g} N and {self._gap_text}. AICc "
            f"{'falls' if self.aicc_gain > 0 else 'rises'} by {abs(self.aicc_gain):.4g} over {self.effective_sample_size:.0f} "
            f"independent rows; idle parameters would do as well with a probability "
            f"{'below 1e-300' if self.p_value < 1e-300 else f'of {self.p_value:.2g}'}."
        )
        if np.isfinite(self.repeat_rmse):
            text += (
                f" On the second run the error goes from {self.repeat_rmse_without_friction:.3g} to {self.repeat_rmse:.3g} N; the "
                f"runs themselves scatter by {self.repeatability:.3g} N."
            )
        if self.rmse < self.repeatability:
            text += " The fit lies below that floor: part of it follows chance."
        if self.undetermined:
            text += f" Not determined: {', '.join(self.undetermined)}."
        return f"{text} The data {'justify' if self.justified else 'do not justify'} this friction."

    @property
    def _gap_text(self) -> str:
        if not np.isfinite(self.gap):
            return "the branches have no place in common where rows count"
        return f"the gap between the branches from {self.gap:.3g} to {self.residual_gap:.3g} N"

    def plot(self) -> Any:
        """The loop and what the friction explains of it; a Matplotlib figure."""
        from .plot import plot_hysteresis

        return plot_hysteresis(self)

    def __str__(self) -> str:
        lines = [
            f"{leaf.path:<16}{leaf.declared.symbol:<9}{leaf.value:<12.6g}{leaf.declared.unit}"
            for leaf in leaves(self.friction)
        ]
        return "\n".join([f"{type(self.friction).__name__} fitted to {self.series.origin}", *lines, self.verdict])


def assess_fit(friction: Friction, free: int, run: LoopSeries, repeat: LoopSeries | None) -> HysteresisFit:
    """A fitted friction, beside the static curve alone."""
    with_it, without = run.coefficients(friction), run.coefficients(None)
    errors, plain = run.residuals(friction, with_it)[run.fitted_rows], run.residuals(None, without)[run.fitted_rows]
    square, plain_square = float(np.mean(errors**2)), float(np.mean(plain**2))
    rows, base = effective_sample_size(errors), run.design_matrix.shape[1]
    path, way = run.path[run.fitted_rows], run.direction[run.fitted_rows]
    again = plain_again = floor = float("nan")
    if repeat is not None:
        again = _rms(repeat.fitted_residuals(friction))
        plain_again = _rms(repeat.fitted_residuals(None))
        other = repeat.residuals(None, without)[repeat.fitted_rows]
        beside = (repeat.path[repeat.fitted_rows], other, repeat.direction[repeat.fitted_rows])
        floor = _rms(branches.repeat_difference(path, plain, way, *beside)) / np.sqrt(2)
    return HysteresisFit(
        friction=friction,
        coefficients=with_it,
        rmse=float(np.sqrt(square)),
        rmse_without_friction=float(np.sqrt(plain_square)),
        gap=_rms(branches.branch_gap(path, plain, way)),
        residual_gap=_rms(branches.branch_gap(path, errors, way)),
        effective_sample_size=rows,
        aicc_gain=aicc(plain_square, rows, base) - aicc(square, rows, base + free),
        p_value=f_test_p_value(plain_square, square, rows, base + free, free),
        repeat_rmse=again,
        repeat_rmse_without_friction=plain_again,
        repeatability=floor,
        series=run,
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
