"""Predicted quantities of a record beside the measured ones, with their errors and 95 % bands."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from ....core.arrays import Array
from ....core.short_repr import ShortRepr
from ....recording import Recording


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class QuantityPrediction(ShortRepr):
    """One quantity of a record, measured and predicted [SI], shape (N,) each.

    `half_width` (N,) is that of the 95 % band, None where the model states none. `compared` (N,) marks the rows that
    are compared: a finite measured value, and for a static law tension, or no tension where the law pulls by more than
    the half width. `band` says where the band comes from, or why there is none.
    """

    name: str
    measured: Array
    predicted: Array
    half_width: Array | None
    compared: npt.NDArray[np.bool_]
    band: str = ""

    @property
    def errors(self) -> Array:
        """Predicted minus measured value at every row [SI], shape (N,)."""
        return self.predicted - self.measured

    @property
    def rms(self) -> float:
        """Root mean square error over the compared rows [SI]."""
        return float(np.sqrt(np.mean(self.errors[self.compared] ** 2)))

    @property
    def worst_row(self) -> int:
        """Index of the compared row with the maximum error."""
        return int(np.argmax(np.where(self.compared, np.abs(self.errors), -1.0)))

    @property
    def max_error(self) -> float:
        """Predicted minus measured value of largest magnitude [SI]."""
        return float(self.errors[self.worst_row])

    @property
    def share(self) -> float | None:
        """Share of the compared rows within the 95 % band; None without a band."""
        if self.half_width is None:
            return None
        return float(np.mean(np.abs(self.errors[self.compared]) <= self.half_width[self.compared]))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecordPrediction(ShortRepr):
    """The prediction of one record: its recording, the predicted quantities, and notes on what limits them."""

    recording: Recording
    quantities: tuple[QuantityPrediction, ...]
    notes: tuple[str, ...] = ()
    outside: npt.NDArray[np.bool_] | None = None
    """Mask (N,) of the rows outside the range of the fit; None where the range is not known."""

    @property
    def origin(self) -> str:
        """Name of the record."""
        return self.recording.origin
