"""The part of the surface that something was measured, printed or fitted on."""

from __future__ import annotations

from ..core.errors import ParameterError
from ..core.model import model, parameter
from ..core.ops import Value

PRESSURES = (-101_325.0, 1e8)
CONTRACTIONS = (-0.5, 1.0)
"""What can be measured: no pressure below absolute zero, no contraction beyond the whole length."""


@model
class Box:
    """A rectangle of gauge pressure and contraction."""

    least_pressure: float = parameter(
        "Pa", "p_low", "lower end of the box in gauge pressure", bounds=PRESSURES, fitted=False
    )
    greatest_pressure: float = parameter(
        "Pa", "p_high", "upper end of the box in gauge pressure", bounds=PRESSURES, fitted=False
    )
    least_contraction: float = parameter(
        "1", "eps_low", "lower end of the box in contraction", bounds=CONTRACTIONS, fitted=False
    )
    greatest_contraction: float = parameter(
        "1", "eps_high", "upper end of the box in contraction", bounds=CONTRACTIONS, fitted=False
    )

    def check(self) -> None:
        for name in ("pressure", "contraction"):
            low, high = getattr(self, name)
            if not low < high:
                raise ParameterError(f"Box: least_{name} {low:g} must lie below greatest_{name} {high:g}.")

    @property
    def pressure(self) -> tuple[float, float]:
        """Lower and upper end in gauge pressure [Pa]."""
        return (self.least_pressure, self.greatest_pressure)

    @property
    def contraction(self) -> tuple[float, float]:
        """Lower and upper end in contraction [1]."""
        return (self.least_contraction, self.greatest_contraction)

    def holds(self, pressure: Value, contraction: Value) -> Value:
        """Whether points lie inside, ends included."""
        in_pressure = (pressure >= self.least_pressure) & (pressure <= self.greatest_pressure)
        return in_pressure & (contraction >= self.least_contraction) & (contraction <= self.greatest_contraction)
