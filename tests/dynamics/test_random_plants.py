"""Parts put together at random: every plant runs through, or says which muscle its load tore out of its reach.

Muscles with any elements, circuits with any valves, tubes, leaks, tanks and vacuum, mechanisms for one muscle or two,
commands at random instants. No number is NaN, steps are bounded, and the books of air mass, of the air's energy and of
the mechanism close. The bounds are chosen: ten times what was found in sixty draws.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.control.inputs import Schedule
from airmuscle.friction import Dahl, LuGre, MaxwellSlip, NoFriction
from airmuscle.mechanism import (
    AntagonisticJoint,
    HangingMass,
    Isometric,
    Isotonic,
    Lever,
    MusclesInSeries,
    Pulley,
    SpringLoad,
    WithEndStops,
    WithOffsets,
)
from airmuscle.mechanism.contact import HuntCrossley
from airmuscle.muscle import (
    CreepElements,
    CubicSpring,
    DirectionalDamper,
    EndStop,
    LinearDamper,
    PressureDamper,
    RigidSeriesElement,
    SeriesSpring,
    ViscoelasticWall,
)
from airmuscle.plant.energy_balance import WithEnergyMeters
from airmuscle.plant.plant import Plant
from airmuscle.pneumatics import (
    CheckValve,
    ClosedChamber,
    DistributedTube,
    FillDischarge,
    Manifold,
    ProportionalRegulator,
    ProportionalValve,
    RegulatedSupply,
    SecondOrderLag,
    SharedSupply,
    SubsonicIndexValve,
    Supply,
    Tank,
    ThreePositionValve,
    Tube,
    Valve,
    WithLeak,
    WithTubes,
)
from airmuscle.pneumatics.gas import EnergyBalance, Isothermal, Polytropic
from airmuscle.simulation import simulate

MOST_STEPS = 20_000


class Drawer:
    """Draws parts, each with numbers of its own."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def one_of(self, *things):
        return things[self.rng.integers(len(things))]

    def about(self, value, factor=3.0):
        return float(value * factor ** self.rng.uniform(-1, 1))

    def gas(self):
        return self.one_of(Isothermal(), Polytropic(1.2), EnergyBalance(0.0), EnergyBalance(self.about(0.3)))

    def muscle(self, name):
        about, sometimes = self.about, lambda: self.rng.random() < 0.3
        series = self.one_of(RigidSeriesElement(), RigidSeriesElement(), SeriesSpring(about(3e4)))
        frictions = [NoFriction(), Dahl(about(3e4), about(15.0)), MaxwellSlip((about(2e4), about(2e4)), (2e-4, 1e-3))]
        if isinstance(series, RigidSeriesElement):
            frictions.append(LuGre(about(4e4), about(15.0), 5.0, 0.01, 50.0, 20.0))
        dampers = (
            LinearDamper(about(150.0)), PressureDamper(about(150.0), 2e-4),
            DirectionalDamper(about(200.0), about(100.0), 2e-4, 1e-4),
        )  # fmt: skip
        parts = {"damper": self.one_of(*dampers), "friction": self.one_of(*frictions), "series": series}
        for field, part in (
            ("stop", EndStop(self.rng.uniform(0.05, 0.15), HuntCrossley(about(3e8)))),
            ("creep", CreepElements((about(3e3),), (about(0.3),))),
            ("wall", ViscoelasticWall(about(1e-11), about(0.03))),
            ("spring", CubicSpring(about(1e3), 20.0)),
        ):
            if sometimes():
                parts[field] = part
        return replace(chosen_muscle(), name=name, **parts)

    def valve(self):
        conductance = self.about(5e-9, 10.0)
        return self.one_of(
            Valve(conductance, self.rng.uniform(0.0, 0.6)),
            SubsonicIndexValve(conductance, 0.3, self.rng.uniform(0.4, 0.7), self.one_of(0.0, 2e4)),
            CheckValve(Valve(conductance, 0.3)),
        )

    def supply(self):
        plain = Supply(self.one_of(8e5, 6e5, 2e5, 0.0, -0.9e5))
        tank, regulated = Tank(plain, self.valve(), 1e-3, self.gas()), RegulatedSupply(plain, self.valve(), 3e5)
        return self.one_of(plain, plain, plain, tank, regulated)

    def circuit(self, supply, muscles=1):
        first, second, spool = self.valve(), self.valve(), SecondOrderLag(self.about(40.0))
        if muscles == 2:
            return self.around(ProportionalValve(supply, first, second, spool, 0.02, 2))
        return self.around(
            self.one_of(
                FillDischarge(supply, first, second),
                ThreePositionValve(supply, first, second),
                ProportionalValve(supply, first, second, spool, self.rng.uniform(-0.1, 0.1)),
                ProportionalRegulator(supply, first, second, spool),
                FillDischarge(supply, first, second) if isinstance(supply, SharedSupply) else ClosedChamber(),
            )
        )

    def around(self, circuit):
        orifice, pieces = Valve(self.about(2e-8), self.rng.uniform(0.0, 0.5)), int(self.rng.integers(1, 4))
        lumped = Tube(orifice, self.about(5e-6), pieces, self.gas())
        tube = self.one_of(
            lumped, DistributedTube(self.about(0.5), 3e-3, pieces, self.one_of(Isothermal(), EnergyBalance(0.0)))
        )
        circuit = WithTubes(circuit, tube) if self.rng.random() < 0.4 else circuit
        return WithLeak(circuit, Valve(self.about(1e-10, 10.0), 0.3)) if self.rng.random() < 0.3 else circuit

    def plant(self):
        about = self.about
        if self.rng.random() < 0.6:
            stop = HuntCrossley(1e7)
            mechanism = self.one_of(
                HangingMass(about(10.0)), SpringLoad(about(5.0), 1e3, 5.0, 40.0), Isotonic(about(80.0), 2.0, 30.0),
                Isometric(self.rng.uniform(-0.03, 0.15)), Pulley(0.04, about(10.0), 0.5, 0.02, 20.0),
                Lever((0.05,), 2.0, 0.3, 0.01, 0.3, (0.1,)), WithEndStops(HangingMass(about(15.0)), -0.005, 0.03, stop),
            )  # fmt: skip
            return Plant(self.muscle("muscle"), self.circuit(self.supply()), mechanism, self.gas())
        mechanism = self.one_of(
            AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.08), WithOffsets(HangingMass(about(20.0)), (0.0, 0.03)),
            Lever((0.05, -0.05), 2.0, 0.3, 0.01, 0.3, (0.1, 0.1)), MusclesInSeries(HangingMass(about(8.0)), (0.3,), 15.0),
        )  # fmt: skip
        circuits = self.one_of(
            (self.circuit(self.supply()), self.circuit(self.supply())),
            self.circuit(self.supply(), 2),
            Manifold(self.supply(), (self.circuit(SharedSupply()), self.circuit(SharedSupply())), ("left", "right")),
        )
        return Plant((self.muscle("left"), self.muscle("right")), circuits, mechanism, self.gas())

    def command(self, plant):
        changes = {}
        for given in plant.input_variables:
            instants = np.cumsum(self.rng.uniform(0.02, 0.3, 5))
            levels = self.rng.uniform(given.minimum, min(given.maximum, 4e5), 5)
            levels = np.round(levels) if given.maximum <= 1.0 and self.rng.random() < 0.7 else levels
            changes[given.name] = tuple(zip(instants.tolist(), levels.tolist(), strict=True))
        return Schedule(changes)


