"""A command is cut at its instants and linear in between: recorded, sampled from a function,
repeated.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle import ColumnMapping, Recording, read_csv
from airmuscle.engine import Periodic, PiecewiseLinear, SampledSignal, Schedule
from airmuscle.errors import ColumnError, ParameterError


def course(command, start: float, duration: float, times: np.ndarray) -> np.ndarray:
    segments: PiecewiseLinear = command.segments(("fill",), start, duration)
    assert (np.diff(segments.ends, prepend=start) > 0).all()
    assert segments.ends[-1] == start + duration
    return segments.inputs_at(times, start)[:, 0]


changes = st.lists(
    st.tuples(st.integers(-20, 60), st.floats(0.0, 1.0)), max_size=12, unique_by=lambda c: c[0]
)


@given(changes, st.integers(-30, 50), st.integers(1, 40))
def test_a_schedule_holds_its_last_value_whenever_the_run_begins(
    given_changes, start: int, duration: int
):
    ordered = sorted(given_changes)
    times = start + np.arange(0.25, duration, 0.5)
    expected = [next((v for t, v in reversed(ordered) if t <= time), 0.0) for time in times]
    assert course(Schedule({"fill": ordered}), start, duration, times).tolist() == expected


# Recorded


def test_a_measured_column_is_a_command(tmp_path):
    file = tmp_path / "bench.csv"
    file.write_text(
        "time [ms],fill [%],pressure [kPa]\n0,0,0\n100,40,20\n300,80,50\n", encoding="utf-8"
    )
    recording = read_csv(file, ColumnMapping(units={"pressure": "kPa(g)"}))
    signal = SampledSignal.recorded(recording, {"fill": "fill"})
    assert signal == SampledSignal({"fill": ((0.0, 0.0), (0.1, 0.4), (0.3, 0.8))})
    assert course(signal, 0.0, 0.4, np.array([0.05, 0.2, 0.35])) == pytest.approx([0.2, 0.6, 0.8])
    with pytest.raises(
        ColumnError, match=r"bench.csv: no column 'discharge'; the columns are time, fill, pressure"
    ):
        SampledSignal.recorded(recording, {"fill": "discharge"})
    with pytest.raises(ColumnError, match="no column 'time'"):
        SampledSignal.recorded(Recording({"fill": np.zeros(2)}, "a list"), {"fill": "fill"})


# Sampled


@pytest.mark.parametrize("error", [1e-2, 1e-4, 1e-6])
def test_a_sampled_function_is_followed_to_the_stated_error(error: float):
    def sine(t: float) -> float:
        return 0.5 + 0.4 * math.sin(2 * math.pi * 3 * t)

    signal = SampledSignal.sampled({"fill": sine}, start=0.7, duration=2.0, error=error)
    times = np.random.default_rng(1).uniform(0.7, 2.7, 20_000)
    away = np.abs(course(signal, 0.7, 2.0, times) - [sine(t) for t in times])
    assert away.max() <= error * 1.01, (
        "the quarters of a line see its greatest distance but for a hundredth"
    )
    ideal = 2.0 * 6 * math.pi * math.sqrt(0.4 / (8 * error))
    assert len(signal.points["fill"]) < max(2 * ideal, 130), (
        "no more lines than the error needs, but for halving"
    )


def test_a_function_that_no_lines_follow_is_refused():
    def step(t: float) -> float:
        return float(t > 0.3)

    for function, error in ((step, 1e-4), (lambda t: math.sin(1 / (t + 1e-3)), 1e-10)):
        with pytest.raises(
            ParameterError,
            match=r"'fill' is not approximated to .* points: the error is .* as a Schedule",
        ):
            SampledSignal.sampled({"fill": function}, duration=1.0, error=error)
    with pytest.raises(ParameterError, match=r"'fill' is nan at 0 s; it must be finite"):
        SampledSignal.sampled({"fill": lambda t: math.nan}, duration=1.0)
    for wrong in ({"error": 0.0}, {"duration": 0.0}, {"duration": math.inf}):
        with pytest.raises(
            ParameterError, match="the error and the duration must be greater than 0"
        ):
            SampledSignal.sampled({"fill": math.sin}, **{"duration": 1.0, **wrong})


# Repeated


@given(st.integers(-40, 40), st.integers(1, 60))
def test_what_is_periodic_is_the_same_a_period_later(start: int, duration: int):
    once = SampledSignal({"fill": ((0.0, 0.2), (0.03, 1.0), (0.05, 0.4))})
    command = Periodic(once, 0.1)
    begin = start * 0.05
    length = duration * 0.02
    times = begin + (np.arange(50) + 0.37) * length / 50
    found = course(command, begin, length, times)
    assert found == pytest.approx(
        np.interp(times % 0.1, [0.0, 0.03, 0.05], [0.2, 1.0, 0.4]), abs=1e-9
    )


def test_a_period_that_rounding_moves_leaves_no_sliver():
    segments = Periodic(Schedule({"fill": ((0.03, 1), (0.07, 0))}), 0.1).segments(
        ("fill",), 0.3, 0.2
    )
    assert segments.ends - 0.3 == pytest.approx([0.03, 0.07, 0.1, 0.13, 0.17, 0.2])
    assert segments.values[:, 0].tolist() == [0, 1, 0, 0, 1, 0]


def test_an_impossible_period_is_refused():
    for period in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(
            ParameterError, match=r"Periodic.period is .* s; it must be positive and finite"
        ):
            Periodic(Schedule({}), period)
    with pytest.raises(
        ParameterError, match=r"every 1e-09 s makes more than 10000000 instants in 1 s"
    ):
        Periodic(Schedule({}), 1e-9).segments(("fill",), 0.0, 1.0)
