"""Flow of air that a motion demands of the muscles of a body, against that of a valve and of the
supply.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from ...core import Array, ShortRepr
from ...physics.pneumatics import Orifice, Valve
from ...physics.pneumatics.gas import GAS_CONSTANT, REFERENCE_DENSITY, absolute_pressure
from ..sizing import SizingConditions
from ..sizing.laws_of_product import with_volume
from ..sizing.working_range import working_muscle
from .route_muscle import RouteMuscle

BISECTIONS = 50
"""Bisections of the pressure that gives a tension; they reach 1e-9 Pa."""
NO_FLOW = 1e-9
"""Mass flow [kg/s] that is none (chosen)."""
UNIT = Valve(1e-8, 0.3)
"""Valve of 1 dm3/(s bar), with the critical ratio 0.3 (chosen), in whose multiples the needed
conductance is stated."""


class MotionOfRoute(NamedTuple):
    """A route in a motion: instants [s], lengths [m] and tensions [N], (N,) each."""

    time: Array
    length: Array
    tension: Array


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RouteFlow(ShortRepr):
    """Greatest flows that a motion demands of the muscles of a route.

    route        its name
    count        number of muscles
    fill         greatest mass flow into one muscle [kg/s]
    discharge    greatest mass flow out of one muscle [kg/s]
    conductance  least sonic conductance of a valve of one muscle [m3/(s Pa)]
    use          greatest part of the flow of the stated valve; None without a valve
    """

    route: str
    count: int
    fill: float
    discharge: float
    conductance: float
    use: float | None

    @property
    def volume_flow(self) -> float:
        """Greatest flow into one muscle as a volume at the reference atmosphere [m3/s (ANR)]."""
        return self.fill / REFERENCE_DENSITY


def route_flow(
    choice: RouteMuscle,
    motion: MotionOfRoute,
    conditions: SizingConditions,
    valve: Orifice | None = None,
) -> RouteFlow | None:
    """The flows of the muscles of a route in a motion, whose air has the temperature of the
    surroundings; None where their volume is not known.

    valve  between the supply and each muscle, and between the muscle and the surroundings
    """
    entry, _ = with_volume(choice.muscle.entry)
    muscle = working_muscle(entry, conditions)
    contraction = choice.contraction_at(motion.length)
    force = motion.tension * choice.tackle / choice.count
    pressure = _pressures(choice, force, contraction)
    volumes = [
        muscle.volume(float(p), float(eps)) for p, eps in zip(pressure, contraction, strict=True)
    ]
    if None in volumes:
        return None
    ambient = conditions.ambient
    absolute = np.asarray(absolute_pressure(pressure, ambient))
    mass = absolute * np.array(volumes, float) / (GAS_CONSTANT * ambient.temperature)
    flow = np.gradient(mass, motion.time)
    supply = float(absolute_pressure(conditions.supply, ambient))
    needed = _use(UNIT, flow, absolute, supply, conditions)
    return RouteFlow(
        choice.name,
        choice.count,
        max(float(flow.max()), 0.0),
        max(float(-flow.min()), 0.0),
        needed * UNIT.conductance,
        None if valve is None else _use(valve, flow, absolute, supply, conditions),
    )


def _pressures(choice: RouteMuscle, force: Array, contraction: Array) -> Array:
    """Gauge pressures [Pa] that give forces [N] of one muscle, within its working range."""
    least, greatest = choice.muscle.pressure_range
    low = np.full(force.shape, least)
    high = np.full(force.shape, greatest)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        is_weak = np.asarray(choice.muscle.force(middle, contraction)) < force
        low = np.where(is_weak, middle, low)
        high = np.where(is_weak, high, middle)
    return np.asarray(0.5 * (low + high))


def _use(
    valve: Orifice, flow: Array, absolute: Array, supply: float, conditions: SizingConditions
) -> float:
    """Greatest part of the flow of an open valve that is demanded; infinite where it gives none."""
    temperature = conditions.ambient.temperature
    surroundings = conditions.ambient.pressure
    greatest = 0.0
    for demanded, pressure in zip(flow.tolist(), absolute.tolist(), strict=True):
        if abs(demanded) <= NO_FLOW:
            continue
        upstream = supply if demanded > 0.0 else pressure
        downstream = pressure if demanded > 0.0 else surroundings
        given = float(valve.mass_flow(upstream, downstream, 1.0, temperature))
        greatest = max(greatest, abs(demanded) / given if given > 0.0 else np.inf)
    return greatest
