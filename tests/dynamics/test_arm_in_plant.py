"""An arm of two joints with six muscles in a plant: its energy book closes, its equilibria balance
every joint.

d(T + V)/dt = power of the tensions - power lost in the joints
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle
from widths import widened

from airmuscle.engine import Rodas4, Schedule, simulate
from airmuscle.physics import (
    ArmLink,
    CrankProfile,
    FillDischarge,
    HuntCrossley,
    JointWithEndStops,
    JointWithFriction,
    MuscleRoute,
    PlanarArm,
    Plant,
    Polytropic,
    Supply,
    Valve,
    WithEnergyMeters,
    find_equilibrium,
    linearise,
    stiffness,
)

NAMES = ("s_flex", "s_ext", "e_flex", "e_ext", "bi_flex", "bi_ext")
ARM = PlanarArm(
    (
        ArmLink(0.3, 1.5, 0.14, 0.012, 0.3, -0.9, 0.9),
        ArmLink(0.25, 1.1, 0.11, 0.006, 0.2, -0.9, 0.9),
    ),
    (
        MuscleRoute((1,), (0.03,), 0.1),
        MuscleRoute((1,), (-0.03,), 0.1),
        MuscleRoute((2,), (0.025,), 0.1, (CrankProfile(0.2),)),
        MuscleRoute((2,), (-0.025,), 0.1, (CrankProfile(-0.2),)),
        MuscleRoute((1, 2), (0.02, 0.015), 0.1),
        MuscleRoute((1, 2), (-0.02, -0.015), 0.1),
    ),
    0.7,
)
RUBBING = JointWithEndStops(
    JointWithFriction(ARM, 0.2, coordinate="joint2.angle"),
    -0.15,
    0.15,
    0.05,
    HuntCrossley(1e7),
    "joint1.angle",
)
VALVE = Valve(2.6e-9, 0.433)
CIRCUIT = FillDischarge(Supply(6e5), VALVE, VALVE)


def arm(mechanism=ARM):
    muscles = tuple(replace(chosen_muscle(), name=name) for name in NAMES)
    return Plant(muscles, (CIRCUIT,) * 6, mechanism, Polytropic(1.2))


@pytest.mark.parametrize(
    "mechanism",
    widened([ARM, RUBBING], lambda mechanism: mechanism is RUBBING),
    ids=["arm", "with friction and stops"],
)
def test_the_energy_book_of_an_arm_with_six_muscles_closes(mechanism):
    plant = WithEnergyMeters(arm(mechanism))
    start = plant.extend_state(find_equilibrium(plant.plant, pressure=2e5))
    command = Schedule(
        {
            "s_flex.fill": ((0.05, 1.0), (0.2, 0.0)),
            "bi_ext.discharge": ((0.1, 1.0), (0.2, 0.0)),
            "e_ext.fill": ((0.3, 1.0), (0.45, 0.0)),
            "bi_flex.fill": ((0.5, 1.0), (0.6, 0.0)),
        }
    )
    run = simulate(plant, command, duration=0.9, initial_state=start, integrator=Rodas4(1e-9))
    mechanical = run["kinetic_energy"] + run["potential_energy"]
    book = run["work_of_tension"] - run["mechanism_loss"]
    size = np.abs(run["work_of_tension"]).max()
    assert size > 0.3
    assert run["kinetic_energy"].max() > 1e-4 * size
    np.testing.assert_allclose(mechanical - mechanical[0], book, atol=1e-6 * size)
    assert np.ptp(run["joint1.angle"]) > 0.05
    assert np.ptp(run["joint2.angle"]) > 0.05
    assert run["mechanism_loss"][-1] > 1e-4 * size


def test_an_arm_at_rest_balances_the_weight_at_every_joint():
    plant = arm()
    pressures = (3e5, 2e5, 2e5, 3e5, 2.5e5, 2e5)
    state = find_equilibrium(plant, pressure=pressures)
    muscles = plant.muscle_states(state)
    forces = ARM.generalised_forces(state, [m.tension for m in muscles], plant.resting_lengths)
    step = 1e-6
    for name, force in forces.items():
        above, below = (
            ARM.potential_energy({**state, name: state[name] + s}) for s in (step, -step)
        )
        assert float(force) == pytest.approx((above - below) / (2 * step), abs=1e-5)
    assert state["joint1.angle"] > 0.02


def test_a_biarticular_muscle_stiffens_both_joints():
    plant = arm()
    soft, stiff = (
        find_equilibrium(plant, pressure=(2e5, 2e5, 2e5, 2e5, bi, bi)) for bi in (1.5e5, 3.5e5)
    )
    for name in ("joint1.angle", "joint2.angle"):
        low, high = (stiffness(plant, state).coordinates[name] for state in (soft, stiff))
        assert high.constant_pressure > low.constant_pressure
        assert high.shut_valves > high.constant_pressure


def test_an_arm_at_rest_is_stable():
    plant = arm()
    poles = linearise(plant, find_equilibrium(plant, pressure=2e5)).poles
    assert max(pole.value.real for pole in poles) < 1e-6
