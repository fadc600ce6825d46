"""A plant put together from components against the same equations written out as one system: is there a price?"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from derivative import CALLS, calls
from filling import JOINT_PULSES, Run, runs
from joints import HEAT_CAPACITY, Joint, JointWithHeat
from measure import Bar, Section, interleaved, of_time, show
from rodas4 import kernel

from airmuscle.compile.program import CompiledSystem, compile_system
from airmuscle.control.inputs import Schedule
from airmuscle.core import ops
from airmuscle.core.declaration import model, parameter
from airmuscle.core.ops import Value
from airmuscle.core.variables import Input, StateVariable
from airmuscle.mechanism.base import Coordinate, Mechanism
from airmuscle.plant.plant import Plant
from airmuscle.pneumatics import Circuit, CircuitFlows, FillDischarge, ProportionalValve, Supply, Tube, Valve, WithTubes
from airmuscle.pneumatics.fill_discharge import ambient_air
from airmuscle.pneumatics.flow import orifice_flow
from airmuscle.pneumatics.gas import GAS_CONSTANT, Air, Ambient, EnergyBalance, Isothermal
from airmuscle.pneumatics.proportional import SecondOrderLag
from airmuscle.simulation.integrators import Rodas4

RTOL = 1e-6
SIDE_NAMES = ("left", "right")
HEADING = ("states", "plant", "derivative", "25 s", "least", "steps", "one step", "times written out")
TEXT = (
    "The joints of `joints.py`, whose equations are written out, beside plants of the library's components: muscles, "
    "`WithTubes` with `Tube`, `Isothermal` or `EnergyBalance`, with a mechanism and for ten states a valve with a lagging "
    "spool that are made here. Both have the same rates to rounding, which is checked; their steps differ a little, "
    "because a plant takes other nominal sizes. The ratio is that of one derivative, the least of its times on both "
    "sides: a neighbour on the same core doubles some 50 ns. `ProportionalValve` has a spool of second order, so that "
    "two such valves make twelve states; no system is written out for it. Rodas4 at rtol 1e-6."
)
WHY = (
    "half open, no branch around a valve saves anything, and what it costs depends on what is in registers there; with "
    "shut valves both take 40 ns"
)


@model
class Antagonists(Mechanism):
    """Two muscles that pull a lever with a weight to either side: J a'' = r (F_1 - F_2) - b a' - M sin a."""

    inertia: float = parameter("kg m^2", "J", "moment of inertia")
    radius: float = parameter("m", "r", "lever of both muscles")
    friction: float = parameter("N m s/rad", "b", "viscous friction of the joint")
    load: float = parameter("N m", "M", "torque of the weight at a right angle")
    offset: float = parameter("1", "eps_0", "contraction of both muscles at angle zero")

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("angle", "speed", "rad", 0.1, 1.0),)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        left, right = resting_lengths
        return self.offset + self.radius * q["angle"] / left, self.offset - self.radius * q["angle"] / right

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        torque = pulls["angle"] - self.friction * v["speed"] - self.load * ops.sin(q["angle"])
        return {"angle": torque / self.inertia}


@model
class LaggedValve(Circuit):
    """The servo valve of `JointWithHeat`: a spool that follows fill minus discharge with a lag of first order."""

    supply: Supply
    valve: Valve
    lag: float = parameter("s", "T_s", "time constant of the spool")

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("fill"), Input("discharge"))

    def own_states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        return (StateVariable("spool", "1", 1.0, "place of the spool"),)

    def supplied_flow(
        self, inlet: Air, airs: tuple[Air, ...], state: Mapping[str, Value], inputs: Mapping[str, Value],
        ambient: Ambient,
    ) -> CircuitFlows:  # fmt: skip
        spool = state["spool"]
        incoming = orifice_flow(self.valve, inlet, airs[0], ops.maximum(spool, 0.0))
        outgoing = orifice_flow(self.valve, airs[0], ambient_air(ambient), ops.maximum(-spool, 0.0))
        moving = (inputs["fill"] - inputs["discharge"] - spool) / self.lag
        return CircuitFlows((incoming - outgoing,), incoming, outgoing, {"spool": moving})


@model
class JointWithUpstreamHeat(JointWithHeat):
    """`JointWithHeat` with the flow of a tube at the temperature of the side that it comes from, as components have."""

    def _flows(self, side: str, state: Mapping[str, Any], pressure: Any, fill: Any, discharge: Any) -> tuple[Any, Any]:
        incoming, _ = super()._flows(side, state, pressure, fill, discharge)
        wall = self.ambient.temperature
        in_tube = state[f"{side}.tube_mass"] * GAS_CONSTANT * wall / self.tube_volume
        inside = state[f"{side}.energy"] / (state[f"{side}.air_mass"] * HEAT_CAPACITY)
        temperature = ops.where(in_tube >= pressure, wall, inside)
        return incoming, self.tube.mass_flow(in_tube, pressure, 1.0, temperature)


