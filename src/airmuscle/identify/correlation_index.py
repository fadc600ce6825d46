"""The correlation index by which the Kosice papers judge a model against measurements."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from ..core.errors import IdentificationError


@dataclasses.dataclass(frozen=True)
class CorrelationIndex:
    """IK = sqrt(1 - SSE/SST), SSE = Sum (k_i - y_i)^2, SST = Sum (mean(y) - y_i)^2; k_i model, y_i measured.

    Where SSE > SST the mean of the measurements is a better model than the model, and IK does not exist;
    `explained` = 1 - SSE/SST then says how far off it is.
    Reference: Borzikova et al., the index beside their plane curves.
    """

    r_squared: float
    """1 - SSE/SST [1], at most 1; this is R2."""

    @property
    def is_defined(self) -> bool:
        """Whether there is an index at all."""
        return self.r_squared >= 0.0

    @property
    def value(self) -> float | None:
        """IK [1], or None where it does not exist; never NaN."""
        return math.sqrt(self.r_squared) if self.is_defined else None

    def __str__(self) -> str:
        if self.value is None:
            return f"no index: 1 - SSE/SST = {self.r_squared:.4g} is negative"
        return f"IK = {self.value:.4f}"


def correlation_index(measured: npt.ArrayLike, modelled: npt.ArrayLike) -> CorrelationIndex:
    """The index of modelled against measured values, shape (N,) each and in one unit.

    Raises IdentificationError where a value is not finite, the shapes differ, or the measurements do not
    vary.
    """
    y, k = np.asarray(measured, dtype=float), np.asarray(modelled, dtype=float)
    if y.shape != k.shape or y.size < 2:
        raise IdentificationError(
            f"correlation index: {y.size} measured and {k.size} modelled values; as many of each, and two at the "
            "least, are wanted."
        )
    if not (np.isfinite(y).all() and np.isfinite(k).all()):
        raise IdentificationError("correlation index: a value is not finite; drop such rows first.")
    total = float(np.sum((y.mean() - y) ** 2))
    if total == 0.0:
        raise IdentificationError("correlation index: all measured values are equal, so it is not defined.")
    return CorrelationIndex(1.0 - float(np.sum((k - y) ** 2)) / total)
