"""Validity range of a characteristic."""

import dataclasses
from typing import Any

from ....core import Value, model, parameter

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
