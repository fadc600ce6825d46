"""Segmentation of recordings, compared with synthetic recordings of known structure.

Branches are identified from the pressure history alone; a dwell belongs to the branch before it.
The resolution of a sensor is the step of its readings, its limit the reading at which they stay
constant. Outliers are listed and never removed; the overshoot of a step is not an outlier.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from airmuscle.bench import (
    AT_REST,
    FREE,
    ISOBARIC,
    ISOMETRIC,
    ISOTONIC,
    analyse_sampling,
    branch_directions,
    check_swept,
    estimate_sensors,
    find_branches,
    find_outliers,
    find_plateaus,
    find_runs,
    inspect,
    inspect_all,
    plateau_points,
    quasi_static_rows,
)
from airmuscle.bench.inspection import (
    branch_column_agreement,
    estimate_noise,
    estimate_resolution,
    inspection_chapters,
    interval,
)
from airmuscle.errors import ColumnError
from airmuscle.recording import Recording

STEP = 0.05
RANDOM = np.random.default_rng


def staircase(levels: list[float], rows: int = 10, overshoot: float = 0.0) -> np.ndarray:
    """Plateaus of `rows` rows; the first row of each overshoots by a fraction of the step."""
    pressure = np.repeat(np.asarray(levels, dtype=float), rows)
    for i in range(1, len(levels)):
        pressure[i * rows] += overshoot * (levels[i] - levels[i - 1])
    return pressure


def timed(pressure: np.ndarray, **columns: np.ndarray) -> Recording:
    return Recording(
        {"time": STEP * np.arange(len(pressure)), "pressure": pressure, **columns}, "synthetic"
    )


def bench(seed: int = 1, noise: float = 400.0) -> tuple[Recording, int]:
    """A stepped isometric run up and down with noise, rounding and saturation; and the row of the
    reversal.
    """
    up = np.linspace(0, 6e5, 25)
    down = np.linspace(5.4e5, 5e4, 20)
    pressure = staircase([*up, *down], 10, overshoot=0.6)
    random = RANDOM(seed)
    force = np.maximum(1.5e-3 * pressure - 300.0 + random.normal(0, 0.8, len(pressure)), -9.0)
    pressure = pressure + random.normal(0, noise, len(pressure))
    rounded = {
        "pressure": 765.0 * np.round(pressure / 765.0),
        "force": 0.68 * np.round(force / 0.68),
    }
    return (
        timed(rounded["pressure"], force=rounded["force"], length=np.full(len(pressure), 0.25)),
        250,
    )


# Branches


def test_a_stepped_ramp_with_overshoots_has_one_reversal_at_the_last_row_of_the_top():
    recording, turn = bench()
    up, down = find_branches(recording)
    assert (up.direction, up.name, up.interval.start, up.interval.stop) == (1, "inflating", 0, turn)
    assert (down.direction, down.name, down.interval.stop) == (-1, "deflating", len(recording))


@given(
    turns=st.lists(st.floats(0.2, 1.0), min_size=1, max_size=6),
    rows=st.integers(15, 60),
    rest=st.integers(0, 40),
    first=st.sampled_from([1, -1]),
    seed=st.integers(0, 99),
)
def test_every_reversal_of_a_random_history_is_found(turns, rows, rest, first, seed):
    corners = np.cumsum([0.0, *(first * (-1) ** i * part * 5e5 for i, part in enumerate(turns))])
    corners += 1e5 - corners.min()
    parts = []
    truth = []
    for i, (a, b) in enumerate(itertools.pairwise(corners)):
        parts += [np.linspace(a, b, rows, endpoint=False), np.full(rest, b)]
        truth += [first * (-1.0) ** i] * (rows + rest)
    pressure = np.concatenate(parts)
    measured = pressure + RANDOM(seed).normal(0, 200.0, len(pressure))
    found = find_branches(timed(measured))
    assert [b.direction for b in found] == [first * (-1) ** i for i in range(len(turns))]
    slack = (
        0.6 * 0.05 * np.ptp(pressure) / (0.2 * 5e5 / rows) + 2
    )  # rows that half a swing takes at the least slope
    differing = np.count_nonzero(branch_directions(timed(measured), found) != truth)
    assert differing <= len(turns) * slack


@given(scale=st.floats(1e-2, 1e2), shift=st.floats(-5e4, 1e6), stretch=st.floats(0.5, 2.0))
def test_branches_do_not_depend_on_unit_or_zero_of_the_pressure(
    scale: float, shift: float, stretch: float
):
    recording, _ = bench()
    other = recording.with_columns(pressure=recording["pressure"] * scale + shift)
    cut = [(b.direction, b.interval) for b in find_branches(recording)]
    assert [(b.direction, b.interval) for b in find_branches(other)] == cut


def test_negating_the_pressure_negates_the_directions():
    recording, turn = bench()
    found = find_branches(recording.with_columns(pressure=6e5 - recording["pressure"]))
    assert [b.direction for b in found] == [-1, 1]
    assert found[0].interval.stop == turn


def test_a_minor_loop_is_found_and_a_ripple_is_not():
    loop = np.concatenate(
        [np.linspace(0, 4e5, 80), np.linspace(4e5, 3e5, 30), np.linspace(3e5, 6e5, 60)]
    )
    assert [b.direction for b in find_branches(timed(loop))] == [1, -1, 1]
    ripple = np.linspace(0, 6e5, 300) + 1.2e4 * np.sin(np.arange(300) * 0.5)
    assert [b.direction for b in find_branches(timed(ripple))] == [1]
    assert len(find_branches(timed(loop), reversal=0.3)) == 1


def test_a_sawtooth_has_a_deflating_branch_of_one_or_two_rows_at_each_fall():
    tooth = np.tile(np.linspace(0, 6e5, 200), 4)
    found = find_branches(timed(tooth))
    assert [b.direction for b in found] == [1, -1, 1, -1, 1, -1, 1]
    assert all(len(b.interval) < 10 for b in found[1::2])


@pytest.mark.parametrize("constant", ["contraction", "force"])
def test_no_branch_leaves_its_run_where_ramps_at_other_lengths_or_loads_follow_each_other(
    constant: str,
):
    swept = {"contraction": "force", "force": "contraction"}[constant]
    pressure = np.tile(np.linspace(0.0, 6e5, 150), 5) + RANDOM(4).normal(0, 300.0, 750)
    levels = np.repeat(np.linspace(0.05, 0.25, 5), 150)
    recording = timed(pressure, **{constant: levels, swept: 1e-6 * pressure})
    found = inspect(recording).branches
    assert [(b.interval.start, b.interval.stop) for b in found] == [
        (i, i + 150) for i in range(0, 750, 150)
    ]
    assert {b.name for b in found} == {"inflating"}
    assert found == find_branches(recording)


@pytest.mark.parametrize(("after", "falls"), [(5e5, {(150, 4)}), (2e4, set())])
def test_rows_between_runs_belong_to_the_branch_of_neither(
    after: float, falls: set[tuple[int, int]]
):
    gap = np.array([0.0107, 0.0111, 0.0193, 0.0197])
    contraction = np.concatenate(
        [0.03 * i + np.concatenate([np.zeros(150), gap]) for i in range(5)]
    )
    contraction += RANDOM(6).normal(0.0, 1e-5, contraction.size)
    pressure = np.tile(
        np.concatenate([np.linspace(0.0, 6e5, 150), np.linspace(after, 0.2 * after, 4)]), 5
    )
    recording = timed(pressure, contraction=contraction, force=1e-3 * pressure).rows(slice(0, 766))
    found = inspect(recording).branches
    rising = [(b.interval.start, b.interval.stop) for b in found if b.direction > 0]
    assert rising == [(i, i + 150) for i in range(0, 770, 154)]
    assert {(b.interval.start % 154, len(b.interval)) for b in found if b.direction < 0} == falls


def test_a_short_run_of_a_slack_muscle_does_not_split_the_branches():
    swing = 1.0 - np.abs(np.linspace(-1.0, 1.0, 400))
    contraction = np.maximum(swing - 0.1, 0.0)
    recording = timed(6e5 * swing, contraction=0.2 * contraction, force=500.0 * contraction)
    assert len(find_runs(recording)) > 1
    assert [b.direction for b in inspect(recording).branches] == [1, -1]


def test_constant_pressure_and_no_pressure_have_no_branch():
    assert (
        find_branches(
            timed(2e5 + RANDOM(0).normal(0, 300, 200)),
            estimate_sensors(timed(RANDOM(0).normal(0, 300, 200)))["pressure"],
        )
        == ()
    )
    assert find_branches(Recording({"force": np.arange(9.0)}, "x")) == ()


def test_a_branch_column_is_compared_but_not_used():
    recording, turn = bench()
    stated = np.where(np.arange(len(recording)) < turn - 9, 1.0, 2.0)
    judged = recording.with_columns(branch=stated)
    assert find_branches(judged) == find_branches(recording)
    assert branch_column_agreement(judged, find_branches(judged)) == pytest.approx(
        1.0 - 9 / len(recording)
    )
    assert branch_column_agreement(recording, find_branches(recording)) is None


# Sensors


@given(
    step=st.floats(1e-3, 1e3),
    noise=st.floats(0.4, 3.0),
    offset=st.floats(-1.0, 1.0),
    twins=st.booleans(),
    seed=st.integers(0, 99),
)
def test_the_resolution_is_found_in_spite_of_a_varying_last_digit(step, noise, offset, twins, seed):
    course = 60.0 * np.sin(np.linspace(0, 9, 800)) + RANDOM(seed).normal(0, noise, 800)
    counts = np.round(course)
    values = step * (counts + offset)
    if twins:
        values = values + 0.01 * step * RANDOM(seed).integers(0, 2, 800)
    assert estimate_resolution(values) == pytest.approx(step, rel=0.01)


@given(seed=st.integers(0, 999), size=st.integers(30, 2000))
def test_continuous_readings_have_no_resolution(seed: int, size: int):
    values = RANDOM(seed).normal(0, 1, size).cumsum()
    found = estimate_resolution(values)
    assert found < 0.02 * np.ptp(values) / np.sqrt(size), (
        "chance leaves at most a step far below the noise"
    )


def test_a_few_set_points_of_a_test_are_not_a_resolution():
    assert estimate_resolution(np.repeat(np.arange(0, 7e5, 1e5), 30)) == 0.0
    assert estimate_resolution(np.full(50, 3.0)) == 0.0


@given(sigma=st.floats(1e-3, 1e3), seed=st.integers(0, 99))
def test_the_noise_is_separated_from_the_signal(sigma: float, seed: int):
    course = 1e3 * sigma * np.sin(np.linspace(0, 6, 2000))
    noise = RANDOM(seed).normal(0, sigma, 2000)
    noise[::100] += 50.0 * sigma
    assert estimate_noise(course + noise) == pytest.approx(sigma, rel=0.15)


def test_resolution_and_saturation_of_a_test_bench_are_found():
    recording, _ = bench()
    found = estimate_sensors(recording)
    assert found["pressure"].resolution == pytest.approx(765.0, rel=1e-3)
    assert found["force"].resolution == pytest.approx(0.68, rel=1e-3)
    assert found["force"].lower_limit == pytest.approx(recording["force"].min())
    assert np.isinf(found["force"].upper_limit)
    assert np.isinf(found["pressure"].lower_limit)
    assert "time" not in found
    sides = found["force"].censoring(recording["force"])
    assert np.array_equal(sides == 1, recording["force"] < -8.7)
    assert not (sides == -1).any()
    assert found["force"].std == pytest.approx(
        np.hypot(found["force"].noise, 0.68 / np.sqrt(12)), rel=1e-3
    )


def test_saturation_at_the_upper_limit_is_found():
    recording, _ = bench()
    full = np.minimum(recording["force"], recording["force"][180])
    found = estimate_sensors(recording.with_columns(force=full))["force"]
    assert (found.lower_limit, found.upper_limit) == (full.min(), full.max())
    assert found.noise == pytest.approx(estimate_sensors(recording)["force"].noise, rel=0.3), (
        "cut-off rows hide no noise"
    )
    np.testing.assert_array_equal(found.censoring(full) == -1.0, full == full.max())
    few, many = (np.minimum(recording["force"], recording["force"][row]) for row in (180, 80))
    for values, serious in ((few, False), (many, True)):
        said = [
            f
            for f in inspect(recording.with_columns(force=values)).findings
            if "upper limit" in f.text
        ]
        assert [f.serious for f in said] == [serious]
        assert "These rows are bounds (censored), not values." in said[0].text


def test_a_constant_signal_without_noise_or_with_noise_on_both_sides_is_not_saturated():
    vented = timed(np.maximum(np.concatenate([np.zeros(200), np.linspace(0, 5e5, 300)]), 0.0))
    assert np.isinf(estimate_sensors(vented)["pressure"].lower_limit), (
        "a sensor without noise does not show its end"
    )
    noisy = timed(765.0 * np.round((vented["pressure"] + RANDOM(4).normal(0, 600, 500)) / 765.0))
    assert np.isinf(estimate_sensors(noisy)["pressure"].lower_limit)


def test_several_runs_of_a_rig_show_a_limit_that_one_run_hardly_reaches():
    reaching, _ = bench(1)
    rows = np.concatenate(
        [np.flatnonzero(reaching["force"] <= reaching["force"].min())[:2], np.arange(150, 380)]
    )
    hardly = reaching.rows(np.sort(rows))
    assert np.isinf(estimate_sensors(hardly)["force"].lower_limit)
    seen = inspect_all([reaching, hardly])
    assert seen[1].sensors["force"].lower_limit == pytest.approx(reaching["force"].min())


# Plateaus and transients


def test_the_plateaus_of_a_staircase_are_its_steps():
    recording, _ = bench()
    found = find_plateaus(recording)
    steps = {p.interval.start // 10 for p in found}
    assert len(found) == len(steps) == 45
    levels = [*np.linspace(0, 6e5, 25), *np.linspace(5.4e5, 5e4, 20)]
    for plateau in found:
        assert plateau.values["pressure"] == pytest.approx(
            levels[plateau.interval.start // 10], abs=900.0
        )
        assert plateau.interval.stop <= 10 * (plateau.interval.start // 10 + 1)
    points = plateau_points(recording, found)
    assert len(points) == 45
    assert "45 plateaus replace" in points.notes[-1]


def test_the_standard_errors_of_a_plateau_are_those_of_the_mean_of_a_sample():
    recording, _ = bench()
    for plateau in find_plateaus(recording):
        rows = recording["pressure"][plateau.interval.rows]
        assert plateau.standard_errors["pressure"] == pytest.approx(stats.sem(rows))


def test_a_slow_ramp_is_quasi_static_but_not_a_plateau_and_a_fast_one_neither():
    slow = timed(np.linspace(0, 6e5, 600))
    assert quasi_static_rows(slow).all()
    assert find_plateaus(slow) == ()
    fast = timed(np.concatenate([np.zeros(50), np.linspace(0, 6e5, 20), np.full(50, 6e5)]))
    calm = quasi_static_rows(fast)
    assert not calm[50:70].any()
    assert calm[:47].all()
    assert calm[73:].all()
    assert [p.values["pressure"] for p in find_plateaus(fast)] == pytest.approx([0.0, 6e5], abs=1.0)


def test_points_without_time_are_steady_states():
    table = Recording({"pressure": np.array([0.0, 3e5, 1e5]), "force": np.zeros(3)}, "table")
    assert quasi_static_rows(table).all()
    assert find_plateaus(table) == ()
    assert find_outliers(table) == ()
    assert analyse_sampling(table) is None


# Glitches


@given(
    rows=st.sets(st.integers(1, 44), min_size=1, max_size=5),
    sign=st.sampled_from([1, -1]),
    seed=st.integers(0, 9),
)
def test_synthetic_outliers_are_listed_and_not_removed(rows: set[int], sign: int, seed: int):
    recording, _ = bench(seed)
    force = recording["force"].copy()
    planted = {10 * step + 5 for step in rows if force[10 * step + 1] > -7.0}
    for row in planted:
        force[row] += sign * 40.0
    spoilt = recording.with_columns(force=force)
    found = {o.row for o in find_outliers(spoilt) if o.column == "force"}
    assert planted <= found
    assert len(found - planted) <= 1
    assert np.array_equal(inspect(spoilt).recording["force"], force), "listed, not removed"
    for outlier in find_outliers(spoilt):
        if outlier.row in planted and outlier.column == "force":
            assert outlier.expected == pytest.approx(recording["force"][outlier.row], abs=4.0)


def test_an_outlier_of_two_rows_is_found_and_the_overshoot_of_a_step_is_not():
    noise = RANDOM(3).normal(0, 300.0, 200)
    step = np.where(np.arange(200) < 100, 1e5, 3e5) + noise
    step[100:102] += 5e4
    assert find_outliers(timed(step)) == ()
    step[150:152] += 5e4
    assert [o.row for o in find_outliers(timed(step))] == [150, 151]


# Runs


def test_each_kind_of_run_is_recognised():
    sweep = np.linspace(0, 1, 200)
    noise = RANDOM(0).normal(0, 1, 200)
    held = {
        "pressure": 3e5 + 200 * noise,
        "contraction": 0.1 + 1e-4 * noise,
        "force": 500.0 + noise,
    }
    swept = {"pressure": 6e5 * sweep, "contraction": 0.25 * sweep, "force": 1500 * (1 - sweep)}
    for kind, name in ((ISOBARIC, "pressure"), (ISOMETRIC, "contraction"), (ISOTONIC, "force")):
        recording = Recording({**swept, name: held[name]}, "run")
        (run,) = find_runs(recording)
        assert (run.kind, run.constant_column) == (kind, name)
        assert run.constant_value == pytest.approx(np.median(held[name]))
        assert set(run.swept_columns) == set(swept) - {name}
    assert [r.kind for r in find_runs(Recording(swept, "free"))] == [FREE]
    assert [r.kind for r in find_runs(Recording(held, "rest"))] == [AT_REST]
    by_length = {
        "pressure": swept["pressure"],
        "length": np.full(200, 0.3),
        "force": swept["force"],
    }
    assert find_runs(Recording(by_length, "length"))[0].kind is ISOMETRIC


def test_a_relaxation_at_constant_pressure_and_length_is_isobaric():
    force = 500.0 + 80.0 * np.exp(-np.linspace(0, 4, 200))
    (run,) = find_runs(timed(np.full(200, 3e5), length=np.full(200, 0.28), force=force))
    assert (run.kind, run.swept_columns) == (ISOBARIC, ("force",))


def test_a_table_of_isobars_has_one_run_per_isobar():
    pressures, contractions = (
        g.ravel()
        for g in np.meshgrid(np.linspace(1e5, 6e5, 6), np.linspace(0, 0.25, 11), indexing="ij")
    )
    table = Recording(
        {
            "pressure": pressures,
            "contraction": contractions,
            "force": pressures * (0.01 - 0.03 * contractions),
        },
        "t",
    )
    found = find_runs(table)
    assert [run.kind for run in found] == [ISOBARIC] * 6
    assert [run.constant_value for run in found] == pytest.approx(np.linspace(1e5, 6e5, 6))
    assert [(r.interval.start, r.interval.stop) for r in found] == [
        (11 * i, 11 * i + 11) for i in range(6)
    ]


def test_constant_pressure_stated_to_be_an_isometric_sweep_is_rejected():
    noise = RANDOM(0).normal(0, 1, 200)
    resting = timed(3e5 + 100 * noise, force=200 + 0.5 * noise, length=np.full(200, 0.28))
    with pytest.raises(
        ColumnError,
        match=r"synthetic: no measured quantity varies \(pressure 299\.\d to 300(\.\d)? kPa",
    ):
        check_swept(resting, find_runs(resting))
    isobaric = timed(
        3e5 + 100 * noise, force=np.linspace(0, 900, 200), length=np.linspace(0.25, 0.3, 200)
    )
    check_swept(isobaric, find_runs(isobaric))
    said = isobaric.with_constants(run="isometric")
    with pytest.raises(ColumnError, match="stated to be isometric, but the data are isobaric"):
        check_swept(said, find_runs(said))
    assert inspect(said).findings[0].serious


# Time


def test_rate_jitter_gaps_repeated_and_decreasing_times():
    steps = STEP * (1 + 0.02 * RANDOM(0).normal(0, 1, 400))
    steps[100] = 2.0
    time = np.concatenate([[0.0], np.cumsum(steps)])
    time[200] = time[199]
    time[301] = time[299]
    seen = analyse_sampling(Recording({"time": time}, "clock"))
    assert seen.rate == pytest.approx(20.0, rel=0.01)
    assert seen.jitter == pytest.approx(0.02, rel=0.25)
    assert [(g.row, round(g.duration, 6)) for g in seen.gaps] == [(100, 2.0)]
    assert (seen.repeated_rows, seen.backward_rows) == ((200,), (301,))
    texts = [
        f.text for f in inspect(timed(np.linspace(0, 6e5, 401)).with_columns(time=time)).findings
    ]
    assert texts[0].startswith("time repeats in 1 row, first in row 201")
    assert texts[1].startswith("time decreases in 1 row, first in row 302")
    assert texts[2].startswith("1 gap in time, the longest of 2 s after row 101")


def test_the_rate_of_rounded_time_stamps_is_that_of_the_rows():
    clock = np.concatenate([STEP * np.arange(200), 30.0 + STEP * np.arange(200)])
    rounded = np.floor(clock / 0.1 + 1e-9) * 0.1
    seen = analyse_sampling(Recording({"time": rounded}, "logger"))
    assert seen.rounded
    assert seen.rate == pytest.approx(20.0, rel=0.01)
    assert [gap.row for gap in seen.gaps] == [199]
    texts = [
        f.text for f in inspect(timed(np.linspace(0, 6e5, 400)).with_columns(time=rounded)).findings
    ]
    assert (
        "For stamps that the logger rounded, use time=UniformTime() of ColumnMapping." in texts[0]
    )


def test_a_record_shorter_than_its_dynamics_is_reported():
    rise = 6e5 * (1 - np.exp(-np.arange(200) * STEP / 1.0))
    assert not any("may be shorter" in f.text for f in inspect(timed(rise)).findings)
    short = inspect(timed(rise[:15])).findings
    assert any("may be shorter than the dynamics" in f.text and f.serious for f in short)
    sudden = inspect(timed(np.repeat([0.0, 6e5], 30))).findings
    assert any("undersampled at 20 rows per second" in f.text for f in sudden)
    slow_sweep = inspect(timed(np.linspace(0, 6e5, 900))).findings
    assert not any("may be shorter" in f.text for f in slow_sweep)
    sweep = 6e5 * np.abs(1 - np.arange(200) / 100)
    assert [f.serious for f in inspect(timed(sweep)).findings if "may be shorter" in f.text] == [
        False
    ]


@given(values=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40), with_time=st.booleans())
def test_any_recording_can_be_inspected(values: list[float], with_time: bool):
    columns = {"pressure": np.array(values), "force": np.array(values[::-1])}
    if with_time:
        columns["time"] = STEP * np.arange(len(values))
    seen = inspect(Recording(columns, "any"))
    assert sum(len(b.interval) for b in seen.branches) in (0, len(values))
    assert all(0 <= r.interval.start < r.interval.stop <= len(values) for r in seen.runs)


def test_a_time_that_stands_still_has_no_rate():
    step = Recording({"time": np.zeros(20), "pressure": np.repeat([0.0, 2e5], 10)}, "still")
    seen = inspect(step)
    assert [each.serious for each in seen.findings[:1]] == [True]
    chapter = seen.chapter()
    assert chapter.summary == "The time stands still."
    assert not any("nan" in text for text in (*chapter.problems, *chapter.notes, str(seen)))


def test_a_recording_without_rows_is_inspected_with_the_sensors_of_others():
    whole, _ = bench()
    _, _, chapter = inspection_chapters(inspect_all([whole, whole.rows(slice(0, 0))]))
    assert chapter.title == "synthetic: 0 rows"
    assert np.isfinite(inspect_all([whole])[0].sensors["force"].lower_limit)
    assert (
        chapter.tables[0].columns["min"].values
        == chapter.tables[0].columns["max"].values
        == [None] * 4
    )


@pytest.mark.parametrize("width", [3, 5, 41])
def test_the_moving_median_leaves_out_missing_values_and_shortens_its_windows_at_the_ends(
    width, monkeypatch
):
    monkeypatch.setattr(interval, "_MAX_WINDOW_VALUES", 100)
    values = np.random.default_rng(width).standard_normal(60).round(1)
    values[[7, 20, 21, 22]] = np.nan
    windows = [values[max(i - width // 2, 0) : i + width // 2 + 1] for i in range(60)]
    expected = [np.median(w[np.isfinite(w)]) if np.isfinite(w).any() else np.nan for w in windows]
    assert np.array_equal(interval.running_median(values, width), expected, equal_nan=True)
