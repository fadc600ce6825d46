"""The part of the surface that something was measured, printed or fitted on."""

from __future__ import annotations

from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value

PRESSURE_BOUNDS = (-101_325.0, 1e8)
CONTRACTION_BOUNDS = (-0.5, 1.0)
"""What can be measured: no pressure below absolute zero, no contraction beyond the whole length."""


@model
class ValidityRange:
    """A rectangle of gauge pressure and contraction."""

    min_pressure: float = parameter(
        "Pa", "p_low", "lower end of the validity range in gauge pressure", bounds=PRESSURE_BOUNDS, fitted=False
    )
    max_pressure: float = parameter(
        "Pa", "p_high", "upper end of the validity range in gauge pressure", bounds=PRESSURE_BOUNDS, fitted=False
    )
    min_contraction: float = parameter(
        "1", "eps_low", "lower end of the validity range in contraction", bounds=CONTRACTION_BOUNDS, fitted=False
    )
    max_contraction: float = parameter(
        "1", "eps_high", "upper end of the validity range in contraction", bounds=CONTRACTION_BOUNDS, fitted=False
    )

    def check(self) -> None:
        for name in ("pressure", "contraction"):
            low, high = getattr(self, name)
            if not low < high:
                raise ParameterError(f"ValidityRange: min_{name} {low:g} must lie below max_{name} {high:g}.")

    @property
    def pressure(self) -> tuple[float, float]:
        """Lower and upper end in gauge pressure [Pa]."""
        return (self.min_pressure, self.max_pressure)

    @property
    def contraction(self) -> tuple[float, float]:
        """Lower and upper end in contraction [1]."""
        return (self.min_contraction, self.max_contraction)

    def contains(self, pressure: Value, contraction: Value) -> Value:
        """Whether points lie inside, ends included."""
        in_pressure = (pressure >= self.min_pressure) & (pressure <= self.max_pressure)
        return in_pressure & (contraction >= self.min_contraction) & (contraction <= self.max_contraction)
