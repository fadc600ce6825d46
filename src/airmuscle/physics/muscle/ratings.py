"""Ratings of a muscle: values that its maker permits for force, pressure, contraction, length and
temperature.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

from ...core import INFINITY, ParameterError, model, parameter, parameters
from .characteristic.validity_range import CONTRACTION_BOUNDS, FORCE_BOUNDS, PRESSURE_BOUNDS

LENGTH_BOUNDS = (1e-3, 20.0)
TEMPERATURE_BOUNDS = (1.0, 1000.0)
"""Physical bounds; a limit that is not stated is equal to its bound."""
QUANTITIES: dict[str, tuple[Any, ...]] = {
    "force": (1.0, "N"),
    "pressure": (1e3, "kPa"),
    "contraction": (0.01, "%"),
    "length": (1e-3, "mm"),
    "temperature": (1.0, "°C", 273.15),
}
"""Rated quantities, with the factor, the unit and the offset of their display."""


class RatedRange(NamedTuple):
    """Permitted range of a quantity in SI units, with the factor and the unit of its display."""

    quantity: str
    low: float
    high: float
    scale: float
    unit: str
    offset: float = 0.0

    def contains(self, value: float) -> bool:
        """Whether a value is permitted; a margin of 1e-9 of each limit allows for rounding."""
        return self.low - 1e-9 * abs(self.low) <= value <= self.high + 1e-9 * abs(self.high)

    def display(self, value: float) -> str:
        """A value with its unit."""
        return f"{self._scaled(value):.4g} {self.unit}"

    def _scaled(self, value: float) -> float:
        return (value - self.offset) / self.scale + 0.0

    def __str__(self) -> str:
        if self.low == -INFINITY:
            return f"at most {self.display(self.high)}"
        if self.high == INFINITY:
            return f"at least {self.display(self.low)}"
        return f"{self._scaled(self.low):.4g} to {self.display(self.high)}"


def _lower_limit(unit: str, symbol: str, description: str, bounds: tuple[float, float]) -> Any:
    """A parameter that is not fitted; unless it is stated, it is equal to the lower bound and does
    not limit.
    """
    return parameter(unit, symbol, description, bounds=bounds, fitted=False, default=bounds[0])


def _upper_limit(unit: str, symbol: str, description: str, bounds: tuple[float, float]) -> Any:
    return parameter(unit, symbol, description, bounds=bounds, fitted=False, default=bounds[1])


@model
class Ratings:
    """Permitted values of a muscle, as its maker states them; a value that is not stated does not
    limit.

    They belong to the product and protect it; the validity range of a characteristic belongs to the
    measurements. Points may be permitted and not measured, or measured and not permitted.
    """

    max_force: float = _upper_limit("N", "F_max", "permitted force", FORCE_BOUNDS)
    min_pressure: float = _lower_limit(
        "Pa", "p_min", "minimum permitted gauge pressure", PRESSURE_BOUNDS
    )
    max_pressure: float = _upper_limit(
        "Pa", "p_max", "maximum permitted gauge pressure", PRESSURE_BOUNDS
    )
    max_contraction: float = _upper_limit(
        "1", "eps_max", "maximum permitted contraction", (0.0, CONTRACTION_BOUNDS[1])
    )
    max_prestretch: float = _upper_limit(
        "1",
        "eps_pre",
        "maximum permitted elongation beyond the resting length",
        (0.0, -CONTRACTION_BOUNDS[0]),
    )
    min_length: float = _lower_limit("m", "L_min", "minimum nominal length", LENGTH_BOUNDS)
    max_length: float = _upper_limit("m", "L_max", "maximum nominal length", LENGTH_BOUNDS)
    diameter: float = _lower_limit(
        "m", "D", "nominal inner diameter at rest; 0 is not stated", (0.0, 1.0)
    )
    min_temperature: float = _lower_limit(
        "K", "T_min", "minimum permitted ambient temperature", TEMPERATURE_BOUNDS
    )
    max_temperature: float = _upper_limit(
        "K", "T_max", "maximum permitted ambient temperature", TEMPERATURE_BOUNDS
    )

    @property
    def stated(self) -> tuple[str, ...]:
        """Names of the values that are stated."""
        return tuple(p.name for p in parameters(self) if getattr(self, p.name) != p.default)

    def ranges(self) -> Iterator[RatedRange]:
        """Permitted ranges of force, pressure, contraction, length and temperature that state a
        limit.
        """
        stated = {name: getattr(self, name) for name in self.stated}
        limits = {
            q: (stated.get(f"min_{q}", -INFINITY), stated.get(f"max_{q}", INFINITY))
            for q in QUANTITIES
        }
        limits["contraction"] = (-stated.get("max_prestretch", INFINITY), limits["contraction"][1])
        rows = (
            RatedRange(quantity, *limits[quantity], *display)
            for quantity, display in QUANTITIES.items()
        )
        return (row for row in rows if row.low > -INFINITY or row.high < INFINITY)

    def excesses(self, **values: float) -> tuple[str, ...]:
        """Texts on the given quantities [SI] that are not permitted, with the allowed ranges; empty
        if all are.

        The quantities are `force`, `pressure`, `contraction`, `length` and `temperature`. Raises
        ParameterError for another name.
        """
        unknown = set(values) - set(QUANTITIES)
        if unknown:
            raise ParameterError(
                f"Ratings: '{min(unknown)}' is not rated; there are {', '.join(QUANTITIES)}."
            )
        return tuple(
            f"the {row.quantity} {row.display(values[row.quantity])} is not permitted; allowed"
            f" range: {row}"
            for row in self.ranges()
            if row.quantity in values and not row.contains(values[row.quantity])
        )
