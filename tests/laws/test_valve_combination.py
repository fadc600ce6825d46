"""Valves in series and in parallel as one, judged by the pressure between them found by root
search.

At choke and near equal pressures the equivalent valve is exact; between, an ellipse stands for a
curve that is none, and is off by no more than its docstring says. In series the order matters.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from airmuscle.errors import ParameterError
from airmuscle.physics import SubsonicIndexValve, Valve, in_parallel, in_series

P1 = 7e5
T0 = 293.15
valves = st.builds(Valve, st.floats(1e-9, 1e-7), st.floats(0.0, 0.6))


def phi(ratio: float, b: float) -> float:
    """Share of the choked flow as ISO 6358 prints it, without any laminar range."""
    return 1.0 if ratio <= b else np.sqrt(max(0.0, 1 - ((ratio - b) / (1 - b)) ** 2))


def exact(parts: tuple[Valve, ...], ratio: float) -> float:
    """Flow through valves in series over the upstream pressure, C phi of the whole, by nested root
    searches.
    """
    if len(parts) == 1:
        return parts[0].conductance * phi(ratio, parts[0].critical_ratio)
    first = parts[0]
    rest = parts[1:]

    def surplus(share: float) -> float:
        return first.conductance * phi(share, first.critical_ratio) - share * exact(
            rest, ratio / share
        )

    if surplus(1.0) >= 0:
        return first.conductance * phi(1.0, first.critical_ratio)
    share = brentq(surplus, max(ratio, 1e-9), 1.0, xtol=1e-13)
    return first.conductance * phi(share, first.critical_ratio)


@given(valves, valves)
def test_the_choked_conductance_in_series_is_exact(first, second):
    assert in_series(first, second).conductance == pytest.approx(
        exact((first, second), 1e-6), rel=1e-9
    )


@given(valves, valves)
def test_near_equal_pressures_the_squares_of_the_flow_add_up(first, second):
    """dp = (1 - b) (q/C)^2 / 2 for each: their sum is the whole's."""
    whole = in_series(first, second)
    resistance = [(1 - v.critical_ratio) / v.conductance**2 for v in (first, second, whole)]
    assert resistance[2] == pytest.approx(resistance[0] + resistance[1], rel=1e-9)


def off(whole: Valve, truth) -> float:
    """The greatest difference from the truth over all pressure ratios, in shares of the choked
    flow.
    """
    ratios = np.linspace(0.01, 0.99, 50)
    differences = [whole.conductance * phi(r, whole.critical_ratio) - truth(r) for r in ratios]
    return float(np.abs(differences).max() / whole.conductance)


def pairs(ratios: tuple[float, ...]):
    for b1, b2, c in itertools.product(ratios, ratios, (0.1, 0.5, 0.8, 1.0, 1.3, 2.0, 10.0)):
        yield Valve(1e-8, b1), Valve(c * 1e-8, b2)


@pytest.mark.parametrize(
    ("ratios", "series", "parallel"),
    [((0.0, 0.2, 0.4, 0.6), 0.028, 0.053), ((0.2, 0.35, 0.5), 0.016, 0.0181)],
)
def test_between_they_are_off_by_what_the_docstrings_say_and_not_much_less(
    ratios, series, parallel
):
    in_line = max(
        off(in_series(a, b), lambda r, a=a, b=b: exact((a, b), r)) for a, b in pairs(ratios)
    )
    aside = max(
        off(in_parallel(a, b), lambda r, a=a, b=b: exact((a,), r) + exact((b,), r))
        for a, b in pairs(ratios)
    )
    assert 0.9 * series < in_line <= series
    assert 0.9 * parallel < aside <= parallel


def test_the_order_matters_in_series():
    wide = Valve(2e-8, 0.3)
    narrow = Valve(1e-8, 0.3)
    assert in_series(narrow, wide).conductance == pytest.approx(0.9653e-8, rel=1e-4)
    assert in_series(wide, narrow).conductance == pytest.approx(0.9213e-8, rel=1e-4)
    assert in_parallel(wide, narrow) == in_parallel(narrow, wide)


