"""Scales of measured points, by which laws choose their initial parameters."""

import dataclasses
import math
from collections.abc import Sequence
from typing import NoReturn, Self, TypeAlias

import numpy as np

from .... import recording
from ....core import IdentificationError
from ..geometry.braid import Braid

BRAID_ANGLE = 0.45
"""Initial braid angle [rad] (chosen); the angles of fluidic muscles lie within 0.15 of it."""


@dataclasses.dataclass(frozen=True)
class DataScales:
    """Maxima of measured points, by which a law scales its initial parameters; all SI."""

    force: float
    pressure: float
    contraction: float
    max_length: float | None = None
    """Maximum resting length [m]; None unless every recording states one."""
    length_count: int = 0
    """Number of different resting lengths; 0 unless every recording states one."""
    specimen_count: int = 1

    @classmethod
    def of(cls, data: "MeasuredPoints") -> "DataScales":
        """The scales of all rows of one recording or several; given scales as they are. Raises
        IdentificationError where a column has no value."""
        if isinstance(data, DataScales):
            return data
        runs = [data] if isinstance(data, recording.Recording) else list(data)
        names = ("force", "pressure", "contraction")
        columns = [[run[name] for run in runs if not np.isnan(run[name]).all()] for name in names]
        if runs and not all(columns):  # without recordings, the call that lacks them is named
            refuse_guess(
                "the recordings have no value of the pressure, of the contraction or of the force"
            )
        force, pressure, contraction = (
            max(float(np.nanmax(values)) for values in column) for column in columns
        )
        lengths = list(map(recording.resting_length_of, runs))
        known = {length for length in lengths if length is not None}
        complete = len(lengths) > 0 and None not in lengths
        specimens = {
            run.constants.get("specimen", length) for run, length in zip(runs, lengths, strict=True)
        }
        length, count = (max(known), len(known)) if complete else (None, 0)
        return cls(force, pressure, contraction, length, count, len(specimens))

    @property
    def resting_length(self) -> float:
        """Maximum resting length [m]. Raises IdentificationError unless every recording states
        one.
        """
        if self.max_length is None:
            refuse_guess(
                "not every recording states its resting length", "State the resting length."
            )
        return self.max_length

    @property
    def braid(self) -> Braid:
        """A braid of the resting length that exerts the maximum force at the maximum pressure, with
        a radius of 0.2 to 100 mm. Raises IdentificationError without a positive pressure, or unless
        every recording states its length.
        """
        area = math.pi * self.check_positive("pressure").pressure
        area *= 3 / math.tan(BRAID_ANGLE) ** 2 - 1 / math.sin(BRAID_ANGLE) ** 2
        radius = min(max(math.sqrt(max(self.force, 1.0) / area), 2e-4), 0.1)
        return Braid(radius, BRAID_ANGLE, self.resting_length)

    def check_positive(self, name: str) -> Self:
        """These scales. Raises IdentificationError where the maximum of `force` or `pressure` is
        not positive.
        """
        if not getattr(self, name) > 0:
            refuse_guess(f"no row has a positive {name}")
        return self

    def check_lengths(self) -> Self:
        """These scales. Raises IdentificationError for fewer than two resting lengths."""
        if self.length_count < 2:
            refuse_guess("data of two resting lengths or more are required")
        return self


def refuse_guess(cause: str, remedy: str = "") -> NoReturn:
    """Raise IdentificationError for initial parameters that do not follow from the data."""
    raise IdentificationError(f"{cause[0].upper()}{cause[1:]}. {remedy}".rstrip(), cause=cause)


MeasuredPoints: TypeAlias = "recording.Recording | Sequence[recording.Recording] | DataScales"
"""One recording or several with pressure, contraction and force, or their scales."""
