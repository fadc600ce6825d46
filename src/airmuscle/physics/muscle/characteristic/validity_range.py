"""Validity range: the pressures and contractions for which a characteristic was measured, printed or fitted."""

import dataclasses
from typing import Any

from ....core import ParameterError, Value, model, parameter

PRESSURE_BOUNDS = (-101_325.0, 1e8)
CONTRACTION_BOUNDS = (-0.5, 1.0)
"""Physical bounds: pressure not below absolute vacuum, contraction not above the whole length."""


@model
class ValidityRange:
    """Rectangle of gauge pressure and contraction; outside it a characteristic is extrapolated."""

    min_pressure: float = parameter(
        "Pa", "p_low", "lower limit of the validity range in gauge pressure", bounds=PRESSURE_BOUNDS, fitted=False
    )
    max_pressure: float = parameter(
        "Pa", "p_high", "upper limit of the validity range in gauge pressure", bounds=PRESSURE_BOUNDS, fitted=False
    )
    min_contraction: float = parameter(
        "1", "eps_low", "lower limit of the validity range in contraction", bounds=CONTRACTION_BOUNDS, fitted=False
    )
    max_contraction: float = parameter(
        "1", "eps_high", "upper limit of the validity range in contraction", bounds=CONTRACTION_BOUNDS, fitted=False
    )

    def check(self) -> None:
        for name in ("pressure", "contraction"):
            low, high = getattr(self, name)
            if not low < high:
                raise ParameterError(f"ValidityRange: min_{name} {low:g} must be less than max_{name} {high:g}.")

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
        return in_pressure & (contraction >= self.min_contraction) & (contraction <= self.max_contraction)


def validity_range_of(characteristic: Any, stated: ValidityRange | None = None) -> ValidityRange | None:
    """Return the stated validity range, otherwise the one stored in the law by its fit, otherwise None."""
    names = [field.name for field in dataclasses.fields(ValidityRange)]
    if stated is not None or not all(hasattr(characteristic, name) for name in names):
        return stated
    return ValidityRange(*(getattr(characteristic, name) for name in names))
