"""A tube delays and weakens what it passes; cut into pieces with inertia it tends to the closed
forms.

Steady isothermal flow: p1^2 - p2^2 = 256 mu R T L q g/(pi D^4) + zeta R T (q/A)^2, g = 1 laminar,
(Re/1187)^(3/4) beyond (Blasius), zeta of the ends. Small vibrations: q_L/p_0 = 1/(Z sinh(gamma L)),
gamma = sqrt((r + i w l) i w c), with r, l, c friction, inertance and compliance for each metre. A
front arrives after L over the speed of sound.
"""

from __future__ import annotations

import importlib.util
import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joints import chosen_muscle
from scipy.optimize import brentq

from airmuscle.engine import Rodas4, Schedule, simulate
from airmuscle.physics import (
    GAS_CONSTANT,
    Air,
    Ambient,
    DistributedTube,
    EnergyBalance,
    FillDischarge,
    Isometric,
    Isothermal,
    Plant,
    Polytropic,
    Supply,
    Tube,
    TubeOrifice,
    Valve,
    WithTubes,
)
from airmuscle.physics.pneumatics import NO_FLOW, SPECIFIC_HEAT_CONSTANT_PRESSURE

AMBIENT = Ambient()
WARM = AMBIENT.temperature
MU = 1.82e-5
GASES = [Isothermal(), Polytropic(1.2), EnergyBalance(0.0)]


def steady(p1, p2, length, diameter, end_loss=1.5):
    """The flow of the closed form, by root search."""
    reynolds = 4 / (np.pi * diameter * MU)
    area = np.pi / 4 * diameter**2

    def excess(q):
        g = max(reynolds * q / (64 / 0.3164) ** (4 / 3), 1.0) ** 0.75
        friction = 256 * MU * length * q * g / (np.pi * diameter**4)
        return GAS_CONSTANT * WARM * (friction + end_loss * (q / area) ** 2) - (p1**2 - p2**2)

    return brentq(excess, 0.0, 1.0, xtol=1e-18, rtol=1e-12)


def at_rest(tube, pressure, tilt=0.0):
    """States of a tube and its air_states; `tilt` makes the pressures fall towards the muscle."""
    state = tube.steady_state(Air(pressure, WARM), AMBIENT)
    n = tube.segment_count
    for i in range(n):
        prefix = "tube." if n == 1 else f"tube{i + 1}."
        for name in ("air_mass", "internal_energy"):
            if prefix + name in state:
                state[prefix + name] *= 1 - tilt * i / n
    return state


# Steady flow


@pytest.mark.parametrize("pieces", [1, 3, 17])
@pytest.mark.parametrize(("p1", "p2"), [(3.01e5, 3e5), (6e5, 5e5), (2e5, 1.9e5)])
@pytest.mark.parametrize(
    ("length", "diameter", "end_loss"), [(2.0, 4e-3, 1.5), (10.0, 2e-3, 0.0), (0.5, 1e-3, 3.0)]
)
def test_a_steady_flow_obeys_darcys_law_however_few_the_pieces(
    p1, p2, length, diameter, end_loss, pieces
):
    tube = DistributedTube(length, diameter, pieces, end_loss=end_loss)
    q = steady(p1, p2, length, diameter, end_loss)
    area = np.pi / 4 * diameter**2
    ends = GAS_CONSTANT * WARM * end_loss * (q / area) ** 2
    squares = p1**2 - (p1**2 - p2**2 - ends) * np.arange(pieces) / pieces
    state = {}
    for name, p in zip(tube.prefixes, np.sqrt(squares), strict=True):
        state |= {
            f"{name}air_mass": p * tube.segment_volume / (GAS_CONSTANT * WARM),
            f"{name}flow": q,
        }
    rates, onward = tube.rates(
        state, tube.air_states(state, AMBIENT), NO_FLOW, Air(p2, WARM), AMBIENT
    )
    driving = tube.area * (p1 - p2) / length
    assert onward.mass == q
    for name in tube.prefixes:
        assert rates[f"{name}flow"] == pytest.approx(0.0, abs=1e-9 * driving)
    for name in tube.prefixes[1:]:
        assert rates[f"{name}air_mass"] == pytest.approx(0.0, abs=1e-15)


