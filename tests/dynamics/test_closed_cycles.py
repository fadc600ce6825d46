"""No part gives energy in a closed cycle with shut air: what a part takes is never negative.

    friction of a muscle   int F dx >= 0 over a closed path, at pressures that follow it
    dampers                F v >= 0
    friction by load       int Q_f w dt = heat + growth of the store - what changes of the load give
    residual               the same with the changes of the pressures; refused where air is shut in

The tension of a static law is a function of the contraction alone where the air is shut in, so that
it has no cycle to take or give energy in.
"""

from __future__ import annotations

import inspect
from dataclasses import replace

import numpy as np
import pytest
from plants import EXAMPLES

import airmuscle as am
from airmuscle.engine import Rodas4
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    Braid,
    Circuit,
    ClosedChamber,
    FillDischarge,
    GaussianResidual,
    Isothermal,
    LinearInPressure,
    LoopScales,
    Manifold,
    Muscle,
    MuscleRoute,
    Plant,
    PressureRegulator,
    ProportionalRegulator,
    ProportionalValve,
    SecondOrderLag,
    SerialArm,
    SharedSupply,
    SpatialLink,
    StickSlip,
    Supply,
    ThreePositionValve,
    Valve,
    WithEnergyMeters,
    WithLeak,
    WithStickSlip,
)

RNG = np.random.default_rng(44)
ROWS = 4001
TOLERANCE = 1e-6
SCALES = LoopScales(stroke=0.02, amplitude=20.0, elements=8)
WRAPPERS = {"NoFriction", "IdentifiedFriction", "PressureScaledFriction"}
LAWS = [name for name in am.friction.__all__ if inspect.isclass(getattr(am.friction, name))]
FRICTIONS = [
    name
    for name in LAWS
    if issubclass(getattr(am.friction, name), am.friction.Friction)
    and name not in WRAPPERS
    and not inspect.isabstract(getattr(am.friction, name))
]


def closed_path(size: float) -> np.ndarray:
    """A smooth closed displacement [m] of three harmonics, turned through three times."""
    angle = np.linspace(0.0, 6 * np.pi, 3 * (ROWS - 1) + 1)
    return size * sum(
        RNG.normal() * np.cos(k * angle) / k + RNG.normal() * np.sin(k * angle) / k
        for k in (1, 2, 3)
    )


def shut_pressure(displacement: np.ndarray) -> np.ndarray:
    """Gauge pressure [Pa] of air that is compressed by 30 % at most, as the volume follows."""
    ratio = 1.0 - 0.3 * displacement / np.abs(displacement).max()
    return 3e5 * ratio**-1.4 - 1e5


@pytest.mark.parametrize("scaled", [None, 0.0, 0.5])
@pytest.mark.parametrize("name", FRICTIONS)
def test_friction_of_a_muscle_takes_energy_in_every_closed_cycle_with_shut_air(name, scaled):
    law = getattr(am.friction, name).guess(SCALES)
    if scaled is not None:
        law = am.friction.PressureScaledFriction(law, scaled, 3e5)
    for size in np.geomspace(1e-5, 0.05, 12):
        x = closed_path(size)
        time = np.linspace(0.0, 3.0, len(x))
        force = law.pressure_factor(shut_pressure(x)) * law.force_along(x, time)
        power = 0.5 * (force[1:] + force[:-1]) * np.diff(x)
        last = power[-(ROWS - 1) :]
        assert last.sum() > -TOLERANCE * np.abs(last).sum(), size


DAMPERS = {
    type(muscle.damper): muscle.damper
    for plant in EXAMPLES.values()
    if isinstance(plant, Plant)
    for muscle in plant.muscles
}


@pytest.mark.parametrize("damper", DAMPERS.values(), ids=lambda damper: type(damper).__name__)
def test_dampers_take_power_at_every_pressure_and_speed(damper):
    pressure, contraction, speed = RNG.uniform((0.0, 0.0, -1.0), (6e5, 0.25, 1.0), (500, 3)).T
    power = damper.force(pressure, contraction, speed) * speed
    assert np.all(power >= 0.0)


# Friction of a joint by load, and the residual of a hybrid law

VALVE = Valve(2e-9, 0.3)
REGULATOR = ProportionalRegulator(Supply(5e5), VALVE, VALVE, SecondOrderLag(12.0))
BRAID = Braid(0.01, 0.42, 0.2)
RESIDUAL = GaussianResidual(
    ("m0.pressure", "m1.pressure"),
    (0.4, 0.4),
    (1e5, 1e5),
    tuple(RNG.normal(0.5, 1.0, 16)),
    (0.2, -0.15, 0.1, 0.2),
    (0.0,) * 8,
)


def arm(circuit: Circuit, residual: GaussianResidual | None = None) -> Plant:
    """Two joints whose friction grows with the tensions of both muscles and the loads of the
    bearings.
    """
    law = LinearInPressure((6e-4, -8e-4), (-10.0,), 5.0)
    muscles = tuple(Muscle(law, BRAID, name=f"m{i}") for i in range(2))
    links = (
        SpatialLink((0, 1, 0), (0.0, 0.0, 0.0), 0.6, (0.05, 0.0, -0.1), 0.0, 0.02, 0.2),
        SpatialLink((0, 1, 0), (0.0, 0.0, -0.2), 0.4, (0.0, 0.0, -0.1), 0.0, 0.02, 0.1),
    )
    routes = (MuscleRoute((1,), (0.03,), 0.1), MuscleRoute((2,), (-0.03,), 0.1))
    frictions = (
        StickSlip(0.02, (2e-3, 4e-3), presliding_angle=0.2),
        StickSlip(0.02, (4e-3, 2e-3), 0.3, presliding_angle=0.2, bearing_arms=(0.01, 0.01)),
    )
    mechanism = WithStickSlip(SerialArm(links, routes), frictions, residual)
    return Plant(muscles, (circuit,) * 2, mechanism, Isothermal())


