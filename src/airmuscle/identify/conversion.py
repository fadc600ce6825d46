"""One model into another: `convert`, and how far the two are apart."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..characteristic.base import Characteristic
from ..characteristic.validity_range import ValidityRange
from ..core.arrays import Array
from ..core.errors import IdentificationError, SolveError
from ..recording import Recording
from .censoring import UNCENSORED
from .static_fit import fit

GRID_POINTS = 24
"""Pressures and contractions that the other law is fitted to; one more of each judges it."""


@dataclasses.dataclass(frozen=True, eq=False)
class ModelConversion:
    """The other model with the parameters that bring it nearest, and its errors in force over the validity range."""

    model: Characteristic
    rmse: float
    """Root mean square difference [N], at points between those of the fit."""
    max_error: float
    """The greatest difference [N], other less first."""
    max_error_pressure: float
    """Where it stands [Pa]."""
    max_error_contraction: float
    """Where it stands [1]."""
    check_points: Recording
    """The points between, where the first law pulls, with its force and the `error` of the other [N]."""

    def __str__(self) -> str:
        return (
            f"{type(self.model).__name__}: rms {self.rmse:.4g} N, greatest {self.max_error:.4g} N at "
            f"{self.max_error_pressure / 1e3:.4g} kPa and {self.max_error_contraction:.2%}"
        )


def convert(characteristic: Characteristic, other: Characteristic, validity_range: ValidityRange) -> ModelConversion:
    """The parameters of `other` that meet `characteristic` best on a validity range, where it pulls, and the error that stays.

    `other` gives the structure and the start values, as in `fit`. Raises IdentificationError where the validity range does not
    determine it, NoSolution where the first law pulls nowhere on it.
    """
    given = sample_on_grid(characteristic, validity_range, GRID_POINTS)
    law: Any = other
    if hasattr(law, "max_force") and law.max_force <= float(given["force"].max()):
        law = dataclasses.replace(law, max_force=2.0 * float(given["force"].max()))
    model = fit(law, given, censoring=UNCENSORED).model
    judged = sample_on_grid(characteristic, validity_range, GRID_POINTS + 1)
    difference = _evaluate_force(model, judged["pressure"], judged["contraction"]) - judged["force"]
    lacking = np.flatnonzero(~np.isfinite(difference))
    if lacking.size:
        p, c = judged["pressure"][lacking[0]], judged["contraction"][lacking[0]]
        raise IdentificationError(
            f"{type(other).__name__}, brought as near as it comes, has no force at {lacking.size} of {len(judged)} "
            f"points where {type(characteristic).__name__} pulls, the first at {p / 1e3:.4g} kPa and {c:.2%}; choose a "
            "smaller validity range."
        )
    at = int(np.argmax(np.abs(difference)))
    return ModelConversion(
        model, float(np.sqrt(np.mean(difference**2))), float(difference[at]), float(judged["pressure"][at]),
        float(judged["contraction"][at]), judged.with_columns(error=difference),
    )  # fmt: skip


def sample_on_grid(law: Characteristic, validity_range: ValidityRange, count: int) -> Recording:
    """The forces of a law on a grid of the validity range, denser towards its edges; points without force or slack left out.

    Raises NoSolution where none is left.
    """
    places = (1 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2
    (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
    pressure, contraction = np.meshgrid(p_low + (p_high - p_low) * places, c_low + (c_high - c_low) * places)
    p, c = pressure.ravel(), contraction.ravel()
    force = _evaluate_force(law, p, c)
    pulls = force > 0
    if not pulls.any():
        raise SolveError(f"{type(law).__name__} pulls nowhere on the validity range: nothing to convert.")
    columns = {"pressure": p[pulls], "contraction": c[pulls], "force": force[pulls]}
    return Recording(columns, type(law).__name__)


def _evaluate_force(law: Characteristic, pressure: Array, contraction: Array) -> Array:
    """Forces [N]; NaN where the law has none, found by halving the points."""
    try:
        found = np.asarray(law.force(pressure, contraction), dtype=float)
    except SolveError:
        if pressure.size == 1:
            return np.array([np.nan])
        half = pressure.size // 2
        parts = (_evaluate_force(law, pressure[s], contraction[s]) for s in (slice(None, half), slice(half, None)))
        return np.concatenate(list(parts))
    return np.asarray(found + np.zeros(pressure.size))
