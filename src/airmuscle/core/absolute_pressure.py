"""Pressures that are stated as absolute: gauge pressures that keep the absolute pressure they were
converted from.
"""

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Any

from .errors import ParameterError

STANDARD_ATMOSPHERE = 101_325.0
"""Ambient pressure [Pa] where none is stated."""

_ambient: ContextVar[float] = ContextVar("ambient_pressure", default=STANDARD_ATMOSPHERE)


class AbsolutePressure(float):
    """A gauge pressure [Pa] that was stated as an absolute one, such as "7 bara", at an ambient
    pressure [Pa].

    It is a number like any other; a plant converts it anew with its own ambient pressure.
    """

    absolute: float
    """The absolute pressure that was stated [Pa]."""
    ambient: float
    """The ambient pressure that was subtracted [Pa]."""

    def __new__(cls, absolute: float, ambient: float) -> "AbsolutePressure":
        pressure = super().__new__(cls, absolute - ambient)
        pressure.absolute = absolute
        pressure.ambient = ambient
        return pressure

    def __getnewargs__(self) -> tuple[float, float]:  # type: ignore[override]
        return self.absolute, self.ambient


def at_ambient(value: Any, ambient: float) -> Any:
    """A value, or where it was stated as an absolute pressure, the gauge pressure at an ambient
    pressure [Pa].
    """
    return (
        AbsolutePressure(value.absolute, ambient) if isinstance(value, AbsolutePressure) else value
    )


def ambient_of_texts() -> float:
    """Ambient pressure [Pa] with which texts of absolute pressures are converted."""
    return _ambient.get()


@contextlib.contextmanager
def ambient_pressure(pressure: float) -> Iterator[None]:
    """Context in which texts of absolute pressures are converted with an ambient pressure [Pa],
    that of a plant.
    """
    token = _ambient.set(pressure)
    try:
        yield
    finally:
        _ambient.reset(token)


def check_above_vacuum(pressure: float, ambient_pressure: float = STANDARD_ATMOSPHERE) -> None:
    """Raise ParameterError for a gauge pressure [Pa] at or below absolute vacuum."""
    if not pressure > -ambient_pressure:
        raise ParameterError(
            f"a gauge pressure of {pressure / 1e3:.6g} kPa is not above absolute vacuum "
            f"({-ambient_pressure / 1e3:.6g} kPa gauge). Check the unit."
        )
