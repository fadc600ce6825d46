"""Limits of the segmentation, each from both sides: outliers, gaps, saturation, constant
quantities, ripple, reversals.

The chosen numbers are those of the modules of `recording.segment`: eight standard deviations of an
outlier, five sample times of a gap, five rows of a saturated sensor, 0.5 % contraction and 2 %
pressure of a constant quantity.
"""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle.bench import (
    ISOBARIC,
    ISOMETRIC,
    Sensor,
    analyse_sampling,
    estimate_sensors,
    find_branches,
    find_outliers,
    find_runs,
    inspect,
    quasi_static_rows,
)
from airmuscle.bench.inspection import estimate_noise
from airmuscle.recording import Recording

RANDOM = np.random.default_rng
SENSOR = {"force": Sensor("force", 0.0, 1.0)}


def timed(step: float = 0.2, **columns: np.ndarray) -> Recording:
    size = len(next(iter(columns.values())))
    return Recording({"time": step * np.arange(size), **columns}, "synthetic")


# Outliers


def test_the_expected_value_of_an_outlier_on_a_ramp_is_that_of_the_ramp():
    force = 3.0 * np.arange(60.0)
    force[30] += 50.0
    (found,) = find_outliers(timed(force=force), SENSOR)
    assert (found.row, found.value) == (30, 140.0)
    assert (found.expected, found.deviations) == (pytest.approx(90.0), pytest.approx(50.0))


@pytest.mark.parametrize(("distance", "count"), [(7.9, 0), (8.1, 1), (-8.1, 1)])
def test_an_outlier_differs_by_more_than_eight_standard_deviations(distance: float, count: int):
    force = np.zeros(60)
    force[30] = distance
    assert len(find_outliers(timed(force=force), SENSOR)) == count


@pytest.mark.parametrize(("missing", "count"), [(0.0, 0), (0.45, 0), (-0.2, 0), (-3.0, 1)])
def test_a_rounded_turning_point_is_no_outlier_and_one_beyond_both_lines_is(
    missing: float, count: int
):
    force = 20.0 * (30.0 - np.abs(np.arange(61.0) - 30.0))
    force[30] -= 20.0 * missing
    assert len(find_outliers(timed(force=force), SENSOR)) == count


# Sampling and sensors


@pytest.mark.parametrize(("steps", "gaps"), [(4.9, ()), (5.1, (9,))])
def test_a_gap_is_longer_than_five_sample_times(steps: float, gaps: tuple[int, ...]):
    time = 0.1 * np.arange(20.0)
    time[10:] += 0.1 * (steps - 1.0)
    found = analyse_sampling(Recording({"time": time}, "x"))
    assert tuple(gap.row for gap in found.gaps) == gaps


def test_the_noise_of_many_rows_is_their_standard_deviation():
    assert estimate_noise(RANDOM(1).normal(5.0, 2.0, 200_000)) == pytest.approx(2.0, rel=0.01)


def test_readings_within_a_quarter_of_the_resolution_of_a_limit_are_at_the_limit():
    sensor = Sensor("force", 1.0, 0.1, lower_limit=-2.0, upper_limit=10.0)
    assert sensor.censoring(np.array([-2.3, -1.8, -1.7, 9.7, 9.8, 10.3])).tolist() == [
        1,
        1,
        0,
        0,
        -1,
        -1,
    ]


@pytest.mark.parametrize(
    ("at_top", "elsewhere", "is_saturated"),
    [(4, 1, False), (5, 1, True), (6, 3, False), (7, 3, True)],
)
def test_a_saturated_sensor_stays_at_its_limit_for_five_rows_and_twice_as_long_as_elsewhere(
    at_top: int, elsewhere: int, is_saturated: bool
):
    force = RANDOM(2).normal(0.0, 1.0, 300)
    force[100 : 100 + at_top] = force.max() + 1.0
    force[200 : 200 + elsewhere] = 0.5
    assert np.isfinite(estimate_sensors(timed(force=force))["force"].upper_limit) == is_saturated


# Constant quantities


@pytest.mark.parametrize(("drift", "is_constant"), [(0.0048, True), (0.0055, False)])
def test_a_constant_contraction_stays_within_half_a_per_cent(drift: float, is_constant: bool):
    ramp = np.linspace(0.0, 1.0, 400)
    run = find_runs(timed(contraction=0.1 + drift * ramp, pressure=5e5 * ramp))[0]
    assert (run.kind is ISOMETRIC and len(run.interval) == 400) == is_constant


