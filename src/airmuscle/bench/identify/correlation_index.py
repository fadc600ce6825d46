"""Correlation index IK, the measure of fit in the papers from Košice."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from ...core.errors import IdentificationError


@dataclasses.dataclass(frozen=True)
class CorrelationIndex:
    """IK = sqrt(1 - SSE/SST), SSE = Sum (k_i - y_i)^2, SST = Sum (mean(y) - y_i)^2; k_i modelled, y_i measured.

    Where SSE > SST the model is worse than the mean of the measurements and IK is undefined; `r_squared` is then
    negative.
    Reference: Borzíková et al., the index given next to their plane curves.
    """

    r_squared: float
    """Coefficient of determination R^2 = 1 - SSE/SST [1], at most 1."""

    @property
    def is_defined(self) -> bool:
        """Whether IK exists, that is R^2 >= 0."""
        return self.r_squared >= 0.0

    @property
    def value(self) -> float | None:
        """IK [1], or None where it is undefined; never NaN."""
        return math.sqrt(self.r_squared) if self.is_defined else None

    def __str__(self) -> str:
        if self.value is None:
            return f"undefined, because 1 - SSE/SST = {self.r_squared:.4g} is negative"
        return f"IK = {self.value:.4f}"


def correlation_index(measured: npt.ArrayLike, modelled: npt.ArrayLike) -> CorrelationIndex:
    """The correlation index of modelled and measured values, shape (N,) each, in the same unit.

    Raises IdentificationError where a value is not finite, the shapes differ, there are fewer than two values, or the
    measured values do not vary.
    """
    y, k = np.asarray(measured, dtype=float), np.asarray(modelled, dtype=float)
    if y.shape != k.shape or y.size < 2:
        raise IdentificationError(
            f"correlation index: there are {y.size} measured and {k.size} modelled values; give the same number of "
            "each, at least two."
        )
    if not (np.isfinite(y).all() and np.isfinite(k).all()):
        raise IdentificationError("correlation index: a value is not finite. Remove such rows first.")
    total = float(np.sum((y.mean() - y) ** 2))
    if total == 0.0:
        raise IdentificationError("correlation index: undefined, because all measured values are equal.")
    return CorrelationIndex(1.0 - float(np.sum((k - y) ** 2)) / total)
