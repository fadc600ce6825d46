"""Air that passes an orifice between two places."""

from __future__ import annotations

from ..core import ops
from ..core.ops import Value
from .gas import SPECIFIC_HEAT_CONSTANT_PRESSURE, Air, Flow
from .orifice import Orifice


def orifice_flow(orifice: Orifice, first: Air, second: Air, opening: Value = 1.0) -> Flow:
    """The flow from the first place to the second; it has the temperature of the place that it comes from."""
    temperature = first.temperature
    if second.temperature is not first.temperature:  # a choice between two equal temperatures would cost time
        temperature = ops.where(first.pressure >= second.pressure, first.temperature, second.temperature)
    mass = orifice.mass_flow(first.pressure, second.pressure, opening, temperature)
    return Flow(mass, SPECIFIC_HEAT_CONSTANT_PRESSURE * temperature * mass)


def proportional_opening(excess: Value, band: Value) -> Value:
    """Opening [1] that grows from 0 to 1 as `excess` grows from 0 to `band`."""
    return ops.clip(excess / band, 0.0, 1.0)
