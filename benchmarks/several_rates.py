"""Hand-written rates of several muscles on one mass in scalar Python; `scalar_rates.hill` is that
of one muscle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from filling import stretch_factor
from scalar_rates import Rates, extrapolate, valve_flow

import airmuscle as am

OneMuscle = Callable[[float, float, float, float, float], tuple[float, float]]


def one_muscle(muscle: am.Muscle, circuit: am.FillDischarge, ambient: am.Ambient) -> OneMuscle:
    """A function from air mass, position, speed and valve openings to tension [N] and mass flow
    [kg/s].
    """
    law = muscle.contractile
    per_length = 1.0 / muscle.geometry.resting_length
    k, c = stretch_factor(muscle.geometry)
    rt = am.physics.GAS_CONSTANT * ambient.temperature
    outside = ambient.pressure
    cc = c * c
    source = am.physics.absolute_pressure(circuit.supply.pressure, ambient)
    fill_flow, discharge_flow = (
        valve_flow(v, ambient.temperature) for v in (circuit.fill, circuit.discharge)
    )
    stiffness = muscle.spring.stiffness
    damping = muscle.damper.damping
    growth = muscle.damper.damping_slope
    low_x = law.min_contraction
    scale_x = 2.0 / (law.max_contraction - law.min_contraction)
    low_q = law.min_pressure
    scale_q = 2.0 / (law.max_pressure - law.min_pressure)
    min_force, max_force, tangent = law.min_force, law.max_force, extrapolate(law)
    (
        a00,
        a10,
        a20,
        a30,
        a40,
        a50,
        a01,
        a11,
        a21,
        a31,
        a41,
        a02,
        a12,
        a22,
        a32,
        a03,
        a13,
        a23,
        a04,
        a14,
        a05,
    ) = law.coefficients

    def one(
        air: float, position: float, speed: float, fill: float, discharge: float
    ) -> tuple[float, float]:
        contraction = position * per_length
        s = 1.0 - contraction
        p = air * rt / (k * s * (1.0 - cc * s * s))
        gauge = p - outside
        x = (contraction - low_x) * scale_x - 1.0
        q = (gauge - low_q) * scale_q - 1.0
        if -1.0 <= x <= 1.0 and -1.0 <= q <= 1.0:
            r0 = a00 + x * (a10 + x * (a20 + x * (a30 + x * (a40 + x * a50))))
            r1 = a01 + x * (a11 + x * (a21 + x * (a31 + x * a41)))
            r2 = a02 + x * (a12 + x * (a22 + x * a32))
            force = r0 + q * (
                r1 + q * (r2 + q * (a03 + x * (a13 + x * a23) + q * (a04 + x * a14 + q * a05)))
            )
        else:
            force = tangent(x, q)
        force = min_force if force < min_force else max_force if force > max_force else force
        tension = force - stiffness * position - (damping + growth * gauge) * speed
        flow = 0.0
        if fill:
            flow += fill * fill_flow(source, p)
        if discharge:
            flow -= discharge * discharge_flow(p, outside)
        return (tension if tension > 0.0 else 0.0), flow

    return one


def hanging_rates(plant: am.Plant) -> Callable[[Sequence[float]], Rates]:
    """A function from valve openings to the rates of a hanging plant with several muscles."""
    load = plant.mechanism
    inverse_mass = 1.0 / load.mass
    gravity = load.gravity
    muscles = [
        one_muscle(m, c, plant.ambient) for m, c in zip(plant.muscles, plant.circuits, strict=True)
    ]

    def rates_at(openings: Sequence[float]) -> Rates:
        parts = list(zip(muscles, openings[::2], openings[1::2], strict=True))

        def rates(t: float, y: Any) -> list[float]:
            *airs, position, speed = y.tolist()
            pull = 0.0
            rates_of_states = []
            for air, (one, fill, discharge) in zip(airs, parts):  # noqa: B905 - checked above, and this is timed
                tension, flow = one(air, position, speed, fill, discharge)
                pull += tension
                rates_of_states.append(flow)
            rates_of_states += (speed, pull * inverse_mass - gravity)
            return rates_of_states

        return rates

    return rates_at