def test_a_first_valve_that_chokes_sets_the_flow():
    """C1 <= b1 C2: what is behind it cannot matter at choke, but moves b."""
    first = Valve(1e-9, 0.4)
    whole = in_series(first, Valve(1e-8, 0.3))
    assert whole.conductance == first.conductance
    assert whole.critical_ratio < first.critical_ratio


def test_without_a_critical_ratio_the_rules_are_those_of_squares():
    """b = 0: q^2 = C^2 (p1^2 - p2^2), so 1/C^2 adds up in series and the equivalent is exact."""
    whole = in_series(Valve(3e-9, 0.0), Valve(4e-9, 0.0))
    assert whole.conductance == pytest.approx(2.4e-9)
    assert whole.critical_ratio == pytest.approx(0.0, abs=1e-12)


@given(
    st.lists(st.floats(1e-9, 1e-7), min_size=2, max_size=5),
    st.floats(0.0, 0.6),
    st.floats(0.0, 0.99),
)
def test_valves_of_one_critical_ratio_side_by_side_are_exact(conductances, b, ratio):
    whole = in_parallel(*(Valve(c, b) for c in conductances))
    expected = sum(Valve(c, b).mass_flow(P1, ratio * P1, 1.0, T0) for c in conductances)
    assert whole.mass_flow(P1, ratio * P1, 1.0, T0) == pytest.approx(expected, rel=1e-9)


@given(valves, valves, valves)
def test_the_choked_conductance_of_three_in_series_is_exact(a, b, c):
    whole = in_series(a, b, c)
    assert whole.conductance == pytest.approx(exact((a, b, c), 1e-6), rel=1e-9)
    resistance = [(1 - v.critical_ratio) / v.conductance**2 for v in (a, b, c, whole)]
    assert resistance[3] == pytest.approx(sum(resistance[:3]), rel=1e-9)
    assert in_series(a) == in_parallel(a) == a


@pytest.mark.parametrize("order", list(itertools.permutations((0.8, 1.0, 1.5))))
def test_three_in_series_stay_near_the_truth(order):
    parts = tuple(Valve(c * 1e-8, 0.3) for c in order)
    assert off(in_series(*parts), lambda r: exact(parts, r)) < 0.018


def test_a_silencer_behind_an_exhaust_lessens_it_as_a_valve_in_series():
    exhaust = Valve(1.2e-8, 0.2)
    silencer = Valve(3e-8, 0.5)
    whole = in_series(exhaust, silencer)
    assert 0.9 * exhaust.conductance < whole.conductance < exhaust.conductance
    assert whole.mass_flow(2e5, 1e5, 1.0, T0) < exhaust.mass_flow(2e5, 1e5, 1.0, T0)


@given(valves, valves)
def test_the_widest_laminar_range_is_kept(first, second):
    soft = Valve(1e-8, 0.3, 0.97)
    assert in_series(first, soft).laminar_ratio == in_parallel(soft, second).laminar_ratio == 0.97


@pytest.mark.parametrize("rule", [in_series, in_parallel])
def test_what_has_no_equivalent_is_refused(rule):
    name = rule.__name__
    with pytest.raises(ParameterError, match=f"{name}: no valve is given; give at least one"):
        rule()
    with pytest.raises(
        ParameterError, match=f"{name}: the conductance of argument 2 is 0; it must be positive"
    ):
        rule(Valve(1e-8, 0.3), Valve(0.0, 0.3))
    with pytest.raises(
        ParameterError,
        match=f"{name}: argument 2 is SubsonicIndexValve; it must be a Valve, with C and b",
    ):
        rule(Valve(1e-8, 0.3), SubsonicIndexValve(1e-8, 0.3))
