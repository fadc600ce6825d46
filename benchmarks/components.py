"""Plants made of components, compared with the same equations written as one system."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from derivative import CALLS, make_calls
from filling import JOINT_PULSES, Run, runs
from joints import HEAT_CAPACITY, Joint, JointWithHeat
from measure import Section, Target, format_time, print_section, time_variants
from rodas4 import kernel

import airmuscle as am
from airmuscle.core import ops
from airmuscle.core.declaration import model, parameter
from airmuscle.core.ops import Value
from airmuscle.core.system import Input, StateVariable
from airmuscle.engine.compile.program import CompiledSystem, compile_system

RTOL = 1e-6
SIDE_NAMES = ("left", "right")
HEADER = (
    "states",
    "plant",
    "derivative",
    "25 s",
    "minimum",
    "steps",
    "one step",
    "ratio to single system",
)
TEXT = (
    "The joints of `joints.py`, whose equations are written as one system, and plants of the"
    " library's components: muscles, `WithTubes` with `Tube`, `Isothermal` or `EnergyBalance`; the"
    " mechanism and, for ten states, a valve with a first-order spool are defined in the benchmark."
    " Both have the same rates to rounding, which is checked; their steps differ slightly, because"
    " a plant has other nominal values. The ratio is that of the minimum times of one derivative,"
    " because other load can double some 50 ns. `ProportionalValve` has a second-order spool, so"
    " that two such valves give twelve states, for which there is no single system. Rodas4 at rtol"
    " 1e-6."
)
REASON = (
    "with half-open valves no branch saves time, and its cost depends on register allocation; with"
    " closed valves both take 40 ns"
)


@model
class Antagonists(am.Mechanism):
    """Antagonistic muscles on a lever with a weight: J a'' = r (F_1 - F_2) - b a' - M sin a."""

    inertia: float = parameter("kg m^2", "J", "moment of inertia")
    radius: float = parameter("m", "r", "lever arm of both muscles")
    friction: float = parameter("N m s/rad", "b", "viscous friction of the joint")
    load: float = parameter("N m", "M", "torque of the weight at 90 degrees")
    offset: float = parameter("1", "eps_0", "contraction of both muscles at angle zero")

    @property
    def coordinates(self) -> tuple[am.physics.Coordinate, ...]:
        return (am.physics.Coordinate("angle", "speed", "rad", 0.1, 1.0),)

    def contractions(
        self, q: Mapping[str, Value], resting_lengths: Sequence[Value]
    ) -> tuple[Value, ...]:
        left, right = resting_lengths
        return (
            self.offset + self.radius * q["angle"] / left,
            self.offset - self.radius * q["angle"] / right,
        )

    def acceleration(
        self,
        q: Mapping[str, Value],
        v: Mapping[str, Value],
        pulls: Mapping[str, Value],
        inputs: Mapping[str, Value],
    ) -> Mapping[str, Value]:
        torque = pulls["angle"] - self.friction * v["speed"] - self.load * ops.sin(q["angle"])
        return {"angle": torque / self.inertia}


@model
class LaggedValve(am.Circuit):
    """The servo valve of `JointWithHeat`: a spool that follows fill minus discharge as a
    first-order lag.
    """

    supply: am.Supply
    valve: am.Valve
    lag: float = parameter("s", "T_s", "time constant of the spool")

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("fill"), Input("discharge"))

    def own_states(self, ambient: am.Ambient) -> tuple[StateVariable, ...]:
        return (StateVariable("spool", "1", 1.0, "position of the spool"),)

    def supplied_flow(
        self,
        inlet: am.physics.Air,
        airs: tuple[am.physics.Air, ...],
        state: Mapping[str, Value],
        inputs: Mapping[str, Value],
        ambient: am.Ambient,
    ) -> am.physics.CircuitFlows:
        spool = state["spool"]
        incoming = am.physics.orifice_flow(self.valve, inlet, airs[0], ops.maximum(spool, 0.0))
        outgoing = am.physics.orifice_flow(
            self.valve, airs[0], am.physics.ambient_air(ambient), ops.maximum(-spool, 0.0)
        )
        moving = (inputs["fill"] - inputs["discharge"] - spool) / self.lag
        return am.physics.CircuitFlows(
            (incoming - outgoing,), incoming, outgoing, {"spool": moving}
        )


@model
class JointWithUpstreamHeat(JointWithHeat):
    """`JointWithHeat` with the upstream temperature in the flow of a tube, as the components
    have.
    """

    def _flows(
        self, side: str, state: Mapping[str, Any], pressure: Any, fill: Any, discharge: Any
    ) -> tuple[Any, Any]:
        incoming, _ = super()._flows(side, state, pressure, fill, discharge)
        wall = self.ambient.temperature
        in_tube = state[f"{side}.tube_mass"] * am.physics.GAS_CONSTANT * wall / self.tube_volume
        inside = state[f"{side}.energy"] / (state[f"{side}.air_mass"] * HEAT_CAPACITY)
        temperature = ops.where(in_tube >= pressure, wall, inside)
        return incoming, self.tube.mass_flow(in_tube, pressure, 1.0, temperature)


