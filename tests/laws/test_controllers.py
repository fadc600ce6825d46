"""PID is u = K (b r - y) + I + D with I' = K/T_i (r - y) by forward and (T_d/N) D' + D = K T_d (c r
- y)' by backward differences; cut off at the range of its input, I follows with the time constant
T_t; its first command is u_0.

TwoPoint is on from y < r - H/2 and off from y > r + H/2 on. Split gives what is above zero to one
input, what is below to another. A memory is a value: the same step from the same memory is the
same.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.control import PID, OnOffController
from airmuscle.core import cite, leaves
from airmuscle.engine import Measurement, SplitRange
from airmuscle.engine.loop import relative_unit
from airmuscle.errors import ParameterError

WIDE = {"fill": (-math.inf, math.inf)}
H = 0.01


def carried(controller, setpoints, measured, ranges=None, dt=H):
    """The commands of a controller of 'fill' for sequences of set points and measurements, and its
    last memory.
    """
    memory = controller.init()
    told = []
    for r, y in zip(setpoints, measured, strict=True):
        commands, memory = controller.step(
            memory, Measurement({"y": y}, {"y": r}, ranges or WIDE), dt
        )
        told.append(commands["fill"])
    return np.array(told), memory


numbers = st.floats(-5.0, 5.0)
courses = st.lists(st.tuples(numbers, numbers), min_size=2, max_size=40)


@given(
    courses,
    st.floats(-3.0, 3.0),
    st.floats(0.02, 5.0),
    st.floats(0.0, 2.0),
    st.floats(1.0, 30.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
)
def test_pid_is_its_discrete_transfer_functions(course, k, t_i, t_d, n, b, c):
    """P, I = K h/T_i/(z - 1) and D = K T_d N (1 - 1/z)/(T_d + N h - T_d/z), each by a filter of its
    own.
    """
    from scipy.signal import lfilter

    r, y = np.array(course).T
    pid = PID("y", "fill", k, t_i, t_d, n, b, c, initial_output=0.7)
    told, _ = carried(pid, r, y)
    proportional = k * (b * r - y)
    integral = 0.7 - proportional[0] + lfilter([0.0, k * H / t_i], [1.0, -1.0], r - y)
    weighted = c * r - y - (c * r[0] - y[0])  # nothing was there before the first sample
    derivative = lfilter(
        np.array([1.0, -1.0]) * k * t_d * n / (t_d + n * H), [1.0, -t_d / (t_d + n * H)], weighted
    )
    assert told == pytest.approx(
        proportional + integral + derivative, abs=1e-9 * max(1.0, np.abs(told).max())
    )


def test_pid_by_hand():
    """K = 2, T_i = 0.5 s, T_d = 0.1 s, N = 5, b = 0.5, c = 0, h = 0.1 s, u_0 = 1; r = 1, y = 0,
    0.5, 0.8.

    T_d + N h = 0.6, so D_k = D_(k-1)/6 - (5/3) (y_k - y_(k-1)); K h/T_i = 0.4.
    k = 0: P = 1, I = 0, D = 0: u = 1.  k = 1: P = 0, I = 0.4, D = -5/6.  k = 2: P = -0.6, I = 0.6,
                                        D = -5/36 - 0.5.
    """
    pid = PID("y", "fill", 2.0, 0.5, 0.1, 5.0, 0.5, 0.0, initial_output=1.0)
    told, _ = carried(pid, [1.0, 1.0, 1.0], [0.0, 0.5, 0.8], dt=0.1)
    assert told == pytest.approx([1.0, 0.4 - 5 / 6, -5 / 36 - 0.5], rel=1e-12)


@given(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0), st.floats(0.0, 1.0))
def test_the_first_command_is_the_one_that_is_given(setpoint, measured, first):
    pid = PID("y", "fill", 3.0, 0.2, 0.1, initial_output=first)
    told, _ = carried(pid, [setpoint], [measured], {"fill": (0.0, 1.0)})
    assert told[0] == pytest.approx(first, abs=1e-12)


def test_without_integral_action_the_first_command_is_a_bias():
    told, _ = carried(PID("y", "fill", 2.0, initial_output=0.3), [1.0, 1.0, 2.0], [0.5, 0.9, 2.0])
    assert told == pytest.approx([1.3, 0.5, 0.3], rel=1e-12)


def test_a_step_of_the_set_point_is_weighted():
    """With b = c = 0 a step of the set point goes through the integral alone."""
    pid = PID("y", "fill", 2.0, 0.5, 0.1, 5.0, 0.0, 0.0)
    told, _ = carried(pid, [0.0, 1.0, 1.0], [0.0, 0.0, 0.0], dt=0.1)
    assert told == pytest.approx([0.0, 0.0, 0.4], abs=1e-15)


@pytest.mark.parametrize(
    ("t_d", "tracking", "expected"),
    [(0.0, 0.0, 0.5), (0.32, 0.0, 0.4), (0.0, 0.2, 0.2), (0.32, 0.2, 0.2)],
)
def test_anti_windup_tends_to_its_rest_with_its_time_constant(t_d, tracking, expected):
    """Under a lasting error e, v - u tends to K e T_t/T_i, each sample nearer by 1 - h/T_t; T_t =
    sqrt(T_i T_d) by the rule.
    """
    k = 2.0
    t_i = 0.5
    greatest = 1.0
    e = 3.0
    pid = PID("y", "fill", k, t_i, t_d, tracking_time=tracking)
    memory = pid.init()
    beyond = []
    for _ in range(2000):
        commands, memory = pid.step(
            memory, Measurement({"y": 0.0}, {"y": e}, {"fill": (0.0, greatest)}), H
        )
        assert 0.0 <= commands["fill"] <= greatest
        beyond.append(k * e + memory["integral"] - greatest)
    rest = k * e * expected / t_i
    assert beyond[-1] == pytest.approx(rest, rel=1e-9)
    away = np.array(beyond[60:200]) - rest
    assert away[1:] / away[:-1] == pytest.approx(1.0 - H / expected, rel=1e-6)


def test_anti_windup_never_overshoots_where_its_time_constant_is_less_than_a_period():
    pid = PID("y", "fill", 2.0, 0.5, tracking_time=1e-4)
    memory = pid.init()
    for _ in range(50):
        _, memory = pid.step(memory, Measurement({"y": 0.0}, {"y": 3.0}, {"fill": (0.0, 1.0)}), H)
    assert 6.0 + memory["integral"] == pytest.approx(1.0 + 2.0 * H / 0.5 * 3.0, rel=1e-9), (
        "at the limit, and one step on"
    )


def test_a_controller_keeps_nothing_outside_its_memory():
    pid = PID("y", "fill", 2.0, 0.5, 0.1)
    rng = np.random.default_rng(3)
    setpoints, measured = rng.normal(size=(2, 30))
    whole, end = carried(pid, setpoints, measured)
    again, same = carried(pid, setpoints, measured)
    assert np.array_equal(whole, again)
    assert end == same
    measurement = Measurement({"y": 1.0}, {"y": 2.0}, WIDE)
    assert pid.step(end, measurement, H) == pid.step(end, measurement, H)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"gain": math.nan}, r"PID.gain \(K, proportional gain\) is nan; it must be finite"),
        ({"gain": math.inf}, "it must be finite"),
        ({"gain": "2"}, "must be a number in u/y"),
        ({"integral_time": -1.0}, r"PID.integral_time .* is -1 s; allowed range: 0 to"),
        ({"derivative_filter": 0.0}, r"PID.derivative_filter .* allowed range: 1 to 1000"),
        ({"setpoint_weight": 2.0}, r"PID.setpoint_weight .* allowed range: 0 to 1"),
    ],
)
def test_what_a_controller_cannot_be_is_said(changed, message):
    with pytest.raises(ParameterError, match=message):
        PID("y", "fill", **{"gain": 1.0, **changed})


def test_a_controller_has_its_source():
    assert [r.key for r in cite(PID("y", "fill", 1.0))] == ["astrom-hagglund-1995"]
    assert [r.key for r in cite(OnOffController("y", "fill", 1.0))] == ["astrom-hagglund-1995"]


# Two points


@given(st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=60), st.floats(0.0, 1.5))
def test_two_point_holds_within_its_hysteresis_and_switches_beyond(away, hysteresis):
    told, _ = carried(
        OnOffController("y", "fill", hysteresis),
        [1.0] * len(away),
        [1.0 + a for a in away],
        {"fill": (0.2, 0.9)},
    )
    assert set(told) <= {0.2, 0.9}
    before = [0.2, *told]
    for (was, now), y in zip(itertools.pairwise(before), away, strict=True):
        error = (1.0 + y) - 1.0
        if error < -hysteresis / 2:
            assert now == 0.9
        elif error > hysteresis / 2:
            assert now == 0.2
        else:
            assert now == was


# Two inputs, and units


@given(st.floats(-3.0, 3.0))
def test_split_opens_one_side_or_the_other(setpoint):
    pid = PID("y", SplitRange("up", "down"), 1.0)
    ranges = {"up": (0.0, 1.0), "down": (0.0, 0.5)}
    commands, _ = pid.step(pid.init(), Measurement({"y": 0.0}, {"y": setpoint}, ranges), H)
    assert commands["up"] == pytest.approx(min(max(setpoint, 0.0), 1.0))
    assert commands["down"] == pytest.approx(min(max(-setpoint, 0.0), 0.5))
    assert pid.inputs == ("up", "down")


def test_both_sides_of_split_are_not_one_input():
    with pytest.raises(ParameterError, match="SplitRange: both inputs are 'fill'; name two inputs"):
        SplitRange("fill", "fill")


@pytest.mark.parametrize(
    ("unit", "measured", "commanded", "expected"),
    [
        ("u/y", "Pa", "1", "1/Pa"),
        ("u/y", "Pa", "Pa", "1"),
        ("u/y", "1", "Pa", "Pa"),
        ("u/y", "m", "Pa", "Pa/m"),
        ("u/y", "m/s", "1", "1/(m/s)"),
        ("u", "m", "Pa", "Pa"),
        ("y", "m", "Pa", "m"),
        ("s", "m", "Pa", "s"),
    ],
)
def test_a_relative_unit_follows_from_column_and_input(unit, measured, commanded, expected):
    assert relative_unit(unit, measured, commanded) == expected


def test_every_number_of_a_controller_is_declared():
    assert {leaf.path: leaf.declared.unit for leaf in leaves(PID("y", "fill", 1.0))} == {
        "gain": "u/y",
        "integral_time": "s",
        "derivative_time": "s",
        "derivative_filter": "1",
        "setpoint_weight": "1",
        "derivative_weight": "1",
        "tracking_time": "s",
        "initial_output": "u",
    }
