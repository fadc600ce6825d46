"""Supplies, proportional valves, regulators, manifolds: each law alone, and the balances that all
must keep.

Mass: what a circuit draws goes into muscles, into its own volumes or to the surroundings. Energy,
with every gas by its first law and no heat: the enthalpy drawn does the same.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.engine import ZERO_INPUT, Rodas4, Schedule, simulate
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    GAS_CONSTANT,
    Air,
    Ambient,
    CheckValve,
    ClosedChamber,
    DistributedTube,
    EnergyBalance,
    FillDischarge,
    Flow,
    HangingMass,
    Isometric,
    Isothermal,
    Manifold,
    Plant,
    PressureRegulator,
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
    WithEnergyMeters,
    WithLeak,
    WithTubes,
    orifice_flow,
)
from airmuscle.physics.pneumatics import NO_FLOW

AMBIENT = Ambient()
VALVE, WIDE, NARROW = Valve(1e-8, 0.4), Valve(5e-8, 0.4), Valve(2e-9, 0.3)
HELD = Isometric(0.05)
ADIABATIC = EnergyBalance(0.0)
SPOOL = SecondOrderLag(20.0, 0.7)


def tube(pieces=1):
    return Tube(WIDE, 2e-5, pieces, ADIABATIC)


def tank(gas=ADIABATIC):
    return Tank(Supply(6e5), NARROW, 2e-3, gas)


def plant(circuit, gas=ADIABATIC, count=1, mechanism=HELD):
    muscles = tuple(replace(chosen_muscle(), name=f"m{i}") for i in range(count))
    return Plant(muscles if count > 1 else muscles[0], circuit, mechanism, gas)


CIRCUITS = {
    "two valves": plant(FillDischarge(Supply(5e5), VALVE, NARROW)),
    "check and index": plant(
        FillDischarge(Supply(5e5), CheckValve(VALVE), SubsonicIndexValve(1e-8, 0.3, 0.6, 2e4))
    ),
    "three positions on a tank": plant(ThreePositionValve(tank(), VALVE, NARROW)),
    "regulated supply on a tank": plant(
        FillDischarge(RegulatedSupply(tank(), WIDE, 4e5, gas=ADIABATIC), VALVE, NARROW)
    ),
    "tube": plant(WithTubes(FillDischarge(tank(), VALVE, NARROW), tube(3))),
    "tube with inertia": plant(
        WithTubes(FillDischarge(tank(), VALVE, NARROW), DistributedTube(1.0, 4e-3, 3, ADIABATIC))
    ),
    "proportional valve for two": plant(
        ProportionalValve(tank(), VALVE, NARROW, SPOOL, -0.1, 2), count=2
    ),
    "regulator through a leaking tube": plant(
        WithLeak(WithTubes(ProportionalRegulator(tank(), VALVE, VALVE, SPOOL), tube()), NARROW)
    ),
    "pressure regulators on one tank": plant(
        Manifold(
            tank(),
            (
                PressureRegulator(SharedSupply(), VALVE, NARROW, 1e5, 0.05, 0.2),
                PressureRegulator(SharedSupply(), NARROW, VALVE, 5e4, 0.03, 0.1, leak=0.05),
            ),
            ("one", "two"),
        ),
        count=2,
    ),
    "manifold": plant(
        Manifold(
            tank(),
            (
                WithTubes(ProportionalValve(SharedSupply(), VALVE, VALVE, SPOOL, 0.1, 2), tube()),
                WithLeak(FillDischarge(SharedSupply(), VALVE, VALVE), NARROW),
                ClosedChamber(SharedSupply()),
            ),
            ("arm", "hand", "spare"),
        ),
        count=4,
    ),
}

LEAKING = {
    "pressure regulators on one tank",
    "proportional valve for two",
    "regulator through a leaking tube",
    "manifold",
}


def shaken(system, seed):
    """A state and inputs away from rest: every pressure, temperature, flow and spool somewhere
    else.
    """
    rng = np.random.default_rng(seed)
    start = system.state_at(pressure=2e5)
    state = {}
    for s in system.states:
        swing = rng.uniform(-0.3, 0.3)
        state[s.name] = start[s.name] * (1 + swing) if start[s.name] else s.nominal * 2 * swing
    inputs = {i.name: rng.uniform(i.minimum, min(i.maximum, 6e5)) for i in system.input_variables}
    return state, inputs


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize("seed", range(4))
def test_no_air_and_no_enthalpy_is_lost_or_made(name, seed):
    system = CIRCUITS[name]
    state, inputs = shaken(system, seed)
    rates = system.rates(state, inputs)
    done = system.circuit_flows(system.muscle_states(state), state, inputs)
    for ending, part in (("air_mass", "mass"), ("internal_energy", "enthalpy")):
        held = [float(rates[s.name]) for s in system.states if s.name.endswith(ending)]
        drawn = sum(float(getattr(r.drawn, part)) for r in done)
        lost = sum(float(getattr(r.exhausted, part)) for r in done)
        assert math.fsum(held) == pytest.approx(
            drawn - lost, abs=1e-12 * max(np.abs([*held, drawn, lost]))
        )
        assert max(np.abs(held)) > 0


@pytest.mark.parametrize("name", sorted(set(CIRCUITS) - LEAKING))
def test_a_settled_circuit_with_everything_shut_stays_as_it_is(name):
    system = CIRCUITS[name]
    rates = system.rates(
        system.state_at(pressure=2e5), {i.name: 0.0 for i in system.input_variables}
    )
    assert [s.name for s in system.states if abs(float(rates[s.name])) > 1e-9 * s.nominal] == []


# Proportional valve


def spool_course(overlap=0.0, follower=SPOOL, to=0.6, duration=0.3):
    valve = ProportionalValve(Supply(6e5), VALVE, NARROW, follower, overlap)
    system = plant(valve, Isothermal())
    start = system.state_at(pressure=2e5)
    command = Schedule({"command": ((0.0, to),)})
    return system, simulate(
        system,
        command,
        duration=duration,
        initial_state=start,
        integrator=Rodas4(1e-9),
        output_times=1e-3,
    )


@pytest.mark.parametrize("damping", [0.2, 0.7, 1.0, 3.0])
def test_a_spool_follows_its_command_as_a_second_order_lag(damping):
    from scipy.signal import step

    follower = SecondOrderLag(20.0, damping)
    _, run = spool_course(follower=follower)
    w = 2 * np.pi * 20.0
    _, expected = step(([w**2], [1, 2 * damping * w, w**2]), T=run["time"])
    np.testing.assert_allclose(run["spool"], 0.6 * expected, atol=1e-7)


@pytest.mark.parametrize(
    ("place", "fill", "discharge"),
    [
        (0.2, 0.0, 0.0),
        (-0.2, 0.0, 0.0),
        (0.6, 0.5, 0.0),
        (-0.6, 0.0, 0.5),
        (1.0, 1.0, 0.0),
        (1.3, 1.0, 0.0),
    ],
)
def test_overlap_is_a_dead_zone_and_the_edges_have_areas_of_their_own(place, fill, discharge):
    """Overlap 0.2: nothing flows up to 0.2 of the stroke, then the opening rises linearly to 1 at
    its end.
    """
    circuit = ProportionalValve(Supply(6e5), VALVE, NARROW, SPOOL, 0.2)
    system = plant(circuit, Isothermal())
    start = system.state_at(pressure=2e5) | {"spool": place}
    (done,) = system.circuit_flows(system.muscle_states(start), start, {"command": 0.0})
    temperature = AMBIENT.temperature
    inside = 2e5 + AMBIENT.pressure
    into = fill * VALVE.mass_flow(6e5 + AMBIENT.pressure, inside, 1.0, temperature)
    out = discharge * NARROW.mass_flow(inside, AMBIENT.pressure, 1.0, temperature)
    assert done.flows[0].mass == pytest.approx(into - out, rel=1e-12, abs=1e-18)
    assert (done.drawn.mass, done.exhausted.mass) == pytest.approx(
        (into, out), rel=1e-12, abs=1e-18
    )


def test_underlap_leaks_in_the_middle():
    circuit = ProportionalValve(Supply(6e5), VALVE, VALVE, SPOOL, -0.2)
    system = plant(circuit)
    start = system.state_at(pressure=2e5)
    (done,) = system.circuit_flows(system.muscle_states(start), start, {"command": 0.0})
    assert done.drawn.mass > 0
    assert done.exhausted.mass > 0


def test_the_second_port_does_the_opposite():
    circuit = ProportionalValve(Supply(6e5), VALVE, NARROW, SPOOL, 0.1, 2)
    system = plant(circuit, Isothermal(), count=2)
    start = system.state_at(pressure=2e5) | {"spool": 0.5}
    (done,) = system.circuit_flows(system.muscle_states(start), start, {"command": 0.0})
    mirrored = system.circuit_flows(
        system.muscle_states(start), start | {"spool": -0.5}, {"command": 0.0}
    )[0]
    assert done.flows[0].mass == mirrored.flows[1].mass > 0
    assert done.flows[1].mass == mirrored.flows[0].mass < 0


# Proportional regulator


def test_a_regulator_reaches_its_set_point_up_and_down_and_no_faster_than_its_orifice():
    circuit = ProportionalRegulator(Supply(7e5), VALVE, VALVE, SecondOrderLag(50.0))
    system = plant(circuit, Isothermal())
    start = system.state_at(pressure=1e5)
    command = Schedule({"setpoint": ((0.0, 1e5), (0.1, 4e5), (1.2, 1.5e5))})
    run = simulate(system, command, duration=3.0, initial_state=start, integrator=Rodas4(1e-8))
    up = run["time"] < 1.2
    down = run["time"] >= 1.2
    assert run["pressure"][up][-1] == pytest.approx(4e5, abs=200.0)
    assert run["pressure"][-1] == pytest.approx(1.5e5, abs=200.0)
    assert run["pressure"].max() < 4e5 + 100.0
    choked = VALVE.mass_flow(7e5 + AMBIENT.pressure, AMBIENT.pressure, 1.0, AMBIENT.temperature)
    assert run["mass_flow"].max() == pytest.approx(
        choked, rel=1e-6
    )  # far from the set point it is fully open
    assert (np.diff(run["pressure"][down]) <= 1.0).all()


def test_a_regulator_with_a_leak_stays_below_its_set_point_within_its_band():
    circuit = WithLeak(
        ProportionalRegulator(Supply(7e5), VALVE, VALVE, SecondOrderLag(50.0), 2e4),
        Valve(3e-9, 0.4),
    )
    system = plant(circuit, Isothermal())
    command = Schedule({"setpoint": ((0.0, 3e5),)})
    run = simulate(system, command, duration=4.0, initial_state=system.state_at(pressure=0.0))
    assert 3e5 - 2e4 < run["pressure"][-1] < 3e5 - 1e3


def test_a_set_point_beyond_the_range_is_refused():
    system = plant(ProportionalRegulator(Supply(7e5), VALVE, VALVE, SecondOrderLag(50.0)))
    with pytest.raises(ParameterError, match=r"setpoint.*allowed range: 0 to 1e\+06 Pa"):
        simulate(system, Schedule({"setpoint": ((0.0, 2e6),)}), duration=1.0)


# Supplies


def test_a_tank_sags_while_air_is_drawn_and_recovers():
    system = plant(
        FillDischarge(Tank(Supply(6e5), Valve(3e-10, 0.4), 5e-4), VALVE, VALVE), Isothermal()
    )
    start = system.state_at(pressure=0.0)
    run = simulate(
        system, Schedule({"fill": ((0.5, 1), (1.5, 0))}), duration=40.0, initial_state=start
    )
    tank_pressure = run["supply.air_mass"] * 287.05 * AMBIENT.temperature / 5e-4 - AMBIENT.pressure
    assert tank_pressure[0] == pytest.approx(6e5)
    assert tank_pressure.min() < 5.2e5
    assert tank_pressure[-1] == pytest.approx(6e5, abs=500.0)


def test_a_tank_left_to_itself_shares_its_air_with_the_muscle():
    """m R T = p1 V1 + p2 V2 isothermally; with the first law the energy is shared as well, U1 +
    U2.
    """
    for gas in (Isothermal(), ADIABATIC):
        system = plant(
            FillDischarge(Tank(Supply(6e5), Valve(0.0, 0.4), 5e-4, gas), VALVE, VALVE), gas
        )
        run = simulate(
            system,
            Schedule({"fill": ((0.0, 1),)}),
            duration=20.0,
            initial_state=system.state_at(pressure=0.0),
        )
        volume = system.muscles[0].geometry.volume(0.05)
        shared = (6e5 * 5e-4) / (5e-4 + volume)
        assert run["pressure"][-1] == pytest.approx(shared, abs=50.0)
        total = run["air_mass"] + run["supply.air_mass"]
        np.testing.assert_allclose(total, total[0], rtol=1e-12)


def test_a_regulated_supply_droops_in_proportion_to_the_flow():
    """Steady: what the outlet gives is opening times what its valve passes, opening = (p_set -
    p)/B.
    """
    source = RegulatedSupply(Supply(8e5), WIDE, 5e5, 2e4)
    system = plant(WithLeak(FillDischarge(source, WIDE, VALVE), NARROW), Isothermal())
    run = simulate(
        system,
        Schedule({"fill": ((0.0, 1.0),)}),
        duration=5.0,
        initial_state=system.state_at(pressure=4e5),
    )
    end = {s.name: run[s.name][-1] for s in system.states}
    outlet = source.air({"air_mass": end["supply.air_mass"]}, AMBIENT).pressure
    droop = 5e5 + AMBIENT.pressure - outlet
    (done,) = system.circuit_flows(system.muscle_states(end), end, {"fill": 1.0, "discharge": 0.0})
    full = WIDE.mass_flow(8e5 + AMBIENT.pressure, outlet, 1.0, AMBIENT.temperature)
    assert done.exhausted.mass == pytest.approx(droop / 2e4 * full, rel=1e-5)
    assert 100.0 < droop < 2e4


def test_a_regulated_supply_begins_no_higher_than_what_feeds_it():
    low = RegulatedSupply(Supply(3e5), WIDE, 5e5)
    content = low.steady_state(AMBIENT)
    assert low.air(content, AMBIENT).pressure == pytest.approx(3e5 + AMBIENT.pressure)
    assert RegulatedSupply(Supply(8e5), WIDE, 5e5).air(
        RegulatedSupply(Supply(8e5), WIDE, 5e5).steady_state(AMBIENT), AMBIENT
    ).pressure == pytest.approx(5e5 + AMBIENT.pressure)


def test_branches_starve_each_other_on_one_tank():
    """A tank left to itself fills one muscle to p V_T/(V_T + V), and two to p V_T/(V_T + 2 V)."""
    source = Tank(Supply(6e5), Valve(0.0, 0.4), 2e-4)
    branch = FillDischarge(SharedSupply(), WIDE, VALVE)
    system = plant(Manifold(source, (branch, branch), ("greedy", "patient")), Isothermal(), count=2)
    volume = system.muscles[0].geometry.volume(0.05)
    start = system.state_at(pressure=0.0)
    for greedy, filled in ((0.0, 1), (1.0, 2)):
        command = Schedule({"patient.fill": ((0.0, 1.0),), "greedy.fill": ((0.0, greedy),)})
        run = simulate(system, command, duration=5.0, initial_state=start)
        assert run["m1.pressure"][-1] == pytest.approx(
            6e5 * 2e-4 / (2e-4 + filled * volume), abs=20.0
        )
        assert run["m0.pressure"][-1] == pytest.approx(greedy * run["m1.pressure"][-1], abs=20.0)


def test_a_manifold_books_what_its_branches_draw():
    metered = WithEnergyMeters(CIRCUITS["manifold"])
    start = metered.extend_state(metered.plant.state_at(pressure=1e5))
    command = Schedule(
        {"arm.command": ((0.0, 0.8), (0.3, -0.5)), "hand.fill": ((0.1, 1.0), (0.4, 0.0))}
    )
    run = simulate(metered, command, duration=0.6, initial_state=start, integrator=Rodas4(1e-9))
    grown = run["air_total"] - run["air_total"][0]
    np.testing.assert_allclose(grown, run["air_supplied"] - run["air_exhausted"], atol=1e-13)
    assert run["air_exhausted"][-1] > 1e-5


# What is refused


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: plant(FillDischarge(SharedSupply(), VALVE, VALVE)),
            r"Plant: its FillDischarge: SharedSupply\(\) is allowed only as the supply of",
        ),
        (
            lambda: plant(WithTubes(FillDischarge(SharedSupply(), VALVE, VALVE), tube())),
            r"Plant: its WithTubes: SharedSupply\(\)",
        ),
        (
            lambda: Tank(SharedSupply(), VALVE, 1e-3),
            r"Tank: SharedSupply\(\) is allowed only .* give a Supply, a Tank or a Reg",
        ),
        (lambda: RegulatedSupply(SharedSupply(), VALVE, 4e5), r"RegulatedSupply: SharedSupply\(\)"),
        (
            lambda: Manifold(Supply(6e5), (FillDischarge(Supply(6e5), VALVE, VALVE),), ("a",)),
            "the supply of branch 'a' is Supply; it must be",
        ),
        (
            lambda: Manifold(Supply(6e5), (ClosedChamber(SharedSupply()),), ("a", "b")),
            "give a distinct name for each of the 1 branches",
        ),
        (
            lambda: Manifold(Supply(6e5), (ClosedChamber(SharedSupply()),), ("supply",)),
            "cannot be named 'supply'",
        ),
        (
            lambda: Manifold(Supply(6e5), (ClosedChamber(SharedSupply()),), ("a.b",)),
            "give a name without a dot",
        ),
        (
            lambda: ProportionalValve(Supply(6e5), VALVE, VALVE, SPOOL, 0.0, 3),
            "muscle_count is 3; allowed range: 1 to 2",
        ),
        (
            lambda: ProportionalValve(Supply(6e5), VALVE, VALVE, SPOOL, 0.0, True),
            "muscle_count must be an integer; it is True",
        ),
        (
            lambda: ProportionalValve(Supply(6e5), VALVE, VALVE, SPOOL, 1.0),
            r"overlap .* allowed range: -0.5 to 0.9",
        ),
        (lambda: Tube(VALVE, 1e-5, 0), "Tube: segment_count is 0; allowed range: 1 to 200"),
        (
            lambda: DistributedTube(1.0, 4e-3, 2.5),
            "DistributedTube: segment_count must be an integer; it is 2.5",
        ),
        (
            lambda: plant(FillDischarge(Supply(5e5), VALVE, VALVE), count=2),
            "circuits feed 1 muscles; 2 are given",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_what_can(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_an_orifice_without_a_command_is_fully_open():
    """A leak and the feed of a tank pass the flow of their orifice at an opening of 1; air carries
    c_p T.
    """
    inside = Air(4e5, 310.0)
    outside = Air(AMBIENT.pressure, AMBIENT.temperature)
    flow = NARROW.mass_flow(4e5, AMBIENT.pressure, 1.0, 310.0)
    leaking = WithLeak(ClosedChamber(), NARROW).compute_flows((inside,), {}, {}, AMBIENT)
    assert leaking.flows[0].mass == pytest.approx(-flow)
    assert leaking.exhausted.enthalpy == pytest.approx(1.4 / 0.4 * GAS_CONSTANT * 310.0 * flow)
    assert tank().feed_flow(inside, outside, AMBIENT) == orifice_flow(NARROW, inside, outside, 1.0)


def test_a_flow_and_the_opposite_flow_cancel():
    assert Flow(2e-3, 600.0) + (-Flow(2e-3, 600.0)) == NO_FLOW


def test_a_muscle_that_leaks_empties_to_the_surroundings_and_rests_there():
    system = plant(WithLeak(ClosedChamber(), NARROW), Isothermal(), mechanism=HangingMass(1.0))
    start = system.state_at(pressure=3e5, position=0.02)
    run = simulate(system, ZERO_INPUT, duration=60.0, initial_state=start)
    assert run["pressure"][-1] == pytest.approx(0.0, abs=20.0)
    assert np.isfinite(run["position"]).all()