@given(st.floats(-1e-2, 1e-2), st.floats(0.5, 10))
def test_friction_holds_back_in_both_directions_and_is_continuous_at_its_transition(q, density):
    tube = DistributedTube(2.0, 4e-3)
    assert tube.friction_coefficient(q, density) == tube.friction_coefficient(-q, density) > 0
    critical = (64 / 0.3164) ** (4 / 3) * tube.area * MU / tube.diameter
    one, other = (tube.friction_coefficient(critical * (1 + s), density) for s in (-1e-9, 1e-9))
    assert one == pytest.approx(other, rel=1e-8)
    assert tube.friction_coefficient(critical, density) == pytest.approx(
        32 * MU / (density * tube.diameter**2)
    )


@pytest.mark.parametrize(
    ("length", "diameter"), [(1.0, 4e-3), (2.0, 4e-3), (5.0, 6e-3), (2.0, 2.5e-3)]
)
def test_the_formula_for_a_tubes_conductance_agrees_with_darcys_law(length, diameter):
    """From 6 to 5.5 bar absolute. This holds the formula's units fast: others would be off by
    powers of ten.
    """
    orifice = TubeOrifice(length, diameter)
    found = orifice.mass_flow(6e5, 5.5e5, 1.0, WARM)
    assert found == pytest.approx(steady(6e5, 5.5e5, length, diameter), rel=0.06)
    assert 0.0 < orifice.critical_ratio < 0.61


@pytest.mark.parametrize(
    ("drop", "low", "high"), [(0.02, 0.05, 0.19), (0.08, -0.03, 0.08), (0.3, -0.12, -0.02)]
)
def test_the_formula_for_a_tubes_conductance_differs_from_darcys_law_as_stated(drop, low, high):
    cases = itertools.product((4e5, 5e5, 7e5, 9e5), (0.5, 1.0, 2.0), (4e-3, 6e-3, 8e-3))
    found = [_excess_of_the_formula(p, drop, length, diameter) for p, length, diameter in cases]
    assert low <= min(found) <= low + 0.01
    assert high - 0.01 <= max(found) <= high


def test_the_formula_for_a_tubes_conductance_is_too_large_for_laminar_flow():
    assert _excess_of_the_formula(2e5, 0.02, 8.0, 2e-3) == pytest.approx(0.64, abs=0.01)
    assert _excess_of_the_formula(2e5, 0.08, 8.0, 2e-3) == pytest.approx(0.31, abs=0.01)


def _excess_of_the_formula(pressure, drop, length, diameter):
    found = TubeOrifice(length, diameter).mass_flow(pressure, (1 - drop) * pressure, 1.0, WARM)
    return found / steady(pressure, (1 - drop) * pressure, length, diameter) - 1


@pytest.mark.parametrize("mass_flow", [2e-4, -2e-4])
def test_the_air_that_flows_on_is_as_warm_as_where_it_comes_from(mass_flow):
    tube = DistributedTube(1.0, 3e-3, 2, EnergyBalance(0.0))
    state = at_rest(tube, 3e5) | {"tube2.flow": mass_flow}
    state["tube2.internal_energy"] *= 1.1
    air_states = tube.air_states(state, AMBIENT)
    muscle = Air(3e5, 350.0)
    _, onward = tube.rates(state, air_states, NO_FLOW, muscle, AMBIENT)
    origin = air_states[1] if mass_flow > 0 else muscle
    assert onward.enthalpy == pytest.approx(
        SPECIFIC_HEAT_CONSTANT_PRESSURE * origin.temperature * mass_flow
    )


def test_a_tube_of_a_size_has_its_volume_and_its_flow():
    tube = Tube.from_dimensions(2.0, 4e-3)
    assert tube.volume == pytest.approx(np.pi * 4e-6 * 2.0)
    assert tube.orifice.conductance == pytest.approx(
        0.029 * 1.6e-5 / np.sqrt(2.0 / 4e-3**1.25 + 510)
    )
    as_valve = Valve(tube.orifice.conductance, tube.orifice.critical_ratio)
    for p2 in (1e5, 4e5, 5.9999e5, 6e5, 7e5):
        assert tube.orifice.mass_flow(6e5, p2, 0.5, WARM) == pytest.approx(
            as_valve.mass_flow(6e5, p2, 0.5, WARM)
        )


