"""Approximation of one characteristic by another in least squares, and its error."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...core.arrays import Array
from ...core.errors import IdentificationError, SolveError
from ...core.short_repr import ShortRepr
from ...physics.muscle.characteristic.base import Characteristic
from ...physics.muscle.characteristic.validity_range import ValidityRange
from ...recording import Recording
from .static_fit import fit
from .weighting import UNCENSORED

GRID_POINTS = 24
"""Grid points in pressure and in contraction for the fit; the error is evaluated on a grid with one more of each."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ModelApproximation(ShortRepr):
    """The fitted target model, and its error in force over the validity range."""

    model: Characteristic
    rmse: float
    """Root mean square error [N], at points between those of the fit."""
    max_error: float
    """Error of maximum magnitude [N], target minus source."""
    max_error_pressure: float
    """Gauge pressure [Pa] of the maximum error."""
    max_error_contraction: float
    """Contraction [1] of the maximum error."""
    check_points: Recording
    """The points where the error was evaluated: force of the source law [N], and `error` of the target [N]."""

    def __str__(self) -> str:
        return (
            f"{type(self.model).__name__}: rms error {self.rmse:.4g} N, maximum error {self.max_error:.4g} N at "
            f"{self.max_error_pressure / 1e3:.4g} kPa and {100 * self.max_error_contraction:.2f} %"
        )


def approximate(law: Characteristic, other: Characteristic, validity_range: ValidityRange) -> ModelApproximation:
    """Approximate `law` by the model of `other` on a validity range, by least squares in force.

    `other` gives the structure and the initial values, as in `fit`. Only points where `law` gives a positive
    force are used. Raises IdentificationError where the validity range does not determine the parameters of `other`,
    SolveError where `law` gives no positive force on it.
    """
    data = sample_on_grid(law, validity_range, GRID_POINTS)
    target: Any = other
    if hasattr(target, "max_force") and target.max_force <= float(data["force"].max()):
        target = dataclasses.replace(target, max_force=2.0 * float(data["force"].max()))
    model = fit(target, data, censoring=UNCENSORED).model
    check_points = sample_on_grid(law, validity_range, GRID_POINTS + 1)
    difference = _evaluate_force(model, check_points["pressure"], check_points["contraction"]) - check_points["force"]
    missing = np.flatnonzero(~np.isfinite(difference))
    if missing.size:
        p, c = check_points["pressure"][missing[0]], check_points["contraction"][missing[0]]
        raise IdentificationError(
            f"the fitted {type(other).__name__} has no force at {missing.size} of {len(check_points)} points where "
            f"{type(law).__name__} has one, the first at {p / 1e3:.4g} kPa and {100 * c:.2f} %. Choose a "
            "smaller validity range."
        )
    worst = int(np.argmax(np.abs(difference)))
    return ModelApproximation(
        model, float(np.sqrt(np.mean(difference**2))), float(difference[worst]),
        float(check_points["pressure"][worst]), float(check_points["contraction"][worst]),
        check_points.with_columns(error=difference),
    )  # fmt: skip


def sample_on_grid(law: Characteristic, validity_range: ValidityRange, count: int) -> Recording:
    """The forces of a law on a Chebyshev-Lobatto grid of the validity range, `count` points in each direction.

    Points without a positive force are omitted. Raises SolveError where no point is left.
    """
    nodes = (1 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2
    (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
    pressure, contraction = np.meshgrid(p_low + (p_high - p_low) * nodes, c_low + (c_high - c_low) * nodes)
    p, c = pressure.ravel(), contraction.ravel()
    force = _evaluate_force(law, p, c)
    pulls = force > 0
    if not pulls.any():
        raise SolveError(
            f"{type(law).__name__} gives no positive force on the validity range, so it cannot be converted. Choose "
            "another validity range."
        )
    columns = {"pressure": p[pulls], "contraction": c[pulls], "force": force[pulls]}
    return Recording(columns, type(law).__name__)


def _evaluate_force(law: Characteristic, pressure: Array, contraction: Array) -> Array:
    """Forces [N]; NaN where the law has none. Such points are isolated by bisection of the arrays."""
    try:
        force = np.asarray(law.force(pressure, contraction), dtype=float)
    except SolveError:
        if pressure.size == 1:
            return np.array([np.nan])
        half = pressure.size // 2
        parts = (_evaluate_force(law, pressure[s], contraction[s]) for s in (slice(None, half), slice(half, None)))
        return np.concatenate(list(parts))
    return np.asarray(force + np.zeros(pressure.size))
