"""Systems with six and ten states for tests and benchmarks: a joint with two antagonistic muscles
and tubes.

Both are written like a user-defined system: a frozen model with states, inputs, rates and outputs.
Values are chosen; no paper prints them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import airmuscle as am
from airmuscle.core import ops
from airmuscle.core.declaration import model, parameter
from airmuscle.core.system import StateVariable, System

HEAT_CAPACITY = am.physics.GAS_CONSTANT / 0.4
"""Specific heat of air at constant volume [J/(kg K)], for a heat capacity ratio of 1.4."""
SIDES = (("left", 1.0), ("right", -1.0))


def chosen_muscle() -> am.Muscle:
    """A braided muscle of diameter 20 mm and length 200 mm with limited force, spring and
    damper.
    """
    braid = am.geometry.Braid(0.01, 0.4363, 0.2)
    return am.Muscle(
        am.characteristic.Clamped(am.characteristic.VirtualWork(braid), 0.0, 1200.0),
        braid,
        am.LinearSpring(3000.0),
        am.LinearDamper(150.0),
    )


@model
class Joint(System):
    """Six states: angle, angular speed, and the air masses of each muscle and its tube;
    isothermal.
    """

    muscle: am.Muscle
    valve: am.Valve
    tube: am.Valve
    supply: am.Supply
    ambient: am.Ambient = am.Ambient()
    tube_volume: float = parameter("m3", "V_t", "volume of a tube", default=2e-5)
    inertia: float = parameter("kg m^2", "J", "moment of inertia", default=0.05)
    radius: float = parameter("m", "r", "lever arm of both muscles", default=0.03)
    friction: float = parameter("N m s/rad", "b", "viscous friction of the joint", default=0.2)
    load: float = parameter("N m", "M", "torque of the weight at 90 degrees", default=2.0)
    offset: float = parameter(
        "1", "eps_0", "contraction of both muscles at angle zero", default=0.12
    )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Angle, speed, then the states of each side."""
        joint = (StateVariable("angle", "rad", 0.1), StateVariable("speed", "rad/s", 1.0))
        return joint + tuple(s for side, _ in SIDES for s in self.side_states(side))

    def side_states(self, side: str) -> tuple[StateVariable, ...]:
        """The states of one muscle and its tube."""
        return (
            StateVariable(f"{side}.air_mass", "kg", 1e-4),
            StateVariable(f"{side}.tube_mass", "kg", 2e-5),
        )

    @property
    def inputs(self) -> tuple[str, ...]:
        """Openings to the supply and to ambient pressure on each side."""
        return tuple(f"{side}.{name}" for side, _ in SIDES for name in ("fill", "discharge"))

    def rates(self, state: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Equation of motion of the joint, and mass balances of each side."""
        rates: dict[str, Any] = {"angle": state["speed"]}
        torque = -self.friction * state["speed"] - self.load * ops.sin(state["angle"])
        for side, sign in SIDES:
            tension, balances = self.side_rates(side, sign, state, inputs)
            torque = torque + sign * self.radius * tension
            rates |= balances
        return {**rates, "speed": torque / self.inertia}

    def side_rates(
        self, side: str, sign: float, state: Mapping[str, Any], inputs: Mapping[str, Any]
    ) -> Any:
        """Tension [N] of one muscle, and the rates of its states."""
        contraction, speed = self._motion(sign, state)
        temperature = self.ambient.temperature
        pressure = (
            state[f"{side}.air_mass"]
            * am.physics.GAS_CONSTANT
            * temperature
            / self.muscle.geometry.volume(contraction)
        )
        incoming, through = self._flows(
            side, state, pressure, inputs[f"{side}.fill"], inputs[f"{side}.discharge"]
        )
        tension = self.muscle.tension(
            am.physics.gauge_pressure(pressure, self.ambient), contraction, speed
        )
        return tension, {f"{side}.air_mass": through, f"{side}.tube_mass": incoming - through}

    def _motion(self, sign: float, state: Mapping[str, Any]) -> tuple[Any, Any]:
        length = self.muscle.geometry.resting_length
        return (
            self.offset + sign * self.radius * state["angle"] / length,
            sign * self.radius * state["speed"],
        )

    def _flows(
        self, side: str, state: Mapping[str, Any], pressure: Any, fill: Any, discharge: Any
    ) -> tuple[Any, Any]:
        temperature = self.ambient.temperature
        in_tube = (
            state[f"{side}.tube_mass"] * am.physics.GAS_CONSTANT * temperature / self.tube_volume
        )
        source = am.physics.absolute_pressure(self.supply.pressure, self.ambient)
        incoming = self.valve.mass_flow(source, in_tube, fill, temperature)
        outgoing = self.valve.mass_flow(in_tube, self.ambient.pressure, discharge, temperature)
        return incoming - outgoing, self.tube.mass_flow(in_tube, pressure, 1.0, temperature)

    def outputs(self, state: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Tension of each muscle [N]."""
        return {
            f"{side}.force": self.side_rates(side, sign, state, inputs)[0] for side, sign in SIDES
        }


@model
class JointWithHeat(Joint):
    """Ten states: those of Joint, and on each side the internal energy of the air and the spool of
    a servo valve.
    """

    heat_transfer: float = parameter("W/K", "hA", "heat transfer to the wall", default=1.0)
    spool_lag: float = parameter("s", "T_s", "time constant of the spool", default=0.005)

    def side_states(self, side: str) -> tuple[StateVariable, ...]:
        more = (
            StateVariable(f"{side}.energy", "J", 20.0),
            StateVariable(f"{side}.spool", "1", 1.0),
        )
        return (*super().side_states(side), *more)

    def side_rates(
        self, side: str, sign: float, state: Mapping[str, Any], inputs: Mapping[str, Any]
    ) -> Any:
        contraction, speed = self._motion(sign, state)
        volume = self.muscle.geometry.volume(contraction)
        growth = (
            self.muscle.geometry.volume_derivative(contraction)
            * speed
            / self.muscle.geometry.resting_length
        )
        mass, energy, spool = (state[f"{side}.{name}"] for name in ("air_mass", "energy", "spool"))
        temperature = energy / (mass * HEAT_CAPACITY)
        pressure = mass * am.physics.GAS_CONSTANT * temperature / volume
        opened = ops.maximum(spool, 0.0), ops.maximum(-spool, 0.0)
        incoming, through = self._flows(side, state, pressure, *opened)
        wall = self.ambient.temperature
        energy_flow = (
            (HEAT_CAPACITY + am.physics.GAS_CONSTANT)
            * through
            * ops.where(through >= 0, wall, temperature)
        )
        heat = self.heat_transfer * (wall - temperature)
        tension = self.muscle.tension(
            am.physics.gauge_pressure(pressure, self.ambient), contraction, speed
        )
        return tension, {
            f"{side}.air_mass": through,
            f"{side}.tube_mass": incoming - through,
            f"{side}.energy": energy_flow - pressure * growth + heat,
            f"{side}.spool": (
                (inputs[f"{side}.fill"] - inputs[f"{side}.discharge"] - spool) / self.spool_lag
            ),
        }


def joint(heat: bool = False) -> Joint:
    """The joint with six states, or with ten states including heat transfer and spools."""
    valve = am.Valve(2.6e-8, 0.433)
    tube = am.Valve(4e-8, 0.433)
    return (JointWithHeat if heat else Joint)(chosen_muscle(), valve, tube, am.Supply(6e5))


def joint_start(system: Joint, pressure: float = 2e5) -> dict[str, float]:
    """The state at angle and speed zero, with muscles and tubes at a gauge pressure [Pa] and
    ambient temperature.
    """
    per_volume = am.physics.absolute_pressure(pressure, system.ambient) / (
        am.physics.GAS_CONSTANT * system.ambient.temperature
    )
    mass = float(per_volume * system.muscle.geometry.volume(system.offset))
    start = {"angle": 0.0, "speed": 0.0}
    for side, _ in SIDES:
        start |= {
            f"{side}.air_mass": mass,
            f"{side}.tube_mass": float(per_volume * system.tube_volume),
        }
        if isinstance(system, JointWithHeat):
            start |= {
                f"{side}.energy": mass * HEAT_CAPACITY * system.ambient.temperature,
                f"{side}.spool": 0.0,
            }
    return start