@pytest.mark.parametrize("pieces", [2, 7])
def test_the_pieces_of_a_lumped_tube_flow_as_the_whole(pieces):
    """Exact for b = 0: the squares of the pressures fall by equal steps."""
    whole = Tube(Valve(1e-8, 0.0), 2e-5)
    cut = Tube(Valve(1e-8, 0.0), 2e-5, pieces)
    p1 = 6e5
    p2 = 3e5
    squares = p1**2 + (p2**2 - p1**2) * np.arange(pieces) / pieces
    state = {
        f"tube{i}.air_mass": p * 2e-5 / pieces / (GAS_CONSTANT * WARM)
        for i, p in enumerate(np.sqrt(squares), 1)
    }
    rates, onward = cut.rates(
        state, cut.air_states(state, AMBIENT), NO_FLOW, Air(p2, WARM), AMBIENT
    )
    expected = whole.orifice.mass_flow(p1, p2, 1.0, WARM)
    assert onward.mass == pytest.approx(expected, rel=1e-9)
    assert [abs(rates[f"tube{i}.air_mass"]) < 1e-9 * expected for i in range(2, pieces + 1)] == [
        True
    ] * (pieces - 1)


# Delay and attenuation


def linearised(tube, pressure):
    """Rates of flows and inner pieces by themselves, and by 1 Pa imposed on the first; the muscle's
    pressure stays.
    """
    state = at_rest(tube, pressure)
    muscle = tube.air_states(state, AMBIENT)[0]
    first = [n for n in state if n.startswith("tube1.") and not n.endswith("flow")]
    inner = [n for n in state if n not in first]
    exponent = tube.gas.sound_speed(muscle) ** 2 / (GAS_CONSTANT * muscle.temperature)

    def rates(values):
        found = tube.rates(values, tube.air_states(values, AMBIENT), NO_FLOW, muscle, AMBIENT)[0]
        return np.array([found[n] for n in inner])

    def by(shift):
        up, down = ({**state, **{n: state[n] + s * shift[n] for n in shift}} for s in (1, -1))
        return (rates(up) - rates(down)) / 2

    sizes = {n: 1e-6 * (state[n] if state[n] else 1e-5) for n in inner}
    a = np.stack([by({n: size}) / size for n, size in sizes.items()], axis=1)
    # along the gas's own process mass changes by dp/(p n), and an energy, where there is one, by
    # dp/p
    imposed = {first[0]: state[first[0]] / exponent} | {n: state[n] for n in first[1:]}
    b = by({n: 1e-6 * size for n, size in imposed.items()}) / 1e-6 / pressure
    return a, b, inner.index(f"tube{tube.segment_count}.flow"), muscle


@pytest.mark.parametrize("gas", GASES, ids=repr)
def test_vibrations_are_delayed_and_weakened_as_the_telegraph_equation_has_it(gas):
    pressure = 3e5
    length = 2.0
    diameter = 2e-3
    tube = DistributedTube(length, diameter, 40, gas)
    a, b, flow, air = linearised(tube, pressure)
    c = gas.sound_speed(air)
    density = pressure / (GAS_CONSTANT * air.temperature)
    area = tube.area
    # for the mass flow: pressure falls by (l q' + r q) for each metre, mass grows by area/c^2 p'
    inertance = 1 / area
    friction = 32 * MU / (density * diameter**2 * area)
    compliance = area / c**2
    for frequency in (5.0, 20.0, 45.0, 100.0, 200.0):
        w = 2j * np.pi * frequency
        series = friction + w * inertance
        shunt = w * compliance
        expected = 1 / (np.sqrt(series / shunt) * np.sinh(np.sqrt(series * shunt) * length))
        found = np.linalg.solve(w * np.eye(len(b)) - a, b)[flow]
        assert abs(found / expected - 1) < 0.05


def shock_tube(tube, gas, duration):
    """Both ends behind much wider openings: 3 bar at the valve, then a little more."""
    wide = Valve(1e-6, 0.4)
    plant = Plant(
        chosen_muscle(),
        WithTubes(FillDischarge(Supply(2.1e5), wide, wide), tube),
        Isometric(0.05),
        gas,
    )
    start = plant.state_at(pressure=2e5)
    return simulate(
        plant,
        Schedule({"fill": ((0.0, 1.0),)}),
        duration=duration,
        initial_state=start,
        integrator=Rodas4(1e-6),
        output_times=1e-5,
    )