def component_plant(system: Joint) -> am.Plant:
    """A joint of `joints.py`, made of components."""
    muscles = tuple(dataclasses.replace(system.muscle, name=name) for name in SIDE_NAMES)
    mechanism = Antagonists(
        system.inertia, system.radius, system.friction, system.load, system.offset
    )
    tube = am.physics.Tube(system.tube, system.tube_volume)
    if isinstance(system, JointWithHeat):
        line = am.physics.WithTubes(
            LaggedValve(system.supply, system.valve, system.spool_lag), tube
        )
        return am.Plant(
            muscles,
            (line, line),
            mechanism,
            am.physics.EnergyBalance(system.heat_transfer),
            system.ambient,
        )
    line = am.physics.WithTubes(am.FillDischarge(system.supply, system.valve, system.valve), tube)
    return am.Plant(muscles, (line, line), mechanism, am.Isothermal(), system.ambient)


def with_proportional_valves(system: JointWithHeat) -> am.Plant:
    """The joint with heat transfer and a 5/3 proportional valve for each muscle: twelve states."""
    plant = component_plant(system)
    spool = am.physics.SecondOrderLag(1.0 / (2.0 * ops.pi * system.spool_lag))
    valve = am.physics.ProportionalValve(system.supply, system.valve, system.valve, spool)
    return dataclasses.replace(
        plant, circuit=(am.physics.WithTubes(valve, plant.circuits[0].tube),) * 2
    )


def written_name(name: str) -> str:
    """The name of a plant's state in the single system."""
    return name.replace("internal_energy", "energy").replace("tube.air_mass", "tube_mass")


def check_rates(
    single: CompiledSystem, composed: CompiledSystem, start: Mapping[str, float]
) -> float:
    """The maximum difference of the rates, relative to the maximum of each; raises AssertionError
    above 1e-12.
    """
    rng = np.random.default_rng(1)
    names = [s.name for s in single.system.states]
    order = [names.index(written_name(s.name)) for s in composed.system.states]
    y0 = np.array([start[name] for name in names])
    rates = []
    expected = []
    for _ in range(100):
        y = y0 * rng.uniform(0.8, 1.2, y0.size) + 0.1 * (y0 == 0) * rng.standard_normal(y0.size)
        u = rng.random(4)
        expected.append(single.rates(y, u)[order])
        rates.append(composed.rates(y[order], u))
    worst = float(
        (np.abs(np.array(rates) - expected).max(axis=0) / np.abs(expected).max(axis=0)).max()
    )
    if not worst < 1e-12:
        raise AssertionError(
            f"the rates of the components differ by {worst:.2g} from those of the single system"
        )
    return worst


def _spools() -> am.Schedule:
    """The pulses of the joints as spool commands: 1 to fill a side, -1 to discharge it."""
    changes_of = JOINT_PULSES.changes
    both = {
        side: [*changes_of[f"{side}.fill"], *((t, -v) for t, v in changes_of[f"{side}.discharge"])]
        for side in SIDE_NAMES
    }
    return am.Schedule(
        {f"{side}.command": tuple(sorted(changes)) for side, changes in both.items()}
    )


def _run(plant: am.Plant, single: Run, command: am.Schedule = JOINT_PULSES) -> Run:
    """The run of the single system, for a plant of components."""
    start = {s.name: single.initial_state.get(written_name(s.name), 0.0) for s in plant.states}
    return Run(plant, start, command, "angle", single.lever)


def pairs() -> tuple[tuple[Run, Run | None], ...]:
    """Runs of plants of components, each with the run of the equivalent single system, if there is
    one.
    """
    six = runs()[6]
    ten = runs()[10]
    heated = JointWithUpstreamHeat(
        **{f.name: getattr(ten.system, f.name) for f in dataclasses.fields(ten.system)}
    )
    return (
        (_run(component_plant(six.system), six), six),
        (_run(component_plant(heated), ten), dataclasses.replace(ten, system=heated)),
        (_run(with_proportional_valves(heated), ten, _spools()), None),
    )


def measure(
    composed: Run, single: Run | None, rounds: int
) -> tuple[tuple[tuple[str, ...], ...], tuple[Target, ...]]:
    """Rows and target of one pair."""
    both = {"components": composed} | ({"single system": single} if single else {})
    ready = {name: compile_system(run.system) for name, run in both.items()}
    if single:
        check_rates(ready["single system"], ready["components"], single.initial_state)
    derivatives = time_variants(
        {n: make_calls(ready[n], run.initial_state) for n, run in both.items()}, rounds
    )
    simulations = time_variants(
        {n: kernel(run, ready[n], am.Rodas4(RTOL)) for n, run in both.items()}, rounds
    )
    last = derivatives[list(both)[-1]].minimum
    rows = []
    size = len(composed.system.states)
    for name, run in both.items():
        steps = am.Rodas4(RTOL).run(ready[name], run.segments, 0.0, run.vector, run.times).steps
        cells = (
            derivatives[name].minimum / CALLS,
            simulations[name].median,
            simulations[name].minimum,
        )
        ratio = f"{derivatives[name].minimum / last:.3g}" if single else ""
        rows.append(
            (
                str(size),
                name,
                *map(format_time, cells),
                str(steps),
                format_time(simulations[name].median / steps),
                ratio,
            )
        )
    if not single:
        return tuple(rows), ()
    ratio = derivatives["components"].minimum / last
    return tuple(rows), (
        Target(
            f"{size} states: derivative of components / single system",
            ratio,
            1.1,
            "x",
            reason=REASON,
        ),
    )


def section(rounds: int = 15) -> Section:
    """The complete benchmark."""
    parts = [measure(*pair, rounds) for pair in pairs()]
    rows, targets = (
        tuple(x for part in column for x in part) for column in zip(*parts, strict=True)
    )
    return Section("Plants of components and single systems", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
