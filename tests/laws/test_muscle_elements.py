"""What stands beside the contractile element: dampers, springs, creep, wall, series spring, end
stop.

Each has a law that is solved by hand here; none of the passive ones may give energy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joints import chosen_muscle
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from airmuscle.engine import ZERO_INPUT, Rodas4, Schedule, simulate
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    ClosedChamber,
    CreepElements,
    CubicSeriesSpring,
    Dahl,
    DirectionalDamper,
    EndStop,
    FillDischarge,
    ForceLaw,
    HangingMass,
    HuntCrossley,
    Isometric,
    Isothermal,
    LinearDamper,
    LuGre,
    Plant,
    Polytropic,
    PressureDamper,
    Reynolds2003,
    Reynolds2003Damper,
    Reynolds2003Spring,
    SeriesSpring,
    Serres2009,
    Serres2009Damper,
    Serres2009Spring,
    Stop,
    Supply,
    SwellingWall,
    Valve,
    ViscoelasticWall,
    WithEnergyMeters,
)

pressures = st.floats(-1e5, 8e5)
speeds = st.floats(-2, 2)
DAMPERS = [
    LinearDamper(200.0),
    PressureDamper(100.0, 1e-3),
    PressureDamper(10.0, 1e-3),
    DirectionalDamper(300.0, 150.0, 1e-3, -1e-3),
    Reynolds2003Damper(),
    Serres2009Damper(),
]
STOP = EndStop(0.1, HuntCrossley(1e9, 0.5))


# Dampers and springs


@pytest.mark.parametrize("damper", DAMPERS, ids=repr)
@given(p=pressures, v=speeds)
def test_a_damper_never_drives_and_is_continuous_at_standstill(damper, p, v):
    assert damper.force(p, 0.1, v) * v >= 0.0
    assert damper.force(p, 0.1, 0.0) == 0.0
    assert abs(damper.force(p, 0.1, 1e-9) - damper.force(p, 0.1, -1e-9)) < 2e-5


@pytest.mark.parametrize(
    "damper", [d for d in DAMPERS if min(d.coefficients(-1e5, 0.0)) > 0], ids=repr
)
@given(p=st.floats(-1e5, 1e5), v=speeds, beside=st.floats(0, 1e3))
def test_the_speed_at_which_a_damper_holds_a_force_is_its_inverse(damper, p, v, beside):
    force = damper.force(p, 0.1, v) + beside * v
    assert damper.speed(p, 0.1, force, beside) == pytest.approx(v, abs=1e-12)


def test_the_dampers_of_the_papers_have_their_printed_values():
    """Reynolds 2003 at 400 kPa: 1.01 + 0.00691 p and 0.6 - 0.000803 p in N s/mm. Serres 2009: 2.90;
    1.57, then 0.311 + 0.00338 p from 372 kPa on."""
    assert Reynolds2003Damper().coefficients(400e3, 0.1) == pytest.approx(
        (1.01e3 + 2764.0, 600.0 - 321.2)
    )
    assert Serres2009Damper().coefficients(200e3, 0.1) == pytest.approx((2900.0, 1570.0))
    assert Serres2009Damper().coefficients(550e3, 0.1) == pytest.approx((2900.0, 311.0 + 1859.0))
    below, above = (Serres2009Damper().coefficients(p, 0.1)[1] for p in (371.9e3, 372.6e3))
    assert above - below < 1.0


@given(p=pressures, speed=st.floats(1e-3, 2))
def test_a_direction_dependent_damper_has_one_line_over_pressure_for_each_direction(p, speed):
    """b = max(b_0 + b_p p, 0): where a falling line would be negative there is no damping."""
    for damper, shortening, lengthening in (
        (DirectionalDamper(300.0, 150.0, 1e-3, -1e-3), 300.0 + 1e-3 * p, 150.0 - 1e-3 * p),
        (DirectionalDamper(150.0, 300.0, -1e-3, 2e-3), 150.0 - 1e-3 * p, 300.0 + 2e-3 * p),
    ):
        assert damper.force(p, 0.1, speed) == pytest.approx(max(shortening, 0.0) * speed)
        assert damper.force(p, 0.1, -speed) == pytest.approx(-max(lengthening, 0.0) * speed)


@given(p=st.floats(0, 8e5), eps=st.floats(-0.05, 0.3))
def test_the_springs_of_the_papers_are_those_of_their_characteristics(p, eps):
    """Contractile force less spring is the characteristic."""
    for law, spring in (
        (Reynolds2003(0.25), Reynolds2003Spring()),
        (Serres2009(0.25), Serres2009Spring()),
    ):
        contractile = law.force_offset + law.force_by_pressure * p
        assert contractile - spring.force(p, eps, 0.25) == pytest.approx(
            law.force(p, eps), abs=1e-9
        )


# Creep and wall


def test_creep_relaxes_after_a_step_as_a_maxwell_element():
    """A muscle held after it was shortened by d: its force returns as sum k d exp(-t/tau) fades."""
    creep = CreepElements((2e4, 1e4), (0.2, 3.0))
    muscle = replace(chosen_muscle(), creep=creep)
    plant = Plant(muscle, ClosedChamber(), Isometric(0.05), Isothermal())
    step = 1e-3
    start = plant.state_at(pressure=3e5, creep1=step, creep2=step)
    run = simulate(plant, ZERO_INPUT, duration=5.0, initial_state=start, integrator=Rodas4(1e-9))
    t = run["time"]
    settled = muscle.tension(3e5, 0.05)
    expected = settled - step * (2e4 * np.exp(-t / 0.2) + 1e4 * np.exp(-t / 3.0))
    np.testing.assert_allclose(run["force"], expected, atol=1e-6)


def test_a_creeping_muscle_goes_on_to_contract_and_ends_where_it_would_without_creep():
    plain = Plant(chosen_muscle(), ClosedChamber(), HangingMass(20.0), Isothermal())
    creeping = replace(plain, muscle=replace(chosen_muscle(), creep=CreepElements((2e4,), (0.3,))))
    ends = []
    for plant in (plain, creeping):
        run = simulate(
            plant,
            ZERO_INPUT,
            duration=6.0,
            initial_state=plant.state_at(pressure=4e5, position=0.03),
        )
        ends.append(run["position"])
    assert ends[1][-1] == pytest.approx(ends[0][-1], abs=1e-6)
    assert abs(ends[1][100] - ends[1][-1]) > 1e-4


@pytest.mark.parametrize("seed", range(3))
def test_a_lagging_wall_is_passive(seed):
    """Work p V' = what is stored, V^2/(2 c), and heat, tau V'^2/c, whatever the pressure does."""
    wall, rng = ViscoelasticWall(5e-11, 0.05), np.random.default_rng(seed)
    sizes, frequencies, phases = (
        rng.uniform(0, 1e5, 5),
        rng.uniform(0.1, 20, 5),
        rng.uniform(0, 6, 5),
    )

    def pressure(t):
        return 2e5 * (1 - np.exp(-t)) + np.sum(
            sizes * (np.sin(frequencies * t + phases) - np.sin(phases))
        )

    def rates(t, y):
        growth = wall.rates({"wall_volume": y[0]}, pressure(t))["wall_volume"]
        return [growth, pressure(t) * growth, wall.time_constant * growth**2 / wall.compliance]

    volume, work, heat = solve_ivp(
        rates, (0, 5), [0, 0, 0], rtol=1e-10, atol=1e-16, max_step=0.02
    ).y
    np.testing.assert_allclose(
        work, volume**2 / (2 * wall.compliance) + heat, atol=1e-7 * np.abs(work).max()
    )
    assert (work >= -1e-12).all()
    assert heat[-1] > 0


@pytest.mark.parametrize(
    "wall", [ViscoelasticWall(5e-11, 0.05), SwellingWall(4e-5, 2e5, 3e4, 0.05)], ids=repr
)
def test_a_wall_comes_to_rest_where_it_says_and_nowhere_without_pressure(wall):
    assert wall.steady_state(0.0)["wall_volume"] == 0.0
    for p in (-9e4, 1e5, 9e5):
        assert wall.rates(wall.steady_state(p), p)["wall_volume"] == pytest.approx(0.0, abs=1e-20)
    assert np.isfinite(SwellingWall(4e-5, 1e6, 1e3, 0.05).steady_volume(-1e5))


def test_the_air_in_a_lagging_wall_counts_and_its_work_is_booked():
    muscle = replace(chosen_muscle(), wall=ViscoelasticWall(5e-11, 0.05))
    valve = Valve(5e-9, 0.4)
    metered = WithEnergyMeters(
        Plant(muscle, FillDischarge(Supply(5e5), valve, valve), HangingMass(15.0), Polytropic(1.2))
    )
    start = metered.extend_state(metered.plant.state_at(pressure=2e5))
    command = Schedule({"fill": ((0.1, 1), (0.4, 0)), "discharge": ((0.8, 1), (1.0, 0))})
    run = simulate(metered, command, duration=1.5, initial_state=start, integrator=Rodas4(1e-9))
    assert np.ptp(run["wall_volume"]) > 1e-5
    expected = run["energy_of_flow"] - run["work_of_air"]
    size = np.abs(run["energy_of_flow"]).max()
    np.testing.assert_allclose(run["air_energy"] - run["air_energy"][0], expected, atol=1e-7 * size)


# End stop


@pytest.mark.parametrize("brisk", [0.01, 0.1, 0.5, 2.0])
def test_an_impact_is_restituted_as_hunt_and_crossley_have_it(brisk):
    """m v dv = -K d^1.5 (1 + c v) dd: cv - ln(1 + cv) is the same before and after, whatever m and
    K.
    """
    contact = HuntCrossley(1e8, 0.8)
    speed = brisk / 0.8
    exact = (
        brentq(lambda w: -w - np.log1p(-w) - (brisk - np.log1p(brisk)), 1e-12, 1 - 1e-12) / brisk
    )

    def rates(t, y):
        return [y[1], -contact.force(max(y[0], 0.0), y[1]) / 5.0]

    def parted(t, y):
        return y[0] if t > 1e-9 else 1.0

    parted.terminal = True
    parted.direction = -1
    run = solve_ivp(rates, (0, 5), [0, speed], events=parted, rtol=1e-9, atol=1e-12)
    assert -run.y[1, -1] / speed == pytest.approx(exact, rel=1e-4)
    if brisk < 0.02:
        assert exact == pytest.approx(1 - 2 / 3 * brisk, abs=1e-3)


@given(st.floats(-1e-3, 1e-2), st.floats(-5, 5))
def test_a_contact_begins_without_a_jump_and_never_pulls(depth, speed):
    contact = HuntCrossley(1e9, 0.5)
    assert contact.force(max(depth, 0.0), speed) >= 0.0
    assert contact.force(0.0, speed) == 0.0
    still, growth = STOP.static_force_and_damping(0.1 + depth / 0.2, 0.2)
    assert STOP.force(0.1 + depth / 0.2, speed, 0.2) == pytest.approx(
        max(still + growth * speed, 0.0), rel=1e-12
    )


def test_an_end_stop_ends_the_way_and_the_book_of_the_load_still_closes():
    muscle = replace(chosen_muscle(), stop=STOP)
    valve = Valve(2e-8, 0.4)
    metered = WithEnergyMeters(
        Plant(muscle, FillDischarge(Supply(6e5), valve, valve), HangingMass(5.0))
    )
    start = metered.extend_state(metered.plant.state_at(pressure=1e5))
    command = Schedule({"fill": ((0.05, 1), (0.5, 0)), "discharge": ((0.7, 1), (0.9, 0))})
    run = simulate(
        metered,
        command,
        duration=1.0,
        initial_state=start,
        integrator=Rodas4(1e-10),
        output_times=1e-3,
    )
    assert 0.1 < run["contraction"].max() < 0.11
    assert run["force"].min() < 0.0
    energy = run["kinetic_energy"] + run["potential_energy"]
    np.testing.assert_allclose(energy - energy[0], run["work_of_tension"], atol=1e-7)


# Series spring


def in_series(stiffness=2e5, **parts):
    return replace(chosen_muscle(), series=SeriesSpring(stiffness), **parts)


@pytest.mark.parametrize("series", [SeriesSpring(2e5), CubicSeriesSpring(5e4, 1e-3)])
@pytest.mark.parametrize("contraction", [-0.02, 0.0, 0.1, 0.2])
@pytest.mark.parametrize("p", [-2e4, 0.0, 2e5, 5e5])
@pytest.mark.parametrize("stop", [None, STOP])
def test_a_series_spring_at_rest_holds_what_the_contractile_part_pulls(
    contraction, p, stop, series
):
    muscle = replace(in_series(**({"stop": stop} if stop else {})), series=series)
    inner = muscle.steady_state(p, contraction)["inner_contraction"]
    stretch = (inner - contraction) * 0.2
    assert muscle.series.force(stretch) == pytest.approx(muscle.static_force(p, inner), abs=1e-6)
    pull = muscle.compute_force(p, inner, contraction, 0.3, {"inner_contraction": inner})
    assert pull.tension == pytest.approx(max(muscle.static_force(p, inner), 0.0), abs=1e-6)
    assert pull.inner_speed == pytest.approx(0.0, abs=1e-8)


@given(st.floats(-0.05, 0.25), st.floats(-0.03, 0.03), st.floats(-5e4, 6e5))
def test_the_speed_inside_balances_the_forces(contraction, stretch, p):
    """Contractile - spring - damper - stop = series force, with a stop that has damping and a
    lopsided damper.
    """
    muscle = in_series(stop=STOP, damper=DirectionalDamper(300.0, 150.0, 1e-3, 0.0))
    inner = contraction + stretch / 0.2
    pull = muscle.compute_force(p, inner, contraction, 0.0, {"inner_contraction": inner})
    held = muscle.unclamped_tension(p, inner, pull.inner_speed) - muscle.stop.force(
        inner, pull.inner_speed, 0.2
    )
    assert held == pytest.approx(muscle.series.force(stretch), rel=1e-9, abs=1e-6)


def test_a_stiff_series_spring_tends_to_the_rigid_muscle():
    valve = Valve(5e-9, 0.4)
    courses = []
    for muscle in (chosen_muscle(), in_series(1e6), in_series(1e7)):
        plant = Plant(muscle, FillDischarge(Supply(5e5), valve, valve), HangingMass(20.0))
        start = plant.state_at(pressure=3e5, position=0.01)
        command = Schedule({"fill": ((0.2, 1), (0.5, 0))})
        courses.append(
            simulate(plant, command, duration=1.0, initial_state=start, integrator=Rodas4(1e-8))[
                "position"
            ]
        )
    apart = [np.abs(course - courses[0]).max() for course in courses[1:]]
    assert apart[0] > 1e-4
    assert apart[1] / apart[0] == pytest.approx(0.1, rel=0.15)


def test_a_cubic_series_spring_doubles_its_force_at_the_hardening_stretch_and_never_pushes():
    spring = CubicSeriesSpring(5e4, 2e-3)
    assert [spring.force(s) for s in (-1e-3, 0.0, 2e-3)] == [0.0, 0.0, 200.0]
    for stretch in (1e-4, 2e-3, 5e-3):
        slope = (spring.force(stretch + 1e-8) - spring.force(stretch - 1e-8)) / 2e-8
        assert spring.tangent_stiffness(stretch) == pytest.approx(slope, rel=1e-6)
    assert CubicSeriesSpring(5e4, 10.0).force(1e-3) == pytest.approx(
        SeriesSpring(5e4).force(1e-3), rel=1e-7
    )


def test_a_slack_series_spring_pulls_nothing_and_pushes_nothing():
    muscle = in_series()
    assert muscle.compute_force(5e5, 0.05, 0.1, 0.0, {"inner_contraction": 0.05}).tension == 0.0
    plant = Plant(muscle, ClosedChamber(), HangingMass(1.0))
    run = simulate(
        plant,
        ZERO_INPUT,
        duration=1.0,
        initial_state=plant.state_at(pressure=1e5, position=0.05, speed=0.5),
    )
    assert run["force"].min() == 0.0


def test_the_books_of_load_muscle_and_air_close_with_everything_in_it():
    """Contractile work = tension's + dampers' + friction's + springs', creep's, stop's and series
    spring's.
    """
    muscle = in_series(
        friction=Dahl(5e4, 15.0),
        creep=CreepElements((5e3,), (0.2,)),
        stop=STOP,
        damper=Serres2009Damper(),
        wall=ViscoelasticWall(2e-11, 0.02),
    )
    valve = Valve(2e-8, 0.4)
    metered = WithEnergyMeters(
        Plant(muscle, FillDischarge(Supply(6e5), valve, valve), HangingMass(20.0), Polytropic(1.2))
    )
    start = metered.extend_state(metered.plant.state_at(pressure=2e5, position=0.005))
    command = Schedule({"fill": ((0.1, 1), (0.6, 0)), "discharge": ((0.8, 1), (1.1, 0))})
    run = simulate(metered, command, duration=1.5, initial_state=start, integrator=Rodas4(1e-9))
    assert run["inner_contraction"].max() > 0.1
    given_out = (
        run["work_of_tension"] + run["damping_heat"] + run["element_work"] + run["friction_work"]
    )
    np.testing.assert_allclose(run["work_of_contractile"], given_out, atol=1e-6)
    energy = run["kinetic_energy"] + run["potential_energy"]
    np.testing.assert_allclose(energy - energy[0], run["work_of_tension"], atol=1e-6)
    assert np.abs(run["work_of_contractile"]).max() > 10.0


def test_what_cannot_stand_beside_a_series_spring_is_refused():
    with pytest.raises(
        ParameterError,
        match=(
            r"with a series spring, the damping coefficient must be greater than 0, .* at -100 kPa"
            r" gauge"
        ),
    ):
        in_series(damper=LinearDamper(0.0))
    with pytest.raises(ParameterError, match=r"at 1000 kPa gauge that of Reynolds2003Damper"):
        in_series(damper=Reynolds2003Damper())
    with pytest.raises(
        ParameterError, match="with a series spring, the friction must be rate-independent"
    ):
        in_series(friction=LuGre(5e4, 20.0))


def test_an_own_stop_without_its_force_at_rest_is_refused():
    class Wedge(Stop):
        def force(self, contraction, speed, resting_length):
            return 1e4 * contraction

    with pytest.raises(TypeError, match="static_force_and_damping"):
        Wedge()


def test_an_own_law_may_compute_its_greatest_contraction():
    class Falling(ForceLaw):
        def max_contraction(self, pressure):
            return 0.3

        def force(self, pressure, contraction):
            return 1e-3 * pressure * (1.0 - contraction / self.max_contraction(pressure))

    assert Plant(
        replace(chosen_muscle(), contractile=Falling()), ClosedChamber(), HangingMass(1.0)
    ).states


def test_unequal_lists_of_creep_are_refused():
    with pytest.raises(
        ParameterError, match="2 stiffnesses and 1 relaxation times are given; give one of each"
    ):
        CreepElements((1.0, 2.0), (1.0,))


def test_a_state_that_cannot_be_is_refused():
    plant = Plant(
        replace(chosen_muscle(), wall=ViscoelasticWall(5e-9, 0.1)),
        ClosedChamber(),
        HangingMass(1.0),
    )
    with pytest.raises(
        ParameterError,
        match=r"the volume of muscle would be -\S+ m3 at -9e\+04 Pa; its wall deforms too far",
    ):
        plant.state_at(pressure=-9e4)
    with pytest.raises(ParameterError, match="2 pressures are given for 1 muscles"):
        plant.state_at(pressure=(1e5, 2e5))