@pytest.mark.parametrize(
    ("length", "gas"),
    [
        (1.0, Isothermal()),
        pytest.param(3.0, Isothermal(), marks=pytest.mark.slow),
        pytest.param(3.0, EnergyBalance(0.0), marks=pytest.mark.slow),
    ],
)
def test_a_step_arrives_after_the_length_over_the_speed_of_sound(gas, length):
    tube = DistributedTube(length, 4e-3, 24, gas)
    delay = length / gas.sound_speed(Air(3e5, WARM))
    run = shock_tube(tube, gas, 1.6 * delay)
    flow = run["tube24.flow"]
    half = run["time"][np.argmax(flow > 0.5 * flow.max())]
    assert half == pytest.approx(delay, rel=0.05)
    assert np.abs(flow[run["time"] < 0.7 * delay]).max() < 0.01 * flow.max()


@pytest.mark.parametrize(
    ("diameter", "segments"), [pytest.param(2e-3, 60, marks=pytest.mark.slow), (1e-3, 40)]
)
def test_the_front_fades_with_the_way_that_it_runs(diameter, segments):
    """exp(-f L/(2 c)): the flow behind a front that has run L, by that at the valve when it set
    out.

    The segments smear the front, and a front that fades less needs more of them.
    """
    length, gas = 2.0, Isothermal()
    tube, c = DistributedTube(length, diameter, segments, gas), gas.sound_speed(Air(3e5, WARM))
    run = shock_tube(tube, gas, 1.2 * length / c)
    friction = tube.friction_coefficient(0.0, 3.05e5 / (GAS_CONSTANT * WARM))
    at = np.argmax(
        run["time"] >= 1.08 * length / c
    )  # behind the smeared front, before what comes back
    sent = tube.area / c * 1e4
    assert run[f"tube{9 * segments // 10}.flow"][at] / sent == pytest.approx(
        np.exp(-friction * 0.9 * length / (2 * c)), rel=0.1
    )


def test_a_lumped_tube_knows_no_delay_and_both_agree_once_the_waves_are_gone():
    length = 2.0
    diameter = 4e-3
    valve = Valve(2.6167e-9, 0.433)
    courses = {}
    for tube in (DistributedTube(length, diameter, 30), Tube.from_dimensions(length, diameter)):
        circuit = WithTubes(FillDischarge(Supply(5.5e5), valve, valve), tube)
        plant = Plant(chosen_muscle(), circuit, Isometric(0.1), Isothermal())
        start = plant.state_at(pressure=0.0)
        times = np.concatenate([np.arange(0.0, 0.02, 1e-4), np.arange(0.02, 1.0, 1e-3)])
        courses[type(tube).__name__] = simulate(
            plant,
            Schedule({"fill": ((0.0, 1.0),)}),
            duration=1.0,
            initial_state=start,
            output_times=times,
        )
    lumped = courses["Tube"]
    distributed = courses["DistributedTube"]
    early = np.searchsorted(lumped["time"], 0.5 * length / 290.0)
    assert lumped["mass_flow"][early] > 1e3 * abs(distributed["mass_flow"][early])
    apart = np.abs(lumped["pressure"] - distributed["pressure"])
    assert apart.max() < 0.01 * 5.5e5


@pytest.mark.parametrize(
    ("length", "conductance", "per_cent"),
    [
        (1.0, 2.6167e-9, 0.3),
        *(
            pytest.param(*row, marks=pytest.mark.slow)
            for row in ((8.0, 2.6167e-9, 1.2), (0.25, 1e-8, 0.7))
        ),
    ],
)
def test_the_page_states_the_error_of_lumped_tubes(length, conductance, per_cent):
    root = Path(__file__).parents[2]
    script = root / "release" / "figures" / "make_tubes_figure.py"
    spec = importlib.util.spec_from_file_location("make_tubes_figure", script)
    drawing = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(drawing)
    assert 100 * drawing.max_error(length, 1, conductance) == pytest.approx(per_cent, abs=0.07)
    page = (root / "docs" / "guides" / "components.md").read_text(encoding="utf-8")
    assert f"{per_cent} %" in page