def swing(plant: Plant, **setpoints: float) -> am.Recording:
    """A second of free motion with shut air, or with regulators at constant set points."""
    metered = WithEnergyMeters(plant)
    start = plant.state_at(
        pressure=1.2e5, **{"joint1.angle": 0.3, "joint2.angle": -0.2, "joint2.angular_speed": 1.0}
    )
    return am.simulate(
        metered,
        am.Schedule({name: ((0.0, level),) for name, level in setpoints.items()}),
        duration=1.0,
        initial_state=metered.extend_state(start),
        output_times=np.linspace(0.0, 1.0, 2001),
        integrator=Rodas4(1e-9),
    )


@pytest.fixture(scope="module")
def shut() -> am.Recording:
    return swing(arm(ClosedChamber()))


def test_friction_by_load_makes_heat_alone_with_shut_air(shut):
    heat = shut["bristle_heat"]
    throughput = np.abs(np.diff(shut["bristle_work"])).sum()
    assert heat[-1] > 0.1 * throughput > 1e-4
    assert np.diff(heat).min() > -TOLERANCE * throughput


def test_what_the_load_gives_a_bristle_is_the_integral_over_the_level():
    """int theta_s z^2/2 dT with the tensions of the recording, without loads of bearings."""
    plant = arm(ClosedChamber())
    mechanism = plant.mechanism
    elements = tuple(
        replace(each, bearing_arms=(), static_excess=0.0) for each in mechanism.elements
    )
    run = swing(replace(plant, mechanism=replace(mechanism, elements=elements)))
    given = 0.0
    for joint, element in enumerate(elements, 1):
        bristle = run[f"joint{joint}.friction_bristle"]
        level = element.coulomb_torque + sum(
            mu * run[f"m{i}.force"] for i, mu in enumerate(element.load_arms)
        )
        middle = 0.5 * (bristle[1:] ** 2 + bristle[:-1] ** 2)
        given = given + 0.5 * element.presliding_angle * np.cumsum(middle * np.diff(level))
    unpaid = run["bristle_energy_unpaid"][1:]
    assert np.abs(unpaid).max() > 1e-5
    np.testing.assert_allclose(unpaid, given, atol=2e-4 * np.abs(run["bristle_work"]).max())


SHUTTING = [
    FillDischarge(Supply(5e5), VALVE, VALVE),
    ThreePositionValve(Supply(5e5), VALVE, VALVE),
    ClosedChamber(),
    WithLeak(ThreePositionValve(Supply(5e5), VALVE, VALVE), VALVE),
]


@pytest.mark.parametrize("circuit", SHUTTING, ids=lambda circuit: type(circuit).__name__)
def test_a_residual_is_refused_where_a_circuit_can_shut_the_air_in(circuit):
    with pytest.raises(ParameterError, match="has a GaussianResidual, which depends on pressures"):
        arm(circuit, RESIDUAL)
    assert arm(circuit).mechanism.residual is None  # the remedy


def test_every_circuit_of_the_library_holds_the_pressure_or_refuses_a_residual():
    """The regulators alone hold it, also behind tubes and leaks and in a manifold of them."""
    circuits = {
        type(circuit): circuit
        for plant in EXAMPLES.values()
        if isinstance(plant, Plant)
        for circuit in plant.circuits
    }
    holding = {kind for kind, circuit in circuits.items() if circuit.holds_pressure}
    assert ProportionalRegulator in holding
    branch = replace(REGULATOR, supply=SharedSupply())
    valves = FillDischarge(SharedSupply(), VALVE, VALVE)
    assert Manifold(Supply(5e5), (branch, branch), ("a", "b")).holds_pressure
    assert not Manifold(Supply(5e5), (branch, valves), ("a", "b")).holds_pressure
    assert WithLeak(REGULATOR, VALVE).holds_pressure
    assert PressureRegulator.holds_pressure
    shutting = {FillDischarge, ThreePositionValve, ClosedChamber, ProportionalValve}
    assert not holding & shutting


def test_the_meters_book_what_changes_of_pressure_give_the_potential_of_a_residual():
    """int dV/dp dp along the recording, by the potential itself, with regulated pressures."""
    run = swing(arm(REGULATOR, RESIDUAL), **{"m0.setpoint": 1.2e5, "m1.setpoint": 2.4e5})
    angles = np.array([run["joint1.angle"], run["joint2.angle"]])
    pressures = np.array([run["m0.pressure"], run["m1.pressure"]])

    def potential(p):
        return RESIDUAL.potential(list(angles), dict(zip(RESIDUAL.pressures, p, strict=True)))

    given = np.zeros(len(run["time"]) - 1)
    for i in range(2):
        step = np.zeros((2, 1))
        step[i] = 10.0
        slope = (potential(pressures + step) - potential(pressures - step)) / 20.0
        given += np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(pressures[i]))
    stored = run["residual_energy"]
    np.testing.assert_allclose(stored, potential(pressures), rtol=1e-9)
    unpaid = run["residual_energy_unpaid"] - run["residual_energy_unpaid"][0]
    assert np.abs(given).max() > 1e-3
    np.testing.assert_allclose(unpaid[1:], given, atol=2e-3 * np.abs(given).max())