def of_components(system: Joint) -> Plant:
    """A joint of `joints.py`, put together from components."""
    muscles = tuple(dataclasses.replace(system.muscle, name=name) for name in SIDE_NAMES)
    mechanism = Antagonists(system.inertia, system.radius, system.friction, system.load, system.offset)
    tube = Tube(system.tube, system.tube_volume)
    if isinstance(system, JointWithHeat):
        line = WithTubes(LaggedValve(system.supply, system.valve, system.spool_lag), tube)
        return Plant(muscles, (line, line), mechanism, EnergyBalance(system.heat_transfer), system.ambient)
    line = WithTubes(FillDischarge(system.supply, system.valve, system.valve), tube)
    return Plant(muscles, (line, line), mechanism, Isothermal(), system.ambient)


def with_proportional_valves(system: JointWithHeat) -> Plant:
    """The joint with heat, a 5/3 proportional valve for each muscle: twelve states."""
    plant, spool = of_components(system), SecondOrderLag(1.0 / (2.0 * ops.pi * system.spool_lag))
    valve = ProportionalValve(system.supply, system.valve, system.valve, spool)
    return dataclasses.replace(plant, circuit=(WithTubes(valve, plant.circuits[0].tube),) * 2)


def as_written(name: str) -> str:
    """What a plant's state is called where it is written out."""
    return name.replace("internal_energy", "energy").replace("tube.air_mass", "tube_mass")


def refuse_other_rates(written: CompiledSystem, put_together: CompiledSystem, start: Mapping[str, float]) -> float:
    """The greatest difference of the two sets of rates, relative to each rate's greatest; raises above 1e-12."""
    rng, names = np.random.default_rng(1), [s.name for s in written.system.states]
    order = [names.index(as_written(s.name)) for s in put_together.system.states]
    y0 = np.array([start[name] for name in names])
    found, expected = [], []
    for _ in range(100):
        y, u = y0 * rng.uniform(0.8, 1.2, y0.size) + 0.1 * (y0 == 0) * rng.standard_normal(y0.size), rng.random(4)
        expected.append(written.rates(y, u)[order])
        found.append(put_together.rates(y[order], u))
    worst = float((np.abs(np.array(found) - expected).max(axis=0) / np.abs(expected).max(axis=0)).max())
    if not worst < 1e-12:
        raise AssertionError(f"the rates of the components differ by {worst:.2g} from those written out")
    return worst


def _spools() -> Schedule:
    """The pulses of the joints as places of a spool: 1 where a side is filled, -1 where it is discharged."""
    given = JOINT_PULSES.changes
    both = {side: [*given[f"{side}.fill"], *((t, -v) for t, v in given[f"{side}.discharge"])] for side in SIDE_NAMES}
    return Schedule({f"{side}.command": tuple(sorted(changes)) for side, changes in both.items()})


def _run(plant: Plant, written: Run, command: Schedule = JOINT_PULSES) -> Run:
    """The same run of a plant of components."""
    start = {s.name: written.start.get(as_written(s.name), 0.0) for s in plant.states}
    return Run(plant, start, command, "angle", written.lever)


def pairs() -> tuple[tuple[Run, Run | None], ...]:
    """RunSplit of plants of components, each with the same written out, where it is."""
    six, ten = runs()[6], runs()[10]
    heated = JointWithUpstreamHeat(**{f.name: getattr(ten.system, f.name) for f in dataclasses.fields(ten.system)})
    return (
        (_run(of_components(six.system), six), six),
        (_run(of_components(heated), ten), dataclasses.replace(ten, system=heated)),
        (_run(with_proportional_valves(heated), ten, _spools()), None),
    )


def measure(put_together: Run, written: Run | None, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Bar, ...]]:
    """Rows and the bar of one pair."""
    both = {"of components": put_together} | ({"written out": written} if written else {})
    ready = {name: compile_system(run.system) for name, run in both.items()}
    if written:
        refuse_other_rates(ready["written out"], ready["of components"], written.start)
    derivatives = interleaved({n: calls(ready[n], run.start) for n, run in both.items()}, rounds)
    whole = interleaved({n: kernel(run, ready[n], Rodas4(RTOL)) for n, run in both.items()}, rounds)
    last = derivatives[list(both)[-1]].least
    rows, size = [], len(put_together.system.states)
    for name, run in both.items():
        steps = Rodas4(RTOL).run(ready[name], run.segments, 0.0, run.vector, run.times).steps
        cells = (derivatives[name].least / CALLS, whole[name].median, whole[name].least)
        ratio = f"{derivatives[name].least / last:.3g}" if written else ""
        rows.append((str(size), name, *map(of_time, cells), str(steps), of_time(whole[name].median / steps), ratio))
    if not written:
        return tuple(rows), ()
    ratio = derivatives["of components"].least / last
    return tuple(rows), (Bar(f"{size} states: derivative of components / written out", ratio, 1.1, "x", why=WHY),)


def section(rounds: int = 15) -> Section:
    """All pairs."""
    parts = [measure(*pair, rounds) for pair in pairs()]
    rows, bars = (tuple(x for part in column for x in part) for column in zip(*parts, strict=True))
    return Section("A plant of components against one written out", TEXT, HEADING, rows, bars)


if __name__ == "__main__":
    show(section())
