"""Ranges of data: where a characteristic is valid, and the scales of measured points, from which a
fit starts.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NoReturn, Self

import numpy as np

from ....core import IdentificationError, Value, model, parameter
from ....recording import Recording, resting_length_of
from ..geometry.braid import Braid

Limits = tuple[float, float]
"""Lower and upper limit."""
PRESSURE_BOUNDS = (-101_325.0, 1e8)
CONTRACTION_BOUNDS = (-0.5, 1.0)
FORCE_BOUNDS = (0.0, 1e6)
"""Physical bounds: pressure not below absolute vacuum, contraction not above the whole length."""


@model
class ValidityRange:
    """Rectangle of gauge pressure and contraction; outside it a characteristic is extrapolated."""

    min_pressure: float = parameter(
        "Pa",
        "p_low",
        "lower limit of the validity range in gauge pressure",
        bounds=PRESSURE_BOUNDS,
        fitted=False,
    )
    max_pressure: float = parameter(
        "Pa",
        "p_high",
        "upper limit of the validity range in gauge pressure",
        bounds=PRESSURE_BOUNDS,
        fitted=False,
    )
    min_contraction: float = parameter(
        "1",
        "eps_low",
        "lower limit of the validity range in contraction",
        bounds=CONTRACTION_BOUNDS,
        fitted=False,
    )
    max_contraction: float = parameter(
        "1",
        "eps_high",
        "upper limit of the validity range in contraction",
        bounds=CONTRACTION_BOUNDS,
        fitted=False,
    )

    @property
    def pressure(self) -> tuple[float, float]:
        """Lower and upper limit of the gauge pressure [Pa]."""
        return (self.min_pressure, self.max_pressure)

    @property
    def contraction(self) -> tuple[float, float]:
        """Lower and upper limit of the contraction [1]."""
        return (self.min_contraction, self.max_contraction)

    def contains(self, pressure: Value, contraction: Value) -> Value:
        """Return whether points are within the range, limits included; arrays broadcast."""
        in_pressure = (pressure >= self.min_pressure) & (pressure <= self.max_pressure)
        return (
            in_pressure
            & (contraction >= self.min_contraction)
            & (contraction <= self.max_contraction)
        )


def validity_range_of(
    characteristic: Any, stated: ValidityRange | None = None
) -> ValidityRange | None:
    """Return the stated validity range, otherwise the one stored in the law by its fit, otherwise
    None.
    """
    if stated is not None or not states_validity_range(characteristic):
        return stated
    return ValidityRange(*(getattr(characteristic, name) for name in _LIMITS))


_LIMITS = tuple(field.name for field in dataclasses.fields(ValidityRange))


def states_validity_range(characteristic: Any) -> bool:
    """Whether the parameters of a law contain the limits of a validity range."""
    return all(hasattr(characteristic, name) for name in _LIMITS)


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
        runs = [data] if isinstance(data, Recording) else list(data)
        names = ("force", "pressure", "contraction")
        columns = [[run[name] for run in runs if not np.isnan(run[name]).all()] for name in names]
        if runs and not all(columns):  # without recordings, the call that lacks them is named
            refuse_guess(
                "the recordings have no value of the pressure, of the contraction or of the force"
            )
        force, pressure, contraction = (
            max(float(np.nanmax(values)) for values in column) for column in columns
        )
        lengths = list(map(resting_length_of, runs))
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
            refuse_guess("it needs recordings of two resting lengths or more")
        return self


MeasuredPoints = Recording | Sequence[Recording] | DataScales
"""One recording or several with pressure, contraction and force, or their scales."""


def refuse_guess(cause: str, remedy: str = "") -> NoReturn:
    """Raise IdentificationError for initial parameters that do not follow from the data."""
    raise IdentificationError(f"{cause[0].upper()}{cause[1:]}. {remedy}".rstrip(), cause=cause)
