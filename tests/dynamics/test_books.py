"""Conservation: the air mass behind shut valves, the mechanical and the air's energy book, rest
before a release.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.core import autodiff
from airmuscle.engine import DormandPrince8, Rodas4, Schedule, simulate
from airmuscle.errors import EquilibriumError, ParameterError
from airmuscle.files import load
from airmuscle.physics import (
    Ambient,
    ClosedChamber,
    FillDischarge,
    HangingMass,
    Isometric,
    Isothermal,
    LinearDamper,
    Plant,
    Polytropic,
    Supply,
    Valve,
    WithEnergyMeters,
    WithLatch,
    find_equilibria,
    find_equilibrium,
)
from airmuscle.physics.plant.diagnostics import percent_of_rows

VALVE = Valve(2.6167e-9, 0.433)
CIRCUIT = FillDischarge(Supply(548675.0), VALVE, VALVE)
RELEASE = Schedule({"latched": ((0.0, 1.0), (0.5, 0.0))})
GASES = [Isothermal(), Polytropic(1.2)]


def release_plant(gas):
    return Plant(chosen_muscle(), CIRCUIT, WithLatch(HangingMass(30.0)), gas)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-10])
@pytest.mark.parametrize("gas", GASES, ids=repr)
def test_the_air_mass_is_constant_while_the_valves_are_shut(gas, rtol):
    plant = release_plant(gas)
    run = simulate(
        plant,
        RELEASE,
        duration=3.0,
        initial_state=plant.state_at(pressure=3e5),
        integrator=Rodas4(rtol),
    )
    assert np.ptp(run["position"]) > 0.005
    np.testing.assert_allclose(run["air_mass"], run["air_mass"][0], rtol=1e-12)


@pytest.mark.parametrize("gas", GASES, ids=repr)
def test_both_energy_books_close(gas):
    """A fill, a shut phase with oscillation and a discharge, as one run at rtol 1e-10."""
    plant = Plant(chosen_muscle(), CIRCUIT, HangingMass(10.0), gas)
    metered = WithEnergyMeters(plant)
    start = metered.extend_state(plant.state_at(pressure=1.5e5, position=0.0))
    command = Schedule({"fill": ((0.3, 1), (0.8, 0)), "discharge": ((1.5, 1), (1.8, 0))})
    run = simulate(metered, command, duration=2.5, initial_state=start, integrator=Rodas4(1e-10))

    mechanical = run["kinetic_energy"] + run["potential_energy"]
    turned_over = np.abs(run["work_of_tension"]).max()
    assert turned_over > 1.0
    np.testing.assert_allclose(
        np.diff(mechanical), np.diff(run["work_of_tension"]), atol=1e-8 * turned_over
    )
    np.testing.assert_allclose(
        mechanical - mechanical[0], run["work_of_tension"], atol=1e-8 * turned_over
    )

    expected = run["energy_of_flow"] - run["work_of_air"]
    size = np.abs(run["energy_of_flow"]).max()
    np.testing.assert_allclose(run["air_energy"] - run["air_energy"][0], expected, atol=1e-8 * size)
    assert (np.diff(run["damping_heat"]) >= -1e-12).all()


@pytest.mark.parametrize("gas", GASES, ids=repr)
def test_the_energy_of_the_air_falls_with_volume_by_its_pressure(gas):
    ambient = Ambient()
    mass = 3e-4
    volume = 8e-5
    (by_volume,) = autodiff.jvp(lambda x: [gas.energy(mass, x[0], ambient)], [volume], [1.0])
    assert by_volume == pytest.approx(-gas.pressure(mass, volume, ambient), rel=1e-12)
    assert gas.air_mass(gas.pressure(mass, volume, ambient), volume, ambient) == pytest.approx(
        mass, rel=1e-14
    )


def test_the_latch_holds_until_it_is_released():
    plant = release_plant(Isothermal())
    run = simulate(
        plant,
        RELEASE,
        duration=1.0,
        initial_state=plant.state_at(pressure=3e5),
        integrator=DormandPrince8(1e-4),
    )
    before = run["time"] < 0.5
    assert (run["position"][before] == 0).all()
    assert (run["acceleration"][before] == 0).all()
    released = run["acceleration"][~before][0]
    assert released == pytest.approx(run["force"][~before][0] / 30.0 - 9.80665, rel=1e-12)


def test_an_equilibrium_stays_where_it_is():
    plant = Plant(chosen_muscle(), CIRCUIT, HangingMass(10.0))
    start = find_equilibrium(plant, pressure=3e5)
    run = simulate(plant, Schedule({}), duration=2.0, initial_state=start, integrator=Rodas4(1e-10))
    np.testing.assert_allclose(run["position"], start["position"], atol=1e-12)
    assert run["force"][0] == pytest.approx(10.0 * 9.80665, rel=1e-12)


def test_more_pressure_lifts_the_load_higher_and_all_equilibria_are_found():
    plant = Plant(chosen_muscle(), CIRCUIT, HangingMass(10.0))
    heights = [find_equilibrium(plant, pressure=p)["position"] for p in (1.5e5, 3e5, 4.5e5)]
    assert heights == sorted(heights)
    assert [rest.stable for rest in find_equilibria(plant, pressure=3e5)] == [True]


def test_a_plant_that_cannot_rest_names_the_muscle_and_the_forces():
    plant = Plant(replace(chosen_muscle(), name="biceps"), CIRCUIT, HangingMass(500.0))
    with pytest.raises(
        EquilibriumError, match=r"biceps pulls [\d.]+ N at 300 kPa.*requires a tension of 4903 N"
    ):
        find_equilibrium(plant, pressure=3e5)


def test_an_isometric_muscle_only_builds_up_tension():
    plant = Plant(chosen_muscle(), CIRCUIT, Isometric(0.05), Isothermal())
    run = simulate(
        plant,
        Schedule({"fill": ((0.0, 1.0),)}),
        duration=5.0,
        initial_state=plant.state_at(pressure=0.0),
    )
    assert (run["contraction"] == 0.05).all()
    assert run["pressure"][-1] == pytest.approx(548675.0, abs=1.0)
    assert run["force"][-1] > run["force"][0]
    assert (run["force"] >= 0).all()


def test_a_muscle_never_pushes():
    plant = Plant(chosen_muscle(), ClosedChamber(), HangingMass(1.0))
    run = simulate(
        plant,
        Schedule({}),
        duration=1.0,
        initial_state=plant.state_at(pressure=1e5, position=0.05, speed=0.3),
    )
    assert run["force"].min() == 0.0


@pytest.mark.parametrize(
    ("pressure", "position", "message"),
    [
        (-2e5, 0.0, "not above absolute vacuum"),
        (1e5, 0.25, "a contraction of 125 % is outside its range"),
    ],
)
def test_a_state_that_cannot_be_is_refused(pressure, position, message):
    plant = Plant(chosen_muscle(), CIRCUIT, HangingMass(1.0))
    with pytest.raises(Exception, match=message) as caught:
        plant.state_at(pressure=pressure, position=position)
    assert type(caught.value).__name__ in ("ParameterError", "GeometryLimitError")


def test_an_unknown_coordinate_or_input_is_refused_with_what_there_is():
    plant = Plant(chosen_muscle(), CIRCUIT, HangingMass(1.0))
    with pytest.raises(ParameterError, match="no coordinate 'angle'; there are position, speed"):
        plant.state_at(pressure=0.0, angle=1.0)
    with pytest.raises(
        ParameterError, match=r"no input 'fil'; there are fill, discharge\. Did you mean 'fill'\?"
    ):
        simulate(
            plant,
            Schedule({"fil": ((0.0, 1.0),)}),
            duration=1.0,
            initial_state=plant.state_at(pressure=0.0),
        )


def test_a_small_share_of_rows_outside_a_range_is_not_told_as_zero():
    assert [percent_of_rows(share) for share in (0.004, 0.01, 0.313, 1.0)] == [
        "0.4 %",
        "1 %",
        "31 %",
        "100 %",
    ]


def test_a_run_says_when_and_how_far_it_left_what_was_measured():
    """A fitted surface carries its validity range, a library muscle that of its file; inside it
    nothing is said.
    """
    muscle = load("dmsp-20-300").muscle
    assert muscle.validity_range is not None
    damped = replace(muscle, damper=LinearDamper(300.0))
    plant = Plant(damped, CIRCUIT, HangingMass(10.0))
    start = find_equilibrium(plant, pressure=0.0)
    run = simulate(plant, Schedule({"fill": ((0.5, 1.0),)}), duration=4.0, initial_state=start)
    pressure, contraction = [note for note in run.notes if "outside the validity range" in note]
    assert re.search(
        r"was outside the validity range of its characteristic in pressure \(35 to 675 kPa\) in \d+"
        r" % of the rows, by at most 35 kPa",
        pressure,
    )
    assert re.search(
        r"in contraction \(1\.333 to 26 %\).*values there are extrapolated", contraction
    )
    inside = simulate(
        plant, Schedule({}), duration=1.0, initial_state=find_equilibrium(plant, pressure=4e5)
    )
    assert not [note for note in inside.notes if "outside the validity range" in note]