def gaps(run):
    """What is missing in each book at its worst, as a share of what was held or turned over."""
    mechanical = run["kinetic_energy"] + run["potential_energy"]
    turned = sum(np.abs(np.diff(column)).sum() for column in (mechanical, run["work_of_tension"]))
    books = {
        "mass": (run["air_total"], run["air_supplied"] - run["air_exhausted"], run["air_total"].max()),
        "air": (run["air_energy"], run["energy_of_flow"] + run["heat_to_air"] - run["work_of_air"], run["air_energy"].max()),
        "mechanical": (mechanical, run["work_of_tension"] - run["mechanism_loss"], turned + 1e-3),
    }  # fmt: skip
    return {name: np.abs(held - held[0] - brought).max() / size for name, (held, brought, size) in books.items()}


def judged(seed):
    drawer = Drawer(seed)
    plant = drawer.plant()
    command = drawer.command(plant)
    metered = WithEnergyMeters(plant)
    start = metered.extend_state(plant.state_at(pressure=drawer.one_of(0.0, 1e5, 3e5)))
    run = simulate(metered, command, duration=1.5, initial_state=start, output_times=5e-3, complete=False)
    for name in run:
        assert np.isfinite(run[name]).all(), name
    counts = run.notes[0].split(": ")[1].split()
    assert int(counts[0]) + int(counts[2]) < MOST_STEPS
    found = gaps(run)
    assert found["mass"] < 1e-13
    assert found["air"] < 1e-5
    assert found["mechanical"] < 1e-4
    if run["time"][-1] < 1.5:  # the plant itself says why
        torn = simulate(
            plant, command, duration=1.5, initial_state={s.name: start[s.name] for s in plant.states}, complete=False
        )
        assert any("its geometry" in note for note in torn.notes), torn.notes


@pytest.mark.parametrize("seed", range(6))
def test_a_plant_of_parts_drawn_at_random_runs_and_its_books_close(seed):
    judged(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 160))
def test_so_do_sixty_others(seed):
    judged(seed)
