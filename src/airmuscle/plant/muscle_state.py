"""MuscleState: the pneumatic and mechanical state of a muscle at one instant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ..core.ops import Value
from ..muscle import Muscle
from ..pneumatics.gas import Air, Ambient, Gas, gauge_pressure


class MuscleState(NamedTuple):
    """One muscle at one instant: contraction [1], shortening speed [m/s], volume [m3], pressures [Pa], forces [N].

    `inner_contraction` and `inner_speed` belong to the contractile part; with a series spring they differ from those of
    the fittings. `states` are the states of the muscle and of its air, without prefix; `rates` the rates of the former.
    """

    contraction: Value
    speed: Value
    volume: Value
    air: Air
    pressure: Value
    tension: Value
    friction: Value
    inner_contraction: Value
    inner_speed: Value
    volume_rate: Value
    states: Mapping[str, Value]
    rates: Mapping[str, Value]


def muscle_state(
    muscle: Muscle, state: Mapping[str, Value], contraction: Value, speed: Value, gas: Gas, ambient: Ambient
) -> MuscleState:
    """A muscle with its own state and that of its air, at a contraction and a shortening speed of its fittings."""
    inner = muscle.inner_contraction(contraction, state)
    volume = muscle.volume(inner, state)
    air = gas.air(state, volume, ambient)
    pressure = gauge_pressure(air.pressure, ambient)
    pull = muscle.compute_force(pressure, inner, contraction, speed, state)
    rates = muscle.rates(state, pressure, pull.inner_speed)
    growth = muscle.geometry.volume_derivative(inner) * pull.inner_speed / muscle.geometry.resting_length
    growth = sum((rates[s.name] for s in muscle.wall.states), growth)
    return MuscleState(
        contraction, speed, volume, air, pressure, pull.tension, pull.friction, inner, pull.inner_speed, growth, state,
        rates,
    )  # fmt: skip
