"""Metrics of a curve, compared with closed forms.

The references are straight lines (exact up to rounding) and the step response of a second-order
system with damping ratio zeta (overshoot exp(-pi zeta / sqrt(1 - zeta^2)), Ogata, Modern Control
Engineering, 5.3).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airmuscle.design.study import (
    Final,
    Maximum,
    Mean,
    Metric,
    Minimum,
    Overshoot,
    RootMeanSquare,
    SettlingTime,
    TimeSeries,
    TimeToReach,
)
from airmuscle.design.study.result import _statistics
from airmuscle.errors import ParameterError

TIME = np.linspace(0.0, 2.0, 21)
RAMP = 3.0 * TIME - 1.0
"""A straight line from -1 to 5."""


@pytest.mark.parametrize(
    ("metric", "expected"),
    [
        (Final("x"), 5.0),
        (Final("x", end=1.03), 2.09),
        (Maximum("x", end=0.55), 0.65),
        (Minimum("x", begin=1.234), 2.702),
        (Mean("x"), 2.0),
        (Mean("x", begin=0.51, end=1.49), 2.0),
        (RootMeanSquare("x"), math.sqrt((5.0**3 + 1.0) / 9.0 / 2.0)),
        (RootMeanSquare("x", begin=1 / 3, end=1.0), math.sqrt(2.0**3 / 9.0 / (2 / 3))),
        (TimeToReach("x", 2.03), 1.01),
        (TimeToReach("x", 2.03, begin=0.5), 0.51),
        (TimeToReach("x", -1.0), 0.0),
        (TimeToReach("x", 5.0), 2.0),
        (Overshoot("x"), 0.0),
        (SettlingTime("x"), 0.98 * 2.0),
        (SettlingTime("x", band=0.1, begin=1.0), 0.9),
    ],
)
def test_on_a_straight_line(metric, expected):
    assert metric.value(TIME, RAMP) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_a_missing_metric_is_nan():
    assert math.isnan(TimeToReach("x", 5.1).value(TIME, RAMP))
    assert math.isnan(Final("x", begin=2.5).value(TIME, RAMP))
    assert math.isnan(Overshoot("x").value(TIME, np.ones_like(TIME)))
    assert SettlingTime("x").value(TIME, np.ones_like(TIME)) == 0.0
    assert math.isnan(
        SettlingTime("x").value(TIME, np.sin(np.pi * TIME) * (TIME < 2))
    )  # it comes back to its start


def test_a_falling_column_reaches_its_level_too():
    assert TimeToReach("x", 0.5).value(TIME, -RAMP) == pytest.approx(1 / 6)
    assert SettlingTime("x").value(TIME, -RAMP) == pytest.approx(1.96)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_column_that_crosses_its_band_between_two_rows_settles_where_the_straight_line_enters_it(
    sign,
):
    """The line falls from 2 at 1 s to -1 at 4 s; half the band is 1.5, a tenth of the change from
    15 to 0.
    """
    time = np.array([0.0, 1.0, 4.0, 5.0])
    values = sign * np.array([15.0, 2.0, -1.0, 0.0])
    assert SettlingTime("x", band=0.1).value(time, values) == pytest.approx(1.5, rel=1e-12)


@pytest.mark.parametrize("zeta", [0.2, 0.5, 0.7])
@pytest.mark.parametrize("sign", [1.0, -4.0])
def test_the_step_response_of_second_order(zeta, sign):
    t = np.linspace(0.0, 80.0, 80_001)
    damped = math.sqrt(1 - zeta**2)
    envelope = np.exp(-zeta * t)
    y = sign * (1.0 - envelope * (np.cos(damped * t) + zeta / damped * np.sin(damped * t))) + 7.0
    assert Overshoot("y").value(t, y) == pytest.approx(math.exp(-math.pi * zeta / damped), rel=1e-4)
    settled = SettlingTime("y", band=0.05).value(t, y)
    away = np.abs(y - y[-1]) / abs(sign)
    assert away[t > settled + 1e-3].max() <= 0.05
    assert away[t < settled].max() > 0.05
    assert away[np.searchsorted(t, settled)] == pytest.approx(0.05, abs=1e-3)


@settings(deadline=None)
@given(arrays(float, 12, elements=st.floats(-1e3, 1e3)), st.floats(0.1, 10), st.floats(-100, 100))
def test_metrics_scale_and_shift_with_their_column(values, factor, shift):
    time = np.linspace(0.0, 1.0, 12)
    for metric in (Final("x"), Maximum("x"), Minimum("x"), Mean("x")):
        expected = factor * metric.value(time, values) + shift
        assert metric.value(time, factor * values + shift) == pytest.approx(
            expected, rel=1e-9, abs=1e-6
        )
    low, mean, high = (o.value(time, values) for o in (Minimum("x"), Mean("x"), Maximum("x")))
    assert low - 1e-9 <= mean <= high + 1e-9
    assert abs(mean) - 1e-9 <= RootMeanSquare("x").value(time, values) <= max(-low, high) + 1e-9


@settings(deadline=None)
@given(st.floats(0.0, 0.95), st.floats(0.01, 1.0))
def test_the_window_does_not_depend_on_the_rows(begin, length):
    end = begin + length
    coarse = Mean("x", begin=begin, end=end).value(TIME, RAMP)
    assert coarse == pytest.approx(3.0 * (begin + min(end, 2.0)) / 2.0 - 1.0, abs=1e-9)


def test_a_time_series_is_sampled_at_its_times():
    series = TimeSeries("x", 0.25, begin=0.5).clip_to_run(0.0, 2.0)
    assert series.times == pytest.approx([0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0])
    assert series.sample(TIME, RAMP) == pytest.approx(3.0 * series.times - 1.0)
    half = series.sample(TIME[:11], RAMP[:11])
    assert np.isfinite(half[:3]).all()
    assert np.isnan(half[3:]).all()


def test_units_follow_from_the_column():
    found: list[tuple[Metric, str]] = [
        (Final("p"), "Pa"),
        (RootMeanSquare("p"), "Pa"),
        (TimeToReach("p", 1.0), "s"),
        (Overshoot("p"), "1"),
        (SettlingTime("p"), "s"),
        (TimeSeries("p", 0.1), "Pa"),
    ]
    for metric, unit in found:
        assert metric.unit("Pa") == unit


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Final("x", begin=1.0, end=1.0), "its end must be later than its begin"),
        (lambda: Final("x", begin=math.nan), "its end must be later than its begin"),
        (lambda: TimeToReach("x", math.inf), "it must be finite"),
        (lambda: SettlingTime("x", band=0.0), "it must be between 0 and 1"),
        (lambda: TimeSeries("x", 0.0), "it must be positive and finite"),
        (lambda: TimeSeries("x", 1e-9).clip_to_run(0.0, 1.0), "2 to 1000000 samples"),
    ],
)
def test_an_invalid_metric_is_rejected(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_the_statistics_of_the_runs_are_those_of_a_sample_without_missing_values():
    found = _statistics(np.array([1.0, np.nan, 2.0, 6.0]))
    assert (found["runs"], found["mean"], found["median"]) == (3, 3.0, 2.0)
    assert found["standard deviation"] == pytest.approx(np.sqrt(7.0))
    assert (found["5 %"], found["95 %"]) == pytest.approx((1.1, 5.6))
    assert np.isnan(_statistics(np.array([4.0]))["standard deviation"])