@pytest.mark.parametrize(("drift", "is_constant"), [(0.019, True), (0.023, False)])
def test_a_constant_pressure_stays_within_two_per_cent(drift: float, is_constant: bool):
    ramp = np.linspace(0.0, 1.0, 400)
    run = find_runs(timed(contraction=0.2 * ramp, pressure=3e5 * (1.0 - drift * ramp)))[0]
    assert (run.kind is ISOBARIC and len(run.interval) == 400) == is_constant


def test_a_single_outlier_does_not_end_a_run():
    pressure = np.full(400, 3e5)
    pressure[200] = 5e5
    (run,) = find_runs(timed(contraction=np.linspace(0.0, 0.2, 400), pressure=pressure))
    assert run.kind is ISOBARIC


def ripple(width: float, crossings: int, stroke: float) -> Recording:
    """A pressure that oscillates within a fraction of its maximum and crosses the middle so often,
    during a stroke.
    """
    phase = np.linspace(0.0, np.pi * crossings, 400) + 0.5 * np.pi
    pressure = 3e5 * (1.0 - 0.5 * width * (1.0 - np.sin(phase)))
    return timed(contraction=np.linspace(0.0, stroke, 400), pressure=pressure)


@pytest.mark.parametrize(
    ("width", "crossings", "stroke", "is_constant"),
    [
        (0.055, 7, 0.1, True),
        (0.065, 7, 0.1, False),
        (0.055, 3, 0.1, True),
        (0.055, 2, 0.1, False),
        (0.055, 7, 0.022, True),
        (0.055, 7, 0.019, False),
    ],
)
def test_a_pressure_that_ripples_within_six_per_cent_while_the_muscle_moves_is_constant(
    width: float, crossings: int, stroke: float, is_constant: bool
):
    runs = find_runs(ripple(width, crossings, stroke))
    assert (len(runs) == 1 and runs[0].kind is ISOBARIC) == is_constant


# Quasi-static rows and branches


@pytest.mark.parametrize(("change", "is_slow"), [(0.009, True), (0.012, False)])
def test_a_quasi_static_pressure_changes_by_less_than_one_per_cent_in_a_tenth_of_a_second(
    change: float, is_slow: bool
):
    count = round(0.1 / change / 0.01)
    pressure = np.concatenate([np.linspace(0.0, 5e5, count), np.full(50, 5e5)])
    sensors = {"pressure": Sensor("pressure", 0.0, 0.0)}
    assert quasi_static_rows(timed(0.01, pressure=pressure), sensors)[count // 2] == is_slow


@pytest.mark.parametrize(("reverse", "count"), [(9.5e3, 1), (10.5e3, 3)])
def test_a_reversal_exceeds_ten_standard_deviations_of_the_sensor(reverse: float, count: int):
    pressure = np.concatenate(
        [
            np.linspace(0.0, 6e4, 60),
            np.linspace(6e4, 6e4 - reverse, 20),
            np.linspace(6e4 - reverse, 1e5, 60),
        ]
    )
    assert len(find_branches(timed(pressure=pressure), Sensor("pressure", 0.0, 1e3))) == count


@pytest.mark.parametrize(("duration", "count"), [(0.06, 1), (0.1, 3)])
def test_an_overshoot_of_a_valve_pulse_is_no_reversal(duration: float, count: int):
    pressure = np.concatenate([np.linspace(0.0, 3e5, 200), np.linspace(3e5, 6e5, 200)])
    pressure[200 : 200 + round(duration / 0.01)] += 1e5
    assert len(find_branches(timed(0.01, pressure=pressure))) == count


@pytest.mark.parametrize("std", [0.0, 2e-4])
def test_the_noise_of_a_length_makes_no_reversal_of_a_motion(std: float):
    contraction = np.concatenate([np.linspace(0.05, 0.056, 120), np.linspace(0.056, 0.05, 120)])
    contraction = contraction + RANDOM(4).normal(0.0, std, 240)
    recording = timed(contraction=contraction, pressure=np.full(240, 3e5), force=2e3 * contraction)
    assert [b.direction for b in find_branches(recording)] == [1, -1]


# No rows


def test_a_recording_without_rows_has_no_sensor_and_no_segment_and_does_not_count_beside_others():
    empty = timed(pressure=np.empty(0), contraction=np.empty(0), force=np.empty(0))
    found = inspect(empty)
    assert (found.sensors, found.runs, found.branches, found.plateaus, found.quasi_static) == (
        {},
        (),
        (),
        (),
        0.0,
    )
    other = timed(pressure=RANDOM(5).normal(0.0, 100.0, 50))
    assert estimate_sensors([empty, other]) == estimate_sensors([other])
