"""What every orifice keeps: continuous, never uphill, monotone in both pressures, choked,
reversible or one way.

ISO 6358-1:2013 with index m and cracking pressure dp_c, printed form: phi = (1 - ((r - b)/(1 - b -
dp_c/p1))^2)^m. With m = 0.5 and dp_c = 0 it is Valve. A check valve passes one way.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from airmuscle.core import autodiff, cite, evaluation, nodes, ops
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    CheckValve,
    Orifice,
    SubsonicIndexValve,
    Valve,
)

T0 = REFERENCE_TEMPERATURE
pressures = st.floats(2e4, 1.2e6)
conductances = st.floats(1e-10, 1e-7)
ratios = st.floats(0.0, 0.6)
indices = st.floats(0.3, 1.0)
crackings = st.one_of(st.just(0.0), st.floats(1e3, 3e5))
valves = st.builds(Valve, conductances, ratios)
indexed = st.builds(SubsonicIndexValve, conductances, ratios, indices, crackings)
reversible = st.one_of(valves, indexed)
orifices = st.one_of(reversible, st.builds(CheckValve, reversible))

EXAMPLES = {
    "valve": Valve(1e-8, 0.3),
    "elliptic": SubsonicIndexValve(1e-8, 0.3),
    "indexed": SubsonicIndexValve(1e-8, 0.25, 0.6),
    "parabolic": SubsonicIndexValve(1e-8, 0.0, 1.0),
    "cracking": SubsonicIndexValve(1e-8, 0.3, 0.55, 3e4),
    "all range cracking": SubsonicIndexValve(1e-8, 0.6, 0.5, 3e5),
    "check": CheckValve(Valve(1e-8, 0.3)),
    "check, cracking": CheckValve(SubsonicIndexValve(5e-8, 0.25, cracking_pressure=2e4)),
}
every_orifice = pytest.mark.parametrize("law", EXAMPLES.values(), ids=EXAMPLES)


def flow(law: Orifice, upstream, downstream):
    return law.mass_flow(upstream, downstream, 1.0, T0)


def printed(valve: SubsonicIndexValve, p1: float, p2: float) -> float:
    """Mass flow as ISO 6358-1:2013 has it, p1 > p2."""
    r = p2 / p1
    b = valve.critical_ratio
    crack = valve.cracking_pressure / p1
    choked = valve.conductance * REFERENCE_DENSITY * p1
    if r >= 1 - crack:
        return 0.0
    return (
        choked
        if r <= b
        else choked * (1 - ((r - b) / (1 - b - crack)) ** 2) ** valve.subsonic_index
    )


@given(indexed, pressures, st.floats(0.0, 1.0))
def test_away_from_the_laminar_chord_it_is_the_printed_formula(valve, p1, r):
    p2 = r * p1
    crack = valve.cracking_pressure
    assume((1 - valve.critical_ratio) * p1 - crack > 2e-3 * p1)
    assume(p1 - p2 > crack + 1.001e-3 * p1 or p1 - p2 < crack)
    expected = printed(valve, p1, p2)
    assert flow(valve, p1, p2) == pytest.approx(expected, rel=1e-9, abs=1e-15)


@given(conductances, ratios, st.floats(0.97, 0.9999), pressures, pressures)
def test_with_index_one_half_and_no_cracking_pressure_it_is_the_valve(c, b, laminar, one, other):
    simple = Valve(c, b, laminar)
    general = SubsonicIndexValve(c, b, 0.5, 0.0, laminar)
    scale = c * REFERENCE_DENSITY * max(one, other)
    assert flow(general, one, other) == pytest.approx(flow(simple, one, other), abs=1e-9 * scale)


def test_a_number_worked_out_by_hand():
    """C = 1e-8, b = 0.2, m = 0.6, dp_c = 30 kPa, 500 to 400 kPa: x = 0.6/0.74, phi = 0.342586^0.6 =
    0.525850.
    """
    valve = SubsonicIndexValve(1e-8, 0.2, 0.6, 30e3)
    assert flow(valve, 5e5, 4e5) == pytest.approx(1e-8 * 1.185 * 5e5 * 0.525850, rel=2e-6)


@given(orifices, pressures, pressures)
def test_air_never_flows_uphill(law, one, other):
    found = flow(law, one, other)
    assert found * (one - other) >= 0.0
    assert flow(law, one, one) == 0.0
    assert law.mass_flow(one, other, 0.0, T0) == 0.0


@given(orifices, pressures, pressures, st.floats(0.001, 0.5))
def test_more_pressure_before_and_less_behind_never_lessen_the_flow(law, one, other, step):
    here = flow(law, one, other)
    slack = 1e-12 * abs(here)
    assert flow(law, one * (1 + step), other) >= here - slack
    assert flow(law, one, other * (1 + step)) <= here + slack


@given(reversible, pressures, pressures)
def test_it_reverses_with_the_pressures(law, one, other):
    assert flow(law, one, other) == -flow(law, other, one)


@given(reversible, pressures, pressures, st.floats(0.0, 1.0), st.floats(200.0, 400.0))
def test_opening_and_temperature_scale_the_flow(law, one, other, opening, temperature):
    expected = opening * np.sqrt(T0 / temperature) * flow(law, one, other)
    assert law.mass_flow(one, other, opening, temperature) == pytest.approx(expected, rel=1e-12)


@given(reversible, pressures)
def test_a_vacuum_chokes_it(law, p1):
    crack = getattr(law, "cracking_pressure", 0.0)
    assume(p1 > 1.01 * crack)
    assert flow(law, p1, 0.0) == pytest.approx(law.conductance * REFERENCE_DENSITY * p1)


@given(reversible, pressures, pressures)
def test_a_check_valve_is_its_orifice_one_way_and_shut_the_other(law, one, other):
    check = CheckValve(law)
    assert flow(check, max(one, other), min(one, other)) == flow(
        law, max(one, other), min(one, other)
    )
    assert flow(check, min(one, other), max(one, other)) == 0.0


def test_below_its_cracking_pressure_it_is_shut_and_above_it_opens():
    valve = SubsonicIndexValve(5e-8, 0.25, cracking_pressure=20e3)
    assert flow(valve, 320e3, 301e3) == 0.0
    assert 0.0 < flow(valve, 320e3, 299.9e3) < flow(valve, 320e3, 299e3)


def test_where_cracking_takes_up_all_of_the_subsonic_range_it_opens_over_the_laminar_one():
    """b = 0.6 and dp_c = 3 bar at 4 bar: 1 - b - dp_c/p1 < 0, where the printed formula has no
    meaning.
    """
    valve = SubsonicIndexValve(1e-8, 0.6, 0.5, 3e5)
    p1 = 4e5
    choked = 1e-8 * REFERENCE_DENSITY * p1
    shares = [
        flow(valve, p1, p1 - 3e5 - part * 0.001 * p1) / choked
        for part in (0.0, 0.25, 0.5, 1.0, 50.0)
    ]
    assert shares == pytest.approx([0.0, 0.25, 0.5, 1.0, 1.0])


@given(indexed, st.floats(0.0, 2.0))
def test_the_power_itself_has_a_finite_slope_even_where_another_branch_rules(valve, way):
    """Derivatives of both branches are worked out before one is chosen: infinity times zero would
    be NaN in JAX.
    """
    assert np.isfinite(autodiff.derivative(valve, "_fraction", way, wrt=0))


def kinks(law: Orifice, p1: float) -> list[float]:
    """Downstream pressures [Pa] at which a branch of the law changes, forward and reverse."""
    inner = getattr(law, "orifice", law)
    b = inner.critical_ratio
    crack = getattr(inner, "cracking_pressure", 0.0)
    laminar = inner.laminar_ratio
    forward = [b * p1, p1 - crack, laminar * p1 - crack, p1]
    return [*forward, *(p1 / r for r in (laminar, b) if r > 0), p1 + crack, (p1 + crack) / laminar]


@every_orifice
@pytest.mark.parametrize("p1", [5e4, 1.013e5, 4e5, 7.5e5, 1.2e6])
def test_rates_are_continuous_on_a_grid_of_points_on_the_kinks(law, p1):
    """A step of 1e-9 of the pressure changes the flow by less than 1e-6 of the choked one, whatever
    the branch.
    """
    inner = getattr(law, "orifice", law)
    scale = inner.conductance * REFERENCE_DENSITY * 1.2e6
    for p2 in kinks(law, p1):
        here = flow(law, p1, p2)
        for side in (-1e-9, 1e-9):
            assert flow(law, p1, p2 * (1 + side)) == pytest.approx(here, abs=1e-6 * scale), p2
            assert flow(law, p1 * (1 + side), p2) == pytest.approx(here, abs=1e-6 * scale), p2


@every_orifice
def test_slopes_are_finite_everywhere_and_of_the_right_sign(law):
    """Traced derivatives, on the kinks too: an infinite or undefined one would stop an implicit
    method.
    """
    for p1 in (5e4, 4e5, 1.2e6):
        for p2 in [*kinks(law, p1), *np.linspace(1e3, 1.5e6, 60)]:
            by_upstream, by_downstream = (
                autodiff.derivative(law, "mass_flow", p1, float(p2), 1.0, T0, wrt=i) for i in (0, 1)
            )
            assert np.isfinite([by_upstream, by_downstream]).all(), (p1, p2)
            assert by_upstream >= -1e-20, (p1, p2)
            assert by_downstream <= 1e-20, (p1, p2)


@every_orifice
def test_arrays_floats_and_symbols_agree(law):
    p2 = np.linspace(5e4, 9e5, 301)
    on_array = flow(law, 4e5, p2)
    assert on_array == pytest.approx([flow(law, 4e5, float(p)) for p in p2], rel=1e-13, abs=1e-18)
    x = nodes.symbol("x")
    recorded = law.mass_flow(4e5, x, 1.0, T0)
    assert ops.is_symbol(recorded)
    ((by_symbol,),) = evaluation.Recorded([[x]], [[recorded]]).at_points([p2])
    assert on_array == pytest.approx(by_symbol, rel=1e-12, abs=1e-16)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SubsonicIndexValve(1e-8, 0.3, 1.5), "subsonic_index .* allowed range: 0.25 to 1"),
        (
            lambda: SubsonicIndexValve(1e-8, 0.3, 0.5, -1.0),
            "cracking_pressure .* allowed range: 0 to 500000 Pa",
        ),
        (lambda: SubsonicIndexValve(1e-8, 1.0), "critical_ratio .* allowed range: 0 to 0.95"),
        (lambda: SubsonicIndexValve(float("nan"), 0.3), "conductance .* must be finite"),
        (
            lambda: SubsonicIndexValve(1.1, 0.3),
            "conductance .* Values are in SI units; check the unit",
        ),
    ],
)
def test_an_impossible_valve_is_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_the_sources_are_named():
    assert {r.key for r in cite(CheckValve(SubsonicIndexValve(1e-8, 0.3)))} == {"iso-6358-1-2013"}
