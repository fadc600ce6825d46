"""Segmentation by the driven quantity: branches, runs, outliers and plateaus of a sweep of length
at constant pressure.

The noise and the ripple of a pressure that the regulator keeps constant are neither branches nor
levels nor plateaus.
"""

from __future__ import annotations

import numpy as np
import pytest

from airmuscle.bench import (
    ISOBARIC,
    find_branches,
    find_outliers,
    find_plateaus,
    find_runs,
    inspect,
    plateau_points,
)
from airmuscle.recording import Recording

ROWS = 400
SWEEP = np.concatenate([np.linspace(0.02, 0.2, ROWS), np.linspace(0.2, 0.02, ROWS)])


def isobar(
    pressure: np.ndarray, contraction: np.ndarray = SWEEP, step: float = 0.05, **columns: np.ndarray
) -> Recording:
    """A sweep of the contraction, with a force that falls with it and has noise."""
    random = np.random.default_rng(3)
    force = 2e-3 * pressure * (1.0 - 3.0 * contraction) + random.normal(0, 0.3, len(contraction))
    time = step * np.arange(len(contraction))
    return Recording(
        {"time": time, "pressure": pressure, "contraction": contraction, "force": force, **columns},
        "isobar",
    )


def noisy(level: float, rows: int, std: float = 1500.0) -> np.ndarray:
    return level + np.random.default_rng(1).normal(0, std, rows)


def test_the_branches_of_an_isobaric_run_are_those_of_the_contraction():
    found = inspect(isobar(noisy(3e5, 2 * ROWS))).branches
    assert [(b.name, b.column) for b in found] == [
        ("contracting", "contraction"),
        ("extending", "contraction"),
    ]
    assert found[0].interval.stop == pytest.approx(ROWS, abs=8)
    assert [(b.direction, b.interval) for b in found] == [
        (b.direction, b.interval) for b in find_branches(isobar(noisy(3e5, 2 * ROWS)))
    ]


def test_a_muscle_contracts_where_its_length_falls():
    recording = isobar(noisy(3e5, 2 * ROWS))
    columns = {name: recording[name] for name in ("time", "pressure", "force")}
    lengths = Recording({**columns, "length": 0.3 * (1.0 - SWEEP)}, "lengths")
    assert [(b.name, b.direction) for b in find_branches(lengths)] == [
        ("contracting", 1),
        ("extending", -1),
    ]


def test_each_of_three_isobaric_runs_has_its_own_branches():
    pressure = np.concatenate([noisy(level, 2 * ROWS, 300.0) for level in (1e5, 2e5, 3e5)])
    recording = isobar(pressure, np.tile(SWEEP, 3))
    assert [b.name for b in find_branches(recording)] == 3 * ["contracting", "extending"]


@pytest.mark.parametrize("periods", [2.5, 7.3, 40.0])
def test_a_ripple_of_the_pressure_does_not_split_an_isobaric_run(periods: float):
    ripple = 3e5 * (1.0 + 0.015 * np.sin(np.linspace(0, 2 * np.pi * periods, 2 * ROWS)))
    (run,) = find_runs(isobar(ripple))
    assert (run.kind, len(run.interval)) == (ISOBARIC, 2 * ROWS)
    several = np.concatenate([ripple / 2.0, ripple])
    assert [len(run.interval) for run in find_runs(isobar(several, np.tile(SWEEP, 2)))] == [
        2 * ROWS,
        2 * ROWS,
    ]


def test_two_close_isobars_remain_two_runs():
    pressure = np.concatenate([noisy(level, 2 * ROWS, 100.0) for level in (3e5, 3.12e5)])
    assert len(find_runs(isobar(pressure, np.tile(SWEEP, 2)))) == 2


def test_the_turning_point_of_a_triangle_is_no_outlier_and_a_spike_on_a_ramp_is():
    triangle = np.concatenate([SWEEP[:ROWS], SWEEP[ROWS + 1 :], SWEEP[-1:]])  # one row at the top
    triangle += np.random.default_rng(2).normal(0, 1e-5, len(triangle))
    recording = isobar(noisy(3e5, 2 * ROWS), triangle)
    assert [o for o in find_outliers(recording) if o.column == "contraction"] == []
    spiked = SWEEP.copy()
    spiked[100:102] += 0.01
    found = find_outliers(isobar(noisy(3e5, 2 * ROWS), spiked))
    assert [o.row for o in found if o.column == "contraction"] == [100, 101]


def test_a_ramp_of_length_at_constant_pressure_is_no_plateau():
    ramp = np.linspace(0.02, 0.2, 2400)
    recording = isobar(noisy(3e5, 2400, 300.0), ramp, step=1 / 60)
    assert find_plateaus(recording) == ()


def test_holds_between_moves_at_constant_pressure_are_the_plateaus():
    moves = [
        np.full(120, 0.02),
        np.linspace(0.02, 0.1, 600),
        np.full(120, 0.1),
        np.linspace(0.1, 0.2, 600),
        np.full(120, 0.2),
    ]
    contraction = np.concatenate(moves)
    recording = isobar(noisy(3e5, len(contraction), 300.0), contraction, step=1 / 60)
    found = find_plateaus(recording)
    assert plateau_points(recording, found)["contraction"] == pytest.approx(
        [0.02, 0.1, 0.2], abs=1e-3
    )
