"""ISO 6358: the published example, the printed pieces, choked, subsonic, laminar, reverse and shut,
without a jump.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from airmuscle.core import autodiff
from airmuscle.physics import REFERENCE_DENSITY, Air, Ambient, FillDischarge, Supply, Valve

T0 = 293.15
MATRIX = Valve(2.6167e-9, 0.433)
pressures = st.floats(2e4, 1.2e6)
valves = st.builds(Valve, st.floats(1e-10, 1e-7), st.floats(0.0, 0.6))


def printed(p1, p2, conductance, critical_ratio):
    """Volume flow at reference conditions as the third paper prints it, p1 the larger absolute
    pressure.
    """
    if p2 / p1 <= critical_ratio:
        return p1 * conductance
    return p1 * conductance * np.sqrt(1 - ((p2 / p1 - critical_ratio) / (1 - critical_ratio)) ** 2)


def test_the_published_worked_example():
    """C = 1e-8 m3/(s Pa), b = 0.35, 700 kPa upstream, choked, 293.15 K: 0.008295 kg/s."""
    assert Valve(1e-8, 0.35).mass_flow(700e3, 100e3, 1.0, T0) == pytest.approx(0.008295, abs=5e-7)


def test_the_matrix_valve_in_usual_units():
    """15.70 NL/(min bar); 110 NL/min choked from 7 bar absolute, 73 from 7 to 6 bar absolute."""
    litres_per_minute = 60e3 / REFERENCE_DENSITY
    assert MATRIX.mass_flow(7e5, 1e5, 1.0, T0) * litres_per_minute == pytest.approx(110, abs=0.5)
    assert MATRIX.mass_flow(7e5, 6e5, 1.0, T0) * litres_per_minute == pytest.approx(73, abs=0.5)


@given(valves, pressures, st.floats(0.0, 0.9989))
def test_up_to_the_laminar_chord_it_is_the_printed_formula(valve, upstream, ratio):
    flow = valve.mass_flow(upstream, ratio * upstream, 1.0, T0)
    expected = REFERENCE_DENSITY * printed(
        upstream, ratio * upstream, valve.conductance, valve.critical_ratio
    )
    assert flow == pytest.approx(expected, rel=1e-12)


@given(valves, pressures, st.floats(0.9991, 1.0))
def test_near_equal_pressures_it_is_linear_in_their_difference(valve, upstream, ratio):
    difference = upstream - ratio * upstream
    flow = valve.mass_flow(upstream, upstream - difference, 1.0, T0)
    at_chord = REFERENCE_DENSITY * printed(
        upstream, 0.999 * upstream, valve.conductance, valve.critical_ratio
    )
    assert flow == pytest.approx(at_chord * difference / (0.001 * upstream), rel=1e-9)


@given(valves, pressures, pressures)
def test_the_flow_reverses_with_the_pressures(valve, one, other):
    assert valve.mass_flow(one, other, 1.0, T0) == -valve.mass_flow(other, one, 1.0, T0)
    assert valve.mass_flow(one, one, 1.0, T0) == 0.0
    assert valve.mass_flow(one, other, 0.0, T0) == 0.0


@given(valves, pressures, pressures, st.floats(0.0, 1.0))
def test_more_difference_never_gives_less_flow_and_the_opening_scales_it(
    valve, upstream, downstream, opening
):
    assume(downstream < upstream)
    flow = valve.mass_flow(upstream, downstream, 1.0, T0)
    assert (
        flow
        >= valve.mass_flow(upstream, downstream + 0.1 * (upstream - downstream), 1.0, T0) - 1e-18
    )
    assert valve.mass_flow(upstream, downstream, opening, T0) == pytest.approx(opening * flow)


def test_hot_air_is_thinner():
    assert MATRIX.mass_flow(7e5, 1e5, 1.0, 4 * T0) == pytest.approx(
        MATRIX.mass_flow(7e5, 1e5, 1.0, T0) / 2
    )


@pytest.mark.parametrize("ratio", [0.2, 0.433, 0.7, 0.999, 1.0, 1 / 0.999, 1.5, 3.0])
def test_flow_is_continuous_and_its_slope_finite_on_every_kink(ratio):
    """Rates must be continuous on choke, chord and reversal; an infinite slope at equal pressures
    would stall.
    """
    upstream = 5e5
    here = MATRIX.mass_flow(upstream, ratio * upstream, 1.0, T0)
    for side in (-1e-9, 1e-9):
        assert MATRIX.mass_flow(upstream, (ratio + side) * upstream, 1.0, T0) == pytest.approx(
            here, abs=1e-8
        )
    slope = autodiff.derivative(MATRIX, "mass_flow", upstream, ratio * upstream, 1.0, T0, wrt=1)
    assert np.isfinite(slope)
    assert slope <= 0.0


def test_at_equal_pressures_the_traced_slope_is_the_chords():
    slope = autodiff.derivative(MATRIX, "mass_flow", 5e5, 5e5, 1.0, T0, wrt=1)
    step = MATRIX.mass_flow(5e5, 5e5 - 1.0, 1.0, T0)
    assert slope == pytest.approx(-step, rel=1e-6)


def test_two_valves_fill_and_discharge_and_shut_ones_pass_nothing():
    circuit, ambient = FillDischarge(Supply(548675.0), MATRIX, MATRIX), Ambient()
    inside = 3e5

    def flow(pressure, fill, discharge):
        openings = {"fill": fill, "discharge": discharge}
        return circuit.compute_flows((Air(pressure, T0),), {}, openings, ambient).flows[0].mass

    filling = flow(inside, 1.0, 0.0)
    emptying = flow(inside, 0.0, 1.0)
    assert filling == pytest.approx(MATRIX.mass_flow(650e3, inside, 1.0, T0))
    assert emptying == pytest.approx(-MATRIX.mass_flow(inside, 101_325.0, 1.0, T0))
    assert flow(inside, 1.0, 1.0) == pytest.approx(filling + emptying)
    assert flow(inside, 0.0, 0.0) == 0.0
    assert flow(8e5, 1.0, 0.0) < 0.0
