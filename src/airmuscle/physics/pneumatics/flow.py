"""Flow of air through an orifice between two volumes."""

from __future__ import annotations

from ...core import ops
from ...core.ops import Value
from .gas import SPECIFIC_HEAT_CONSTANT_PRESSURE, Air, Flow
from .orifice import Orifice


def orifice_flow(orifice: Orifice, first: Air, second: Air, opening: Value = 1.0) -> Flow:
    """Mass flow [kg/s] and enthalpy flow [W] from `first` to `second`, with the temperature of the upstream side."""
    temperature = first.temperature
    if second.temperature is not first.temperature:  # avoids a selection between two equal temperatures
        temperature = ops.where(first.pressure >= second.pressure, first.temperature, second.temperature)
    mass = orifice.mass_flow(first.pressure, second.pressure, opening, temperature)
    return Flow(mass, SPECIFIC_HEAT_CONSTANT_PRESSURE * temperature * mass)


def proportional_opening(error: Value, band: Value) -> Value:
    """Opening from 0 to 1, proportional to an error from 0 to `band` and saturated outside."""
    return ops.clip(error / band, 0.0, 1.0)
