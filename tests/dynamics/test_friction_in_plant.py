"""Friction in a plant: bristles are states by name, its work is in the books, and without it
nothing changes.

What a plant integrates is the law's own replay of the path it took, within the transition that the
law states.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle
from widths import widened

from airmuscle.core import model, nodes, parameter
from airmuscle.engine import DormandPrince8, Rodas4, Schedule, simulate
from airmuscle.engine.compile.functions import trace_system
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    BoucWen,
    Coordinate,
    Dahl,
    FillDischarge,
    HangingMass,
    IdentifiedFriction,
    LuGre,
    MaxwellSlip,
    Mechanism,
    NoFriction,
    Plant,
    Polytropic,
    PrandtlIshlinskii,
    PressureScaledFriction,
    Supply,
    Valve,
    WithEnergyMeters,
    find_equilibrium,
)

VALVE = Valve(3e-10, 0.433)
CIRCUIT = FillDischarge(Supply(548675.0), VALVE, VALVE)
SLIP = MaxwellSlip((4e4, 2e4, 1e4), (2e-4, 8e-4, 2e-3))
LAWS = [
    Dahl(5e4, 20.0),
    LuGre(5e4, 15.0, 5.0, 0.01, 50.0, 20.0),
    BoucWen(5e4, 20.0, 1.7, 0.8),
    SLIP,
    PrandtlIshlinskii((4e4, 2e4, 1e4), (2e-4, 8e-4, 2e-3), (8.0, -8.0), (0.5, -0.5)),
]
LOOPS = Schedule(
    {"fill": ((0.0, 1), (2.0, 0), (6.0, 1), (7.0, 0)), "discharge": ((3.0, 1), (5.0, 0))}
)


def name(law):
    return type(law).__name__


def plant_with(friction):
    return Plant(
        replace(chosen_muscle(), friction=friction), CIRCUIT, HangingMass(10.0), Polytropic(1.2)
    )


def loops_of(friction, duration=9.0, output=2e-3, method=None):
    """Fill, discharge and fill again, from rest at 150 kPa."""
    plant = plant_with(friction)
    start = find_equilibrium(plant, pressure=1.5e5)
    return simulate(
        plant,
        LOOPS,
        duration=duration,
        initial_state=start,
        output_times=output,
        integrator=method or Rodas4(1e-7),
    )


@model
class TwoPull(Mechanism):
    """A mass pulled at from both sides, so that one muscle lengthens as the other shortens."""

    mass: float = parameter("kg", "m", "mass", default=2.0)

    @property
    def coordinates(self):
        return (Coordinate("position", "speed", "m", 0.01, 0.1),)

    def contractions(self, q, resting_lengths):
        left, right = resting_lengths
        return 0.1 + q["position"] / left, 0.1 - q["position"] / right

    def acceleration(self, q, v, pulls, inputs):
        return {"position": pulls["position"] / self.mass}


def test_without_friction_a_plant_is_what_it_was():
    plant = plant_with(NoFriction())
    assert plant == Plant(chosen_muscle(), CIRCUIT, HangingMass(10.0), Polytropic(1.2))
    assert [s.name for s in plant.states] == ["air_mass", "position", "speed"]
    found = trace_system(plant)
    assert "friction" not in found.output_names
    muscle = chosen_muscle()
    p, c, v = map(nodes.symbol, "pcv")
    bare = (
        muscle.contractile_force(p, c)
        - muscle.spring.force(p, c, 0.2)
        - muscle.damper.force(p, c, v)
    )
    assert bare is muscle.unclamped_tension(p, c, v), "equal expressions are one node"


@pytest.mark.parametrize("friction", LAWS, ids=name)
def test_the_plant_integrates_the_law_s_own_replay_of_its_path(friction):
    run = loops_of(friction)
    assert np.ptp(run["position"]) > 0.004
    start = run["position"][0]
    path = np.concatenate([[start], run["position"]])
    replayed = friction.force_along(path, np.concatenate([[-1.0], run["time"]]))[1:]
    largest = np.abs(run["friction"]).max()
    slack = 0.05 if hasattr(friction, "transition") else 0.01
    assert largest > 10.0
    assert np.abs(run["friction"] - replayed).max() < slack * 1.6 * largest


def test_the_slips_of_a_plant_tend_to_the_exact_ones():
    worst = []
    for transition in (0.2, 0.02):
        friction = replace(SLIP, transition=transition)
        run = loops_of(friction)
        worst.append(np.abs(run["friction"] - friction.force_along(run["position"])).max())
    assert worst[1] < 0.3 * worst[0]
    assert worst[1] <= 0.02 * sum(k * d for k, d in zip(SLIP.stiffnesses, SLIP.limits, strict=True))


@pytest.mark.parametrize(
    "friction",
    widened(
        LAWS, lambda law: not isinstance(law, BoucWen | PrandtlIshlinskii)
    ),  # of the forms of Dahl and Maxwell slip
    ids=name,
)
def test_the_result_does_not_depend_on_method_and_tolerance(friction):
    runs = [
        loops_of(friction, 4.0, 0.1, method)
        for method in (Rodas4(1e-6), Rodas4(1e-9), DormandPrince8(1e-4))
    ]
    size = np.ptp(runs[1]["position"])
    for run in (runs[0], runs[2]):
        assert np.abs(run["position"] - runs[1]["position"]).max() < 1e-4 * size


def test_a_load_stands_lower_on_the_way_up_than_on_the_way_down():
    run = loops_of(SLIP)
    up = (run["time"] > 0.5) & (run["time"] < 2.0)
    down = (run["time"] > 4.5) & (run["time"] < 5.0)
    pressures = np.linspace(2.42e5, 2.58e5, 9)

    def height(rows):
        order = np.argsort(run["pressure"][rows])
        return np.interp(pressures, run["pressure"][rows][order], run["position"][rows][order])

    assert (height(down) - height(up) > 5e-3).all()


def test_the_books_close_and_friction_gives_nothing():
    """Mechanical: kinetic and potential energy grow by the work of the tension; friction keeps what
    it took.
    """
    metered = WithEnergyMeters(plant_with(SLIP))
    start = metered.extend_state(find_equilibrium(metered.plant, pressure=1.5e5))
    run = simulate(metered, LOOPS, duration=9.0, initial_state=start, integrator=Rodas4(1e-9))
    mechanical = run["kinetic_energy"] + run["potential_energy"]
    np.testing.assert_allclose(mechanical - mechanical[0], run["work_of_tension"], atol=1e-6)
    stored = sum(0.5 * k * run[f"bristle{i}"] ** 2 for i, k in enumerate(SLIP.stiffnesses, 1))
    heat = run["friction_work"] - stored
    assert (np.diff(heat) >= -1e-8).all()
    assert heat[-1] > 0.1
    assert "friction_work" not in [
        m.name for m in WithEnergyMeters(plant_with(NoFriction())).meters
    ]


def test_bristles_carry_the_name_of_their_muscle():
    left = replace(chosen_muscle(), name="left", friction=SLIP)
    right = replace(chosen_muscle(), name="right", friction=Dahl(5e4, 20.0))
    plant = Plant((left, right), (CIRCUIT, CIRCUIT), TwoPull(), Polytropic(1.2))
    by_name = {s.name: s for s in plant.states}
    assert list(by_name)[4:] == ["left.bristle1", "left.bristle2", "left.bristle3", "right.bristle"]
    assert (by_name["left.bristle2"].unit, by_name["left.bristle2"].nominal) == ("m", 8e-4)
    start = plant.state_at(pressure=(2e5, 2e5))
    assert [start[n] for n in list(by_name)[4:]] == [0.0] * 4
    command = Schedule({"left.fill": ((0.0, 1.0), (0.8, 0.0))})
    run = simulate(plant, command, duration=1.0, initial_state=start)
    assert np.abs(run["left.friction"]).max() > 1.0
    assert np.sign(run["left.friction"][10]) == -np.sign(run["right.friction"][10])
    assert any(
        note.startswith("friction of the muscles: left MaxwellSlip(") and "right Dahl(" in note
        for note in run.notes
    )


def test_a_run_says_which_friction_was_on():
    assert (
        "friction of the muscles: Dahl(stiffness=50000, coulomb_force=20)"
        in loops_of(Dahl(5e4, 20.0), 0.1).notes
    )
    assert "friction of the muscles: off" in loops_of(NoFriction(), 0.1).notes


def test_a_state_may_begin_with_bent_bristles_and_refuses_unknown_ones():
    plant = plant_with(Dahl(5e4, 20.0))
    assert plant.state_at(pressure=1e5, bristle=2e-4)["bristle"] == 2e-4
    with pytest.raises(
        ParameterError, match="no coordinate 'bristle1'; there are position, speed, bristle"
    ):
        plant.state_at(pressure=1e5, bristle1=2e-4)


def test_friction_acts_against_the_tension_and_a_muscle_still_never_pushes():
    muscle = replace(chosen_muscle(), friction=Dahl(5e4, 20.0))
    bare = chosen_muscle().tension(3e5, 0.05)
    assert muscle.tension(3e5, 0.05) == bare
    assert muscle.tension(3e5, 0.05, 0.0, {"bristle": 4e-4}) == pytest.approx(bare - 20.0)
    assert muscle.tension(0.0, 0.05, 0.0, {"bristle": 4e-4}) == 0.0


def test_the_friction_of_a_plant_is_the_law_s_own_times_the_scale_at_its_pressure():
    law = Dahl(5e4, 20.0)
    scaled = PressureScaledFriction(law, 0.2, 3e5)
    run = loops_of(scaled)
    replayed = law.force_along(run["position"])
    expected = (0.2 + 0.8 * run["pressure"] / 3e5) * replayed
    assert np.ptp(run["pressure"]) > 1e5
    assert np.abs(run["friction"] - expected).max() < 0.02 * np.abs(expected).max()


def test_a_run_says_that_it_left_the_pressure_and_the_speed_of_the_data_of_its_friction():
    run = loops_of(IdentifiedFriction(Dahl(5e4, 20.0), 1.6e5, 1.7e5, 1e-4), 4.0)
    notes = [note for note in run.notes if "the range of the data of its friction" in note]
    assert len(notes) == 2
    assert "in pressure (160 to 170 kPa)" in notes[0]
    assert "in speed (-0.0001 to 0.0001 m/s)" in notes[1]
    np.testing.assert_allclose(run["shortening_speed"], run["speed"], atol=1e-12)
    inside = loops_of(IdentifiedFriction(Dahl(5e4, 20.0), 0.0, 1e6, 10.0), 4.0)
    assert not any("its friction" in note for note in inside.notes)
    assert "shortening_speed" not in loops_of(Dahl(5e4, 20.0), 0.1).columns
