"""Identified friction: a friction law with the range of pressure and speed of the data that it was fitted to."""

from __future__ import annotations

from ....core.declaration import model, parameter
from ....core.errors import ParameterError
from .base import Friction, IdentifiedRange
from .wrapper import FrictionWrapper


@model
class IdentifiedFriction(FrictionWrapper):
    """Friction law with the range of its data; a simulation reports when and how far the range is left.

    The force is that of the inner law, inside and outside the range. There is no lower limit of the speed, because
    every motion begins and ends at rest.
    """

    inner: Friction
    min_pressure: float = parameter(
        "Pa", "p_low", "lower limit of the gauge pressure in the data", bounds=(-101325.0, 1e7), fitted=False
    )
    max_pressure: float = parameter(
        "Pa", "p_high", "upper limit of the gauge pressure in the data", bounds=(-101325.0, 1e7), fitted=False
    )
    max_speed: float = parameter(
        "m/s", "v_high", "maximum speed in the data; 100 m/s where it is not known", bounds=(1e-9, 100.0),
        fitted=False, default=100.0,
    )  # fmt: skip

    def check(self) -> None:
        if not self.min_pressure < self.max_pressure:
            raise ParameterError(
                f"IdentifiedFriction: min_pressure {self.min_pressure:g} must be less than max_pressure "
                f"{self.max_pressure:g}."
            )

    @property
    def identified_range(self) -> IdentifiedRange | None:
        return IdentifiedRange((self.min_pressure, self.max_pressure), (-self.max_speed, self.max_speed))
